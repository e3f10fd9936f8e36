// The drive operated by hand: what the switches and sliders say, as the text of a scenario.

const RESET_S = 0.05; // the run command has to be low once after a fault

export const FAULTS = {
  sensor_u: { title: "Unplug current sensor u", group: "sensor", text: 'sensor = "i_u"\nkind = "off"' },
  stuck_v: { title: "Freeze current sensor v", group: "sensor", text: 'sensor = "i_v"\nkind = "stuck"' },
  gain_w: { title: "Current sensor w +20 %", group: "sensor",
            text: 'sensor = "i_w"\nkind = "gain"\nseverity = 1.2' },
  voltage: { title: "Unplug voltage sensor u-v", group: "sensor", text: 'sensor = "u_uv"\nkind = "off"' },
  open_u: { title: "Open motor phase u", group: "phase", text: 'open_phase = "u"\nopen_s = 0.0' },
  contactor: { title: "Open the contactor", group: "phase", text: 'open_phase = "all"\nopen_s = 0.0' },
  short: { title: "Short circuit u-v", group: "short", text: "short_s = 0.0" },
  earth: { title: "Earth fault of phase u", group: "earth", text: 'earth_phase = "u"\nearth_s = 0.0' },
};
const TABLES = ["", "second", "third"];

export class Hand {
  constructor() {
    this.start();
  }

  start() {
    Object.assign(this, { run: true, speed_rpm: 60, load_Nm: 0, rs_ratio: 1, faults: new Set() });
    Object.assign(this, { run_s: 0, reset_s: null });
  }

  // Also after a fault: reset, then the run command again.
  start_again(now_s) {
    Object.assign(this, { run: true, reset_s: now_s, run_s: now_s + RESET_S });
  }

  // Of a group only one at a time, but for sensors.
  toggle(name) {
    const { group } = FAULTS[name];
    if (this.faults.delete(name)) {
      return;
    }
    for (const other of [...this.faults]) {
      if (FAULTS[other].group === group && group !== "sensor") {
        this.faults.delete(other);
      }
    }
    if (group !== "sensor" || this.broken_sensors().length < TABLES.length) {
      this.faults.add(name);
    }
  }

  broken_sensors() {
    return [...this.faults].filter((name) => FAULTS[name].group === "sensor");
  }

  scenario() {
    const lines = ["[scenario]", 'name = "by hand"', "duration_s = 3600"];
    if (this.run) {
      lines.push(`run_on_s = ${this.run_s}`);
    }
    if (this.reset_s !== null) {
      lines.push(`fault_reset_s = ${this.reset_s}`);
    }
    lines.push("[profiles]", `speed_ref_rpm = [[0.0, ${this.speed_rpm}]]`,
               `load_torque_Nm = [[0.0, ${this.load_Nm}]]`, `rs_factor = [[0.0, ${this.rs_ratio}]]`);
    const others = [...this.faults].filter((name) => FAULTS[name].group !== "sensor");
    lines.push("[faults]", ...others.map((name) => FAULTS[name].text));
    this.broken_sensors().forEach((name, k) => {
      const head = TABLES[k] ? [`[faults.${TABLES[k]}]`] : [];
      lines.push(...head, FAULTS[name].text, "start_s = 0.0");
    });
    return `${lines.join("\n")}\n`;
  }
}
