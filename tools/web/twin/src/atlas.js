// The atlas as a map of buttons: one panel per true stator resistance, speed to the right, load
// upwards. Arrow keys move, Enter or a click starts the run of a point.

const WORDS = {
  oriented: "held, flux orientation right",
  held: "speed held, orientation off",
  takeover: "not held, and says so: I-f operation",
  safe_stop: "stopped with a fault in time",
  unsafe: "lost",
};

export class Atlas {
  // on_point(point, title)
  constructor(host, legend, on_point) {
    this.host = host;
    this.on_point = on_point;
    this.chosen = null;
    legend.replaceChildren(...Object.entries(WORDS).map(([outcome, text]) => {
      const item = document.createElement("li");
      item.className = `outcome ${outcome}`;
      item.textContent = text;
      return item;
    }));
  }

  show(points) {
    this.buttons = new Map();
    const ratios = [...new Set(points.map((p) => p.rs_ratio))];
    this.host.replaceChildren(...ratios.map((ratio) => this.panel(
      ratio, points.filter((p) => p.rs_ratio === ratio))));
    this.host.querySelector("button").tabIndex = 0;
  }

  // As if its button was clicked.
  choose(speed_rpm, load_pu, rs_ratio) {
    this.buttons.get(`${speed_rpm} ${load_pu} ${rs_ratio}`).click();
  }

  panel(ratio, points) {
    const speeds = [...new Set(points.map((p) => p.speed_rpm))];
    const loads = [...new Set(points.map((p) => p.load_pu))].sort((a, b) => b - a);
    const panel = document.createElement("div");
    panel.className = "atlas-panel";
    const head = document.createElement("h3");
    head.textContent = `true Rs × ${ratio}`;
    const grid = document.createElement("div");
    grid.className = "atlas-grid";
    grid.style.setProperty("--across", speeds.length);
    for (const load of loads) {
      for (const speed of speeds) {
        grid.append(this.button(points.find((p) => p.speed_rpm === speed && p.load_pu === load)));
      }
    }
    grid.onkeydown = (event) => this.step(event, grid, speeds.length);
    const foot = document.createElement("small");
    foot.textContent = `${speeds[0]} … ${speeds.at(-1)} min⁻¹`;
    panel.append(head, grid, foot);
    return panel;
  }

  button(point) {
    const button = document.createElement("button");
    const load = `${(100 * point.load_pu).toFixed(0).replace("-", "−")} %`;
    const title = `${point.speed_rpm} min⁻¹, load ${load} of rated, true Rs × ${point.rs_ratio}`;
    button.className = `outcome ${point.outcome}`;
    button.tabIndex = -1;
    button.title = `${title}: ${WORDS[point.outcome]}`;
    button.setAttribute("aria-label", button.title);
    this.buttons.set(`${point.speed_rpm} ${point.load_pu} ${point.rs_ratio}`, button);
    button.onclick = () => {
      this.chosen?.removeAttribute("aria-pressed");
      this.chosen = button;
      button.setAttribute("aria-pressed", "true");
      this.on_point(point, title);
    };
    return button;
  }

  step(event, grid, across) {
    const by = { ArrowRight: 1, ArrowLeft: -1, ArrowDown: across, ArrowUp: -across }[event.key];
    if (by === undefined) {
      return;
    }
    event.preventDefault();
    const buttons = [...grid.children];
    const at = buttons.indexOf(document.activeElement);
    const next = buttons[at + by];
    if (next) {
      buttons[at].tabIndex = -1;
      next.tabIndex = 0;
      next.focus();
    } else if (Math.abs(by) === 1) {
      const panel = by > 0 ? grid.parentElement.nextElementSibling : grid.parentElement.previousElementSibling;
      panel?.querySelector("button").focus();
    }
  }
}
