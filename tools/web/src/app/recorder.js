/** The last minute of what is sampled: a time axis and a column per signal. */

const KEEP_S = 65;
const SLACK = 512; // rows dropped at once

export class Recorder {
  t = [];
  columns = new Map();

  clear() {
    this.t = [];
    this.columns.clear();
  }

  /** One row; a signal that was not sampled leaves a gap. @param {number} t @param {Map<string, number>} row */
  add(t, row) {
    if (this.t.length && t < this.t.at(-1)) this.clear(); // the drive was reset
    if (t === this.t.at(-1)) return;
    for (const name of row.keys()) {
      if (!this.columns.has(name)) this.columns.set(name, new Array(this.t.length).fill(null));
    }
    this.t.push(t);
    for (const [name, column] of this.columns) column.push(row.get(name) ?? null);
    this.#trim();
  }

  #trim() {
    const first = this.t.at(-1) - KEEP_S;
    if (this.t.length < SLACK || this.t[SLACK - 1] >= first) return;
    this.t.splice(0, SLACK);
    for (const [name, column] of this.columns) {
      column.splice(0, SLACK);
      if (column.every((value) => value === null)) this.columns.delete(name);
    }
  }

  /** The rows from `from` to `to`, as another recording. */
  between(from, to) {
    const first = lowerBound(this.t, from);
    const last = lowerBound(this.t, to);
    const columns = new Map();
    for (const [name, column] of this.columns) columns.set(name, column.slice(first, last + 1));
    return { t: this.t.slice(first, last + 1), columns };
  }
}

/** Index of the first entry that is not below `value`. */
export function lowerBound(sorted, value) {
  let [low, high] = [0, sorted.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < value) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Seconds and columns as text. Nine digits are a float32 exactly. */
export function csvOf({ t, columns }) {
  const names = [...columns.keys()];
  const lines = [['t_s', ...names].join(',')];
  const text = (value) => (value === null || value === undefined ? '' : String(Number(value.toPrecision(9))));
  t.forEach((time, row) => lines.push([text(time), ...names.map((name) => text(columns.get(name)[row]))].join(',')));
  return `${lines.join('\n')}\n`;
}
