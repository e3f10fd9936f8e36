// Panes of curves over time (uPlot), one cursor for all; what each shows is chosen above it.

import uPlot from "uplot";

const CHOICES = {
  speed: {
    title: "Speed", unit: "min⁻¹",
    lines: [["speed_ref_rpm", "asked", "--ref"], ["speed_rpm", "true", "--true"],
            ["speed_hat_rpm", "estimated", "--est"]],
    bound: "omega_bound_rpm",
  },
  torque: {
    title: "Torque", unit: "N m",
    lines: [["load_Nm", "load", "--load"], ["torque_Nm", "motor", "--true"]],
  },
  frequency: {
    title: "Stator frequency", unit: "Hz",
    lines: [["f_s_Hz", "true", "--true"], ["f_s_hat_Hz", "estimated", "--est"]],
  },
  angle: {
    title: "Error of the flux angle", unit: "°",
    lines: [["flux_angle_err_deg", "estimated − true", "--est"]],
  },
  current: {
    title: "Current, power invariant", unit: "A",
    lines: [["i_abs_A", "|i| true", "--true"], ["i_q_A", "i_q", "--est"], ["i_q_ref_A", "i_q asked", "--ref"],
            ["i_d_A", "i_d", "--load"]],
  },
  flux: {
    title: "Rotor flux", unit: "Wb",
    lines: [["lambda_Wb", "true", "--true"], ["lambda_hat_Wb", "estimated", "--est"]],
  },
  resistance: {
    title: "Stator resistance", unit: "Ω",
    lines: [["Rs_true_ohm", "true", "--true"], ["Rs_hat_ohm", "used by the firmware", "--est"]],
  },
  phase: {
    title: "Current in the stationary frame", unit: "A",
    lines: [["i_alpha_A", "i_α", "--true"], ["i_beta_A", "i_β", "--est"]],
  },
  duty: {
    title: "Duty of the upper switches", unit: "",
    lines: [["duty_u", "u", "--true"], ["duty_v", "v", "--est"], ["duty_w", "w", "--load"]],
  },
  dc: { title: "DC link", unit: "V", lines: [["u_dc_V", "true", "--true"]] },
  residual: { title: "Current error |e₁|", unit: "A", lines: [["e1_abs_A", "|e₁|", "--est"]] },
};
const FIRST = ["speed", "torque", "frequency", "angle"];
const SHADES = ["--closed", "--degraded", "--impressed"]; // by the supervisor's word

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

class Pane {
  constructor(host, choice, scope) {
    this.scope = scope;
    this.choice = choice;
    this.box = document.createElement("section");
    this.box.className = "pane";
    const head = document.createElement("header");
    this.select = document.createElement("select");
    this.select.setAttribute("aria-label", "What this pane shows");
    for (const [name, { title, unit }] of Object.entries(CHOICES)) {
      this.select.add(new Option(unit ? `${title}, ${unit}` : title, name, false, name === choice));
    }
    this.select.onchange = () => this.choose(this.select.value);
    this.legend = document.createElement("span");
    this.legend.className = "legend";
    head.append(this.select, this.legend);
    this.plot_box = document.createElement("div");
    this.box.append(head, this.plot_box);
    host.append(this.box);
  }

  choose(choice) {
    this.choice = this.select.value = choice;
    this.make();
  }

  make() {
    this.plot?.destroy();
    const { lines, bound } = CHOICES[this.choice];
    const axis = {
      stroke: css("--muted"), grid: { stroke: css("--grid"), width: 1 }, ticks: { stroke: css("--grid") },
      font: "11px system-ui, sans-serif",
    };
    const series = [{}, ...lines.map(([, label, color]) => ({ label, stroke: css(color), width: 1.5 }))];
    const bands = [];
    if (bound) {
      const quiet = { auto: false, stroke: "transparent", width: 0, points: { show: false } };
      series.push({ ...quiet }, { ...quiet });
      bands.push({ series: [series.length - 2, series.length - 1], fill: css("--band") });
    }
    this.plot = new uPlot({
      width: this.width(), height: this.scope.pane_height, series, bands,
      legend: { show: false },
      cursor: { sync: { key: "twin" }, points: { size: 6 }, drag: { x: true, y: false } },
      scales: { x: { time: false } },
      axes: [{ ...axis, size: 26, values: (_, ticks) => ticks.map((t) => `${t} s`) },
             { ...axis, size: 52, space: 28 }],
      hooks: { drawClear: [(u) => this.shade(u)], draw: [(u) => this.mark(u)],
               setCursor: [(u) => this.pointed(u)], ready: [(u) => this.scope.playable(u)] },
    }, this.values(), this.plot_box);
    this.say(null);
  }

