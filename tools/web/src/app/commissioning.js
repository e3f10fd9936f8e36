/** From the nameplate to a drive that knows its motor, step by step. */

import uPlot from 'uplot';

import { fill, h, number, store } from './dom.js';

const PLATE = [
  ['power_kW', 'Power', 'kW', 1.5], ['voltage_V', 'Voltage of the line', 'V', 200], ['current_A', 'Current of the line', 'A', 5.73],
  ['frequency_Hz', 'Frequency', 'Hz', 60], ['speed_rpm', 'Speed', 'min⁻¹', 1755], ['cos_phi', 'Power factor', '', 0.83],
];
const STEPS = ['Nameplate', 'Measure at standstill', 'Result', 'Design the gain table', 'Save in the drive', 'Trial'];
const [PLATE_STEP, MEASURE, RESULT, DESIGN, KEEP, TRIAL] = STEPS.keys();
const UNITS = { Rs_ohm: 'Ω', Rr_ohm: 'Ω', Ls_H: 'H', Lr_H: 'H', M_H: 'H' };

/** @param {() => import('./tools_line.js').ToolsLine} makeTools */
export function commissioningTab(session, makeTools) {
  const guide = new Guide(session, makeTools);
  return { element: guide.element, shown: () => guide.open() };
}

class Guide {
  #session;
  #make;
  #tools = null;
  #job = '';
  #steps;
  #log = h('ol', { class: 'log', id: 'commission-log', role: 'log' });
  #bar = h('progress', { max: 1, value: 0, hidden: true, 'aria-label': 'progress' });
  #cancel = h('button', { hidden: true, onclick: () => this.#tools?.begin('cancel') }, 'Cancel');
  #fields = new Map();
  #rotate = h('input', { type: 'checkbox', id: 'commission-rotate' });
  #done = new Set();
  #open = new Set();

