/**
 * One drive as the page sees it: polled while connected, commanded by one hand.
 *
 * Events: `change` (connected, lost), `status`, `monitor`, `samples`, `roles`, `message` (detail: {text, bad}).
 */

import { Client, NO_SESSION, RESET, RUN, TORQUE_OFF, WrongKeyError } from '../link/client.js';
import { sleep } from './clock.js';

export const RPM_PER_RAD_S = 30 / Math.PI;
const STATUS_MS = 100, MONITOR_MS = 50, SENSORS_MS = 250, ROLES_MS = 1000, SAMPLE_MS = 10, KEEP_ALIVE_MS = 150;
const VALID_S = 1.5; // without news the drive stops after this; less than command_timeout_s
const AT_ONCE = 8; // signals of one sample

/** What the side panel shows beside the status. */
const MONITOR = [
  'i_s_alpha_A', 'i_s_beta_A', 'lambda_r_hat_alpha_Wb', 'lambda_r_hat_beta_Wb',
  'overload_motor_pu', 'overload_inverter_pu', 'gates_on', 'brake_on',
];
const LINE_VOLTAGES = ['u_line_alpha_V', 'u_line_beta_V'];
const LIMITS = ['omega_max_rad_s', 'torque_speed_max_rad_s', 'direction', 'control_mode', 'i_d_A', 'i_q_max_A', 'M_H', 'Lr_H'];
const TORQUE_STEP_NM = 0.1;

/** Sensors that not every board has: their signals end in _degC. */
const temperatures = (client) => [...client.signals.keys()].filter((name) => name.endsWith('_degC'));

export class Session extends EventTarget {
  state = 'connecting'; // connected, lost
  progress = 0;
  why = '';
  status = null;
  roles = null;
  monitor = new Map();
  limits = null; // of speed and torque references, as the drive has them now
  temperatures = []; // names of its sensors
  wanted = null; // what this page commands: {speed_rad_s} or {torque_Nm}
  watched = []; // signals that the scope wants
  #askKey;
  #asked = null;
  #make;

  /** @param {{transport: () => object, catalog: object, askKey: (why: string) => Promise<Uint8Array | null>}} wiring */
  constructor({ transport, catalog, askKey }) {
    super();
    this.catalog = catalog;
    this.#make = transport;
    this.#askKey = askKey;
    this.#harmless = Object.entries(catalog.faults)
      .filter(([, fault]) => fault.reaction === 'WARN' || fault.reaction === 'DERATE')
      .reduce((bits, [bit]) => (bits | (1 << Number(bit))) >>> 0, 0);
  }
  #harmless;

  tell(text, bad = false) {
    this.dispatchEvent(new CustomEvent('message', { detail: { text, bad } }));
  }

  #event(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  async connect() {
    this.#to('connecting');
    const transport = this.#make();
    const client = new Client(transport);
    try {
      await client.open();
      transport.onClose((why) => client === this.client && this.#lost(why));
      this.client = client;
      const atBroker = await client.introduce('studio page');
      await client.describe((share) => {
        this.progress = share;
        this.#event('change');
      });
      this.roles = atBroker ? await client.roles() : null;
      await this.#readLimits(client);
      this.temperatures = temperatures(client);
      this.status = await client.status();
      this.#to('connected');
    } catch (error) {
      client.close();
      this.#lost(error.message);
      return;
    }
    this.#poll(client);
    this.#pollScope(client);
    this.#keepAlive(client);
  }

