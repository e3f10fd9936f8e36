/** Sets of parameters in files: read one, compare it with the drive, take it over. */

import { REFUSED } from '../link/client.js';
import { shown } from '../link/answers.js';
import { fill, h } from './dom.js';

/** `name = value` lines, as `zh` writes and reads them; choices by name or number. */
export function parseSet(text, parameters) {
  const values = new Map();
  const unknown = [];
  for (const line of text.split(/\r?\n/)) {
    const found = /^\s*(\w+)\s*=\s*("([^"]*)"|[^#\s]+)\s*(#.*)?$/.exec(line);
    if (!found) continue;
    const parameter = parameters.get(found[1]);
    const word = found[3] ?? found[2];
    const choice = parameter?.choices.indexOf(word) ?? -1;
    const value = choice >= 0 ? choice : Number(word);
    if (!parameter || Number.isNaN(value)) unknown.push(found[1]);
    else values.set(found[1], value);
  }
  return { values, unknown };
}

export const differences = (wanted, have) =>
  [...wanted].filter(([name, value]) => Math.fround(value) !== Math.fround(have.get(name)));

/** @param {{values: () => Map<string, number>, done: () => Promise<void>}} wiring */
export function importPanel(session, { values, done }) {
  const file = h('input', { type: 'file', accept: '.toml,.txt', hidden: true });
  const element = h('section', { class: 'import', hidden: true, 'aria-label': 'imported set' });
  const button = h('button', { id: 'param-import', onclick: () => file.click() }, 'Import, compare');
  const hide = () => (element.hidden = true);

  file.addEventListener('change', async () => {
    const [chosen] = file.files;
    if (!chosen) return;
    await done();
    compare(chosen.name, parseSet(await chosen.text(), session.client.parameters));
    file.value = '';
  });

  function compare(name, { values: wanted, unknown }) {
    const { parameters } = session.client;
    const different = differences(wanted, values());
    const rows = different.map(([p, value]) => h('tr', {}, h('th', {}, p), h('td', {}, shown(parameters.get(p), values().get(p))), h('td', {}, shown(parameters.get(p), value))));
    const report = h('div', { role: 'status' });
    const apply = h('button', { class: 'run', disabled: !different.length, onclick: () => take(different, report) }, `Set these ${different.length}`);
    fill(element,
      h('h2', {}, `${name}: ${wanted.size} values, ${different.length} differ from the drive`),
      unknown.length > 0 && h('p', { class: 'bad' }, `not understood: ${unknown.join(', ')}`),
      different.length > 0 && h('table', {}, h('thead', {}, h('tr', {}, h('th', {}, 'parameter'), h('th', {}, 'drive'), h('th', {}, 'file'))), h('tbody', {}, rows)),
      h('div', { class: 'row' }, apply, h('button', { onclick: hide }, 'Close')), report);
    element.hidden = false;
  }

  /** One that is refused next to the others' old values waits for the new ones. */
  async function take(different, report) {
    let left = different;
    let refused = [];
    const ok = await session.attempt(async (client) => {
      for (let before = Infinity; left.length && left.length < before;) {
        before = left.length;
        refused = [];
        for (const [name, value] of left) {
          await client.set(name, value).catch((error) => {
            if (error.status === undefined) throw error;
            refused.push([[name, value], error]);
          });
        }
        left = refused.filter(([, error]) => error.status === REFUSED).map(([pair]) => pair);
        if (left.length < refused.length) break;
      }
    });
    fill(report, ok && h('p', {}, `${different.length - refused.length} set`), refused.map(([, error]) => h('p', { class: 'bad' }, error.message)));
    await done();
  }
  return { element: h('div', {}, file, element), button };
}
