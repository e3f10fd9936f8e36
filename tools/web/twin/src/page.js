// The twin's page: puts controls, worker, plane, panes and words together.

import { Atlas } from "./atlas.js";
import { Client, unpacked } from "./client.js";
import { changed, eps1_of, given } from "./experiment.js";
import { FAULTS, Hand } from "./hand.js";
import { Plane, RATED_NM, torque_at } from "./plane.js";
import { Player } from "./player.js";
import { Rec } from "./record.js";
import { Scope } from "./scope.js";
import { say_live, say_run } from "./status.js";

const el = (id) => document.getElementById(id);
const ROWS_OF_A_RUN = 8000;
const LIVE_ROWS = 6000; // 30 s
const PERIODS_PER_S = 5000;
const LOAD_MACHINE_RPM = 1000;
const ZERO_RPM = 30;
const AWAY_RPM = 400;
const TRIP_SPEED = 2; // of sim.h: beyond 3000 min^-1
const DWELL_PANES = ["speed", "frequency", "angle", "resistance"];
const COULOMB_NM = 0.4; // friction of the bench, which brakes with the load

const hand = new Hand();
let data = null;
let columns = [];
let tab = "figures";
let shown = null; // {experiment, settings} of the run on its way or shown
let live_rec = null;
let live_faults = 0;
let drawing = false; // of the live curves, with the next frame

const plane = new Plane(el("plane"));
const scope = new Scope(el("scope"), (t_s) => tab !== "hand" && (player.stop(), player.go(t_s)));
const player = new Player(
  { box: el("player"), play: el("play"), time: el("time"), out: el("time-out") },
  (t_s) => {
    plane.set_time(t_s);
    scope.set_time(t_s);
  });
const atlas = new Atlas(el("atlas"), el("atlas-legend"), (point, title) => run_given({ title, job: point.job }));
const client = new Client(el("worker").textContent, {
  ready: (message) => begin(message),
  record: show_record,
  rows: show_rows,
  progress: ({ simulated_s }) => (el("status").textContent = `computing: ${simulated_s.toFixed(0)} s`),
  refused: ({ text }) => (el("notice").textContent = `refused: ${text}`),
});

function event_of(job) {
  const step = /^(?:step_time_s|ramp_start_s) = ([\d.]+)/m.exec(job.scenario);
  const load = /^load_torque_Nm = \[\[([\d.]+)/m.exec(job.scenario);
  return Number((step || load)?.[1] ?? 0);
}

function duration_of(job) {
  return Number(/^duration_s = ([\d.]+)/m.exec(job.scenario)[1]);
}

// ---------------------------------------------------------------- experiments

function experiments() {
  return tab === "figures" ? data.figures : [...data.situations, ...data.special];
}

// Fig. 12 holds; with the leak off it becomes Fig. 9, which does not.
function fill_experiments() {
  el("what").replaceChildren(...experiments().map(
    ({ id, title, text }) => new Option(tab === "figures" ? `${title}: ${text}` : title, id)));
  el("what").value = tab === "figures" ? "fig12" : "load_50_rs_1.5";
}

function experiment() {
  return experiments().find(({ id }) => id === el("what").value);
}

function show_settings(settings) {
  el("config").value = settings.config;
  el("gain").checked = settings.gain;
  el("eps1-mode").value = settings.eps1_mode;
  el("eps1").value = Math.log10(settings.eps1);
  el("rs").value = settings.rs;
}

function read_settings() {
  return {
    config: el("config").value,
    gain: el("gain").checked,
    eps1_mode: Number(el("eps1-mode").value),
    eps1: Number(el("eps1").value) === 0 ? 1 : 10 ** Number(el("eps1").value),
    rs: Number(el("rs").value),
  };
}

function choose_experiment() {
  show_settings(given(experiment(), data));
  run_experiment();
}

function run_experiment() {
  const settings = read_settings();
  const what = experiment();
  el("rs-out").textContent = `${settings.rs.toFixed(2)} × the rig's`;
  el("eps1-out").textContent = eps1_of(what, settings, data).toPrecision(3);
  el("eps1").disabled = settings.eps1_mode === 0;
  el("what-text").textContent = what.paper ? `The paper shows: ${what.paper}.` : what.text;
  const job = changed(what, settings, data);
  run_given({ ...what, job }, job === what.job && tab === "figures");
}

// hash: also compare every signal with the native firmware.
function run_given(what, hash = false) {
  shown = what;
  const periods = duration_of(what.job) * PERIODS_PER_S;
  const ends_with = tab === "dwell" ? TRIP_SPEED : 0;
  client.run(what.job, Math.max(5, Math.ceil(periods / ROWS_OF_A_RUN)), hash, ends_with);
}

function show_record(message) {
  const rec = new Rec(tab === "dwell" ? until_away(message.columns) : message.columns);
  const native = message.hashes ? data.hashes[shown.id] : null;
  const differing = native && message.hashes.map((hash, k) => (hash === native[k] ? "" : data.signals[k])).filter(Boolean);
  const fastest = rec.largest((row) => rec.columns.speed_rpm[row], () => true);
  plane.show(rec, Math.min(1200, Math.max(90, 1.15 * fastest)));
  scope.show(rec);
  player.show(rec);
  say_run(el("status"), { experiment: shown, rec, message, data, event_s: event_of(shown.job), differing });
  const { seen, seconds, hashes } = message;
  const detail = { id: shown.id, title: shown.title, hashes, seconds, simulated_s: seen.steps * seen.period_s };
  dispatchEvent(new CustomEvent("run", { detail })); // for who waits for it
}

// ---------------------------------------------------------------- zero hertz

// The job of a dwell with another modulation, and another end of the drift of Rs.
function run_dwell() {
  const what = data.dwell.find(({ id }) => id === el("dwell-speed").value);
  const modulation = Number(el("dwell-modulation").value);
  const rs = Number(el("dwell-rs").value);
  el("dwell-rs-out").textContent = `${rs.toFixed(2)} × nameplate`;
  const scenario = what.job.scenario.replace(/^(rs_factor = .*, )[\d.]+(\]\])$/m, `$1${rs}$2`);
  const firmware = `${what.job.firmware}\ndwell=${modulation}`;
  const off = modulation === 0 ? ", modulation off" : "";
  run_given({ ...what, title: what.title + off, job: { ...what.job, scenario, firmware } });
}

