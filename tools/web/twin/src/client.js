// The page's side of the worker.

export class Client {
  // on: {ready, record, progress, rows, refused}: what to do with each message.
  constructor(source, on) {
    // From a Blob: a page that was opened as a file may start a worker in no other way.
    this.worker = new Worker(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
    this.worker.onmessage = ({ data }) => {
      if (data.kind === "ready" || data.id === undefined || data.id === this.id) {
        on[data.kind]?.(data);
      }
    };
    this.worker.onerror = (event) => on.refused({ text: event.message });
    this.id = 0;
  }

  send(kind, content = {}, transfer = []) {
    this.worker.postMessage({ kind, ...content }, transfer);
  }

  start(wasm, data) {
    this.send("start", { wasm, data }, [wasm]);
  }

  run(job, decimate, hash, ends_with = 0) {
    this.id += 1;
    this.send("stop");
    this.send("run", { id: this.id, job, decimate, hash, ends_with });
  }

  live(job, pace) {
    this.id += 1;
    this.send("live", { job, pace });
  }
}

// What was packed with gzip and base64 into the page.
export async function unpacked(element) {
  const packed = Uint8Array.from(atob(document.getElementById(element).textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}