  constructor(session, makeTools) {
    this.#session = session;
    this.#make = makeTools;
    const bodies = [this.#plateForm(), this.#measure(), h('div', { id: 'commission-result' }, h('p', { class: 'hint' }, 'Nothing measured yet.')), this.#design(), this.#keep(), this.#trial()];
    this.#steps = STEPS.map((name, k) => h('li', { class: 'step', 'data-step': k }, h('h2', {}, `${k + 1}. ${name}`), bodies[k]));
    this.element = h('section', { class: 'commissioning', 'aria-label': 'commissioning' },
      h('p', {}, 'The drive measures the motor at standstill and derives every parameter from it. The shaft stays where it is, unless you ask for more; current flows for about half a minute.'),
      h('ol', { class: 'steps' }, this.#steps),
      h('div', { class: 'running' }, this.#bar, this.#cancel, this.#log));
    this.#advance([], [PLATE_STEP, MEASURE]);
  }

  #plateForm() {
    const saved = store.get('plate', {});
    const rows = PLATE.map(([name, label, unit, typical]) => {
      const input = h('input', { id: `plate-${name}`, type: 'number', step: 'any', min: 0, value: saved[name] ?? '', placeholder: `such as ${typical}` });
      this.#fields.set(name, input);
      return h('label', {}, label, h('span', {}, input, h('span', { class: 'unit' }, unit)));
    });
    const connection = h('select', { id: 'plate-connection' }, h('option', { value: 'star' }, 'star'), h('option', { value: 'delta' }, 'delta'));
    this.#fields.set('connection', connection);
    return h('div', {},
      h('p', { class: 'hint' }, 'As on the motor’s plate, for the connection that is wired.'),
      h('div', { class: 'plate' }, rows, h('label', {}, 'Connection', connection)));
  }

  #plate() {
    const plate = { connection: this.#fields.get('connection').value };
    for (const [name, label] of PLATE) {
      const value = Number(this.#fields.get(name).value);
      if (!(value > 0)) throw new Error(`${label}: give the nameplate's value`);
      plate[name] = value;
    }
    store.set('plate', plate);
    return plate;
  }

  #measure() {
    return h('div', {}, h('p', { class: 'hint' }, 'Needs the gates off and the drive’s key. Parameters that are changed for it are put back.'),
      h('label', { class: 'rotate' }, this.#rotate, 'Then turn the motor, up to three quarters of its speed: inertia and friction. Shaft free, nobody near it.'),
      h('button', { id: 'commission-start', class: 'run', onclick: () => this.#start() }, 'Measure'));
  }

  #design() {
    return h('div', { id: 'commission-design' }, h('p', { class: 'hint' }, 'The observer’s gains for every speed, by zh design: seconds to minutes. The table becomes part of the next image.'),
      h('button', { id: 'design-start', onclick: () => this.#begin('design') }, 'Design'), h('div', { class: 'answer' }));
  }

  #keep() {
    return h('div', { id: 'commission-keep' }, h('p', { class: 'hint' }, 'Sets what was found and keeps it over power-down. The gain table stays off until the image has this motor’s.'),
      h('button', { id: 'keep-start', onclick: () => this.#begin('keep') }, 'Set and save'), h('div', { class: 'answer' }));
  }

  #trial() {
    return h('div', { id: 'commission-trial' }, h('p', { class: 'hint' }, 'A speed step and rated load, simulated with the designed table: for a simulated motor (zh studio --rig).'),
      h('button', { id: 'trial-start', onclick: () => this.#begin('trial') }, 'Run the trial'), h('div', { class: 'answer' }));
  }

  /** Marks steps as done and lets others begin. */
  #advance(done, next) {
    done.forEach((k) => this.#done.add(k));
    next.forEach((k) => this.#open.add(k));
    this.#steps.forEach((element, k) => {
      const open = this.#open.has(k) && (k !== TRIAL || this.#tools?.offer?.trial === true);
      element.classList.toggle('later', !open);
      element.classList.toggle('done', this.#done.has(k));
      for (const button of element.querySelectorAll('button')) button.disabled = !open;
    });
  }

  /** Connects to the tools; the nameplate of a simulated motor is known. */
  async open() {
    if (this.#tools?.isOpen || this.#session.state !== 'connected') return this.#tools?.isOpen ?? false;
    const tools = this.#make();
    tools.addEventListener('event', ({ detail }) => this.#hear(detail));
    let known = await tools.open((nonce) => this.#session.client.toolsResponse(nonce)).catch((error) => {
      this.#session.tell(error.message, true);
      return null;
    });
    if (known === null) return false;
    this.#tools = tools;
    const { plate } = tools.offer;
    for (const [name, field] of this.#fields) if (plate && !field.value) field.value = plate[name] ?? field.value;
    if (plate) this.#fields.get('connection').value = plate.connection;
    this.#advance([], []);
    return known;
  }

  async #start() {
    let plate;
    try {
      plate = this.#plate();
    } catch (error) {
      this.#session.tell(error.message, true);
      return;
    }
    fill(this.#log);
    // Also asks for the key when it is not the development key.
    if (!(await this.#session.attempt((client) => client.unlock()))) return;
    if (!this.#tools?.isOpen) this.#tools?.close();
    if (!(await this.open())) {
      this.#session.tell('the tools do not know this key; start zh studio with --key', true);
      return;
    }
    this.#begin('commission', { plate, rotate: this.#rotate.checked });
  }

  #begin(job, more = {}) {
    if (!this.#tools?.isOpen) return;
    this.#job = job;
    this.#bar.hidden = this.#cancel.hidden = false;
    this.#bar.removeAttribute('value');
    this.#tools.begin(job, more);
  }

  #hear({ job, say, share, result, error }) {
    if (say) this.#log.append(h('li', {}, say));
    if (share !== undefined) this.#bar.value = share;
    if (error === undefined && result === undefined) return;
    this.#bar.hidden = this.#cancel.hidden = true;
    if (error !== undefined) {
      if (job || this.#job) this.#session.tell(`${job || this.#job}: ${error}`, true);
      this.#job = '';
      return;
    }
    this.#job = '';
    ({ commission: (r) => this.#found(r), design: (r) => this.#designed(r), keep: (r) => this.#kept(r), trial: (r) => this.#tried(r) })[job]?.(result);
  }

  #found({ seconds, rows, i_d_A, rotor_flux_Wb, lost_V, curve, mechanics }) {
    const table = rows.map(({ name, found, guess }) =>
      h('tr', {}, h('th', {}, name.replace(/_\w+$/, '')), h('td', {}, `${number(found)} ${UNITS[name] ?? ''}`), h('td', {}, `${number(guess)} ${UNITS[name] ?? ''}`)));
    const picture = h('div', { class: 'plot small' });
    fill(document.getElementById('commission-result'),
      h('p', {}, `Found in ${seconds.toFixed(0)} s of the drive’s time.`),
      h('table', {}, h('thead', {}, h('tr', {}, h('th', {}, ''), h('th', {}, 'measured'), h('th', {}, 'guess from the nameplate'))), h('tbody', {}, table)),
      h('p', {}, `Rated flux ${number(rotor_flux_Wb)} Wb takes i_d = ${number(i_d_A)} A. A leg of the inverter loses ${number(lost_V)} V.`),
      mechanics && h('p', { id: 'commission-mechanics' }, `Inertia ${number(mechanics.J_kg_m2)} kg m², friction ${number(mechanics.coulomb_Nm, 3)} N m and ${number(mechanics.viscous_Nms, 3)} N m per rad/s.`),
      h('h3', {}, 'Magnetising curve: main flux in Wb over current in A'), picture);
    drawXY(picture, [curve.map((p) => p[1]), curve.map((p) => p[0])], ['A', 'main flux Wb'], true);
    this.#advance([PLATE_STEP, MEASURE, RESULT], [RESULT, DESIGN, KEEP]);
  }

  #designed({ entries, method, gamma, folder }) {
    const bound = gamma === null ? '' : `, gamma at most ${number(gamma)}`;
    fill(document.querySelector('#commission-design .answer'), h('p', { class: 'good' }, `${entries} entries, ${method}${bound}. Written to ${folder}.`));
    this.#advance([DESIGN], [TRIAL]);
  }

  #kept({ parameters }) {
    fill(document.querySelector('#commission-keep .answer'), h('p', { class: 'good' }, `${parameters} parameters set and saved.`));
    this.#advance([KEEP], []);
  }

  #tried({ held, speed_err_pu, angle_err_deg, dip_pu, rise_s, record }) {
    const picture = h('div', { class: 'plot small' });
    fill(document.querySelector('#commission-trial .answer'),
      h('p', { class: held ? 'good' : 'bad' }, `${held ? 'Held' : 'Not held'}: speed step in ${number(rise_s, 3)} s, rated load takes ${number(100 * dip_pu, 3)} % for a moment; settled within ${number(100 * speed_err_pu, 2)} % and ${number(angle_err_deg, 2)} degrees.`),
      picture);
    if (held) this.#advance([TRIAL], []);
    drawXY(picture, [record.t, record.speed_ref_rpm, record.speed_rpm], ['s', 'reference min⁻¹', 'speed min⁻¹'], false);
  }
}

function drawXY(element, data, labels, points) {
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axis = { stroke: css('--text-dim'), grid: { stroke: css('--grid'), width: 1 }, ticks: { stroke: css('--grid') } };
  new uPlot({
    width: Math.max(element.clientWidth, 300), height: 220, scales: { x: { time: false } }, axes: [axis, { ...axis, size: 60 }],
    series: [{ label: labels[0] }, ...labels.slice(1).map((label, k) => ({ label, stroke: css(`--plot-${k + 1}`), width: 1.6, points: { show: points } }))],
  }, data, element);
}
