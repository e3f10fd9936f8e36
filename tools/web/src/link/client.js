/** A drive, or the broker of one, at the other end of a transport. tools/zerohertz/link/client.py. */

import { Fields, bytesOf, conflictOf, identityOf, parameterOf, shown, spanOf, statusOf } from './answers.js';
import { FrameReader, encode } from './frame.js';
import { DEVELOPMENT_KEY, Seal, joined, response, toolsResponse } from './siphash.js';

export const RUN = 1, RESET = 2, TORQUE_OFF = 4, COMMISSION = 8, TORQUE_MODE = 16;
export const EDGES = { now: 0, rising: 1, falling: 2, either: 3 };
const Op = {
  HELLO: 0x01, SESSION: 0x02, PARAM_INFO: 0x03, SIGNAL_INFO: 0x04,
  GET: 0x10, SET: 0x11, SAVE: 0x12, STORE: 0x13, CHALLENGE: 0x14, UNLOCK: 0x15,
  COMMAND: 0x20, STATUS: 0x21, SAMPLE: 0x22, LOADER: 0x24,
  TRACE_ARM: 0x30, TRACE_STATE: 0x31, TRACE_READ: 0x32, TRACE_STOP: 0x33,
  FAULT_LOG: 0x40, FAULT_RECORD: 0x41, FAULT_READ: 0x42, FAULT_CLEAR: 0x43, SEALED: 0x50,
  CLIENT: 0x60, ROLES: 0x61,
};
const ACTING = new Set([Op.SESSION, Op.CHALLENGE, Op.UNLOCK, Op.COMMAND, Op.SEALED]);
const ANSWER = 0x80, PROTOCOL = 1, TRIES = 4, LOCKED_OUT_MS = 11000, POLL_MS = 100;
export const NO_SUCH = 4, NO_SUCH_OP = 5, NO_SESSION = 7, NOT_NOW = 8, PROTECTED = 9, REFUSED = 10, NOT_SEALED = 11, TAKEN = 12, SILENT = 13;
const REASONS = {
  1: 'is no finite number',
  2: 'is out of range',
  3: 'has to be a whole number',
  4: 'is not there',
  5: 'the drive does not know this request',
  6: 'the drive knows this request in another length; is the firmware of another version?',
  7: 'somebody else has taken over or stopped the drive, or it was reset',
  8: 'not now: only with the gates off, or the drive is locked out for a while',
  9: 'is protected; unlock first',
  10: 'is in range, but refused together with the other values, or by the drive as it stands',
  11: 'needs the key of the drive',
};

/** The drive's answer had a status other than 0. */
export class RefusedError extends Error {
  constructor(what, status, detail, why = '') {
    super(`${what}: ${why || REASONS[status] || `refused with status ${status}`}`);
    this.status = status;
    this.detail = detail;
  }
}

/** The key is not this drive's. */
export class WrongKeyError extends Error {}

const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const utf8 = new TextEncoder();

export class Client {
  #transport;
  #reader = new FrameReader();
  #sequence = Math.floor(Math.random() * 256); // a drive remembers the last request of who came before
  #urgent = []; // requests that wait: what acts on the drive comes before what reads
  #queue = [];
  #busy = false;
  #waiting = null;
  #key = DEVELOPMENT_KEY;
  #session = null; // a promise of its number
  #seal = null;
  #opening = null;
  #timeout_ms;
  #resent = false; // some request of a challenge was sent twice

  /** @param {import('./transport.js').Transport} transport */
  constructor(transport, { timeout_ms = 1000 } = {}) {
    this.#transport = transport;
    this.#timeout_ms = timeout_ms;
  }

