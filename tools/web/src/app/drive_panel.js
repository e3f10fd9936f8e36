/** Speed, run, stop, torque off, and what the drive says of itself. */

import { fill, h, number, setText } from './dom.js';
import { RPM_PER_RAD_S } from './session.js';
import { VectorDiagram } from './vector.js';

const CONFIDENCE = ['closed loop', 'degraded', 'I-f operation'];
const MIN = 'min⁻¹';

/** The row of controls that stays in sight. */
export function driveBar(session) {
  const state = h('strong', { class: 'badge', id: 'state', role: 'status' }, '…');
  const speed = h('span', { id: 'speed', class: 'speed' }, '–');
  const slider = h('input', { type: 'range', id: 'speed-slider', min: -100, max: 100, step: 1, value: 0, 'aria-label': `speed reference in ${MIN}` });
  const box = h('input', { type: 'number', id: 'speed-box', step: 1, value: 0, 'aria-label': `speed reference in ${MIN}` });
  const run = h('button', { class: 'run', id: 'run', onclick: () => session.run(wanted()) }, 'Run');
  const stop = h('button', { class: 'stop', id: 'stop', title: 'Escape', onclick: () => session.stop() }, 'Stop');
  const off = h('button', { class: 'off', id: 'torque-off', title: 'gates off at once; the motor coasts', onclick: () => session.torqueOff() }, 'Torque off');
  const reset = h('button', { id: 'reset', onclick: () => session.reset() }, 'Reset fault');
  const zero = h('button', { title: 'reference to zero, drive keeps running', onclick: () => take(0) }, '0');

  const wanted = () => ({ speed_rad_s: Number(box.value) / RPM_PER_RAD_S });
  function take(value) {
    const most = Number(slider.max);
    const rpm = Math.min(Math.max(Number(value) || 0, -most), most);
    slider.value = String(rpm);
    box.value = String(rpm);
    session.retarget(wanted());
  }
  slider.addEventListener('input', () => take(slider.value));
  box.addEventListener('change', () => take(box.value));
  box.addEventListener('keydown', (event) => {
    if (event.key !== 'Enter') return;
    take(box.value);
    session.run(wanted());
  });

  session.addEventListener('change', () => {
    const most = Math.round(session.speedMax_rpm);
    Object.assign(slider, { min: -most, max: most });
    Object.assign(box, { min: -most, max: most });
    for (const control of [run, stop, off, reset, slider, box, zero]) control.disabled = session.state !== 'connected';
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
    h('label', { class: 'drive-speed' }, slider, box, h('span', {}, MIN), zero),
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
    current: row('i_d, i_q', 'status-current'),
    dc: row('Dc link', 'status-dc'),
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
    setText(rows.confidence.value, CONFIDENCE[s.confidence] ?? `confidence ${s.confidence}`);
    rows.confidence.value.dataset.level = s.confidence;
    setText(rows.current.value, `${s.i_d_A.toFixed(2)}, ${s.i_q_A.toFixed(2)} A`);
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
  session.addEventListener('monitor', () => vector.update(session.monitor, session.client?.parameters.get('i_trip_A')?.initial ?? 10));
  return h('aside', { class: 'status', 'aria-label': 'status' },
    h('dl', {}, Object.values(rows).flatMap((r) => r.elements), heat.motor.elements, heat.inverter.elements),
    reasons, vector.element);
}

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
