/** Bodies of the link's answers as objects: firmware/host/README.md, tools/zerohertz/link/client.py. */

const utf8 = new TextDecoder();

/** Little-endian fields, one behind the other. */
export class Fields {
  #view;
  #at = 0;

  /** @param {Uint8Array} body */
  constructor(body) {
    this.#view = new DataView(body.buffer, body.byteOffset, body.byteLength);
  }
  get left() {
    return this.#view.byteLength - this.#at;
  }
  u8 = () => this.#view.getUint8(this.#next(1));
  u16 = () => this.#view.getUint16(this.#next(2), true);
  u32 = () => this.#view.getUint32(this.#next(4), true);
  u64 = () => this.#view.getBigUint64(this.#next(8), true);
  f32 = () => this.#view.getFloat32(this.#next(4), true);
  text() {
    const length = Math.min(this.u8(), this.left);
    const from = this.#view.byteOffset + this.#next(length);
    return utf8.decode(new Uint8Array(this.#view.buffer, from, length));
  }
  #next(bytes) {
    this.#at += bytes;
    return this.#at - bytes;
  }
}

/** Writes fields such as ['u32', 5] as bytes. @param {...[string, number]} fields */
export function bytesOf(...fields) {
  const size = { u8: 1, u16: 2, u32: 4, f32: 4 };
  const bytes = new Uint8Array(fields.reduce((n, [kind]) => n + size[kind], 0));
  const view = new DataView(bytes.buffer);
  let at = 0;
  for (const [kind, value] of fields) {
    if (kind === 'u8') view.setUint8(at, value);
    else if (kind === 'u16') view.setUint16(at, value, true);
    else if (kind === 'u32') view.setUint32(at, value, true);
    else view.setFloat32(at, value, true);
    at += size[kind];
  }
  return bytes;
}

const STATUS_WORDS = ['state', 'faults', 'command', 'period', 'commandRanOut', 'goodFrames', 'badFrames', 'confidence', 'reasons'];
const STATUS_FLOATS = ['speedRef_rad_s', 'speedHat_rad_s', 'speedBound_rad_s', 'lambda_Wb', 'i_d_A', 'i_q_A', 'i_q_ref_A', 'u_dc_V', 'statorFrequency_Hz', 'Rs_hat_ohm'];

export function statusOf(body) {
  const f = new Fields(body);
  const status = {};
  for (const name of STATUS_WORDS) status[name] = f.u32();
  for (const name of STATUS_FLOATS) status[name] = f.f32();
  status.speedUnknown = f.left >= 4 ? f.u32() : 0;
  return status;
}

export function identityOf(body) {
  const f = new Fields(body);
  return {
    protocol: f.u16(),
    parameters: f.u16(),
    signals: f.u16(),
    traceWords: f.u32(),
    motorId: f.u32(),
    tableCrc: f.u32(),
    period_s: Math.round(f.f32() * 1e9) / 1e9, // came as a float32; whole nanoseconds were meant
    polePairs: f.f32(),
    text: f.text(),
  };
}

const ACCESS = ['run', 'ready', 'protected'];

export function parameterOf(index, body) {
  const f = new Fields(body);
  const parameter = {
    index,
    whole: f.u8() === 1,
    access: ACCESS[Math.min(f.u8(), 2)],
    minimum: f.f32(),
    maximum: f.f32(),
    initial: f.f32(),
    name: f.text(),
    unit: f.text(),
    group: f.left ? f.text() : '',
    choices: [],
  };
  for (let n = f.left ? f.u8() : 0; n > 0; n--) parameter.choices.push(f.text());
  return parameter;
}

/** Shortest text of a float32. */
export const short = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(7))) : '–');

export function shown(parameter, value, unit = true) {
  if (parameter.choices.length && parameter.choices[value] !== undefined) return parameter.choices[value];
  return `${short(value)}${unit && parameter.unit ? ` ${parameter.unit}` : ''}`;
}

export const spanOf = (p) =>
  p.choices.length ? `one of ${p.choices.join(', ')}` : `${short(p.minimum)} .. ${short(p.maximum)} ${p.unit}`.trim();

const RELATIONS = ['at most', 'below', 'at least', 'above', 'exactly'];

/** Two parameters that exclude each other; null when the drive names nobody. */
export function conflictOf(body) {
  if (body.length < 9) return null;
  const f = new Fields(body);
  const found = { first: f.u16(), second: f.u16(), relation: RELATIONS[f.u8()], limit: f.f32() };
  return found.first === 0xffff || !found.relation ? null : found;
}
