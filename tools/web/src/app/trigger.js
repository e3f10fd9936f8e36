/** Triggered recording in the drive: every control period, up to eight signals, round an event. */

import { EDGES, TAKEN } from '../link/client.js';
import { sleep } from './clock.js';
import { h } from './dom.js';
import { rawOf } from './signals.js';

const POLL_MS = 60;
const SIGNALS_MAX = 8;

export class Trigger {
  mode = 'live'; // normal, single
  #session;
  #running = 0;
  #loop = Promise.resolve();

  /** @param {(record: object) => void} take @param {(text: string) => void} say @param {() => string[]} chosen */
  constructor(session, { take, say, chosen }) {
    this.#session = session;
    this.take = take;
    this.say = say;
    this.chosen = chosen;
    this.signal = h('input', { list: 'signal-names', value: 'state', size: 16, id: 'trigger-signal', 'aria-label': 'trigger signal' });
    this.edge = h('select', { id: 'trigger-edge', 'aria-label': 'trigger condition' },
      h('option', { value: 'rising' }, 'rises to'), h('option', { value: 'falling' }, 'falls below'),
      h('option', { value: 'either' }, 'crosses'), h('option', { value: 'now' }, 'at once'));
    this.level = h('input', { type: 'number', value: 3, step: 'any', id: 'trigger-level', 'aria-label': 'trigger level' });
    this.before = h('input', { type: 'number', value: 25, min: 0, max: 100, id: 'trigger-before', 'aria-label': 'share before the trigger in percent' });
    this.every = h('input', { type: 'number', value: 1, min: 1, max: 10000, id: 'trigger-every', 'aria-label': 'control periods per row' });
    this.element = h('fieldset', { class: 'trigger', hidden: true }, h('legend', {}, 'Trigger when'),
      this.signal, this.edge, this.level,
      h('label', {}, 'keep', this.before, '% before'),
      h('label', {}, 'a row every', this.every, 'periods'));
  }

  /** live: none. */
  setMode(mode) {
    this.mode = mode;
    this.element.hidden = mode === 'live';
    this.stop();
    if (mode !== 'live') this.start();
  }

  stop() {
    this.#running++;
    this.say('');
  }

  /** Once the one of before has let the trace memory go. */
  start() {
    const mine = ++this.#running;
    this.#loop = this.#loop.then(() => this.#run(mine));
  }

  /** Arms, waits and reads; again and again in normal mode. */
  async #run(mine) {
    const going = () => mine === this.#running && this.#session.state === 'connected';
    while (going()) {
      try {
        const record = await this.#once(going);
        if (!record) return;
        this.take(record);
        if (this.mode === 'single') {
          this.say('recorded');
          return;
        }
      } catch (error) {
        if (!going()) return;
        this.say(error.message);
        if (error.status !== TAKEN) return;
        await sleep(300); // another client's; ours is next
      }
    }
  }

  async #once(going) {
    const { client } = this.#session;
    const names = rawOf(this.chosen()).filter((name) => client.signals.has(name));
    const [signal] = rawOf([this.signal.value]);
    if (!client.signals.has(signal)) throw new Error(`${this.signal.value}: no such signal`);
    if (!names.length) throw new Error('choose a signal first');
    const level = Number(this.level.value) || 0;
    const trigger = { signal, edge: EDGES[this.edge.value], level };
    await client.arm(names.slice(0, SIGNALS_MAX), trigger, {
      before: this.edge.value === 'now' ? 0 : Number(this.before.value) / 100,
      decimation: Math.max(Number(this.every.value) | 0, 1),
      rows: 0,
    });
    const left = names.length > SIGNALS_MAX ? `; of ${names.length} signals the first ${SIGNALS_MAX}` : '';
    this.say(`armed${left}`);
    for (;;) {
      await sleep(POLL_MS);
      if (!going()) {
        await client.stopTrace().catch(() => {});
        return null;
      }
      const state = await client.traceState();
      if (state.state === 2) this.say('triggered');
      if (state.done) return client.traceRecord(state);
    }
  }
}
