/** Current and rotor flux as vectors in the stator's frame: at zero hertz they stand still. */

const SVG = 'http://www.w3.org/2000/svg';
const RADIUS = 90;
const TRAIL = 40;
const JUMP = 60; // further apart than this the points tell nothing of the way between

function svg(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

function arrow(id) {
  const tip = svg('path', { d: 'M0,0 L8,4 L0,8 z', class: `tip-${id}` });
  return svg('marker', { id: `tip-${id}`, viewBox: '0 0 8 8', refX: 7, refY: 4, markerWidth: 5, markerHeight: 5, orient: 'auto-start-reverse' }, tip);
}

export class VectorDiagram {
  #current = svg('line', { class: 'vector-current', x1: 0, y1: 0, 'marker-end': 'url(#tip-current)' });
  #flux = svg('line', { class: 'vector-flux', x1: 0, y1: 0, 'marker-end': 'url(#tip-flux)' });
  #trail = svg('polyline', { class: 'vector-trail' });
  #text = svg('text', { x: -98, y: 96 });
  #points = [];
  #scale_A = 1;

  constructor() {
    this.element = svg(
      'svg',
      { viewBox: '-100 -100 200 200', class: 'vector', role: 'img', 'aria-label': 'stator current and rotor flux as vectors' },
      svg('defs', {}, arrow('current'), arrow('flux')),
      svg('circle', { r: RADIUS, class: 'vector-frame' }),
      svg('circle', { r: RADIUS / 2, class: 'vector-frame' }),
      svg('path', { d: 'M-96 0H96M0-96V96', class: 'vector-frame' }),
      this.#trail, this.#flux, this.#current, this.#text,
    );
  }

  /** @param {Map<string, number>} values @param {number} max_A outer circle */
  update(values, max_A) {
    const at = (name) => values.get(name) ?? 0;
    const [alpha_A, beta_A] = [at('i_s_alpha_A'), at('i_s_beta_A')];
    const flux_Wb = Math.hypot(at('lambda_r_hat_alpha_Wb'), at('lambda_r_hat_beta_Wb'));
    this.#scale_A = RADIUS / Math.max(max_A, 0.1);
    const [x, y] = [alpha_A * this.#scale_A, -beta_A * this.#scale_A];
    this.#place(this.#current, x, y);
    const length = flux_Wb > 1e-3 ? (RADIUS * 0.6) / flux_Wb : 0;
    this.#place(this.#flux, at('lambda_r_hat_alpha_Wb') * length, -at('lambda_r_hat_beta_Wb') * length);
    const [x0, y0] = this.#points.at(-1) ?? [x, y];
    if (Math.hypot(x - x0, y - y0) > JUMP) this.#points = [];
    this.#points = [...this.#points, [x, y]].slice(-TRAIL);
    this.#trail.setAttribute('points', this.#points.map(([a, b]) => `${a.toFixed(1)},${b.toFixed(1)}`).join(' '));
    this.#text.textContent = `${Math.hypot(alpha_A, beta_A).toFixed(1)} A of ${max_A.toFixed(0)} A, flux ${flux_Wb.toFixed(2)} Wb`;
  }

  #place(line, x, y) {
    line.setAttribute('x2', x.toFixed(2));
    line.setAttribute('y2', y.toFixed(2));
    line.style.visibility = Math.hypot(x, y) > 1.5 ? 'visible' : 'hidden';
  }
}
