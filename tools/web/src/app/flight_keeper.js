/** The flight recorder of the computer behind the page: the seconds before the next fault, into a file. */

import { fill, h, setText } from './dom.js';

export class FlightKeeper {
  #session;
  #make;
  #tools = null;
  #begin = h('button', { id: 'flight-begin', title: 'the drive starts its control state anew: at standstill', onclick: () => this.#start() }, 'Keep the seconds before the next fault');
  #end = h('button', { id: 'flight-end', hidden: true, onclick: () => this.#tools?.begin('flight_end') }, 'End, and keep the last seconds');
  #said = h('p', { id: 'flight-said', role: 'status', class: 'hint' });

  /** @param {() => import('./tools_line.js').ToolsLine} makeTools */
  constructor(session, makeTools) {
    this.#session = session;
    this.#make = makeTools;
    this.element = h('div', { class: 'param-bar' }, this.#begin, this.#end, this.#said);
  }

  async #start() {
    const session = this.#session;
    // Also asks for the key when it is not the development key.
    if (!(await session.attempt((client) => client.unlock()))) return;
    if (!this.#tools?.isOpen) {
      const tools = this.#make();
      tools.addEventListener('event', ({ detail }) => this.#hear(detail));
      const known = await tools.open((nonce) => session.client.toolsResponse(nonce)).catch(() => false);
      if (!known) {
        session.tell('the tools do not know this key; start zh studio with --key', true);
        tools.close();
        return;
      }
      this.#tools = tools;
    }
    this.#running(true);
    this.#tools.begin('flight');
  }

  #running(on) {
    this.#begin.hidden = on;
    this.#end.hidden = !on;
  }

  #hear({ job, say, result, error }) {
    if (job && job !== 'flight') return;
    if (say) setText(this.#said, say);
    if (result === undefined && error === undefined) return;
    this.#running(false);
    if (error !== undefined) {
      setText(this.#said, `not recorded: ${error}`);
      return;
    }
    const what = result.fault ? 'to the fault' : 'without a fault';
    fill(this.#said, `${result.seconds.toFixed(1)} s ${what}${result.why ? `, ${result.why}` : ''}. `,
      h('code', {}, `tools/zh replay --flight ${result.file} --out signals.mf4`), ' shows every signal of every period.');
  }
}