  #to(state) {
    this.state = state;
    this.#event('change');
  }

  #lost(why) {
    if (this.state === 'lost') return;
    this.client = null;
    this.wanted = null;
    this.why = why;
    this.#to('lost');
  }

  #alive(client) {
    return this.client === client && this.state === 'connected';
  }

  async #poll(client) {
    const due = { status: 0, monitor: 0, sensors: 0, roles: 0, limits: performance.now() + ROLES_MS };
    const known = (names) => names.filter((name) => client.signals.has(name));
    const names = known(MONITOR);
    const sensors = known([...LINE_VOLTAGES, ...this.temperatures]).slice(0, AT_ONCE);
    const jobs = [
      ['status', STATUS_MS, () => this.#readStatus(client)],
      ['monitor', MONITOR_MS, () => this.#readMonitor(client, names)],
      ['sensors', SENSORS_MS, () => this.#readMonitor(client, sensors)],
      ['roles', ROLES_MS, () => this.#readRoles(client)],
      ['limits', ROLES_MS, () => this.#readLimits(client)],
    ];
    while (this.#alive(client)) {
      try {
        for (const [name, every, job] of jobs) {
          if (performance.now() < due[name]) continue;
          due[name] = performance.now() + every;
          await job();
        }
      } catch (error) {
        if (!this.#alive(client)) return;
        client.close();
        this.#lost(error.message);
        return;
      }
      await sleep(10);
    }
  }

  async #readStatus(client) {
    this.status = await client.status();
    const stopping = (this.status.faults & ~this.#harmless) >>> 0;
    if (this.wanted && stopping) {
      await this.#end(0);
      this.tell(`stopped by ${this.faultNames(stopping).join(', ')}: see Faults`, true);
    }
    this.#event('status');
  }

  /** Speed as people count it, and the torque that flux and current limit allow. */
  async #readLimits(client) {
    const p = await client.get(LIMITS.filter((name) => client.parameters.has(name)));
    const { polePairs } = client.identity;
    const rpm = (name) => (p.get(name) / polePairs) * RPM_PER_RAD_S;
    const torque_Nm = polePairs * (p.get('M_H') ** 2 / p.get('Lr_H')) * p.get('i_d_A') * p.get('i_q_max_A');
    const found = {
      speed_rpm: Math.round(rpm('omega_max_rad_s')) || 3000,
      torque_Nm: TORQUE_STEP_NM * Math.max(Math.floor(torque_Nm / TORQUE_STEP_NM), 1),
      torqueSpeed_rpm: rpm('torque_speed_max_rad_s'),
      direction: ['both', 'positive', 'negative'][p.get('direction') ?? 0] ?? 'both',
      openLoop: (p.get('control_mode') ?? 0) !== 0, // V/f or I-f: nothing is estimated
      fluxFactor: polePairs * (p.get('M_H') / p.get('Lr_H')), // torque over flux and torque current
    };
    if (JSON.stringify(found) === JSON.stringify(this.limits)) return;
    this.limits = found;
    this.#event('limits');
  }

  async #readMonitor(client, names) {
    if (!names.length) return;
    const { values } = await client.sample(names);
    names.forEach((name, k) => this.monitor.set(name, values[k]));
    this.#event('monitor');
  }

  async #readRoles(client) {
    if (!this.roles) return;
    this.roles = await client.roles();
    this.#event('roles');
  }

  async #pollScope(client) {
    while (this.#alive(client)) {
      const names = this.watched.filter((name) => client.signals.has(name));
      const begun = performance.now();
      try {
        const row = new Map();
        let period = 0;
        for (let at = 0; at < names.length; at += AT_ONCE) {
          const some = names.slice(at, at + AT_ONCE);
          const sample = await client.sample(some);
          if (at === 0) period = sample.period;
          some.forEach((name, k) => row.set(name, sample.values[k]));
        }
        if (names.length) this.#event('samples', { t: period * client.identity.period_s, row });
      } catch {
        await sleep(STATUS_MS); // the status poll says what is wrong
      }
      await sleep(Math.max(SAMPLE_MS - (performance.now() - begun), names.length ? 0 : 50));
    }
  }

  async #keepAlive(client) {
    while (this.#alive(client)) {
      if (this.wanted) {
        try {
          await this.#drive(client, this.wanted);
        } catch (error) {
          this.wanted = null;
          this.tell(error.message, true);
          if (error.status === NO_SESSION) client.forgetSession();
        }
        this.#event('status');
      }
      await sleep(KEEP_ALIVE_MS);
    }
  }

  // --- what the user does --------------------------------------------------------------------

  /** Runs `action`; asks for the key when the drive wants another, and says what went wrong. */
  async attempt(action) {
    for (;;) {
      try {
        const result = await action(this.client);
        return result === undefined ? true : result;
      } catch (error) {
        if (!(error instanceof WrongKeyError)) {
          if (error.status === NO_SESSION) this.client?.forgetSession();
          this.tell(error.message, true);
          return false;
        }
        this.#asked ??= this.#askKey(error.message).finally(() => (this.#asked = null));
        const key = await this.#asked; // whoever needs it meanwhile waits for the same answer
        if (!key) return false;
        this.client?.useKey(key);
      }
    }
  }

  #intent = 0; // counts what the user asked for: a later stop wins over an earlier run
  #inFlight = null;

  /** One command to run; a stop that comes meanwhile has to know of it. */
  #drive(client, wanted) {
    const asked = client.command(RUN, { ...wanted, valid_s: VALID_S });
    const done = asked.catch(() => {}).then(() => {
      if (this.#inFlight === done) this.#inFlight = null;
    });
    this.#inFlight = done;
    return asked;
  }

  /** @param {{speed_rad_s?: number, torque_Nm?: number}} wanted mechanical speed */
  async run(wanted) {
    const mine = ++this.#intent;
    const ok = await this.attempt((client) => this.#drive(client, wanted));
    if (mine !== this.#intent) return;
    this.wanted = ok ? wanted : null;
    this.#event('status');
  }

  /** A stop at once, and again behind a run command that was under way. */
  async #end(bits) {
    this.#intent++;
    this.wanted = null;
    const before = this.#inFlight;
    await this.attempt((client) => client.command(bits));
    if (before) {
      await before;
      await this.attempt((client) => client.command(bits));
    }
    this.#event('status');
  }

  /** While it runs: the reference that the next command carries. */
  retarget(wanted) {
    if (this.wanted) this.wanted = wanted;
  }

  stop() {
    return this.#end(0);
  }

  torqueOff() {
    return this.#end(TORQUE_OFF);
  }

  async reset() {
    await this.#end(0);
    await this.attempt(async (client) => {
      await client.command(RESET);
      await sleep(KEEP_ALIVE_MS);
      await client.command(0);
    });
  }

  // --- words ---------------------------------------------------------------------------------

  faultBits(bits) {
    return Array.from({ length: 32 }, (_, bit) => bit).filter((bit) => (bits >>> bit) & 1);
  }

  faultNames(bits) {
    return this.faultBits(bits).map((bit) => this.catalog.faults[bit]?.name ?? `bit ${bit}`);
  }

  stateName(state) {
    return this.catalog.states[state] ?? `state ${state}`;
  }

  /** What the motor gives now, by its flux. */
  get torque_Nm() {
    return this.limits ? this.limits.fluxFactor * this.status.lambda_Wb * this.status.i_q_A : NaN;
  }
}
