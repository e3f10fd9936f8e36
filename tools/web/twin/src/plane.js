// The speed-torque plane: the wedge about zero stator frequency, the operating point and its trail.
//
// The slip of a rotor flux lambda under the torque T is Rr T / (p lambda^2); the stator frequency
// p w + slip is zero on a straight line through the origin, and small in a wedge about it.

const RR_OHM = 0.5; // of the paper's motor, as are the next two
const POLE_PAIRS = 2;
const RATED_NM = 8.4;
const RPM_PER_RAD_S = 30 / Math.PI;
const NEAR_HZ = [2.0, 0.6]; // 0.6: from there on flux steering acts (steer_min_Hz)
const NO_FLUX_WB = 0.05;
const TRAIL_S = 4;

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Torque at which a speed has this stator frequency.
export function torque_at(speed_rpm, f_Hz, flux_Wb) {
  const slip_rad_s = 2 * Math.PI * f_Hz - (POLE_PAIRS * speed_rpm) / RPM_PER_RAD_S;
  return (slip_rad_s * POLE_PAIRS * flux_Wb * flux_Wb) / RR_OHM;
}

function speed_at(torque_Nm, f_Hz, flux_Wb) {
  const slip_rad_s = (RR_OHM * torque_Nm) / (POLE_PAIRS * flux_Wb * flux_Wb);
  return ((2 * Math.PI * f_Hz - slip_rad_s) * RPM_PER_RAD_S) / POLE_PAIRS;
}