  async open() {
    this.#transport.onData((bytes) => {
      for (const frame of this.#reader.feed(bytes)) this.#waiting?.(frame);
    });
    await this.#transport.open();
  }

  close() {
    this.#transport.close();
  }

  /** Kept in memory alone. @param {Uint8Array} key */
  useKey(key) {
    this.#key = key;
    this.#seal = null;
  }

  /** The answer's body. Requests wait for each other: a drive takes one at a time. */
  request(op, body = new Uint8Array(0), what = '') {
    return new Promise((resolve, reject) => {
      const line = ACTING.has(op) ? this.#urgent : this.#queue;
      line.push(() => this.#ask(op, body, what).then(resolve, reject));
      this.#next();
    });
  }

  async #next() {
    if (this.#busy) return;
    this.#busy = true;
    for (let ask; (ask = this.#urgent.shift() ?? this.#queue.shift());) await ask();
    this.#busy = false;
  }

  async #ask(op, body, what) {
    this.#sequence = (this.#sequence + 1) % 256;
    const sequence = this.#sequence;
    const wire = encode({ sequence, op, body });
    for (let tries = 0; tries < TRIES; tries++) {
      this.#resent ||= tries > 0;
      const frame = await new Promise((resolve) => {
        const late = setTimeout(() => resolve(null), this.#timeout_ms);
        this.#waiting = (found) => {
          if (found.sequence !== sequence || found.op !== (op | ANSWER)) return;
          clearTimeout(late);
          resolve(found);
        };
        this.#transport.write(wire);
      });
      this.#waiting = null;
      if (frame) return this.#bodyOf(frame, what || `request ${op}`);
    }
    throw new Error('the drive does not answer; is it powered?');
  }

  #bodyOf({ body }, what) {
    if (body[0] === 0) return body.subarray(1);
    const detail = body.subarray(1);
    const why = (body[0] === TAKEN || body[0] === SILENT) && detail.length ? new Fields(detail).text() : '';
    throw new RefusedError(what, body[0], detail, why);
  }

  // --- what there is -------------------------------------------------------------------------

  /** Identity, parameters and signals; `progress` hears how much of it is there, 0 to 1. */
  async describe(progress = () => {}) {
    this.identity = identityOf(await this.request(Op.HELLO, undefined, 'hello'));
    const { protocol, parameters, signals } = this.identity;
    if (protocol !== PROTOCOL) throw new Error(`the drive speaks protocol ${protocol}, this page ${PROTOCOL}`);
    this.parameters = new Map();
    this.signals = new Map();
    for (let index = 0; index < parameters; index++) {
      const found = parameterOf(index, await this.request(Op.PARAM_INFO, bytesOf(['u16', index])));
      this.parameters.set(found.name, found);
      progress(index / (parameters + signals));
    }
    for (let number = 0; number < signals; number++) {
      const f = new Fields(await this.request(Op.SIGNAL_INFO, bytesOf(['u8', number])));
      const whole = f.u8() === 1;
      const name = f.text();
      this.signals.set(name, { number, name, whole });
      progress((parameters + number) / (parameters + signals));
    }
  }

  /** Tells a broker who is there; false when there is none, but the drive itself. */
  async introduce(name) {
    try {
      await this.request(Op.CLIENT, joined(Uint8Array.of(utf8.encode(name).length), utf8.encode(name)));
      return true;
    } catch (error) {
      if (error instanceof RefusedError) return false;
      throw error;
    }
  }

  /** Who is at this broker, and who runs the drive. */
  async roles() {
    const f = new Fields(await this.request(Op.ROLES));
    const found = { own: f.u32(), commander: f.u32(), names: new Map() };
    for (let n = f.u8(); n > 0; n--) found.names.set(f.u32(), f.text());
    return found;
  }

  // --- who acts ------------------------------------------------------------------------------

  async #acting() {
    const session = (this.#session ??= this.request(Op.SESSION).then((body) => new Fields(body).u32()));
    try {
      return bytesOf(['u32', await session]);
    } catch (error) {
      if (this.#session === session) this.#session = null;
      throw error;
    }
  }

  /** Somebody stopped or reset the drive: only the user may begin again. */
  forgetSession() {
    this.#session = null;
    this.#seal = null;
  }

  /** One at a time: the answer to a challenge is wrong as soon as there is a later challenge. */
  #open(unlock = false) {
    if (this.#opening && !unlock) return this.#opening;
    const before = this.#opening ?? Promise.resolve();
    const opening = before.catch(() => {}).then(() => this.#opened(unlock)).finally(() => {
      if (this.#opening === opening) this.#opening = null;
    });
    this.#opening = opening;
    return opening;
  }

  async #opened(unlock) {
    const until = Date.now() + LOCKED_OUT_MS;
    for (;;) {
      try {
        await this.#answerChallenge(unlock);
        return;
      } catch (error) {
        if (error.status === NO_SESSION) this.forgetSession();
        else if (error.status !== NOT_NOW || Date.now() > until) throw error;
        else await wait(POLL_MS);
      }
    }
  }

  /**
   * A drive says NOT_NOW for a second from its power-up on; a broker passes that on as its answer to UNLOCK.
   * A challenge that was sent twice has made two nonces: the older one answered is no wrong key.
   */
  async #answerChallenge(unlock) {
    this.#resent = false;
    const nonce = new Fields(await this.request(Op.CHALLENGE, await this.#acting(), 'opening a session')).u64();
    try {
      await this.request(Op.UNLOCK, joined(await this.#acting(), response(this.#key, nonce, unlock)), 'unlocking');
    } catch (error) {
      if (error.status !== REFUSED && error.status !== PROTECTED) throw error;
      if (this.#resent) throw new RefusedError('unlocking', NOT_NOW);
      throw new WrongKeyError("the key is not this drive's; three wrong ones lock out for ten seconds");
    }
    this.#seal = new Seal(this.#key, nonce);
  }

  /** A request that can hurt: with counter and MAC, in a session opened with the key. */
  async #sealed(op, rest, what) {
    for (let again = true; ; again = false) {
      if (!this.#seal) await this.#open();
      try {
        return await this.request(Op.SEALED, this.#seal.of(joined(Uint8Array.of(op), await this.#acting(), rest)), what);
      } catch (error) {
        if (error.status === NO_SESSION) this.forgetSession();
        if (error.status !== NOT_SEALED || !again) throw error;
        this.#seal = null; // a session ends by itself after minutes of silence
      }
    }
  }

  /** Protected parameters can be set from now on, for some minutes. */
  unlock() {
    return this.#open(true);
  }

  /** Shows the tools behind the page that the user has the key. @param {bigint} nonce */
  toolsResponse(nonce) {
    return toolsResponse(this.#key, nonce);
  }

  /** valid_s: the drive stops by itself when no command follows in this time. */
  async command(bits, { speed_rad_s = 0, valid_s = 0, torque_Nm = null } = {}) {
    const fields = [['u32', torque_Nm === null ? bits : bits | TORQUE_MODE], ['f32', speed_rad_s], ['u16', Math.round(valid_s * 1000)]];
    if (torque_Nm !== null) fields.push(['f32', torque_Nm]);
    const body = bytesOf(...fields);
    if (bits & ~TORQUE_OFF) return this.#sealed(Op.COMMAND, body, 'command');
    try {
      return await this.request(Op.COMMAND, joined(await this.#acting(), body), 'stop'); // needs no key
    } catch (error) {
      if (error.status !== NO_SESSION) throw error;
      this.forgetSession(); // a stop is sent anew
      return this.request(Op.COMMAND, joined(await this.#acting(), body), 'stop');
    }
  }

  async status() {
    return statusOf(await this.request(Op.STATUS, undefined, 'status'));
  }

  // --- parameters ----------------------------------------------------------------------------

  /** Values by name. @param {string[]} names */
  async get(names) {
    const values = new Map();
    for (let at = 0; at < names.length; at += 60) {
      const some = names.slice(at, at + 60);
      const f = new Fields(await this.request(Op.GET, bytesOf(...some.map((n) => ['u16', this.parameters.get(n).index]))));
      for (const name of some) values.set(name, f.f32());
    }
    return values;
  }

  /** RefusedError says what the value may be, and which other parameter is in the way. */
  async set(name, value) {
    const parameter = this.parameters.get(name);
    const what = `${name} = ${shown(parameter, value)}`;
    try {
      await this.#sealed(Op.SET, bytesOf(['u16', parameter.index], ['f32', value]), what);
    } catch (error) {
      if (!(error instanceof RefusedError)) throw error;
      throw new RefusedError(what, error.status, error.detail, await this.#why(parameter, value, error));
    }
  }

  async #why(parameter, value, { status, detail, message }) {
    if (status === 2 || status === 3) return `${REASONS[status]}; it may be ${spanOf(parameter)}`;
    if (status === TAKEN || status === SILENT) return message;
    const conflict = status === REFUSED ? conflictOf(detail) : null;
    return conflict ? `is refused: ${await this.#conflictText(conflict, parameter.name, value)}` : '';
  }

  async #conflictText({ first, second, relation, limit }, asked, value) {
    const listed = [...this.parameters.values()];
    const [a, b] = [listed[first], listed[second]];
    const values = await this.get([a, b].filter(Boolean).map((p) => p.name));
    values.set(asked, value);
    const other = b && b !== a ? ` with ${b.name} = ${shown(b, values.get(b.name))}` : '';
    return `${a.name} = ${shown(a, values.get(a.name))} has to be ${relation} ${shown(a, limit)}${other}`;
  }

  /** The parameters in use survive power-down; waits until they do. */
  async save() {
    await this.#sealed(Op.SAVE, new Uint8Array(0), 'saving');
    for (let n = 0; n < 300; n++) {
      const f = new Fields(await this.request(Op.STORE));
      const [, saving, failed] = [f.u32(), f.u32(), f.u32()];
      if (failed) throw new Error("the drive's flash has failed; the saved set stays as it was");
      if (!saving) return;
      await wait(POLL_MS);
    }
    throw new Error('the drive has not saved yet; it does so only with the gates off');
  }

  // --- signals -------------------------------------------------------------------------------

  #values(f, names) {
    return names.map((name) => (this.signals.get(name).whole ? f.u32() : f.f32()));
  }

  /** Up to eight signals of one and the same period, and its number. @param {string[]} names */
  async sample(names) {
    const f = new Fields(await this.request(Op.SAMPLE, Uint8Array.from(names, (n) => this.signals.get(n).number)));
    return { period: f.u32(), values: this.#values(f, names) };
  }

  /** Starts a recording of up to eight signals; trigger: {signal, edge, level}. */
  async arm(names, { signal, edge, level }, { before, decimation, rows }) {
    const watched = this.signals.get(signal);
    const head = bytesOf(['u8', names.length], ...names.map((n) => ['u8', this.signals.get(n).number]));
    const how = bytesOf(['u32', decimation], ['u8', watched.number], ['u8', edge], [watched.whole ? 'u32' : 'f32', level], ['f32', before], ['u32', rows]);
    await this.request(Op.TRACE_ARM, joined(await this.#acting(), head, how), 'trace');
  }

  async traceState() {
    const f = new Fields(await this.request(Op.TRACE_STATE));
    const [state, rows, triggerRow, triggerPeriod, decimation, n] = Array.from({ length: 6 }, () => f.u32());
    return { done: state === 3, state, rows, triggerRow, triggerPeriod, decimation, signals: this.#named(f, n) };
  }

  async stopTrace() {
    await this.request(Op.TRACE_STOP, await this.#acting());
  }

  #named(f, n) {
    const all = [...this.signals.keys()];
    return Array.from({ length: n }, () => all[f.u8()]);
  }

  /** Columns of what was recorded, seconds from the trigger first. */
  async traceRecord(state) {
    const columns = await this.#rows(Op.TRACE_READ, state.rows, state.signals);
    return this.#record(columns, state.signals, state.triggerRow, state.decimation);
  }

  async #rows(op, rows, names) {
    const columns = names.map(() => []);
    while (columns[0].length < rows) {
      const f = new Fields(await this.request(op, bytesOf(['u32', columns[0].length])));
      if (f.left < 4 * names.length) throw new Error('the recording ended early');
      while (f.left >= 4 * names.length) this.#values(f, names).forEach((value, k) => columns[k].push(value));
    }
    return columns.map((column) => column.slice(0, rows));
  }

  #record(columns, names, zeroRow, decimation) {
    const t = columns[0].map((_, k) => (k - zeroRow) * decimation * this.identity.period_s);
    return { t, names, columns };
  }

  // --- faults --------------------------------------------------------------------------------

  async faults() {
    const f = new Fields(await this.request(Op.FAULT_LOG));
    const found = { ever: f.u32(), last: [] };
    while (f.left >= 16) found.last.push({ number: f.u32(), faults: f.u32(), state: f.u32(), period: f.u32() });
    return found;
  }

  /** The record round the last fault that opened the gates; null when there is none. */
  async faultRecord() {
    let f;
    try {
      f = new Fields(await this.request(Op.FAULT_RECORD));
    } catch (error) {
      if (error.status === NO_SUCH) return null;
      throw error;
    }
    const [number, period, rows, faultRow, before] = Array.from({ length: 5 }, () => f.u32());
    const names = this.#named(f, f.left);
    const columns = await this.#rows(Op.FAULT_READ, rows, names);
    return { number, period, fromBeforeReset: before !== 0, ...this.#record(columns, names, faultRow, 1) };
  }

  clearFaults() {
    return this.#sealed(Op.FAULT_CLEAR, new Uint8Array(0), 'clearing the faults');
  }
}
