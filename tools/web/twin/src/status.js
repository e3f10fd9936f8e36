// What the page says in words: of a finished run, and of a drive that is operated by hand.

const STATES = ["boot", "self-test", "ready", "magnetising", "running", "ramping down", "coasting",
                "commissioning", "fault", "torque off"];
const CONFIDENCE = ["CLOSED", "DEGRADED", "IMPRESSED"];

function list(rows) {
  const dl = document.createElement("dl");
  for (const [name, text, kind] of rows) {
    const dt = document.createElement("dt");
    const dd = document.createElement("dd");
    dt.textContent = name;
    dd.textContent = text;
    dd.className = kind || "";
    dl.append(dt, dd);
  }
  return dl;
}

export function faults_of(bits, faults) {
  return faults.filter((fault) => (bits >>> fault.bit) & 1);
}

function fault_rows(bits, faults) {
  return faults_of(bits, faults).flatMap((fault) => [
    ["fault", `${fault.name}: ${fault.text}`, "bad"],
    ["cause", fault.cause],
    ["remedy", fault.remedy],
  ]);
}

// Largest error of speed and flux angle from `event_s` on, while the gates are on.
function errors(rec, event_s) {
  const c = rec.columns;
  const counts = (row) => c.t_s[row] >= event_s && c.gates_on[row] > 0;
  return {
    speed_rpm: rec.largest((row) => c.speed_rpm[row] - c.speed_ref_rpm[row], counts),
    angle_deg: rec.largest((row) => c.flux_angle_err_deg[row], counts),
  };
}

export function say_run(host, { experiment, rec, message, data, event_s, differing }) {
  const off = errors(rec, event_s + 1);
  const rows = [["run", experiment.title]];
  if (experiment.paper) {
    rows.push(["the paper shows", experiment.paper]);
  }
  rows.push(["here", `from ${(event_s + 1).toFixed(1)} s on the speed is off by at most ${off.speed_rpm.toFixed(0)} min⁻¹, ` +
    `the flux angle by ${off.angle_deg.toFixed(0)}°`]);
  rows.push(...fault_rows(message.seen.first_fault, data.faults));
  const simulated_s = message.seen.steps * message.seen.period_s;
  rows.push(["computed", `${simulated_s.toFixed(1)} s in ${message.seconds.toFixed(2)} s, ` +
    `${(simulated_s / message.seconds).toFixed(0)} × real time`]);
  if (differing !== null) {
    rows.push(differing.length === 0
      ? ["bits", `all ${message.hashes.length} signals equal the native firmware's`, "good"]
      : ["bits", `${differing.length} signals differ: ${differing.join(", ")}`, "bad"]);
  }
  host.replaceChildren(list(rows));
}

export function say_live(host, { rec, faults, data }) {
  const last = rec.length - 1;
  if (last < 0) {
    return;
  }
  // + 0: no minus before a zero.
  const number = (name, digits) => String(Number(rec.at(name, last).toFixed(digits)) + 0).replace("-", "−");
  const value = (name, digits, unit) => `${number(name, digits)} ${unit}`;
  const hat = rec.at("speed_unknown", last) ? "unknown" : value("speed_hat_rpm", 1, "min⁻¹");
  host.replaceChildren(list([
    ["state", STATES[rec.at("state", last)], faults ? "bad" : ""],
    ["supervisor", CONFIDENCE[rec.at("confidence", last)]],
    ["speed", `true ${value("speed_rpm", 1, "min⁻¹")}, estimated ${hat}`],
    ["stator frequency", value("f_s_Hz", 2, "Hz")],
    ["flux angle error", value("flux_angle_err_deg", 0, "°")],
    ["current", value("i_abs_A", 1, "A")],
    ...fault_rows(faults, data.faults),
  ]));
}
