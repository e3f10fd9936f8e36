// The worker: runs experiments as fast as it goes and one drive by hand at a chosen pace, so that the
// page stays fluid. Messages in: start, run, live, change, set, pace, stop; out: ready, record,
// progress, rows, refused.

import makeTwin from "twin.js";
import { Engine, HASH_SIGNALS } from "./engine.js";

const SLICE = 50000; // control periods between two looks at the messages
const LIVE_DECIMATE = 25;
const LIVE_ROWS = 8192;
const TICK_MS = 33;
const LONGEST_TICK_S = 0.25; // a tab that slept does not catch up

let engine = null;
let data = null;
let newest = 0; // number of the run asked for last
let live = null;

function whole(job) {
  return { ...job, rig: data.rigs[job.rig], board: data.boards[job.board] };
}

async function start(message) {
  data = message.data;
  engine = new Engine(await makeTwin({ wasmBinary: message.wasm }));
  for (const [name, files] of Object.entries(data.motors)) {
    engine.add_motor(name, files);
  }
  postMessage({ kind: "ready", columns: engine.columns, signals: engine.signals });
}

function rows_of(run, seen, from) {
  const columns = {};
  for (const name of engine.columns) {
    columns[name] = run.column(seen, name, from, seen.rows).slice();
  }
  return columns;
}

const pause = () => new Promise((resolve) => setTimeout(resolve, 0));

// ends_with: bits of sim.h's trips after which nothing is to be seen.
async function experiment({ id, job, decimate, hash, ends_with }) {
  newest = id;
  const begin = performance.now();
  const run = engine.open(whole(job), { decimate, flags: hash ? HASH_SIGNALS : 0 });
  let steps = -1;
  let seen = run.look();
  let paused_ms = 0;
  while (seen.steps > steps && newest === id && (seen.trip & ends_with) === 0) {
    steps = seen.steps;
    run.advance(steps + SLICE);
    seen = run.look();
    const stopped = performance.now();
    postMessage({ kind: "progress", id, simulated_s: seen.steps * seen.period_s });
    await pause();
    paused_ms += performance.now() - stopped;
  }
  if (newest === id) {
    const seconds = (performance.now() - begin - paused_ms) / 1000;
    postMessage({
      kind: "record", id, seen, seconds, columns: rows_of(run, seen, 0),
      hashes: hash ? run.hashes(seen) : null, faults: run.faults(),
    });
  }
  run.close();
}

function stop_live() {
  if (live !== null) {
    clearInterval(live.timer);
    live.run.close();
    live = null;
  }
}

function start_live({ job, pace }) {
  stop_live();
  newest += 1; // ends an experiment on its way
  const run = engine.open(whole(job), { decimate: LIVE_DECIMATE, keep_rows: LIVE_ROWS });
  live = { run, pace, rows: 0, steps: 0, last: performance.now(), timer: setInterval(tick, TICK_MS) };
}

function tick() {
  const now = performance.now();
  const passed_s = Math.min((now - live.last) / 1000, LONGEST_TICK_S);
  live.last = now;
  const { run } = live;
  let seen = run.look();
  live.steps += Math.round((passed_s * live.pace) / seen.period_s);
  run.advance(live.steps);
  seen = run.look();
  if (seen.rows > live.rows) {
    postMessage({ kind: "rows", columns: rows_of(run, seen, live.rows), faults: run.faults() });
    live.rows = seen.rows;
  }
}

const handlers = {
  start,
  run: experiment,
  live: start_live,
  stop: stop_live,
  change: ({ scenario }) => live?.run.change(scenario),
  set: ({ name, value }) => live?.run.set(name, value),
  pace: ({ pace }) => {
    if (live !== null) {
      live.pace = pace;
    }
  },
};

onmessage = async ({ data: message }) => {
  try {
    await handlers[message.kind](message);
  } catch (error) {
    postMessage({ kind: "refused", id: message.id, text: error.message });
  }
};

