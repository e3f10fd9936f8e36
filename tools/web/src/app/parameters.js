/** Parameters by group: values, what they may be, and what the drive answers to a change. */

import { shown, short, spanOf } from '../link/answers.js';
import { download, fill, h, setText } from './dom.js';
import { importPanel } from './param_sets.js';

const REFRESH_MS = 3000;
const float32 = Math.fround;

export function parametersTab(session) {
  const tab = new Parameters(session);
  return { element: tab.element, shown: () => tab.refresh() };
}

class Parameters {
  #session;
  #rows = new Map(); // name -> {element, field, message, parameter}
  #values = new Map();
  #groups = h('div', { class: 'groups' });
  #search = h('input', { type: 'search', id: 'param-search', placeholder: 'search …', 'aria-label': 'search parameters', oninput: () => this.#filter() });
  #changedOnly = h('input', { type: 'checkbox', id: 'param-changed', onchange: () => this.#filter() });
  #count = h('span', { class: 'hint', id: 'param-count' });
  #sets;

  constructor(session) {
    this.#session = session;
    this.#sets = importPanel(session, { values: () => this.#values, done: () => this.refresh() });
    const unlock = () => session.attempt((client) => client.unlock()).then((ok) => ok && session.tell('unlocked: protected parameters can be set for ten minutes'));
    const save = () => session.attempt((client) => client.save()).then((ok) => ok && session.tell('saved: these values survive power-down'));
    const bar = h('div', { class: 'param-bar' }, this.#search,
      h('label', {}, this.#changedOnly, 'changed only'), this.#count,
      h('button', { id: 'param-unlock', onclick: unlock }, 'Unlock'),
      h('button', { id: 'param-save', onclick: save, title: 'in the drive, for the next power-up' }, 'Save in the drive'),
      h('button', { id: 'param-export', onclick: () => this.#export() }, 'Export'), this.#sets.button);
    this.element = h('section', { class: 'parameters', 'aria-label': 'parameters' }, bar, this.#sets.element, this.#groups);
    session.addEventListener('change', () => {
      if (session.state === 'connected') this.#build();
    });
    setInterval(() => !this.element.hidden && session.state === 'connected' && this.refresh(), REFRESH_MS);
  }

  #build() {
    const { client, catalog } = this.#session;
    const groups = new Map();
    this.#rows.clear();
    for (const parameter of client.parameters.values()) {
      const row = this.#row(parameter, catalog.parameters[parameter.name] ?? '');
      this.#rows.set(parameter.name, row);
      groups.set(parameter.group, [...(groups.get(parameter.group) ?? []), row.element]);
    }
    fill(this.#groups, [...groups].map(([name, rows]) =>
      h('details', { open: true, class: 'group' }, h('summary', {}, h('h2', {}, name), h('span', { class: 'hint' }, catalog.groups[name] ?? '')),
        h('div', { class: 'param-table', role: 'table', 'aria-label': name }, rows))));
    if (!this.element.hidden) this.refresh();
  }

  #row(parameter, text) {
    const { name } = parameter;
    const message = h('p', { class: 'refusal', role: 'alert', hidden: true });
    const label = `${name}${parameter.unit ? ` in ${parameter.unit}` : ''}`;
    const field = parameter.choices.length
      ? h('select', { id: `p-${name}`, 'aria-label': label }, parameter.choices.map((choice, k) => h('option', { value: k }, choice)))
      : h('input', { id: `p-${name}`, type: 'text', inputMode: 'decimal', autocomplete: 'off', spellcheck: false, 'aria-label': label });
    field.addEventListener('change', () => this.#set(name));
    field.addEventListener('keydown', (event) => {
      if (event.key === 'Escape') this.#show(name);
    });
    const lock = { protected: 'protected', ready: 'gates off' }[parameter.access];
    const element = h('div', { class: 'param', role: 'row' },
      h('label', { class: 'param-name', htmlFor: `p-${name}` }, name, lock && h('span', { class: 'lock', title: lock === 'protected' ? 'unlock before you change it' : 'can be changed with the gates off' }, lock)),
      h('span', { class: 'param-value' }, field, h('span', { class: 'unit' }, parameter.unit)),
      h('span', { class: 'param-span' }, spanOf({ ...parameter, unit: '' }).replace('one of ', '')),
      h('button', { class: 'quiet param-default', title: 'set to the default', onclick: () => this.#set(name, parameter.initial) }, `default ${shown(parameter, parameter.initial, false)}`),
      h('span', { class: 'param-text' }, text), message);
    return { element, field, message, parameter, text: `${name} ${parameter.group} ${text}`.toLowerCase() };
  }

  async refresh() {
    const { client } = this.#session;
    if (!client || this.#session.state !== 'connected') return;
    try {
      this.#values = await client.get([...client.parameters.keys()]);
    } catch {
      return; // the status poll says what is wrong
    }
    for (const name of this.#values.keys()) if (document.activeElement !== this.#rows.get(name).field) this.#show(name);
    this.#filter();
  }

  #show(name) {
    const { field, element, parameter } = this.#rows.get(name);
    const value = this.#values.get(name);
    field.value = parameter.choices.length ? String(value) : short(value);
    element.classList.toggle('changed', float32(value) !== float32(parameter.initial));
  }

  async #set(name, given = null) {
    const { field, message, parameter } = this.#rows.get(name);
    const value = given ?? Number(String(field.value).replace(',', '.'));
    message.hidden = true;
    try {
      if (String(field.value).trim() === '' || Number.isNaN(value)) throw new Error(`${name}: '${field.value}' is no number`);
      const refused = await this.#try((client) => client.set(name, value));
      if (refused) throw refused;
      this.#values.set(name, (await this.#session.client.get([name])).get(name));
    } catch (error) {
      setText(message, error.message);
      message.hidden = false;
    }
    if (parameter.choices.length || message.hidden) this.#show(name);
  }

  /** The refusal itself, to be shown beside the parameter; what else went wrong is told as usual. */
  async #try(action) {
    let refused = null;
    await this.#session.attempt((client) => action(client).catch((error) => {
      if (error.status === undefined) throw error;
      refused = error;
    }));
    return refused;
  }

  #filter() {
    const words = this.#search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let changed = 0;
    for (const { element, text } of this.#rows.values()) {
      const isChanged = element.classList.contains('changed');
      changed += isChanged ? 1 : 0;
      element.hidden = !words.every((word) => text.includes(word)) || (this.#changedOnly.checked && !isChanged);
    }
    for (const group of this.#groups.children) group.hidden = !group.querySelector('.param:not([hidden])');
    setText(this.#count, `${this.#rows.size} parameters, ${changed} changed`);
  }

  async #export() {
    await this.refresh();
    const { identity, parameters } = this.#session.client;
    const lines = [`# ${identity.text}`, '[params]'];
    for (const [name, value] of this.#values) {
      const word = shown(parameters.get(name), value, false);
      lines.push(`${name} = ${parameters.get(name).choices.length ? JSON.stringify(word) : word}`);
    }
    download('parameters.toml', `${lines.join('\n')}\n`);
  }
}
