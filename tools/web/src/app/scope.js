/** The scope: live signals, triggered recordings, the record of the last fault. */

import { download, h, setText, store } from './dom.js';
import { mdf4Of } from './mdf4.js';
import { Pane, signalList } from './pane.js';
import { Recorder, csvOf } from './recorder.js';
import { panesByUnit, rawOf, unitOf } from './signals.js';
import { Trigger } from './trigger.js';

const DRAW_MS = 60;
const FIRST = [['speed_ref_rpm', 'speed_rpm'], ['i_d_A', 'i_q_A']];

export function scopeTab(session) {
  const scope = new Scope(session);
  session.addEventListener('zh-show', ({ detail }) => scope.show(detail.record, detail.title));
  return { element: scope.element, shown: () => scope.layout() };
}

class Scope {
  #session;
  #recorder = new Recorder();
  #panes = [];
  #list = h('div', { class: 'panes' });
  #captured = null; // a recording instead of what is live: {t, columns, title, mark}
  #zoom = null;
  #frozen = null; // recording while paused
  #title = h('span', { class: 'scope-title', id: 'scope-title' });
  #say = h('span', { class: 'hint', id: 'scope-say', role: 'status' });
  #drawn_ms = 0;

  constructor(session) {
    this.#session = session;
    this.#trigger = new Trigger(session, {
      take: (record) => this.show(record, 'triggered recording', true),
      say: (text) => setText(this.#say, text),
      chosen: () => this.#panes.flatMap((pane) => pane.signals),
    });
    this.#controls();
    this.element = h('section', { class: 'scope', 'aria-label': 'scope' }, this.#bar, this.#trigger.element, this.#list, signalList(session));
    for (const signals of store.get('panes', FIRST)) this.#addPane(signals);
    session.addEventListener('samples', ({ detail }) => this.#recorder.add(detail.t, detail.row));
    session.addEventListener('change', () => session.state === 'connected' && this.#watch());
    document.addEventListener('zh-theme', () => this.#panes.forEach((pane) => pane.restyle()));
    document.addEventListener('keydown', (event) => {
      if (event.key === ' ' && document.activeElement === document.body && !this.element.hidden) {
        event.preventDefault();
        this.#pause(!this.#frozen);
      }
    });
    const frame = (now) => {
      requestAnimationFrame(frame);
      if (now - this.#drawn_ms < DRAW_MS || this.element.hidden) return;
      this.#drawn_ms = now;
      this.#draw();
    };
    requestAnimationFrame(frame);
  }
  #trigger;
  #bar;
  #pauseButton;
  #liveButton;
  #mode;
  #window;

  #controls() {
    this.#pauseButton = h('button', { id: 'pause', title: 'space', onclick: () => this.#pause(!this.#frozen) }, 'Pause');
    this.#liveButton = h('button', { id: 'live', hidden: true, onclick: () => this.#live() }, 'Back to live');
    this.#mode = h('select', { id: 'scope-mode', 'aria-label': 'mode', onchange: () => this.#setMode(this.#mode.value) },
      h('option', { value: 'live' }, 'Live'), h('option', { value: 'normal' }, 'Trigger: normal'), h('option', { value: 'single' }, 'Trigger: single'));
    this.#window = h('select', { id: 'scope-window', 'aria-label': 'time window' },
      [2, 5, 10, 30, 60].map((s) => h('option', { value: s, selected: s === 10 }, `${s} s`)));
    const again = h('button', { id: 'arm', title: 'arm the trigger with what is set now', onclick: () => this.#mode.value !== 'live' && this.#setMode(this.#mode.value) }, 'Arm');
    const unzoom = h('button', { onclick: () => (this.#zoom = null) }, 'Whole width');
    const fault = h('button', { id: 'last-fault', onclick: () => this.#lastFault() }, 'Last fault');
    const csv = h('button', { id: 'csv', onclick: () => download('scope.csv', csvOf(this.#shown()), 'text/csv') }, 'CSV');
    const mdf = h('button', { id: 'mdf4', onclick: () => this.#mdf4() }, 'MDF4');
    const pane = h('button', { id: 'add-pane', onclick: () => { this.#addPane([]); this.layout(); } }, '+ Pane');
    this.#bar = h('div', { class: 'scope-bar' }, this.#mode, again, this.#window, this.#pauseButton, this.#liveButton, unzoom, fault, csv, mdf, pane, this.#title, this.#say);
  }

  #addPane(signals) {
    const pane = new Pane(this.#session, signals, {
      changed: () => this.layout(),
      remove: (gone) => {
        this.#panes = this.#panes.filter((other) => other !== gone);
        gone.element.remove();
        this.layout();
      },
      zoomed: (from, to) => {
        if (!this.#captured && !this.#frozen) this.#pause(true);
        this.#zoom = [from, to];
      },
    });
    this.#panes.push(pane);
    this.#list.append(pane.element);
  }

  #setPanes(groups) {
    this.#panes = [];
    this.#list.replaceChildren();
    groups.forEach((signals) => this.#addPane(signals));
  }

  /** After panes or signals changed. */
  layout() {
    if (!this.#captured) store.set('panes', this.#panes.map((pane) => pane.signals));
    this.#watch();
  }

  #watch() {
    this.#session.watched = rawOf(this.#panes.flatMap((pane) => pane.signals));
  }

  #setMode(mode) {
    if (mode === 'live') this.#live();
    this.#trigger.setMode(mode);
  }

  #pause(paused) {
    this.#frozen = paused ? this.#recorder.between(-Infinity, Infinity) : null;
    if (!paused) this.#zoom = null;
    setText(this.#pauseButton, paused ? 'Continue' : 'Pause');
  }

  #live() {
    const foreign = this.#captured?.foreign;
    this.#captured = null;
    this.#zoom = null;
    this.#mode.value = 'live';
    this.#trigger.setMode('live');
    this.#pause(false);
    this.#liveButton.hidden = true;
    setText(this.#title, '');
    if (foreign) this.#setPanes(store.get('panes', FIRST));
    this.layout();
  }

  /** A recording in place of what is live; own: of the signals that the panes have. */
  show({ t, names, columns }, title, own = false) {
    const foreign = !own;
    this.#captured = { t, columns: new Map(names.map((name, k) => [name, columns[k]])), title, mark: 0, foreign };
    this.#zoom = null;
    if (foreign) this.#setPanes(panesByUnit(names, this.#session.catalog));
    this.#liveButton.hidden = false;
    setText(this.#title, title);
  }

  async #lastFault() {
    const record = await this.#session.attempt((client) => client.faultRecord().then((found) => found ?? 'none'));
    if (record === 'none') this.#session.tell('there is no record: no fault has opened the gates yet');
    else if (record) this.show(record, `fault ${record.number}, the periods round it`);
  }

  #shown() {
    return this.#captured ?? this.#frozen ?? this.#recorder.between(-Infinity, Infinity);
  }

  #mdf4() {
    const { client, catalog } = this.#session;
    download('scope.mf4', mdf4Of(this.#shown(), {
      unitOf: (name) => unitOf(name, catalog),
      isWhole: (name) => client?.signals.get(name)?.whole ?? false,
      comment: client?.identity.text ?? '',
    }), 'application/octet-stream');
  }

  #draw() {
    let recording = this.#captured ?? this.#frozen;
    let range = this.#zoom;
    if (!recording) {
      const end = this.#recorder.t.at(-1) ?? 0;
      const span = Number(this.#window.value);
      recording = this.#recorder.between(end - span, end);
      range ??= [end - span, end];
    }
    for (const pane of this.#panes) pane.draw(recording, range, this.#captured?.mark ?? null);
  }
}
