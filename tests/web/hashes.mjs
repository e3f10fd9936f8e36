// node hashes.mjs TWIN_JS DATA_JSON: runs every figure of the data in WebAssembly, once hashed and once
// timed, and prints {"hashes": {figure: [one per signal]}, "seconds", "simulated_s"} as JSON.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { Engine, HASH_SIGNALS } from "../../tools/web/twin/src/engine.js";

const [twin, file] = process.argv.slice(2);
const wasmBinary = readFileSync(twin.replace(/js$/, "wasm"));
const engine = new Engine(await createRequire(import.meta.url)(twin)({ wasmBinary }));
const data = JSON.parse(readFileSync(file));
for (const [name, files] of Object.entries(data.motors)) {
  engine.add_motor(name, files);
}

function run(job, flags, result) {
  const opened = engine.open({ ...job, rig: data.rigs[job.rig], board: data.boards[job.board] },
                             { flags, decimate: 25 });
  opened.advance(1e12);
  const found = result(opened, opened.look());
  opened.close();
  return found;
}

const hashes = {};
for (const figure of data.figures) {
  hashes[figure.id] = run(figure.job, HASH_SIGNALS, (opened, seen) => opened.hashes(seen));
}
let simulated_s = 0;
const begin = performance.now();
for (const figure of data.figures) {
  simulated_s += run(figure.job, 0, (_, seen) => seen.steps * seen.period_s);
}
const seconds = (performance.now() - begin) / 1000;
console.log(JSON.stringify({ hashes, seconds, simulated_s }));