// Up to where the load has pulled the shaft away: what comes then hides everything before.
function until_away(columns) {
  const away = columns.speed_rpm.findIndex((speed, k) => Math.abs(speed - columns.speed_ref_rpm[k]) > AWAY_RPM);
  const end = away < 0 ? columns.speed_rpm.length : away;
  return Object.fromEntries(Object.entries(columns).map(([name, values]) => [name, values.slice(0, end)]));
}

function wire_dwell() {
  let waiting = null;
  for (const id of ["dwell-speed", "dwell-modulation", "dwell-rs"]) {
    el(id).oninput = () => {
      clearTimeout(waiting);
      waiting = setTimeout(run_dwell, 60);
    };
  }
}

// ---------------------------------------------------------------- by hand

function start_hand() {
  hand.start();
  show_hand();
  live_rec = Rec.window(columns, LIVE_ROWS);
  const job = { ...data.live[el("hand-config").value], scenario: hand.scenario() };
  const mode = /^eps1_mode=(\d)/m.exec(job.config);
  el("hand-eps1").value = mode ? mode[1] : data.defaults.eps1_mode;
  client.live(job, Number(el("hand-pace").value));
}

function change_hand() {
  show_hand();
  client.send("change", { scenario: hand.scenario() });
}

function show_hand() {
  el("hand-speed").value = hand.speed_rpm;
  el("hand-load").value = (100 * hand.load_Nm) / RATED_NM;
  el("hand-rs").value = hand.rs_ratio;
  el("hand-speed-out").textContent = `${hand.speed_rpm} min⁻¹`.replace("-", "−");
  const load = `${hand.load_Nm.toFixed(1)} N m, ${((100 * hand.load_Nm) / RATED_NM).toFixed(0)} % of rated`;
  el("hand-load-out").textContent = load.replaceAll("-", "−");
  el("hand-rs-out").textContent = `${hand.rs_ratio.toFixed(2)} × nameplate`;
  el("hand-run").classList.toggle("go", !hand.run);
  for (const button of el("hand-faults").querySelectorAll("button")) {
    button.setAttribute("aria-pressed", hand.faults.has(button.dataset.fault));
  }
}

function show_rows(message) {
  if (tab !== "hand" || live_rec === null) {
    return;
  }
  live_rec.append(message.columns);
  live_faults = message.faults;
  guard_load_machine();
  if (!drawing) {
    drawing = true;
    requestAnimationFrame(draw_live);
  }
}

// However many messages came, and no more than half of the time: a slow machine would never reach
// its buttons again. The curves are painted after this returns, so the time is taken later.
function draw_live() {
  const begin_ms = performance.now();
  setTimeout(() => setTimeout(() => (drawing = false), performance.now() - begin_ms));
  if (tab !== "hand" || !live_rec?.length) {
    return;
  }
  const most = 1.3 * Math.max(Math.abs(hand.speed_rpm), Math.abs(live_rec.at("speed_rpm", live_rec.length - 1)));
  plane.show(live_rec, Math.max(120, 60 * Math.ceil(most / 60)));
  plane.set_time(live_rec.end_s);
  scope.show(live_rec);
  say_live(el("status"), { rec: live_rec, faults: live_faults, data });
}

// With the gates off a driving load would run away: the load machine switches itself off.
function guard_load_machine() {
  const speed_rpm = live_rec.at("speed_rpm", live_rec.length - 1);
  if (Math.abs(speed_rpm) > LOAD_MACHINE_RPM && hand.load_Nm * speed_rpm < 0) {
    hand.load_Nm = 0;
    change_hand();
  }
}

// A slow speed, and the driving load whose slip cancels it: the stator frequency becomes zero.
function go_to_zero() {
  const flux_Wb = live_rec.length ? live_rec.at("lambda_Wb", live_rec.length - 1) : 0.5;
  hand.speed_rpm = ZERO_RPM;
  const torque_Nm = torque_at(hand.speed_rpm, 0, flux_Wb);
  hand.load_Nm = torque_Nm - COULOMB_NM;
  change_hand();
}

