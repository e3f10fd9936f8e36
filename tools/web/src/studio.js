/** Entry of the page that `zh studio` serves. */

import { startStudio } from './app/shell.js';
import { ToolsLine } from './app/tools_line.js';
import { webSocketTransport } from './link/transport.js';

const here = `ws://${location.host}`;

startStudio(document.getElementById('studio'), {
  catalog: window.zhCatalog,
  transport: () => webSocketTransport(`${here}/link`),
  tools: () => new ToolsLine(`${here}/tools`),
});
