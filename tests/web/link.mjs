// node link.mjs TWIN_JS DATA_JSON JOB_JSON: {job, requests: [hex], periods} in; what the drive in
// WebAssembly says to the requests, one after the other, as a JSON list of hex out.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { Engine } from "../../tools/web/twin/src/engine.js";

const [twin, data_file, job_file] = process.argv.slice(2);
const wasmBinary = readFileSync(twin.replace(/js$/, "wasm"));
const engine = new Engine(await createRequire(import.meta.url)(twin)({ wasmBinary }));
const data = JSON.parse(readFileSync(data_file));
const { job, requests, periods } = JSON.parse(readFileSync(job_file));
engine.add_motor(job.motor, data.motors[job.motor]);
const link = engine.open_link({ ...job, rig: data.rigs[job.rig], board: data.boards[job.board] });
const answers = requests.map((request) => {
  const { taken, sent } = link.run(periods, Buffer.from(request, "hex"));
  if (taken * 2 !== request.length) {
    throw new Error("the drive did not take a whole request");
  }
  return Buffer.from(sent).toString("hex");
});
link.close();
console.log(JSON.stringify(answers));
