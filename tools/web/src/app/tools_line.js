/** JSON to the tools behind `zh studio` (tools/zerohertz/studio/tools.py), for who has the key. */

export class ToolsLine extends EventTarget {
  #address;
  #socket = null;
  offer = null;

  constructor(address) {
    super();
    this.#address = address;
  }

  /** @param {(nonce: bigint) => Uint8Array} answer what shows that the user has the key */
  open(answer) {
    return new Promise((resolve, reject) => {
      this.#socket = new WebSocket(this.#address);
      this.#socket.onclose = () => {
        this.#socket = null;
        reject(new Error('the tools do not answer'));
        this.dispatchEvent(new CustomEvent('event', { detail: { job: '', error: 'the tools have ended' } }));
      };
      this.#socket.onmessage = ({ data }) => {
        const told = JSON.parse(data);
        if (told.nonce) {
          const bytes = answer(BigInt(`0x${told.nonce}`));
          this.#send({ response: Array.from(bytes, (b) => b.toString(16).padStart(2, '0')).join('') });
        } else if ('open' in told) {
          this.offer = told;
          resolve(told.open);
        } else {
          this.dispatchEvent(new CustomEvent('event', { detail: told }));
        }
      };
    });
  }

  get isOpen() {
    return this.#socket !== null && this.offer?.open === true;
  }

  begin(what, more = {}) {
    this.#send({ do: what, ...more });
  }

  close() {
    this.#socket?.close();
  }

  #send(content) {
    this.#socket?.send(JSON.stringify(content));
  }
}
