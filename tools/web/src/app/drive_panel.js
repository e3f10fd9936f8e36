/** Speed, run, stop, torque off, and what the drive says of itself. */

import { fill, h, number, setText } from './dom.js';
import { RPM_PER_RAD_S } from './session.js';
import { VectorDiagram } from './vector.js';

const CONFIDENCE = ['closed loop', 'degraded', 'I-f operation'];
const MIN = 'min⁻¹';

/** What a reference can be: its unit, its largest value, what the drive is told. */
const MODES = {
  speed: { title: 'Speed', unit: MIN, step: 1, most: (limits) => limits.speed_rpm, wanted: (value) => ({ speed_rad_s: value / RPM_PER_RAD_S }) },
  torque: { title: 'Torque', unit: 'N m', step: 0.1, most: (limits) => limits.torque_Nm, wanted: (value) => ({ torque_Nm: value }) },
};
const NO_LIMITS = { speed_rpm: 100, torque_Nm: 1, torqueSpeed_rpm: NaN, direction: 'both', openLoop: false };

/** Speed or torque: slider, number, and how far they go. */
class Reference {
  #session;
  #mode = h('select', { id: 'drive-mode', 'aria-label': 'what the reference is', onchange: () => this.#choose() },
    Object.entries(MODES).map(([value, { title }]) => h('option', { value }, title)));
  #slider = h('input', { type: 'range', id: 'speed-slider', value: 0 });
  #box = h('input', { type: 'number', id: 'speed-box', value: 0 });
  #unit = h('span', {}, MIN);
  #hint = h('span', { class: 'hint', id: 'torque-hint' });
  #zero = h('button', { title: 'reference to zero, drive keeps running', onclick: () => this.take(0) }, '0');
  #turn = h('button', { id: 'reverse', title: 'the other direction, along the ramp', onclick: () => this.take(-Number(this.#box.value)) }, 'Reverse');

  constructor(session) {
    this.#session = session;
    this.element = h('div', { class: 'drive-speed' }, this.#mode, this.#slider, this.#box, this.#unit, this.#zero, this.#turn, this.#hint);
    this.#slider.addEventListener('input', () => this.take(this.#slider.value));
    this.#box.addEventListener('change', () => this.take(this.#box.value));
    this.#box.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter') return;
      this.take(this.#box.value);
      session.run(this.wanted());
    });
    session.addEventListener('limits', () => this.#limit());
    session.addEventListener('status', () => this.enable());
    this.#limit();
  }

  get #kind() {
    return MODES[this.#mode.value];
  }

  /** A speed does not become a torque while the drive runs. */
  enable() {
    const connected = this.#session.state === 'connected';
    this.#mode.disabled = !connected || this.#session.wanted !== null;
    for (const control of [this.#slider, this.#box, this.#zero]) control.disabled = !connected;
    this.#turn.disabled = !connected || (this.#session.limits?.direction ?? 'both') !== 'both';
  }

  #choose() {
    this.#limit();
    this.take(0);
  }

  /** By what the drive allows now; a speed only in its directions. */
  #limit() {
    const limits = this.#session.limits ?? NO_LIMITS;
    const { unit, step, most, title } = this.#kind;
    const speed = this.#kind === MODES.speed;
    const range = {
      min: speed && limits.direction === 'positive' ? 0 : -most(limits),
      max: speed && limits.direction === 'negative' ? 0 : most(limits),
      step,
    };
    const label = `${title.toLowerCase()} reference in ${unit}`;
    for (const control of [this.#slider, this.#box]) {
      Object.assign(control, range);
      control.setAttribute('aria-label', label);
    }
    setText(this.#unit, unit);
    setText(this.#hint, speed ? '' : `reduced above ${limits.torqueSpeed_rpm.toFixed(0)} ${MIN}`);
  }

  take(value) {
    const { min, max } = this.#box;
    const within = Math.min(Math.max(Number(value) || 0, Number(min)), Number(max));
    this.#slider.value = this.#box.value = String(within);
    this.#session.retarget(this.wanted());
  }

  wanted() {
    return this.#kind.wanted(Number(this.#box.value));
  }
}

/** The row of controls that stays in sight. */
export function driveBar(session) {
  const state = h('strong', { class: 'badge', id: 'state', role: 'status' }, '…');
  const speed = h('span', { id: 'speed', class: 'speed' }, '–');
  const reference = new Reference(session);
  const run = h('button', { class: 'run', id: 'run', onclick: () => session.run(reference.wanted()) }, 'Run');
  const stop = h('button', { class: 'stop', id: 'stop', title: 'Escape', onclick: () => session.stop() }, 'Stop');
  const off = h('button', { class: 'off', id: 'torque-off', title: 'gates off at once; the motor coasts', onclick: () => session.torqueOff() }, 'Torque off');
  const reset = h('button', { id: 'reset', onclick: () => session.reset() }, 'Reset fault');

  session.addEventListener('change', () => {
    for (const control of [run, stop, off, reset]) control.disabled = session.state !== 'connected';
    reference.enable();
  });
  session.addEventListener('status', () => {
    const { status } = session;
    setText(state, session.stateName(status.state));
    state.dataset.state = session.stateName(status.state);
    const rpm = status.speedHat_rad_s * RPM_PER_RAD_S;
    setText(speed, status.speedUnknown ? 'speed unknown' : `${rpm.toFixed(1)} ${MIN}`);
    run.classList.toggle('active', session.wanted !== null);
    reset.hidden = session.stateName(status.state) !== 'FAULT';
  });
  return h('section', { class: 'drive-bar', 'aria-label': 'drive' },
    h('div', { class: 'drive-now' }, state, speed),
    reference.element,
    h('div', { class: 'drive-buttons' }, run, stop, off, reset));
}

function row(name, id) {
  const value = h('dd', { id }, '–');
  return { value, elements: [h('dt', {}, name), value] };
}

function gauge(name) {
  const bar = h('meter', { min: 0, max: 1, low: 0.7, high: 0.95, optimum: 0, 'aria-label': name });
  const value = h('span', {}, '–');
  return {
    elements: [h('dt', {}, name), h('dd', {}, bar, value)],
    show(share) {
      bar.value = Number.isFinite(share) ? share : 0;
      setText(value, Number.isFinite(share) ? `${(100 * share).toFixed(0)} %` : '–');
    },
  };
}

/** The side panel. */
export function statusPanel(session) {
  const rows = {
    speed: row('Speed', 'status-speed'),
    bound: row('Bound of its error', 'status-bound'),
    reference: row('Reference', 'status-reference'),
    frequency: row('Stator frequency', 'status-frequency'),
    confidence: row('Orientation', 'status-confidence'),
    torque: row('Torque', 'status-torque'),
    current: row('i_d, i_q', 'status-current'),
    phases: row('Phases u, v, w', 'status-phases'),
    lines: row('Lines u-v, v-w', 'status-lines'),
    dc: row('Dc link', 'status-dc'),
    temperature: row('Temperatures', 'status-temperature'),
    Rs: row('Stator resistance', 'status-rs'),
    gates: row('Gates', 'status-gates'),
  };
  const heat = { motor: gauge('Motor heat'), inverter: gauge('Inverter heat') };
  const reasons = h('ul', { class: 'reasons', 'aria-label': 'reasons' });
  const vector = new VectorDiagram();
  let shownReasons = '';

  session.addEventListener('status', () => {
    const s = session.status;
    const rpm = (value) => `${(value * RPM_PER_RAD_S).toFixed(1)} ${MIN}`;
    setText(rows.speed.value, s.speedUnknown ? 'nobody knows' : rpm(s.speedHat_rad_s));
    setText(rows.bound.value, `± ${rpm(s.speedBound_rad_s)}`);
    setText(rows.reference.value, rpm(s.speedRef_rad_s));
    setText(rows.frequency.value, `${s.statorFrequency_Hz.toFixed(2)} Hz`);
    const { openLoop } = session.limits ?? NO_LIMITS;
    setText(rows.confidence.value, openLoop ? 'none: open loop' : (CONFIDENCE[s.confidence] ?? `confidence ${s.confidence}`));
    rows.confidence.value.dataset.level = openLoop ? '' : s.confidence;
    setText(rows.current.value, `${s.i_d_A.toFixed(2)}, ${s.i_q_A.toFixed(2)} A`);
    setText(rows.torque.value, `${session.torque_Nm.toFixed(2)} N m`);
    setText(rows.dc.value, `${s.u_dc_V.toFixed(0)} V`);
    setText(rows.Rs.value, `${number(s.Rs_hat_ohm)} Ω`);
    const { monitor } = session;
    setText(rows.gates.value, (monitor.get('gates_on') ? 'on' : 'off') + (monitor.get('brake_on') ? ', brake resistor on' : ''));
    heat.motor.show(monitor.get('overload_motor_pu'));
    heat.inverter.show(monitor.get('overload_inverter_pu'));
    const key = `${s.reasons} ${s.faults}`;
    if (key !== shownReasons) fill(reasons, reasonItems(session));
    shownReasons = key;
  });
  session.addEventListener('monitor', () => showSensors(session, rows));
  session.addEventListener('monitor', () => vector.update(session.monitor, session.client?.parameters.get('i_trip_A')?.initial ?? 10));
  return h('aside', { class: 'status', 'aria-label': 'status' },
    h('dl', {}, Object.values(rows).flatMap((r) => r.elements), heat.motor.elements, heat.inverter.elements),
    reasons, vector.element);
}

/** What the sensors read: phases and lines, made from the power-invariant vectors. */
function showSensors({ monitor, temperatures }, { phases, lines, temperature }) {
  const [u_A, v_A] = phasesOf(monitor.get('i_s_alpha_A'), monitor.get('i_s_beta_A'));
  setText(phases.value, `${[u_A, v_A, -u_A - v_A].map((i) => rounded(i, 2)).join(', ')} A`);
  const [u_V, v_V] = phasesOf(monitor.get('u_line_alpha_V'), monitor.get('u_line_beta_V'));
  setText(lines.value, Number.isFinite(u_V) ? `${rounded(u_V - v_V, 0)}, ${rounded(u_V + 2 * v_V, 0)} V` : '–');
  const warm = temperatures.map((name) => `${name.replace(/_degC$/, '').replaceAll('_', ' ')} ${monitor.get(name)?.toFixed(0) ?? '–'} °C`);
  setText(temperature.value, warm.join(', ') || 'no sensor');
}

/** Never "-0". */
const rounded = (value, digits) => value.toFixed(digits).replace(/^-(0[.0]*)$/, '$1');

const phasesOf = (alpha, beta) => [Math.sqrt(2 / 3) * alpha, Math.sqrt(2 / 3) * (-alpha / 2 + (Math.sqrt(3) / 2) * beta)];

function reasonItems(session) {
  const { status, catalog } = session;
  const doubts = session.faultBits(status.reasons).map((bit) => {
    const reason = catalog.reasons[bit];
    return h('li', {}, h('b', {}, reason?.name ?? `reason ${bit}`), ` ${reason?.text ?? ''}`);
  });
  const faults = session.faultBits(status.faults).map((bit) => {
    const fault = catalog.faults[bit];
    return h('li', { class: 'bad' }, h('b', {}, fault?.name ?? `bit ${bit}`), ` ${fault?.text ?? ''}`);
  });
  return [...faults, ...doubts];
}
