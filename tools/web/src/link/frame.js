/** Frames of the host link: COBS between zeros, CRC-32C at the end. firmware/host/README.md. */

import { crc32c } from './crc32c.js';

export const BODY_MAX = 244;
const HEAD = 2;
const CRC = 4;
const REST_MAX = 4096; // of bytes without a zero: no frame is that long

/** @typedef {{sequence: number, op: number, body: Uint8Array}} Frame */

/** What goes on the wire, both zeros included. @param {Frame} frame */
export function encode({ sequence, op, body }) {
  if (body.length > BODY_MAX) throw new RangeError(`a body of ${body.length} bytes; ${BODY_MAX} is the most`);
  const raw = new Uint8Array(HEAD + body.length + CRC);
  raw.set([sequence, op]);
  raw.set(body, HEAD);
  new DataView(raw.buffer).setUint32(raw.length - CRC, crc32c(raw.subarray(0, -CRC)), true);
  // Shorter than 254 bytes: every code is the distance to a zero, none stands for a full block.
  const wire = new Uint8Array(raw.length + 3);
  let codeAt = 1;
  raw.forEach((byte, k) => {
    if (byte === 0) {
      wire[codeAt] = k + 2 - codeAt;
      codeAt = k + 2;
    } else {
      wire[k + 2] = byte;
    }
  });
  wire[codeAt] = raw.length + 2 - codeAt;
  return wire;
}

/** What stands between two zeros; null when it is no frame. @param {Uint8Array} chunk @returns {Frame | null} */
export function decode(chunk) {
  const raw = [];
  for (let at = 0; at < chunk.length; at += chunk[at]) {
    const end = at + chunk[at];
    if (end > chunk.length) return null;
    if (at > 0) raw.push(0);
    for (let k = at + 1; k < end; k++) raw.push(chunk[k]);
  }
  if (raw.length < HEAD + CRC || raw.length > HEAD + BODY_MAX + CRC) return null;
  const bytes = Uint8Array.from(raw);
  const told = new DataView(bytes.buffer).getUint32(bytes.length - CRC, true);
  if (told !== crc32c(bytes.subarray(0, -CRC))) return null;
  return { sequence: bytes[0], op: bytes[1], body: bytes.slice(HEAD, -CRC) };
}

/** Bytes as they come, frames out. What is none, such as a banner, is counted and dropped. */
export class FrameReader {
  #rest = new Uint8Array(0);
  bad = 0;

  /** @param {Uint8Array} data @returns {Frame[]} */
  feed(data) {
    const all = new Uint8Array(this.#rest.length + data.length);
    all.set(this.#rest);
    all.set(data, this.#rest.length);
    const frames = [];
    let from = 0;
    for (let zero = all.indexOf(0); zero >= 0; zero = all.indexOf(0, from)) {
      if (zero > from) {
        const frame = decode(all.subarray(from, zero));
        if (frame) frames.push(frame);
        else this.bad++;
      }
      from = zero + 1;
    }
    this.#rest = all.slice(Math.max(from, all.length - REST_MAX));
    return frames;
  }
}
