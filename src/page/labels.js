// Names in the scene: text of the page laid over the canvas, so that it is sharp and takes the page's colours.

import { el } from './dom.js';

const MOST = 30;
const NEEDED = /\b(end|chosen)\b/;
/** Of letters: the style sheet cuts off more. */
const LONG = 24;
/** The style sheet lifts the ends' names over their dots. */
const LIFT = 11;

export class Labels {
  #items = [];

  constructor(layer) {
    this.layer = layer;
  }

  /** `[{place, text, kind}]`; those that there is no room for are left out, the last ones first, but start, target and what is chosen. */
  set(items) {
    const needed = items.filter(({ kind }) => NEEDED.test(kind));
    const others = items.filter(({ kind }) => !NEEDED.test(kind));
    this.#items = [...needed, ...others].slice(0, MOST).map(({ place, text, kind }) => ({ place, lift: /\bend\b/.test(kind) ? LIFT : 0, node: el('span', { class: kind }, text) }));
    this.layer.replaceChildren(...this.#items.map((item) => item.node));
  }

  /** Writes those that are shown. */
  paint(pen, { ink, raised }) {
    Object.assign(pen, { font: '600 13px sans-serif', textAlign: 'center', textBaseline: 'bottom', lineWidth: 3, strokeStyle: raised, fillStyle: ink });
    for (const { at, lift, node } of this.#items) {
      if (node.hidden || !at) continue;
      const text = node.textContent.length > LONG ? `${node.textContent.slice(0, LONG - 1)}…` : node.textContent;
      pen.strokeText(text, at.x, at.y - lift);
      pen.fillText(text, at.x, at.y - lift);
    }
  }

  /** Puts each where `onScreen` says, and hides those that would cover another. */
  place(onScreen) {
    const taken = [];
    for (const item of this.#items) {
      const { place, lift, node } = item;
      const at = onScreen(place);
      item.at = at;
      const y = at && at.y - lift;
      const wide = (Math.min(node.textContent.length, LONG) * 6.4) / 2 + 6;
      const free = at && taken.every((other) => Math.abs(other.x - at.x) > other.wide + wide || Math.abs(other.y - y) > 18);
      node.hidden = !free;
      if (!free) continue;
      taken.push({ x: at.x, y, wide });
      node.style.transform = `translate(${at.x.toFixed(1)}px, ${at.y.toFixed(1)}px) translate(-50%, -100%)`;
    }
  }
}
