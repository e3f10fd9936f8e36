// A drive in this page as the studio's link client wants one (../../src/link/transport.js), and the
// rig it is connected to, which a board's owner would reach with his hands.

export class TwinRig extends EventTarget {
  // source: of the worker; start: what link_worker.js wants to begin with, made anew for each drive.
  constructor(source, start) {
    super();
    this.source = source;
    this.start = start;
  }

  transport() {
    let worker = null;
    let take = () => {};
    let gone = () => {};
    const handlers = {
      bytes: ({ bytes }) => take(bytes),
      speed: ({ speed_rpm }) => {
        worker.postMessage({ kind: "seen" });
        this.dispatchEvent(new CustomEvent("speed", { detail: speed_rpm }));
      },
      refused: ({ text }) => gone(text),
    };
    return {
      open: () => new Promise((resolve, reject) => {
        worker = this.worker = new Worker(URL.createObjectURL(new Blob([this.source])));
        worker.onerror = (event) => reject(new Error(event.message));
        worker.onmessage = ({ data }) => (data.kind === "ready" ? resolve() : handlers[data.kind](data));
        worker.postMessage({ kind: "start", ...this.start() });
      }),
      write: (bytes) => worker.postMessage({ kind: "bytes", bytes }),
      onData: (callback) => (take = callback),
      onClose: (callback) => (gone = callback),
      close: () => worker?.terminate(),
    };
  }

  change(scenario) {
    this.worker?.postMessage({ kind: "change", scenario });
  }
}