function wire_hand() {
  // A little later than what is shown: the drive goes on until the worker hears of it.
  const now_s = () => live_rec.end_s + 0.1 * Math.max(1, Number(el("hand-pace").value));
  const slider = (id, take) => {
    el(id).oninput = () => {
      take(Number(el(id).value));
      change_hand();
    };
  };
  slider("hand-speed", (value) => (hand.speed_rpm = value));
  slider("hand-load", (value) => (hand.load_Nm = (value / 100) * RATED_NM));
  slider("hand-rs", (value) => (hand.rs_ratio = value));
  el("hand-eps1").onchange = () => client.send("set", { name: "eps1_mode", value: Number(el("hand-eps1").value) });
  el("hand-pace").onchange = () => client.send("pace", { pace: Number(el("hand-pace").value) });
  el("hand-config").onchange = start_hand;
  el("hand-new").onclick = start_hand;
  el("hand-zero").onclick = go_to_zero;
  el("hand-run").onclick = () => {
    if (!hand.run || live_faults) {
      hand.start_again(now_s());
      change_hand();
    }
  };
  el("hand-stop").onclick = () => ((hand.run = false), change_hand());
  for (const [name, { title }] of Object.entries(FAULTS)) {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", textContent: title });
    button.dataset.fault = name;
    button.onclick = () => (hand.toggle(name), change_hand());
    el("hand-faults").append(button);
  }
}

// ---------------------------------------------------------------- the page

function open_tab(name) {
  if ((name === "dwell") !== (tab === "dwell")) {
    scope.choose(name === "dwell" ? DWELL_PANES : undefined);
  }
  tab = name;
  for (const button of el("tabs").children) {
    button.setAttribute("aria-selected", button.dataset.tab === name);
    button.tabIndex = button.dataset.tab === name ? 0 : -1;
  }
  el("experiment").hidden = name !== "figures" && name !== "situations";
  el("atlas-panel").hidden = name !== "atlas";
  el("dwell").hidden = name !== "dwell";
  el("hand").hidden = name !== "hand";
  el("player").hidden = name === "hand";
  player.stop();
  el("notice").textContent = "";
  history.replaceState(null, "", `#${name}`);
  if (name === "hand") {
    scope.time_s = null;
    start_hand();
  } else {
    client.send("stop");
    if (name === "atlas") {
      atlas.choose(60, -1, 1);
    } else if (name === "dwell") {
      run_dwell();
    } else {
      fill_experiments();
      choose_experiment();
    }
  }
}

function wire_tabs() {
  const tabs = [...el("tabs").children];
  tabs.forEach((button, k) => {
    button.onclick = () => open_tab(button.dataset.tab);
    button.onkeydown = ({ key }) => {
      const by = { ArrowRight: 1, ArrowLeft: -1 }[key];
      if (by) {
        const next = tabs[(k + by + tabs.length) % tabs.length];
        next.focus();
        next.click();
      }
    };
  });
}

function wire_experiments() {
  el("what").onchange = choose_experiment;
  el("as-given").onclick = choose_experiment;
  let waiting = null;
  for (const id of ["config", "gain", "eps1-mode", "eps1", "rs"]) {
    el(id).oninput = () => {
      clearTimeout(waiting);
      waiting = setTimeout(run_experiment, 60);
    };
  }
}

function wire_theme() {
  const root = document.documentElement;
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const follow = (is_dark) => {
    root.dataset.theme = is_dark ? "dark" : "light";
    scope.make();
    plane.draw();
  };
  dark.onchange = () => follow(dark.matches);
  el("theme").onclick = () => follow(root.dataset.theme !== "dark");
  follow(dark.matches);
}

function begin(message) {
  columns = message.columns;
  for (const id of ["config", "atlas-config", "hand-config"]) {
    el(id).replaceChildren(...Object.entries(data.configs).map(([name, text]) => new Option(text, name)));
    el(id).value = "recommended";
  }
  el("dwell-speed").replaceChildren(...data.dwell.map(({ id, title }) => new Option(title, id)));
  el("dwell-speed").value = data.dwell.at(-1).id;
  const show_atlas = () => atlas.show(data.atlas[el("atlas-config").value]);
  el("atlas-config").onchange = show_atlas;
  show_atlas();
  const wanted = location.hash.slice(1);
  open_tab([...el("tabs").children].some((b) => b.dataset.tab === wanted) ? wanted : "figures");
  document.documentElement.dataset.ready = "yes";
}

async function load() {
  wire_theme();
  wire_tabs();
  wire_experiments();
  wire_dwell();
  wire_hand();
  el("status").textContent = "starting";
  const [wasm, text] = await Promise.all([unpacked("wasm"), unpacked("data")]);
  data = JSON.parse(new TextDecoder().decode(text));
  client.start(wasm, { motors: data.motors, rigs: data.rigs, boards: data.boards });
}

load().catch((error) => (el("status").textContent = error.message));
