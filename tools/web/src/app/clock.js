/** Time that passes in a hidden tab too: browsers slow its timers down, but not those of a worker. */

const TICK_MS = 10;
const waiting = new Set();

function tick() {
  const now = performance.now();
  for (const one of waiting) {
    if (now >= one.due) {
      waiting.delete(one);
      one.resolve();
    }
  }
}

try {
  const code = `setInterval(() => postMessage(0), ${TICK_MS});`;
  const worker = new Worker(URL.createObjectURL(new Blob([code], { type: 'text/javascript' })));
  worker.onmessage = tick;
} catch {
  setInterval(tick, TICK_MS);
}

/** @param {number} ms */
export const sleep = (ms) => new Promise((resolve) => waiting.add({ due: performance.now() + ms, resolve }));