  width() {
    return Math.max(240, this.plot_box.clientWidth || this.box.clientWidth);
  }

  values() {
    const { rec } = this.scope;
    const { lines, bound } = CHOICES[this.choice];
    const empty = [0];
    const found = [rec ? rec.columns.t_s : empty, ...lines.map(([name]) => (rec ? rec.columns[name] : empty))];
    if (bound) {
      const hat = rec ? rec.columns.speed_hat_rpm : empty;
      const by = rec ? rec.columns[bound] : empty;
      const edge = (sign) => Array.from(hat, (w, k) => (by[k] < 3000 ? w + sign * by[k] : null));
      found.push(edge(1), edge(-1));
    }
    return found;
  }

  update() {
    this.plot.setData(this.values(), true);
    this.say(null);
  }

  // Behind the curves: what the supervisor says, and where the gates are off.
  shade(u) {
    const { rec } = this.scope;
    if (!rec || this.choice !== "speed") {
      return;
    }
    const { ctx, bbox } = u;
    const kind = (row) => (rec.at("gates_on", row) > 0 ? rec.at("confidence", row) : 3);
    const x = (row) => u.valToPos(rec.columns.t_s[row], "x", true);
    ctx.save();
    for (let from = 0, row = 1; row <= rec.length; ++row) {
      if (row === rec.length || kind(row) !== kind(from)) {
        const to = Math.min(row, rec.length - 1);
        ctx.fillStyle = css(SHADES[kind(from)] || "--off");
        ctx.fillRect(x(from), bbox.top, x(to) - x(from), bbox.height);
        from = row;
      }
    }
    ctx.restore();
  }

  // Where the operating point in the plane is.
  mark(u) {
    const { rec, time_s } = this.scope;
    if (rec && time_s !== null) {
      const x = Math.round(u.valToPos(time_s, "x", true));
      u.ctx.fillStyle = css("--text");
      u.ctx.fillRect(x, u.bbox.top, devicePixelRatio, u.bbox.height);
    }
  }

  pointed(u) {
    this.say(u.cursor.idx);
  }

  // Names of the curves, with the values under the cursor.
  say(row) {
    const { rec } = this.scope;
    const parts = CHOICES[this.choice].lines.map(([name, label, color]) => {
      const value = rec && row !== null && row !== undefined ? ` ${rec.at(name, row).toPrecision(4)}` : "";
      const part = document.createElement("span");
      part.style.setProperty("--mark", `var(${color})`);
      part.textContent = label + value;
      return part;
    });
    this.legend.replaceChildren(...parts);
  }
}

export class Scope {
  // on_time(t_s): somebody points at a moment.
  constructor(host, on_time) {
    this.rec = null;
    this.time_s = null;
    this.on_time = on_time;
    this.pane_height = 150;
    this.panes = FIRST.map((choice) => new Pane(host, choice, this));
    this.make();
    new ResizeObserver(() => this.resize()).observe(host);
  }

  make() {
    this.panes.forEach((pane) => pane.make());
  }

  // Curves by name, from the top; none: the usual ones.
  choose(choices = FIRST) {
    this.panes.forEach((pane, k) => pane.choose(choices[k]));
  }

  resize() {
    for (const pane of this.panes) {
      pane.plot.setSize({ width: pane.width(), height: this.pane_height });
    }
  }

  playable(u) {
    u.over.addEventListener("click", () => {
      if (this.rec && u.cursor.idx !== null && u.cursor.idx !== undefined) {
        this.on_time(this.rec.columns.t_s[u.cursor.idx]);
      }
    });
  }

  show(rec) {
    this.rec = rec;
    this.panes.forEach((pane) => pane.update());
  }

  set_time(time_s) {
    this.time_s = time_s;
    this.panes.forEach((pane) => pane.plot.redraw(false, false));
  }
}
