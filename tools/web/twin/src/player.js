// Goes through a finished run: the time slider, and play at eight times real time.

const PACE = 8;

export class Player {
  constructor({ box, play, time, out }, on_time) {
    Object.assign(this, { box, play, time, out, on_time, rec: null, now_s: 0, timer: null });
    play.onclick = () => (this.timer === null ? this.start() : this.stop());
    time.oninput = () => {
      this.stop();
      this.go(Number(time.value));
    };
  }

  show(rec) {
    this.stop();
    this.rec = rec;
    this.time.min = rec.begin_s;
    this.time.max = rec.end_s;
    this.time.step = (rec.end_s - rec.begin_s) / 2000;
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.go(still ? rec.end_s : rec.begin_s);
    if (!still) {
      this.start();
    }
  }

  go(t_s) {
    this.now_s = Math.min(Math.max(t_s, this.rec.begin_s), this.rec.end_s);
    this.time.value = this.now_s;
    this.out.textContent = `${this.now_s.toFixed(2)} s`;
    this.on_time(this.now_s);
  }

  start() {
    if (this.rec === null) {
      return;
    }
    if (this.now_s >= this.rec.end_s) {
      this.now_s = this.rec.begin_s;
    }
    let last = performance.now();
    const frame = (now) => {
      this.go(this.now_s + ((now - last) / 1000) * PACE);
      last = now;
      if (this.now_s < this.rec.end_s) {
        this.timer = requestAnimationFrame(frame);
      } else {
        this.stop();
      }
    };
    this.timer = requestAnimationFrame(frame);
    this.play.textContent = "❚❚";
    this.play.setAttribute("aria-label", "Pause");
  }

  stop() {
    cancelAnimationFrame(this.timer);
    this.timer = null;
    this.play.textContent = "▶";
    this.play.setAttribute("aria-label", "Play");
  }
}
