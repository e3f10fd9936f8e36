/**
 * Where the link's bytes go to and come from. Anything with this shape carries a Client:
 *
 * @typedef {object} Transport
 * @property {() => Promise<void>} open
 * @property {(bytes: Uint8Array) => void} write
 * @property {(take: (bytes: Uint8Array) => void) => void} onData
 * @property {(gone: (why: string) => void) => void} onClose
 * @property {() => void} close
 */

const OPEN_MS = 5000;

/** A WebSocket of `zh studio`: each message is some bytes. @returns {Transport} */
export function webSocketTransport(address) {
  let socket;
  let take = () => {};
  let gone = () => {};
  return {
    open: () =>
      new Promise((resolve, reject) => {
        socket = new WebSocket(address);
        socket.binaryType = 'arraybuffer';
        const late = setTimeout(() => reject(new Error('zh studio does not answer')), OPEN_MS);
        socket.onopen = () => {
          clearTimeout(late);
          resolve();
        };
        socket.onmessage = (event) => take(new Uint8Array(event.data));
        socket.onclose = () => {
          clearTimeout(late);
          reject(new Error('zh studio is not running'));
          gone('zh studio has ended');
        };
      }),
    write: (bytes) => socket.readyState === WebSocket.OPEN && socket.send(bytes),
    onData: (callback) => (take = callback),
    onClose: (callback) => (gone = callback),
    close: () => socket?.close(),
  };
}

/** A board at a serial port, in browsers that have Web Serial. Asks the user which one. @returns {Transport} */
export function webSerialTransport(baudRate = 115200) {
  let port, reader, writer;
  let take = () => {};
  let gone = () => {};
  async function pump() {
    let why = 'the serial port was closed';
    try {
      for (;;) {
        const { value, done } = await reader.read();
        if (done) break;
        take(value);
      }
    } catch (error) {
      why = `the serial port is gone (${error.message})`;
    }
    gone(why);
  }
  return {
    async open() {
      port = await navigator.serial.requestPort();
      await port.open({ baudRate });
      reader = port.readable.getReader();
      writer = port.writable.getWriter();
      pump();
    },
    write: (bytes) => writer.write(bytes).catch(() => {}),
    onData: (callback) => (take = callback),
    onClose: (callback) => (gone = callback),
    async close() {
      await reader?.cancel().catch(() => {});
      reader?.releaseLock();
      writer?.releaseLock();
      await port?.close().catch(() => {});
    },
  };
}

export const hasWebSerial = () => typeof navigator !== 'undefined' && 'serial' in navigator;
