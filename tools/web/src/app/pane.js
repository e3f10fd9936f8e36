/** One plot of the scope: its signals, a legend with values at the cursor, zoom by dragging. */

import uPlot from 'uplot';

import { h, number } from './dom.js';
import { BAND_OF, choosable, colourOf, columnOf, textOf, unitOf } from './signals.js';

const HEIGHT_MIN = 130;
const LEGEND_PX = 26;

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** A list of all names for the fields that add a signal; one for the page. */
export function signalList(session) {
  const list = h('datalist', { id: 'signal-names' });
  session.addEventListener('change', () => {
    if (session.state !== 'connected') return;
    list.replaceChildren(...choosable(session.client).map((name) => h('option', { value: name }, textOf(name, session.catalog))));
  });
  return list;
}

export class Pane {
  #session;
  #wiring;
  #plot = null;
  #chips = h('span', { class: 'chips' });
  #plotArea = h('div', { class: 'plot' });
  #drawn = '';
  #pairs = 1; // stays when the connection is lost

  /** @param {{changed: () => void, remove: (pane: Pane) => void, zoomed: (from: number, to: number) => void}} wiring */
  constructor(session, signals, wiring) {
    this.#session = session;
    this.#wiring = wiring;
    this.signals = [...signals];
    const add = h('input', { class: 'add-signal', list: 'signal-names', placeholder: 'add a signal …', 'aria-label': 'add a signal', size: 18 });
    add.addEventListener('change', () => {
      if (!session.client || !choosable(session.client).includes(add.value)) return;
      if (!this.signals.includes(add.value)) this.signals.push(add.value);
      add.value = '';
      this.#changed();
    });
    const close = h('button', { class: 'quiet', 'aria-label': 'remove this pane', title: 'remove this pane', onclick: () => wiring.remove(this) }, '×');
    this.element = h('section', { class: 'pane' }, h('div', { class: 'pane-head' }, this.#chips, add, close), this.#plotArea);
    this.#showChips();
  }

  #changed() {
    this.#showChips();
    this.#wiring.changed();
  }

  #showChips() {
    this.#chips.replaceChildren(...this.signals.map((name, k) => {
      const remove = () => {
        this.signals = this.signals.filter((other) => other !== name);
        this.#changed();
      };
      const chip = h('button', { class: 'chip', title: `${textOf(name, this.#session.catalog)}: click to remove`, onclick: remove }, name, ' ×');
      chip.style.setProperty('--colour', colourOf(k));
      return chip;
    }));
  }

  /** The recording as this pane draws it: time, its columns, the two edges of a band. */
  #dataOf({ t, columns }) {
    this.#pairs = this.#session.client?.identity?.polePairs ?? this.#pairs;
    const pairs = this.#pairs;
    const data = [t];
    for (const name of this.signals) data.push(columnOf(name, columns, pairs) ?? new Array(t.length).fill(null));
    for (const name of this.signals.filter((n) => BAND_OF[n])) {
      const [middle, width] = [columnOf(name, columns, pairs), columnOf(BAND_OF[name], columns, pairs)];
      for (const sign of [1, -1]) {
        data.push(middle && width ? middle.map((m, k) => (m === null || width[k] === null ? null : m + sign * width[k])) : new Array(t.length).fill(null));
      }
    }
    return data;
  }

  /** @param {{t: number[], columns: Map<string, number[]>}} recording @param {[number, number] | null} range @param {number | null} mark */
  draw(recording, range, mark) {
    const size = { width: Math.max(this.#plotArea.clientWidth, 200), height: Math.max(this.#plotArea.clientHeight - LEGEND_PX, HEIGHT_MIN) };
    const key = JSON.stringify([this.signals, mark !== null]);
    const data = this.#dataOf(recording);
    if (key !== this.#drawn) this.#make(size, data, mark);
    this.#drawn = key;
    if (this.#plot.width !== size.width || this.#plot.height !== size.height) this.#plot.setSize(size);
    this.#plot.setData(data, false);
    const [min, max] = range ?? [recording.t[0] ?? 0, recording.t.at(-1) ?? 1];
    this.#plot.setScale('x', { min, max });
  }

  /** Colours and everything anew. */
  restyle() {
    this.#drawn = '';
    this.#showChips();
  }

  #make(size, data, mark) {
    this.#plot?.destroy();
    const { catalog } = this.#session;
    const axis = { stroke: css('--text-dim'), grid: { stroke: css('--grid'), width: 1 }, ticks: { stroke: css('--grid'), width: 1 }, font: '11px system-ui, sans-serif' };
    const value = (_, raw) => number(raw);
    const lines = this.signals.map((name, k) => ({
      label: name, stroke: colourOf(k), width: 1.6, value, spanGaps: false, points: { show: false },
    }));
    const banded = this.signals.map((name, k) => [name, k]).filter(([name]) => BAND_OF[name]);
    const edges = banded.flatMap(() => [0, 1].map(() => ({ auto: false, stroke: 'transparent', width: 0, points: { show: false }, label: '', class: 'edge' })));
    const bands = banded.map(([, k], n) => ({ series: [lines.length + 1 + 2 * n, lines.length + 2 + 2 * n], fill: `${colourOf(k)}33` }));
    const units = [...new Set(this.signals.map((name) => unitOf(name, catalog)))].filter(Boolean);
    this.#plot = new uPlot({
      ...size,
      scales: { x: { time: false }, y: { range: (_, low, high) => padded(low, high) } },
      axes: [
        { ...axis, size: 26, values: (_, ticks) => ticks.map((t) => `${Number(t.toPrecision(6))} s`) },
        { ...axis, size: 62, label: units.join(', '), labelSize: 16, labelFont: '11px system-ui, sans-serif' },
      ],
      series: [{ label: 't', value: (_, t) => (t === null || t === undefined ? '–' : `${t.toFixed(4)} s`) }, ...lines, ...edges],
      bands,
      cursor: { sync: { key: 'zh-scope' }, drag: { x: true, y: false, setScale: false }, points: { size: 5 } },
      legend: { live: true, markers: { width: 3 } },
      hooks: {
        setSelect: [(plot) => {
          if (plot.select.width < 4) return;
          const at = (left) => plot.posToVal(left, 'x');
          this.#wiring.zoomed(at(plot.select.left), at(plot.select.left + plot.select.width));
          plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
        }],
        draw: mark === null ? [] : [(plot) => drawMark(plot, mark)],
      },
    }, data, this.#plotArea);
    this.#plot.root.querySelectorAll('.edge').forEach((e) => e.remove());
  }
}

/** Room above and below; a constant stays in the middle. */
function padded(low, high) {
  if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
  const room = high - low > 1e-6 * Math.abs(high) ? (high - low) * 0.08 : Math.max(Math.abs(high) * 0.02, 0.1);
  return [low - room, high + room];
}

/** The trigger, or the fault. */
function drawMark(plot, at) {
  const x = plot.valToPos(at, 'x', true);
  const { left, top, width, height } = plot.bbox;
  if (x < left || x > left + width) return;
  const { ctx } = plot;
  ctx.save();
  ctx.strokeStyle = css('--mark');
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([5 * devicePixelRatio, 4 * devicePixelRatio]);
  ctx.beginPath();
  ctx.moveTo(x, top);
  ctx.lineTo(x, top + height);
  ctx.stroke();
  ctx.restore();
}
