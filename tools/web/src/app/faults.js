/** The drive's faults: what happened, why it usually does, and what helps. */

import { download, fill, h, number } from './dom.js';
import { csvOf } from './recorder.js';

const REFRESH_MS = 2000;

/** @param {() => void} toScope  @param {Element | null} flights the flight recorder, where a computer has one */
export function faultsTab(session, toScope, flights = null) {
  const list = h('ol', { class: 'fault-list', id: 'fault-list' });
  const count = h('p', { id: 'fault-count' });
  const now = h('div', { class: 'fault-now' });
  let seen = '';

  async function refresh() {
    if (session.state !== 'connected') return;
    const { ever, last } = await session.client.faults().catch(() => ({ ever: 0, last: [] }));
    const key = JSON.stringify([ever, last, session.status?.faults]);
    if (key === seen) return;
    seen = key;
    fill(count, ever === 1 ? '1 fault since the list was cleared' : `${ever} faults since the list was cleared`);
    fill(list, last.map((entry) => h('li', {}, head(entry), session.faultBits(entry.faults).map(cardOf))));
    const standing = session.faultBits(session.status?.faults ?? 0);
    fill(now, standing.length ? [h('h2', {}, 'Standing now'), ...standing.map(cardOf)] : h('p', { class: 'good' }, 'No fault stands.'));
  }

  function head({ number: n, period, state }) {
    const at = period * session.client.identity.period_s;
    return h('h3', {}, `Fault ${n}`, h('span', { class: 'hint' }, ` ${number(at, 7)} s after start, in ${session.stateName(state)}`));
  }

  function cardOf(bit) {
    const fault = session.catalog.faults[bit] ?? { name: `bit ${bit}`, text: '', cause: '', remedy: '', reaction: '' };
    return h('article', { class: 'fault' },
      h('h4', {}, fault.name, h('span', { class: 'hint' }, ` ${fault.reaction.toLowerCase().replaceAll('_', ' ')}`)),
      h('dl', {}, h('dt', {}, 'What'), h('dd', {}, fault.text), h('dt', {}, 'Likely cause'), h('dd', {}, fault.cause), h('dt', {}, 'Remedy'), h('dd', {}, fault.remedy)));
  }

  async function record(use) {
    const found = await session.attempt((client) => client.faultRecord().then((r) => r ?? 'none'));
    if (found === 'none') session.tell('there is no record: no fault has opened the gates yet');
    else if (found) use(found);
  }
  const open = () => record((found) => {
    const before = found.fromBeforeReset ? ', from before the last reset' : '';
    session.dispatchEvent(new CustomEvent('zh-show', { detail: { record: found, title: `fault ${found.number}, the periods round it${before}` } }));
    toScope();
  });
  const csv = () => record((found) => download(`fault-${found.number}.csv`, csvOf({ t: found.t, columns: new Map(found.names.map((n, k) => [n, found.columns[k]])) }), 'text/csv'));
  const clear = () => session.attempt((client) => client.clearFaults()).then(() => refresh());

  const element = h('section', { class: 'faults', 'aria-label': 'faults' },
    h('div', { class: 'param-bar' },
      h('button', { id: 'fault-open', class: 'run', onclick: open }, 'Open the record of the last fault'),
      h('button', { onclick: csv }, 'Record as CSV'),
      h('button', { id: 'fault-reset', onclick: () => session.reset() }, 'Reset'),
      h('button', { onclick: clear }, 'Clear the list')),
    flights, now, count, list);
  setInterval(() => !element.hidden && refresh(), REFRESH_MS);
  return { element, shown: refresh };
}
