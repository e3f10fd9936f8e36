/** SipHash-2-4 (Aumasson, Bernstein 2012): who has the key of a drive. tools/zerohertz/link/siphash.py. */

const MASK = (1n << 64n) - 1n;
const START = [0x736f6d6570736575n, 0x646f72616e646f6dn, 0x6c7967656e657261n, 0x7465646279746573n];
const utf8 = new TextEncoder();

/** Known to everybody: hal/include/hal_development_key.h. */
export const DEVELOPMENT_KEY = utf8.encode('ZeroHertz develo');

const rotated = (x, n) => ((x << n) | (x >> (64n - n))) & MASK;

function round(v) {
  for (const [a, b, n, m] of [[0, 1, 13n, 32n], [2, 3, 16n, 0n], [0, 3, 21n, 0n], [2, 1, 17n, 32n]]) {
    v[a] = (v[a] + v[b]) & MASK;
    v[b] = rotated(v[b], n) ^ v[a];
    if (m) v[a] = rotated(v[a], m);
  }
}

/** 64 bits over the message under a key of 16 bytes. @param {Uint8Array} key @param {Uint8Array} message */
export function siphash24(key, message) {
  const keys = new DataView(key.buffer, key.byteOffset, 16);
  const v = START.map((word, n) => word ^ keys.getBigUint64(n % 2 ? 8 : 0, true));
  const padded = new Uint8Array(8 * (Math.floor(message.length / 8) + 1));
  padded.set(message);
  padded[padded.length - 1] = message.length % 256;
  const words = new DataView(padded.buffer);
  for (let at = 0; at < padded.length; at += 8) {
    const word = words.getBigUint64(at, true);
    v[3] ^= word;
    round(v);
    round(v);
    v[0] ^= word;
  }
  v[2] ^= 0xffn;
  for (let n = 0; n < 4; n++) round(v);
  return v[0] ^ v[1] ^ v[2] ^ v[3];
}

/** @param {bigint} number */
export function word64(number) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setBigUint64(0, number, true);
  return bytes;
}

/** @param {...Uint8Array} parts */
export function joined(...parts) {
  const whole = new Uint8Array(parts.reduce((n, part) => n + part.length, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}

/** What opens a session, or unlocks as well. @param {Uint8Array} key @param {bigint} nonce @param {boolean} unlock */
export function response(key, nonce, unlock) {
  return word64(siphash24(key, joined(utf8.encode(unlock ? 'zhunlock' : 'zhopened'), word64(nonce))));
}

/** What opens the tools behind a page of `zh studio`. @param {Uint8Array} key @param {bigint} nonce */
export function toolsResponse(key, nonce) {
  return word64(siphash24(key, joined(utf8.encode('zhtools\0'), word64(nonce))));
}

/** Counter and MAC of the requests of one session. */
export class Seal {
  #key;
  #counter = 0;

  /** @param {Uint8Array} key @param {bigint} nonce */
  constructor(key, nonce) {
    const head = joined(utf8.encode('zhsealed'), word64(nonce));
    this.#key = joined(...[0n, 1n].map((half) => word64(siphash24(key, joined(head, word64(half))))));
  }

  /** The request with what shows that it is ours, and the next one. @param {Uint8Array} request */
  of(request) {
    this.#counter++;
    const message = joined(request, new Uint8Array(Uint32Array.of(this.#counter).buffer));
    return joined(message, word64(siphash24(this.#key, message)));
  }
}

/** 32 hexadecimal digits as 16 bytes; null for anything else. @param {string} text */
export function keyOf(text) {
  const digits = text.trim();
  if (!/^[0-9a-fA-F]{32}$/.test(digits)) return null;
  return Uint8Array.from({ length: 16 }, (_, k) => parseInt(digits.slice(2 * k, 2 * k + 2), 16));
}
