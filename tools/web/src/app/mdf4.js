/** A recording as MDF 4.10 (ASAM): one data group, float32 or uint32 columns, time as its master. */

const HEADER_BYTES = 24;
const UINT_LE = 0, FLOAT_LE = 4;
const VALUE = 0, MASTER = 2;
const utf8 = new TextEncoder();

/** A file that grows block by block; links are filled in when their target is there. */
class File {
  #parts = [];
  length = 0;

  #add(bytes) {
    this.#parts.push(bytes);
    this.length += bytes.length;
  }

  raw(bytes) {
    this.#add(bytes);
  }

  /** Address of a new block. `data` writes what follows the links. */
  block(id, links, size, data = () => {}) {
    const at = this.length;
    const length = HEADER_BYTES + 8 * links.length + size;
    const bytes = new Uint8Array(8 * Math.ceil(length / 8));
    const view = new DataView(bytes.buffer);
    bytes.set(utf8.encode(`##${id}`));
    view.setBigUint64(8, BigInt(length), true);
    view.setBigUint64(16, BigInt(links.length), true);
    links.forEach((link, k) => view.setBigUint64(HEADER_BYTES + 8 * k, BigInt(link), true));
    data(new DataView(bytes.buffer, HEADER_BYTES + 8 * links.length), bytes.subarray(HEADER_BYTES + 8 * links.length));
    this.#add(bytes);
    return at;
  }

  text(words, id = 'TX') {
    const bytes = utf8.encode(`${words}\0`);
    return this.block(id, [], bytes.length, (_, place) => place.set(bytes));
  }

  /** The link number `k` of a block that was written before. */
  link(at, k, target) {
    let begin = 0;
    for (const part of this.#parts) {
      if (begin === at) new DataView(part.buffer).setBigUint64(HEADER_BYTES + 8 * k, BigInt(target), true);
      begin += part.length;
    }
  }

  bytes() {
    const whole = new Uint8Array(this.length);
    let at = 0;
    for (const part of this.#parts) {
      whole.set(part, at);
      at += part.length;
    }
    return whole;
  }
}

function identification() {
  const bytes = new Uint8Array(64);
  bytes.set(utf8.encode('MDF     4.10    ZeroHz  '));
  new DataView(bytes.buffer).setUint16(28, 410, true);
  return bytes;
}

function channel(file, { name, unit, type, kind, offset, bits }) {
  const links = [0, 0, file.text(name), 0, 0, 0, unit ? file.text(unit) : 0, 0];
  return file.block('CN', links, 72, (view) => {
    view.setUint8(0, kind);
    view.setUint8(1, kind === MASTER ? 1 : 0); // synchronised by time
    view.setUint8(2, type);
    view.setUint32(4, offset, true);
    view.setUint32(8, bits, true);
  });
}

/**
 * @param {{t: number[], columns: Map<string, (number | null)[]>}} recording
 * @param {{unitOf: (name: string) => string, isWhole: (name: string) => boolean, comment: string}} about
 * @returns {Uint8Array}
 */
export function mdf4Of({ t, columns }, { unitOf, isWhole, comment }) {
  const listed = [...columns].map(([name, values]) => ({ name, values, whole: isWhole(name) && values.every(Number.isInteger) }));
  const rowBytes = 8 + 4 * listed.length;
  const file = new File();
  file.raw(identification());
  const head = file.block('HD', [0, 0, 0, 0, 0, 0], 32, (view) => {
    view.setBigUint64(0, BigInt(Date.now()) * 1000000n, true);
  });
  const plain = comment.replace(/[<>&]/g, ' ');
  file.link(head, 5, file.text(`<HDcomment><TX>${plain}</TX></HDcomment>`, 'MD'));
  const made = '<FHcomment><TX>recorded</TX><tool_id>ZeroHertz</tool_id><tool_vendor>ZeroHertz</tool_vendor><tool_version>1</tool_version></FHcomment>';
  file.link(head, 1, file.block('FH', [0, file.text(made, 'MD')], 16));
  const group = file.block('DG', [0, 0, 0, 0], 8);
  file.link(head, 0, group);
  const records = file.block('CG', [0, 0, 0, 0, 0, 0], 32, (view) => {
    view.setBigUint64(8, BigInt(t.length), true);
    view.setUint32(24, rowBytes, true);
  });
  file.link(group, 1, records);
  let last = channel(file, { name: 't', unit: 's', type: FLOAT_LE, kind: MASTER, offset: 0, bits: 64 });
  file.link(records, 1, last);
  listed.forEach(({ name, whole }, k) => {
    const next = channel(file, { name, unit: unitOf(name), type: whole ? UINT_LE : FLOAT_LE, kind: VALUE, offset: 8 + 4 * k, bits: 32 });
    file.link(last, 0, next);
    last = next;
  });
  file.link(group, 2, file.block('DT', [], rowBytes * t.length, (view) => {
    t.forEach((time, row) => {
      view.setFloat64(row * rowBytes, time, true);
      listed.forEach(({ values, whole }, k) => {
        const at = row * rowBytes + 8 + 4 * k;
        if (whole) view.setUint32(at, values[row], true);
        else view.setFloat32(at, values[row] ?? NaN, true);
      });
    });
  }));
  return file.bytes();
}
