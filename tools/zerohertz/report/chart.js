// The report's charts. Drag to zoom in time, double-click or 0 for the whole; the arrow keys move,
// + and - zoom. The vertical axis follows what is shown. Data: chart.py.
(() => {
  const LEFT = 52, RIGHT = 30, TOP = 22, FOOT = 40, GAP = 28;
  const INK = "#1f2937", SOFT = "#6b7280", GRID = "#e5e7eb", FONT = "system-ui, 'DejaVu Sans', sans-serif";

  function unpacked({ low, step, data }) {
    const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
    const levels = new Int16Array(bytes.buffer);
    return Float32Array.from(levels, (level) => low + level * step);
  }

  // Lines with `y` in pairs (least, greatest) over even x, or with `x`.
  function line_of({ packed, ...rest }) {
    const y = unpacked(packed.y);
    return { ...rest, y, x: packed.x && unpacked(packed.x), from: packed.from, to: packed.to };
  }

  const text_of = (value) => String(Number(value.toPrecision(10))).replace("-", "−");

  function ticks(low, high, most) {
    const rough = (high - low) / most;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough);
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(k * step);
    return found;
  }

  class Chart {
    constructor(host) {
      Object.assign(this, JSON.parse(host.dataset.chart));
      this.panels.forEach((panel) => (panel.lines = panel.lines.map(line_of)));
      this.whole = this.x_view;
      this.parametric = this.panels[0].lines[0].x !== undefined;
      this.canvas = document.createElement("canvas");
      Object.assign(this.canvas, { tabIndex: 0, title: "Drag to zoom; double-click shows all" });
      this.canvas.setAttribute("role", "img");
      this.canvas.setAttribute("aria-label", host.getAttribute("aria-label"));
      host.append(this.canvas);
      this.listen();
      new ResizeObserver(() => this.draw()).observe(host);
    }

    listen() {
      const { canvas } = this;
      canvas.onpointerdown = (event) => {
        this.dragged = [event.offsetX, event.offsetX];
        canvas.setPointerCapture(event.pointerId);
      };
      canvas.onpointermove = (event) => {
        this.pointer = event.offsetX;
        if (this.dragged) this.dragged[1] = event.offsetX;
        this.draw();
      };
      canvas.onpointerup = () => {
        const [a, b] = (this.dragged ?? [0, 0]).map((x) => this.value(x)).sort((p, q) => p - q);
        const wide = Math.abs(this.dragged[1] - this.dragged[0]) > 6;
        this.dragged = null;
        if (wide) this.zoom(a, b);
      };
      canvas.onpointerleave = () => {
        this.pointer = null;
        this.draw();
      };
      canvas.ondblclick = () => this.zoom(...this.whole);
      canvas.onkeydown = (event) => this.key(event);
    }

    key(event) {
      const [low, high] = this.x_view;
      const width = high - low;
      const to = { ArrowLeft: [-0.2, -0.2], ArrowRight: [0.2, 0.2], "+": [0.2, -0.2], "-": [-0.3, 0.3] }[event.key];
      if (event.key === "0") this.zoom(...this.whole);
      if (!to) return;
      event.preventDefault();
      this.zoom(low + to[0] * width, high + to[1] * width);
    }

    zoom(low, high) {
      const [first, last] = this.whole;
      this.x_view = [Math.max(first, low), Math.min(last, high)];
      if (this.x_view[1] - this.x_view[0] < 1e-3 * (last - first)) this.x_view = this.whole;
      this.draw();
    }

    x(value) {
      const [low, high] = this.x_view;
      return LEFT + ((value - low) / (high - low)) * this.width;
    }

    value(x) {
      const [low, high] = this.x_view;
      return Math.min(high, Math.max(low, low + ((x - LEFT) / this.width) * (high - low)));
    }

    // Indices of the buckets in view.
    part(line) {
      const count = line.y.length / 2;
      const at = (x) => ((x - line.from) / (line.to - line.from)) * count;
      return [Math.max(0, Math.floor(at(this.x_view[0]))), Math.min(count, Math.ceil(at(this.x_view[1])) + 1)];
    }

    // Zoomed: what is shown fills the panel, but never beyond the view of the whole.
    y_view(panel) {
      if (this.x_view === this.whole || this.parametric) return panel.view;
      let [low, high] = [Infinity, -Infinity];
      for (const line of panel.lines) {
        const [first, end] = this.part(line);
        for (const y of line.y.subarray(2 * first, 2 * end)) {
          low = Math.min(low, y);
          high = Math.max(high, y);
        }
      }
      const room = 0.06 * (high - low) || 0.02 * (panel.view[1] - panel.view[0]);
      const seen = [Math.max(panel.view[0], low - room), Math.min(panel.view[1], high + room)];
      return seen[0] < seen[1] ? seen : panel.view;
    }

    draw() {
      const width = this.canvas.parentElement.clientWidth;
      const height = Math.round(Math.min(460, Math.max(300, 0.72 * width)));
      const scale = devicePixelRatio || 1;
      if (!width) return;
      Object.assign(this.canvas, { width: width * scale, height: height * scale });
      Object.assign(this.canvas.style, { width: `${width}px`, height: `${height}px` });
      const c = (this.c = this.canvas.getContext("2d"));
      c.scale(scale, scale);
      this.width = width - LEFT - RIGHT;
      const shares = this.panels.reduce((sum, panel) => sum + panel.height, 0);
      const free = height - TOP - FOOT - GAP * (this.panels.length - 1);
      let top = TOP;
      for (const panel of this.panels) {
        const tall = (free * panel.height) / shares;
        this.panel(panel, top, tall);
        top += tall + GAP;
      }
      this.foot(height);
      if (this.dragged) {
        c.fillStyle = "rgba(0, 114, 178, .15)";
        c.fillRect(this.dragged[0], TOP, this.dragged[1] - this.dragged[0], height - TOP - FOOT);
      }
    }

    panel(panel, top, tall) {
      const { c } = this;
      const [low, high] = this.y_view(panel);
      const y = (value) => top + ((high - value) / (high - low)) * tall;
      this.write(panel.title, LEFT, top - 7, { color: INK });
      this.legend(panel, top - 7);
      for (const tick of ticks(low, high, Math.max(2, tall / 32))) {
        this.stroke(LEFT, y(tick), LEFT + this.width, y(tick), GRID);
        this.write(text_of(tick), LEFT - 6, y(tick) + 3.5, { align: "right" });
      }
      for (const tick of ticks(...this.x_view, this.width / 70)) this.stroke(this.x(tick), top, this.x(tick), top + tall, GRID);
      c.save();
      c.beginPath();
      c.rect(LEFT, top, this.width, tall);
      c.clip();
      if (low < 0 && high > 0) this.stroke(LEFT, y(0), LEFT + this.width, y(0), "#9ca3af");
      panel.limits.forEach((limit) => this.stroke(LEFT, y(limit), LEFT + this.width, y(limit), SOFT, [2, 3]));
      this.marks.forEach(([at, text]) => this.stroke(this.x(at), top, this.x(at), top + tall, text ? "#b91c1c" : SOFT, [3, 3]));
      panel.lines.forEach((line) => (line.x ? this.curve(line, y) : this.signal(line, y)));
      if (this.pointer) this.stroke(this.pointer, top, this.pointer, top + tall, SOFT);
      c.restore();
      if (panel === this.panels[0]) {
        for (const [at, text] of this.marks) if (text && this.x(at) <= LEFT + this.width) this.write(text, this.x(at) + 4, top + 11, { color: "#b91c1c" });
      }
      if (panel.note && this.x_view === this.whole) this.write(panel.note, LEFT + this.width - 4, top + tall - 5, { align: "right" });
    }

    // Every bucket as an upright stroke, joined to the next.
    signal(line, y) {
      const { c } = this;
      const [first, end] = this.part(line);
      const count = line.y.length / 2;
      this.pen(line);
      for (let k = first; k < end; k++) {
        const x = this.x(line.from + ((k + 0.5) / count) * (line.to - line.from));
        c.lineTo(x, y(line.y[2 * k]));
        c.lineTo(x, y(line.y[2 * k + 1]));
      }
      c.stroke();
    }

    curve(line, y) {
      this.pen(line);
      line.x.forEach((x, k) => this.c.lineTo(this.x(x), y(line.y[k])));
      this.c.stroke();
      this.c.fillStyle = line.color;
      for (let k = 0; line.mark_every && k < line.x.length; k += line.mark_every) this.c.fillRect(this.x(line.x[k]) - 2.5, y(line.y[k]) - 2.5, 5, 5);
    }

    pen(line) {
      const { c } = this;
      c.setLineDash(line.dashed ? [5, 3] : []);
      Object.assign(c, { strokeStyle: line.color, lineWidth: 1.3, lineJoin: "round" });
      c.beginPath();
    }

    // Names, and at the pointer the values, from the right.
    legend(panel, base) {
      let right = LEFT + this.width;
      for (const line of [...panel.lines].reverse()) {
        const value = this.pointer && !line.x ? ` ${text_of(Number(this.at(line).toPrecision(4)))}` : "";
        if (!line.label && !value) continue;
        right -= this.write(line.label + value, right, base, { align: "right", color: line.color }) + 14;
      }
    }

    at(line) {
      const count = line.y.length / 2;
      const k = Math.floor(((this.value(this.pointer) - line.from) / (line.to - line.from)) * count);
      const kept = Math.min(count - 1, Math.max(0, k));
      return (line.y[2 * kept] + line.y[2 * kept + 1]) / 2;
    }

    foot(height) {
      for (const tick of ticks(...this.x_view, this.width / 70)) this.write(text_of(tick), this.x(tick), height - FOOT + 15, { align: "center" });
      this.write(this.x_title, LEFT, height - 7, { color: INK });
      const at = this.pointer ? `at ${text_of(Number(this.value(this.pointer).toPrecision(5)))}` : this.source;
      this.write(at, LEFT + this.width, height - 7, { align: "right", size: 10 });
    }

    write(text, x, y, { align = "left", color = SOFT, size = 11.5 } = {}) {
      const { c } = this;
      Object.assign(c, { font: `${size}px ${FONT}`, textAlign: align, fillStyle: color });
      c.fillText(text, x, y);
      return c.measureText(text).width;
    }

    stroke(x1, y1, x2, y2, color, dash = []) {
      const { c } = this;
      c.setLineDash(dash);
      Object.assign(c, { strokeStyle: color, lineWidth: 1 });
      c.beginPath();
      c.moveTo(x1, y1);
      c.lineTo(x2, y2);
      c.stroke();
    }
  }

  window.charts = [...document.querySelectorAll("[data-chart]")].map((host) => new Chart(host));
})();
