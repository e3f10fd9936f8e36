// Rows of a run by the name of their column: a whole run, or the newest of one that goes on.

export class Rec {
  constructor(columns, room = 0) {
    this.columns = columns;
    this.room = room; // rows of a window that moves; 0: a whole run
  }

  static window(names, room) {
    return new Rec(Object.fromEntries(names.map((name) => [name, new Float32Array(0)])), room);
  }

  get length() {
    return this.columns.t_s.length;
  }

  // Later rows; the oldest go when there is no room.
  append(columns) {
    for (const [name, added] of Object.entries(columns)) {
      const old = this.columns[name];
      const keep = Math.min(old.length, Math.max(0, this.room - added.length));
      const joined = new Float32Array(keep + Math.min(added.length, this.room));
      joined.set(old.subarray(old.length - keep));
      joined.set(added.subarray(Math.max(0, added.length - this.room)), keep);
      this.columns[name] = joined;
    }
  }

  // Of the last row at or before a time.
  row_at(t_s) {
    const times = this.columns.t_s;
    let low = 0;
    let high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= t_s) {
        low = middle;
      } else {
        high = middle - 1;
      }
    }
    return low;
  }

  at(name, row) {
    const column = this.columns[name];
    return column[Math.max(0, Math.min(row, column.length - 1))];
  }

  get begin_s() {
    return this.length ? this.columns.t_s[0] : 0;
  }

  get end_s() {
    return this.length ? this.columns.t_s[this.length - 1] : 0;
  }

  // Largest |value| of the rows where `counts(row)` holds.
  largest(value, counts) {
    let most = 0;
    for (let row = 0; row < this.length; ++row) {
      if (counts(row)) {
        most = Math.max(most, Math.abs(value(row)));
      }
    }
    return most;
  }
}
