/** Entry of the page that `zh studio` serves. With `?serial` it is that of a board at a serial port. */

import { h } from './app/dom.js';
import { startStudio } from './app/shell.js';
import { ToolsLine } from './app/tools_line.js';
import { hasWebSerial, webSerialTransport, webSocketTransport } from './link/transport.js';

const here = `ws://${location.host}`;
const root = document.getElementById('studio');
const catalog = window.zhCatalog;
const link = (href, text) => h('a', { class: 'button quiet', href, id: 'other-drive' }, text);

function served() {
  startStudio(root, {
    catalog,
    transport: () => webSocketTransport(`${here}/link`),
    tools: () => new ToolsLine(`${here}/tools`),
    aside: hasWebSerial() ? link('?serial', 'Board over Web Serial') : null,
  });
}

/** The browser lets a page choose a port only when its user asks for it. */
function serial() {
  const choice = h('section', { class: 'card choice' },
    h('h1', {}, 'A board at a serial port'),
    h('p', {}, 'This page talks to the board itself, by Web Serial. Commissioning needs zh studio --port.'),
    h('p', { class: 'hint' }, 'The board stops by itself 1.5 seconds after this tab is closed or hangs.'),
    h('div', { class: 'row' },
      h('button', { id: 'choose-port', class: 'run', disabled: !hasWebSerial(), onclick: begin }, 'Choose the serial port'),
      link('.', 'Back')),
    hasWebSerial() ? null : h('p', { class: 'bad' }, 'This browser has no Web Serial; Chromium and Edge have.'));
  function begin() {
    choice.remove();
    startStudio(root, { catalog, transport: () => webSerialTransport(), aside: link('.', 'Drive of zh studio') });
  }
  root.append(choice);
}

if (new URLSearchParams(location.search).has('serial')) serial();
else served();
