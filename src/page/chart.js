// How the search went: cost of the best route and of the swarm over iterations, and the bound that none can fall below.

import uPlot from './vendor/uplot.js';
import { el } from './dom.js';
import { onSchemeChange, palette } from './palette.js';
import { cost } from './words.js';

const HEIGHT = 190;
const FONT = '11px ui-sans-serif, system-ui, sans-serif';

export class Chart {
  #plot = null;
  #shown = { points: [], bound: null, others: [], color: null };
  #shape = '';
  #marked = null;
  #marking = false;

  /** `pointed(iteration)` is told where the pointer is; null where it is not. */
  constructor(node, legend, pointed) {
    this.node = node;
    this.legend = legend;
    this.pointed = pointed;
    new ResizeObserver(() => node.clientWidth && this.#plot?.setSize({ width: node.clientWidth, height: HEIGHT })).observe(node);
    onSchemeChange(() => {
      this.#shape = '';
      this.#draw();
    });
  }

  /** `points` of a convergence, the proven `bound` or null, and those of `others`: `{name, points, color}`. */
  show({ points, bound, others, color }) {
    this.#shown = { points, bound, others, color };
    this.#draw();
  }

  /** Marks an iteration; null for none. */
  mark(iteration) {
    this.#marked = iteration;
    if (!this.#plot) return;
    this.#marking = true;
    this.#plot.setCursor(iteration === null ? { left: -10, top: -10 } : { left: this.#plot.valToPos(iteration, 'x'), top: 0 });
    this.#marking = false;
  }

  #draw() {
    const { points, bound, others, color } = this.#shown;
    this.node.hidden = !points.length && !others.length;
    const colours = palette();
    const series = [
      { label: 'mean', stroke: colours.mean, width: 1, values: curve(points, meanOf) },
      ...others.map((other) => ({ label: other.name, stroke: other.color, width: 1.5, values: curve(other.points, bestOf) })),
      { label: 'best', stroke: color ?? colours.best, width: 2, values: curve(points, bestOf) },
    ];
    const columns = [...new Set(series.flatMap((one) => [...one.values.keys()]))].sort((a, b) => a - b);
    const lower = bound > 0 ? bound : null;
    const data = [columns, columns.map(() => lower), ...series.map(({ values }) => columns.map((at) => values.get(at) ?? null))];
    const drawn = [{ label: 'bound', stroke: colours.bound, width: 1, dash: [5, 4], values: new Map() }, ...series];
    const shape = JSON.stringify([drawn.map(({ label, stroke }) => [label, stroke]), colours.ink]);
    if (shape !== this.#shape) {
      this.#plot?.destroy();
      this.#plot = new uPlot(this.#options(drawn, colours), data, this.node);
      this.#shape = shape;
    } else {
      this.#plot.setData(data);
    }
    this.#tell(lower, series, colours);
  }

  #options(series, colours) {
    const axis = { stroke: colours.faint, font: FONT, grid: { stroke: colours.line, width: 1 }, ticks: { show: false } };
    return {
      width: this.node.clientWidth || 300,
      height: HEIGHT,
      padding: [8, 14, 0, 0],
      legend: { show: false },
      cursor: { y: false, points: { size: 7 }, drag: { x: false, y: false } },
      scales: { x: { time: false }, y: { range: (plot) => this.#range(plot) } },
      axes: [{ ...axis, size: 24, gap: 4 }, { ...axis, size: 52, gap: 6, values: (_, ticks) => ticks.map((tick) => tick.toLocaleString('en')) }],
      series: [{}, ...series.map(({ label, stroke, width, dash }) => ({ label, stroke, width, dash, spanGaps: true, points: { show: false } }))],
      hooks: {
        // What is drawn anew has forgotten its mark.
        draw: [() => this.#marked !== null && this.mark(this.#marked)],
        setCursor: [(plot) => {
          if (this.#marking) return;
          const at = plot.cursor.idx;
          this.pointed(at === null || at === undefined || plot.cursor.left < 0 ? null : plot.data[0][at]);
        }],
      },
    };
  }

  /** From the bound or the best to what most of the swarm's history reaches: its wild start is cut off. */
  #range(plot) {
    const all = plot.data.slice(1).flat().filter(Number.isFinite);
    if (!all.length) return [0, 1];
    const best = plot.data.slice(3).flat().filter(Number.isFinite);
    const mean = plot.data[2].filter(Number.isFinite).sort((a, b) => a - b);
    // One by one: a long search has more points than a call can have arguments.
    const low = all.reduce((a, b) => Math.min(a, b));
    const high = (best.length ? best : all).reduce((a, b) => Math.max(a, b), mean[Math.floor(mean.length * 0.75)] ?? -Infinity);
    const room = Math.max((high - low) * 0.08, Math.abs(high) * 1e-4);
    return [low - room, high + room];
  }

  #tell(bound, series, colours) {
    const last = (values) => [...values.values()].filter((value) => value !== null).at(-1);
    // A plan that is laid over is named even where it found no feasible route: its colour is in the scene.
    const shown = ({ label, values }) => !['best', 'mean'].includes(label) || last(values) !== undefined;
    const entries = [...series].reverse().filter(shown).map(({ label, stroke, values }) => [label, stroke, cost(last(values))]);
    if (bound) entries.push(['proven bound', colours.bound, cost(bound)]);
    this.legend.replaceChildren(...entries.map(([label, stroke, value]) => {
      const swatch = el('i');
      swatch.style.background = stroke;
      return el('span', {}, swatch, `${label} `, el('b', {}, value));
    }));
    const said = entries.map(([label, , value]) => `${label} ${value}`);
    this.node.setAttribute('aria-label', said.length ? `Convergence over iterations; at the end: ${said.join(', ')}` : 'No search yet');
  }
}

const bestOf = (point) => point.best_cost;
/** None below the best, but for rounding: that of a swarm with fewer waypoints is one of coarser routes. */
const meanOf = ({ mean_cost: mean, best_cost: best }) => (mean < best * (1 - 1e-9) ? null : mean);

/** Iteration to value; the polished end, which shares the last iteration, stands one to its right. */
function curve(points, valueOf) {
  const values = new Map();
  let last = -1;
  for (const point of points) {
    last = Math.max(point.iteration, last + 1);
    values.set(last, valueOf(point));
  }
  return values;
}
