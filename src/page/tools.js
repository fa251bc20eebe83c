// Drawing in the scene: placing with a click, moving and sizing by dragging. All of it is in the form, too.

import { el } from './dom.js';
import { axes, written } from './frame.js';
import { radiiOf } from './sizes.js';

const NEAR_PX = 13;
/** A finger covers what it is at. */
const NEAR_TOUCH_PX = 24;
const STILL_PX = 5;
/** A side of what is being drawn lies on the ground in so many pieces. */
const PIECES = 16;
const TOOLS = [
  ['look', 'Look', 'Drag to turn, wheel to zoom. Drag start, target and the dots of a chosen threat to move them.', 'Drag to turn, pinch to zoom. Drag start, target and the dots of a chosen threat to move them.'],
  ['start', 'Start', 'Click on the ground to place the start.', 'Tap the ground to place the start.'],
  ['target', 'Target', 'Click on the ground to place the target.', 'Tap the ground to place the target.'],
  ['cylinder', 'Cylinder', 'Click on the ground to place a round threat; drag its dots for its radii.', 'Tap the ground to place a round threat; drag its dots for its radii.'],
  ['polygon', 'Polygon', 'Click the corners one after another; Enter, a double click or a click on the first one closes it, Ctrl+Z takes back the last one, Escape gives up.',
    'Tap the corners one after another; a tap on the first one closes it, Undo takes back the last one, Look gives up.'],
];
/** What a tool says, to fingers or to a mouse. */
const help = ([, , mouse, touch]) => (matchMedia('(pointer: coarse)').matches ? touch : mouse);

export class Tools {
  #tool = 'look';
  #down = null;
  #drag = null;
  #corners = [];
  /** The place under the mouse, where another corner would be. */
  #next = null;
  #drags = 0;
  #buttons = new Map();

