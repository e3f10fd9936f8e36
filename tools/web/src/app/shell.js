/** The page: connection, tabs, drive bar, side panel. The seam for any other host of the drive. */

import { keyOf } from '../link/siphash.js';
import { commissioningTab } from './commissioning.js';
import { fill, h, setText, store } from './dom.js';
import { driveBar, statusPanel } from './drive_panel.js';
import { faultsTab } from './faults.js';
import { FlightKeeper } from './flight_keeper.js';
import { parametersTab } from './parameters.js';
import { scopeTab } from './scope.js';
import { Session } from './session.js';

const MESSAGE_MS = 12000;

/**
 * Builds the page in `root` and connects. Returns the session.
 *
 * transport: makes a Transport (link/transport.js); tools: makes a ToolsLine, or null where there is
 * no computer behind the page; catalog: texts (zerohertz/studio/catalog.py); aside: an element for
 * the page's head.
 */
export function startStudio(root, { catalog, transport, tools = null, extra = [], aside = null }) {
  const messages = h('div', { class: 'messages', role: 'alert', 'aria-live': 'assertive' });
  const dialog = keyDialog();
  const session = new Session({ catalog, transport, askKey: dialog.ask });
  session.addEventListener('message', ({ detail }) => showMessage(messages, detail));

  const tabs = [
    ['Scope', scopeTab(session)],
    ['Parameters', parametersTab(session)],
    ...(tools ? [['Commissioning', commissioningTab(session, tools)]] : []),
    ['Faults', faultsTab(session, () => choose('Scope'), tools && new FlightKeeper(session, tools).element)],
    ...extra,
  ];
  const { bar, choose } = tabBar(tabs);
  applyTheme(store.get('theme', null));
  root.append(
    header(session, bar, aside),
    driveBar(session),
    h('div', { class: 'work' }, statusPanel(session), h('main', {}, tabs.map(([, tab]) => tab.element))),
    messages, dialog.element,
  );
  document.addEventListener('keydown', (event) => {
    if (event.key === 'Escape' && !dialog.element.open && session.state === 'connected') session.stop();
  });
  choose(tabs[0][0]);
  session.connect();
  return session;
}

function header(session, bar, aside) {
  const who = h('span', { class: 'identity', id: 'identity' });
  const link = h('span', { class: 'link-state', id: 'link-state' });
  const again = h('button', { hidden: true, onclick: () => session.connect() }, 'Connect again');
  const theme = h('button', { class: 'quiet', title: 'dark or light', 'aria-label': 'dark or light', onclick: switchTheme }, '◐');
  const update = () => {
    const { state } = session;
    const told = { connecting: `connecting ${(100 * session.progress).toFixed(0)} %`, connected: clients(session), lost: session.why };
    setText(link, told[state]);
    link.dataset.state = state;
    again.hidden = state !== 'lost';
    setText(who, session.client?.identity?.text ?? '');
  };
  session.addEventListener('change', update);
  session.addEventListener('roles', update);
  return h('header', {}, h('h1', {}, 'ZeroHertz'), bar, who, link, again, aside, theme);
}

/** Who runs the drive, and who else is there. */
function clients({ roles }) {
  if (!roles) return 'connected';
  const runs = roles.commander === roles.own ? 'this page' : roles.names.get(roles.commander);
  const others = roles.names.size - 1;
  const beside = others === 1 ? ', 1 other client' : others > 1 ? `, ${others} other clients` : '';
  return runs ? `run by ${runs}${beside}` : `connected${beside}`;
}

function tabBar(tabs) {
  const buttons = tabs.map(([name]) =>
    h('button', { role: 'tab', id: `tab-${name.toLowerCase()}`, onclick: () => choose(name) }, name));
  const choose = (name) => {
    tabs.forEach(([other, tab], k) => {
      const chosen = other === name;
      tab.element.hidden = !chosen;
      buttons[k].setAttribute('aria-selected', String(chosen));
      buttons[k].tabIndex = chosen ? 0 : -1;
      if (chosen) tab.shown?.();
    });
  };
  const bar = h('nav', { role: 'tablist' }, buttons);
  bar.addEventListener('keydown', (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const next = (buttons.indexOf(document.activeElement) + step + buttons.length) % buttons.length;
    buttons[next].focus();
    buttons[next].click();
  });
  return { bar, choose };
}

function showMessage(list, { text, bad }) {
  const close = h('button', { class: 'quiet', 'aria-label': 'dismiss', onclick: () => item.remove() }, '×');
  const item = h('p', { class: bad ? 'bad' : 'good' }, text, close);
  list.append(item);
  while (list.children.length > 4) list.firstChild.remove();
  setTimeout(() => item.remove(), MESSAGE_MS);
}

function applyTheme(theme) {
  if (theme) document.documentElement.dataset.theme = theme;
}

function switchTheme() {
  const chosen = document.documentElement.dataset.theme;
  const dark = chosen ? chosen === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
  const theme = dark ? 'light' : 'dark';
  applyTheme(theme);
  store.set('theme', theme);
  document.dispatchEvent(new CustomEvent('zh-theme'));
}

/** The key stays in a variable of the link client: not in the page, not in storage. */
function keyDialog() {
  const why = h('p', {});
  const input = h('input', { type: 'password', autocomplete: 'off', maxLength: 32, spellcheck: false, 'aria-label': 'key, 32 hexadecimal digits' });
  const wrong = h('p', { class: 'bad', hidden: true }, 'A key has 32 hexadecimal digits.');
  const dialog = h('dialog', {},
    h('form', { method: 'dialog' },
      h('h2', {}, 'Key of the drive'), why, input, wrong,
      h('p', { class: 'hint' }, 'It stays in this tab’s memory until you close or reload it.'),
      h('div', { class: 'row' }, h('button', { value: 'ok', class: 'run' }, 'Use it'), h('button', { value: '', formNoValidate: true }, 'Cancel'))));
  const ask = (text) =>
    new Promise((resolve) => {
      fill(why, text);
      wrong.hidden = true;
      dialog.returnValue = '';
      dialog.onclose = () => {
        const key = dialog.returnValue === 'ok' ? keyOf(input.value) : null;
        if (dialog.returnValue === 'ok' && !key) {
          wrong.hidden = false;
          dialog.showModal();
          return;
        }
        input.value = '';
        resolve(key);
      };
      dialog.showModal();
      input.focus();
    });
  return { element: dialog, ask };
}