export class Plane {
  constructor(canvas) {
    this.canvas = canvas;
    this.rec = null;
    this.row = 0;
    this.most_rpm = 150;
    this.most_Nm = 1.6 * RATED_NM;
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  // `steady`: the axes of a run by hand do not jump about.
  show(rec, most_rpm) {
    this.rec = rec;
    this.most_rpm = most_rpm;
    this.draw();
  }

  set_time(t_s) {
    this.row = this.rec ? this.rec.row_at(t_s) : 0;
    this.draw();
  }

  x(speed_rpm) {
    return this.left + ((speed_rpm + this.most_rpm) / (2 * this.most_rpm)) * this.width;
  }

  y(torque_Nm) {
    return this.top + ((this.most_Nm - torque_Nm) / (2 * this.most_Nm)) * this.height;
  }

  draw() {
    const { canvas } = this;
    const box = canvas.getBoundingClientRect();
    if (box.width === 0) {
      return;
    }
    const scale = devicePixelRatio || 1;
    canvas.width = Math.round(box.width * scale);
    canvas.height = Math.round(box.height * scale);
    const c = (this.c = canvas.getContext("2d"));
    c.scale(scale, scale);
    c.font = "11px system-ui, sans-serif";
    [this.left, this.top] = [46, 10];
    [this.width, this.height] = [box.width - this.left - 12, box.height - this.top - 38];
    const flux_Wb = this.rec && this.rec.length ? this.rec.at("lambda_Wb", this.row) : 0;
    c.save();
    c.beginPath();
    c.rect(this.left, this.top, this.width, this.height);
    c.clip();
    this.wedge(flux_Wb > NO_FLUX_WB ? flux_Wb : 0.5);
    c.restore();
    this.axes();
    this.quadrants();
    if (this.rec && this.rec.length) {
      c.save();
      c.beginPath();
      c.rect(this.left, this.top, this.width, this.height);
      c.clip();
      this.trail();
      c.restore();
      this.point();
    }
  }

  wedge(flux_Wb) {
    const { c } = this;
    const [low, high] = [-this.most_Nm, this.most_Nm];
    NEAR_HZ.forEach((f_Hz, k) => {
      c.beginPath();
      c.moveTo(this.x(speed_at(low, -f_Hz, flux_Wb)), this.y(low));
      c.lineTo(this.x(speed_at(low, f_Hz, flux_Wb)), this.y(low));
      c.lineTo(this.x(speed_at(high, f_Hz, flux_Wb)), this.y(high));
      c.lineTo(this.x(speed_at(high, -f_Hz, flux_Wb)), this.y(high));
      c.closePath();
      c.fillStyle = css(k === 0 ? "--wedge-far" : "--wedge-near");
      c.fill();
    });
    c.beginPath();
    c.moveTo(this.x(speed_at(low, 0, flux_Wb)), this.y(low));
    c.lineTo(this.x(speed_at(high, 0, flux_Wb)), this.y(high));
    c.strokeStyle = css("--wedge-line");
    c.lineWidth = 1.5;
    c.stroke();
    c.save();
    const [x, y] = [this.x(speed_at(-0.62 * this.most_Nm, 0, flux_Wb)), this.y(-0.62 * this.most_Nm)];
    const dx = this.x(speed_at(high, 0, flux_Wb)) - this.x(speed_at(low, 0, flux_Wb));
    c.translate(x, y);
    c.rotate(Math.atan2(this.y(low) - this.y(high), -dx));
    c.textAlign = "center";
    this.text("stator frequency 0", 0, -5, css("--text"));
    c.restore();
  }

  quadrants() {
    const { c } = this;
    for (const [x, y, text] of [[0.97, 0.04, "motor drives"], [0.97, 0.98, "load drives"],
                                [0.03, 0.98, "motor drives"], [0.03, 0.04, "load drives"]]) {
      c.textAlign = x > 0.5 ? "right" : "left";
      c.textBaseline = y > 0.5 ? "bottom" : "top";
      this.text(text, this.left + x * this.width, this.top + y * this.height, css("--muted"));
    }
    c.textBaseline = "alphabetic";
  }

  axes() {
    const { c } = this;
    c.strokeStyle = css("--grid");
    c.fillStyle = css("--muted");
    c.lineWidth = 1;
    const step = [10, 25, 50, 100, 200, 500, 1000].find((s) => (2 * this.most_rpm) / s <= 7) || 2000;
    c.textAlign = "center";
    for (let w = -Math.floor(this.most_rpm / step) * step; w <= this.most_rpm; w += step) {
      this.line(this.x(w), this.top, this.x(w), this.top + this.height);
      c.fillText(String(w).replace("-", "−"), this.x(w), this.top + this.height + 14);
    }
    c.textAlign = "right";
    for (const T of [-12, -8, -4, 0, 4, 8, 12]) {
      this.line(this.left, this.y(T), this.left + this.width, this.y(T));
      c.fillText(String(T).replace("-", "−"), this.left - 5, this.y(T) + 4);
    }
    c.strokeStyle = css("--muted");
    this.line(this.x(0), this.top, this.x(0), this.top + this.height);
    this.line(this.left, this.y(0), this.left + this.width, this.y(0));
    c.textAlign = "center";
    c.fillText("speed, min⁻¹", this.left + this.width / 2, this.top + this.height + 30);
    c.save();
    c.translate(12, this.top + this.height / 2);
    c.rotate(-Math.PI / 2);
    c.fillText("torque of the motor, N m", 0, 0);
    c.restore();
  }

  // Readable over lines.
  text(words, x, y, color) {
    const { c } = this;
    c.lineWidth = 4;
    c.lineJoin = "round";
    c.strokeStyle = css("--card");
    c.strokeText(words, x, y);
    c.fillStyle = color;
    c.fillText(words, x, y);
  }

  line(x1, y1, x2, y2) {
    const { c } = this;
    c.beginPath();
    c.moveTo(x1, y1);
    c.lineTo(x2, y2);
    c.stroke();
  }

  trail() {
    const { c, rec, row } = this;
    const first = rec.row_at(rec.columns.t_s[row] - TRAIL_S);
    const every = Math.max(1, Math.floor((row - first) / 400));
    c.strokeStyle = css("--true");
    c.lineWidth = 1.5;
    for (let k = first; k < row; k += every) {
      const next = Math.min(k + every, row);
      c.globalAlpha = 0.08 + (0.7 * (k - first)) / Math.max(1, row - first);
      this.line(this.x(rec.at("speed_rpm", k)), this.y(rec.at("torque_Nm", k)),
                this.x(rec.at("speed_rpm", next)), this.y(rec.at("torque_Nm", next)));
    }
    c.globalAlpha = 1;
  }

  // The true operating point, and where the firmware believes to be.
  point() {
    const { c, rec, row } = this;
    const y = this.y(this.inside(rec.at("torque_Nm", row), this.most_Nm));
    const x = this.x(this.inside(rec.at("speed_rpm", row), this.most_rpm));
    const hat = rec.at("speed_hat_rpm", row);
    if (rec.at("gates_on", row) > 0 && Number.isFinite(hat)) {
      c.beginPath();
      c.arc(this.x(this.inside(hat, this.most_rpm)), y, 7, 0, 7);
      c.strokeStyle = css("--est");
      c.lineWidth = 2;
      c.stroke();
    }
    c.beginPath();
    c.arc(x, y, 4.5, 0, 7);
    c.fillStyle = css("--true");
    c.fill();
  }

  inside(value, most) {
    return Math.max(-most, Math.min(most, value));
  }
}

export { RATED_NM };
