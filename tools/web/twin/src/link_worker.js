// The worker behind the studio's page: one drive on its rig in real time, at the end of a line.
// Messages in: start, bytes, change, seen; out: ready, bytes, speed, refused.

import makeTwin from "twin.js";
import { Engine } from "./engine.js";

const TICK_MS = 5;
const TOLD_MS = 100;
const MOST_PERIODS = 500; // a tab that slept does not catch up
const HELD_UP_MS = 300; // a page that has not answered for so long commands nothing: its drive waits for it

let link = null;
let period_ms = 0;
let done_ms = 0;
let told_ms = 0;
let seen = true;
let waiting = new Uint8Array(0);

async function start({ wasm, data, job, period_s }) {
  const engine = new Engine(await makeTwin({ wasmBinary: wasm }));
  engine.add_motor(job.motor, data.motors[job.motor]);
  link = engine.open_link({ ...job, rig: data.rigs[job.rig], board: data.boards[job.board] });
  period_ms = 1000 * period_s;
  done_ms = performance.now();
  setInterval(live, TICK_MS);
  postMessage({ kind: "ready" });
}

// Up to now; what the drive did not take waits for the next time.
function live() {
  const now_ms = performance.now();
  const due = Math.floor((now_ms - done_ms) / period_ms);
  if (due < 1) {
    return;
  }
  if (!seen && now_ms - told_ms > HELD_UP_MS) {
    done_ms = now_ms;
    return;
  }
  done_ms = due > MOST_PERIODS ? now_ms : done_ms + due * period_ms;
  const { taken, sent } = link.run(Math.min(due, MOST_PERIODS), waiting);
  waiting = waiting.slice(taken);
  if (sent.length > 0) {
    postMessage({ kind: "bytes", bytes: sent }, [sent.buffer]);
  }
  if (seen && now_ms - told_ms > TOLD_MS) {
    told_ms = now_ms;
    seen = false;
    postMessage({ kind: "speed", speed_rpm: link.speed_rpm() });
  }
}

function take({ bytes }) {
  const joined = new Uint8Array(waiting.length + bytes.length);
  joined.set(waiting);
  joined.set(bytes, waiting.length);
  waiting = joined;
  live();
}

const handlers = { start, bytes: take, change: ({ scenario }) => link.change(scenario), seen: () => (seen = true) };

onmessage = async ({ data: message }) => {
  try {
    await handlers[message.kind](message);
  } catch (error) {
    postMessage({ kind: "refused", text: error.message });
  }
};
