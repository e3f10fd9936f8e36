// Firmware and plant in WebAssembly: runs of a job, period by period. Works in a worker and in node.
//
// A job is what host_sim/sim.h asks for: scenario, rig and board as texts, the motor by the name of a
// folder that add_motor() has brought, overrides as lines.

export const HASH_SIGNALS = 4;
const SEEN = [
  "rows", "stride", "columns", "data", "hashes", "steps", "period_s", "trip", "trip_s",
  "first_fault", "first_fault_s",
];

export class Engine {
  // `module`: of twin.js, ready.
  constructor(module) {
    this.module = module;
    this.columns = this.lines("twin_columns");
    this.signals = this.lines("twin_signals");
    module.FS.mkdir("/motors");
  }

  call(name, result, ...pairs) {
    return this.module.ccall(name, result, pairs.map(([type]) => type), pairs.map(([, value]) => value));
  }

  lines(name) {
    return this.call(name, "string").trimEnd().split("\n");
  }

  // files: {"motor.toml": text, "l_gain.json": text}
  add_motor(name, files) {
    this.module.FS.mkdir(`/motors/${name}`);
    for (const [file, text] of Object.entries(files)) {
      this.module.FS.writeFile(`/motors/${name}/${file}`, text);
    }
  }

  // options: decimate, flags, keep_rows (0: the run ends with its scenario). Throws what is refused.
  open(job, options = {}) {
    this.give(job);
    const flags = (job.flags || 0) | (options.flags || 0);
    const run = this.call("twin_open", "number", ["number", flags], ["number", options.decimate || 1],
                          ["number", job.seed], ["number", options.keep_rows || 0]);
    if (run === 0) {
      throw new Error(this.error());
    }
    return new Run(this, run);
  }

  // The drive at the end of a line, operated over the host link as a board is.
  open_link(job) {
    this.give(job);
    const link = this.call("twin_link_open", "number", ["number", job.seed]);
    if (link === 0) {
      throw new Error(this.error());
    }
    return new Link(this, link);
  }

  give(job) {
    this.call("twin_files", null, ["string", job.scenario], ["string", job.rig], ["string", job.board],
              ["string", `/motors/${job.motor}`]);
    this.call("twin_overrides", null, ["string", job.scenario_overrides || ""],
              ["string", job.rig_overrides || ""], ["string", job.board_overrides || ""],
              ["string", job.config || ""], ["string", job.firmware || ""]);
  }

  error() {
    return this.call("twin_error", "string");
  }
}

class Run {
  constructor(engine, run) {
    this.engine = engine;
    this.run = run;
  }

  call(name, result, ...pairs) {
    return this.engine.call(name, result, ["number", this.run], ...pairs);
  }

  checked(status) {
    if (status !== 0) {
      throw new Error(this.engine.error());
    }
  }

  // Until so many control periods are done in all, or the run has ended.
  advance(steps) {
    this.checked(this.call("twin_advance", "number", ["number", steps]));
  }

  change(scenario) {
    this.checked(this.call("twin_change", "number", ["string", scenario]));
  }

  set(name, value) {
    this.checked(this.call("twin_set", "number", ["string", name], ["number", value]));
  }

  faults() {
    return this.call("twin_faults", "number") >>> 0;
  }

  look() {
    const at = this.call("twin_look", "number") / 8;
    return Object.fromEntries(SEEN.map((name, k) => [name, this.engine.module.HEAPF64[at + k]]));
  }

  // Rows from..to of one column, as a view of the engine's memory where they lie in one piece: good
  // until the next call. `seen` of look().
  column(seen, name, from, to) {
    const heap = this.engine.module.HEAPF32;
    const base = seen.data / 4 + this.engine.columns.indexOf(name) * seen.stride;
    const first = from % seen.stride;
    const last = first + (to - from);
    if (last <= seen.stride) {
      return heap.subarray(base + first, base + last);
    }
    const joined = new Float32Array(to - from);
    joined.set(heap.subarray(base + first, base + seen.stride));
    joined.set(heap.subarray(base, base + last - seen.stride), seen.stride - first);
    return joined;
  }

  // With HASH_SIGNALS: one text of 16 hexadecimal digits per signal.
  hashes(seen) {
    const words = this.engine.module.HEAPU32;
    const hex = (word) => word.toString(16).padStart(8, "0");
    return this.engine.signals.map((_, k) => {
      const at = seen.hashes / 4 + 2 * k;
      return hex(words[at + 1]) + hex(words[at]);
    });
  }

  close() {
    this.call("twin_close", null);
    this.run = 0;
  }
}

const LINE_BYTES = 65536;

class Link {
  constructor(engine, link) {
    this.engine = engine;
    this.link = link;
    const module = engine.module;
    this.received = module._malloc(LINE_BYTES);
    this.sent = module._malloc(LINE_BYTES);
    this.counts = module._malloc(8);
  }

  // Control periods; bytes for the drive in, {taken, sent} out: what it did not take comes again.
  run(periods, bytes) {
    const { module } = this.engine;
    const given = bytes.subarray(0, LINE_BYTES);
    module.HEAPU8.set(given, this.received);
    module.HEAPU32.set([given.length, LINE_BYTES], this.counts / 4);
    const status = this.engine.call(
      "twin_link_run", "number", ["number", this.link], ["number", periods], ["number", this.received],
      ["number", this.counts], ["number", this.sent], ["number", this.counts + 4]);
    if (status !== 0) {
      throw new Error(this.engine.error());
    }
    const [taken, sent] = module.HEAPU32.subarray(this.counts / 4, this.counts / 4 + 2);
    return { taken, sent: module.HEAPU8.slice(this.sent, this.sent + sent) };
  }

  // Load, resistances and faults of another scenario.
  change(scenario) {
    const pairs = [["number", this.link], ["string", scenario]];
    if (this.engine.call("twin_link_change", "number", ...pairs) !== 0) {
      throw new Error(this.engine.error());
    }
  }

  // True, of the shaft.
  speed_rpm() {
    return this.engine.call("twin_link_speed_rpm", "number", ["number", this.link]);
  }

  close() {
    this.engine.call("twin_link_close", null, ["number", this.link]);
    for (const place of [this.received, this.sent, this.counts]) {
      this.engine.module._free(place);
    }
  }
}