  /**
   * `stage` has `frame`, `ground` and `selected`, and `select(index)`; `pointed(place)` hears where the pointer is, and `changed()` that
   * something is being drawn or no longer.
   */
  constructor({ bar, hint, world, draft, stage, pointed, changed }) {
    Object.assign(this, { hint, world, draft, stage, pointed, changed });
    for (const tool of TOOLS) {
      const [name, title] = tool;
      const button = el('button', { type: 'button', data: { tool: name }, 'aria-pressed': String(name === 'look'), title: help(tool), onclick: () => this.use(name) }, title);
      this.#buttons.set(name, button);
      bar.append(button);
    }
    const { canvas } = world;
    canvas.addEventListener('pointerdown', (event) => this.#pressed(event), { capture: true });
    canvas.addEventListener('pointermove', (event) => this.#moved(event));
    canvas.addEventListener('pointerup', (event) => this.#released(event));
    canvas.addEventListener('pointercancel', () => this.#drop());
    canvas.addEventListener('pointerleave', () => {
      pointed(null);
      this.#wouldBe(null);
    });
    addEventListener('keydown', (event) => {
      if (event.key === 'Escape') this.use('look');
      if (event.key === 'Enter' && this.#tool === 'polygon' && !event.target.closest?.('button, input, select')) this.#close();
    });
  }

  use(tool) {
    this.#tool = tool;
    this.#corners = [];
    this.#next = null;
    for (const [name, button] of this.#buttons) button.setAttribute('aria-pressed', String(name === tool));
    this.say(null);
    this.world.canvas.dataset.tool = tool;
    this.show();
  }

  /** Whether there is a corner to take back. */
  get drawing() { return this.#corners.length > 0; }

  /** Takes back the last corner of what is being drawn; says whether there was one. */
  takeBack() {
    if (!this.#corners.length) return false;
    this.#corners.pop();
    this.say(null);
    this.show();
    return true;
  }

  /** In place of what the tool says; null for that. */
  say(text) {
    this.hint.textContent = text ?? help(TOOLS.find(([name]) => name === this.#tool));
    this.hint.hidden = !text && this.#tool === 'look';
  }

  /** Draws what can be dragged, and what is being drawn. */
  show() {
    this.world.handles([...this.#handles().map((handle) => handle.place), ...this.#corners]);
    this.#sketch();
    this.changed();
  }

  /** The sides between the corners there are; and as a band those to the next one and back to the first, or the one that closes it. */
  #sketch() {
    const corners = this.#corners;
    const ends = this.#next ? [this.#next] : corners.length > 2 ? [] : null;
    const band = corners.length && ends ? [corners.at(-1), ...ends, ...(corners.length > 1 ? [corners[0]] : [])] : [];
    this.world.sketch({ sides: this.#draped(corners), band: this.#draped(band) });
  }

  /** A line through places, as it lies on the ground. */
  #draped(places) {
    const { ground } = this.stage;
    return places.slice(1).flatMap((b, k) => {
      const a = places[k];
      return Array.from({ length: PIECES + 1 }, (_, at) => {
        const [x, y] = [a.x + ((b.x - a.x) * at) / PIECES, a.y + ((b.y - a.y) * at) / PIECES];
        return { x, y, z: ground.at(x, y) };
      }).slice(k ? 1 : 0);
    });
  }

  /** Where the next corner would be; null where none would. */
  #wouldBe(place) {
    if (!this.#corners.length || (!place && !this.#next)) return;
    this.#next = place;
    this.#sketch();
  }

  /** Dots of the threat that is chosen: its middle and its radii, or its corners. */
  #handles() {
    const { draft, stage } = this;
    const threat = draft.document?.threats?.[stage.selected];
    if (!threat || !stage.ground) return [];
    const pointer = `/threats/${stage.selected}`;
    const onGround = ({ x, y }) => ({ x, y, z: stage.ground.at(x, y) });
    const [first, second] = axes(draft.document);
    const known = (place) => Number.isFinite(place?.[first]) && Number.isFinite(place?.[second]);
    if (threat.kind === 'polygon') {
      return (threat.vertices ?? []).flatMap((vertex, k) => (known(vertex)
        ? [{ place: onGround(stage.frame.to(vertex)), move: (to) => this.#put(`${pointer}/vertices/${k}`, to) }] : []));
    }
    if (!known(threat.center)) return [];
    const middle = stage.frame.to(threat.center);
    const size = (name) => (to) => {
      const metres = Math.max(1, Math.round(Math.hypot(to.x - middle.x, to.y - middle.y)));
      this.draft.edit((document) => ({
        ...document,
        threats: document.threats.map((one, k) => {
          if (k !== stage.selected) return one;
          const { radius, influence } = radiiOf(one);
          return name === 'radius' ? { ...one, radius: metres, influence: Math.max(metres, influence) } : { ...one, influence: Math.max(metres, radius) };
        }),
      }), this.#gesture());
    };
    const { radius, influence } = radiiOf(threat);
    return [
      { place: onGround(middle), move: (to) => this.#put(`${pointer}/center`, to) },
      { place: onGround({ x: middle.x + radius, y: middle.y }), move: size('radius') },
      { place: onGround({ x: middle.x - influence * 0.7071, y: middle.y - influence * 0.7071 }), move: size('influence') },
    ];
  }

  #ends() {
    const { draft, stage } = this;
    return ['start', 'target'].flatMap((end) => {
      const position = draft.document?.[end];
      if (!axes(draft.document).every((axis) => Number.isFinite(position?.[axis]))) return [];
      const place = stage.frame.to(position);
      const above = stage.heightAbove(end);
      return [{ place, move: (to) => this.#put(`/${end}`, { ...to, z: stage.heightAt(to, above) }, true) }];
    });
  }

  #gesture() { return `drag ${this.#drags}`; }

  #put(pointer, { x, y, z }, high = false) {
    const position = this.stage.frame.from({ x, y, z });
    const [, , third] = axes(this.draft.document);
    if (!high) delete position[third];
    this.draft.set(pointer, written(this.draft.document, position), this.#gesture());
  }

  #pressed(event) {
    if (event.button !== 0) return;
    this.#down = { x: event.offsetX, y: event.offsetY };
    if (this.#tool !== 'look') return;
    const near = [...this.#handles(), ...this.#ends()].map((handle) => {
      const at = this.world.onScreen(handle.place);
      return { handle, off: at ? Math.hypot(at.x - event.offsetX, at.y - event.offsetY) : Infinity };
    }).filter(({ off }) => off <= reach(event)).sort((a, b) => a.off - b.off)[0];
    if (!near) return;
    const from = this.world.onGround(event.offsetX, event.offsetY);
    if (!from) return;
    this.#drags += 1;
    const { place, move } = near.handle;
    this.#drag = { move, dx: place.x - from.x, dy: place.y - from.y };
    this.world.controls.enabled = false;
    this.world.canvas.setPointerCapture(event.pointerId);
  }

  #moved(event) {
    if (this.#drag) {
      const at = this.world.onGround(event.offsetX, event.offsetY);
      if (at) this.#drag.move({ x: at.x + this.#drag.dx, y: at.y + this.#drag.dy });
      return;
    }
    if (event.buttons) return;
    this.pointed({ x: event.offsetX, y: event.offsetY });
    // A finger that is not on the glass is nowhere.
    if (this.#corners.length && event.pointerType !== 'touch') this.#wouldBe(this.world.onGround(event.offsetX, event.offsetY));
  }

  #released(event) {
    if (this.#drag) {
      this.#drop();
      return;
    }
    const still = this.#down && Math.hypot(event.offsetX - this.#down.x, event.offsetY - this.#down.y) <= STILL_PX;
    this.#down = null;
    if (still) this.#clicked(event.offsetX, event.offsetY, reach(event));
  }

  #drop() {
    this.#drag = null;
    this.#down = null;
    this.world.controls.enabled = true;
    this.draft.rest();
  }

  #clicked(px, py, near) {
    if (this.#tool === 'look') {
      this.stage.select(this.world.threatAt(px, py));
      return;
    }
    const place = this.world.onGround(px, py);
    if (!place) return;
    this.#drags += 1;
    if (this.#tool === 'polygon') {
      const first = this.#corners[0] && this.world.onScreen(this.#corners[0]);
      const last = this.#corners.length > 1 && this.world.onScreen(this.#corners.at(-1));
      if (first && Math.hypot(first.x - px, first.y - py) <= near) this.#close();
      // The second click of two in the same place.
      else if (last && Math.hypot(last.x - px, last.y - py) <= STILL_PX) this.#close();
      else {
        this.#corners.push(place);
        this.#next = null;
        this.show();
      }
      return;
    }
    if (this.#tool === 'cylinder') this.stage.addThreat('cylinder', [place]);
    else this.#put(`/${this.#tool}`, { ...place, z: this.stage.heightAt(place, this.stage.heightAbove(this.#tool)) }, true);
    this.draft.rest();
    this.use('look');
  }

  #close() {
    if (this.#corners.length < 3) {
      this.say('A polygon takes three corners.');
      return;
    }
    this.stage.addThreat('polygon', this.#corners);
    this.use('look');
  }
}

const reach = ({ pointerType }) => (pointerType === 'touch' ? NEAR_TOUCH_PX : NEAR_PX);
