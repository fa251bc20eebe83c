// What is shown: the draft's ground and threats, and on them the route of the plan in front and of those laid over it.

import { ask } from './api.js';
import { beneath, sameGround } from './beneath.js';
import { describe } from './describe.js';
import { atMost, eachFrame } from './dom.js';
import { axes, frameOf } from './frame.js';
import { extentOf, groundOf, isOf } from './ground.js';
import { palette } from './palette.js';
import { passes } from './passes.js';
import { ceilingOf, threatsOf } from './volumes.js';
import { Way } from './way.js';

const SAMPLES = 201;
const NEAR_PX = 24;
/** Nobody reads a chart faster. */
const CHART_MS = 150;

export class Stage {
  frame = null;
  ground = null;
  selected = null;
  /** The plan in front. */
  plan = null;
  /** Plans laid over it, by id: `{plan, color}`. */
  compared = new Map();
  #groundKey = null;
  #scenery = null;
  #sampled = null;
  /** The dataset that the camera has been turned to. */
  #framed = null;
  #threats = [];
  #passes = {};
  #trailed = null;
  #ways = new WeakMap();
  #scrubbed = null;
  #faded = null;
  #fault = null;
  #fresh = true;

  /** Parts: `world` (null without WebGL), `strip`, `chart`, `draft`; `acts` has `selected(index)` and `legMarked(k)`. */
  constructor(parts, acts) {
    Object.assign(this, parts);
    this.acts = acts;
    this.redraw = eachFrame(() => this.#draw());
    this.drawSearch = atMost(CHART_MS, () => this.#drawSearch());
    this.draft.addEventListener('change', ({ detail }) => {
      if (detail.why === 'replaced') {
        this.frame = null;
        this.#framed = null;
        this.#fresh = true;
        this.selected = null;
      }
      this.redraw();
    });
    if (this.world) this.world.repaint = () => this.redraw();
  }

  /** Turns the camera to the whole at the next drawing. */
  reframe() {
    this.#fresh = true;
    this.redraw();
  }

  /** Puts a plan in front; null for none. */
  front(plan) {
    this.plan = plan;
    this.#scrubbed = null;
    this.#fault = null;
    this.#trailed = null;
    this.#faded = null;
    this.world?.past(null);
    this.mark(null);
    this.redraw();
    this.drawSearch();
  }

  /** Chooses a threat; null for none. */
  select(index) {
    this.selected = this.draft.document?.threats?.[index] ? index : null;
    this.acts.selected(this.selected);
    this.redraw();
  }

  addThreat(kind, places) {
    const [first, second] = axes(this.draft.document);
    const plane = (place) => {
      const p = this.frame.from({ ...place, z: 0 });
      const scale = this.frame.geodetic ? 1e6 : 10;
      return { [first]: Math.round(p[first] * scale) / scale, [second]: Math.round(p[second] * scale) / scale };
    };
    const { min, max } = this.ground.extent;
    const size = Number((Math.max(max.x - min.x, max.y - min.y) / 16).toPrecision(2));
    const threat = kind === 'polygon'
      ? { kind, name: null, vertices: places.map(plane), margin: Math.round(size / 2), base: null, top: null }
      : { kind, name: null, center: plane(places[0]), radius: size, influence: Math.round(size * 1.5), base: null, top: null };
    const index = this.draft.document.threats?.length ?? 0;
    this.draft.edit((document) => ({ ...document, threats: [...(document.threats ?? []), threat] }));
    this.draft.rest();
    this.select(index);
  }

  /** The middle of what is drawn. */
  middle() {
    const { min, max } = this.ground.extent;
    return { x: (min.x + max.x) / 2, y: (min.y + max.y) / 2 };
  }

  /** How high above ground an end stands now, or would. */
  heightAbove(end) {
    const [, , third] = axes(this.draft.document);
    const position = this.draft.document[end];
    if (!Number.isFinite(position?.[third])) return 0;
    const { x, y, z } = this.frame.to(position);
    if (!Number.isFinite(x) || z <= (this.ground.around?.(x, y) ?? -Infinity)) return 0;
    return Math.max(0, z - this.ground.at(x, y));
  }

  /** So high above ground at a place; no lower than the ground is drawn around it, which between its nodes is not known. */
  heightAt({ x, y }, above) {
    return Math.max(this.ground.at(x, y) + above, this.ground.around?.(x, y) ?? -Infinity);
  }

  /** What the service knows of a dataset's ground, so that it can be drawn: under the area of a validated scenario, which the draft need not have; without one, where the service would plan. */
  async sample(scenario, signal) {
    const { terrain, area } = scenario;
    if (terrain?.kind !== 'dataset') return;
    const key = JSON.stringify([terrain, area ?? scenario]);
    if (this.#sampled?.key !== key) {
      const ground = await ask(`/scenarios:ground?columns=${SAMPLES}&rows=${SAMPLES}`, { method: 'POST', body: scenario, signal });
      this.#sampled = { key, name: terrain.name, ground };
      this.#groundKey = null;
      // Where the area follows what is dragged, the camera stays where it is.
      this.#fresh ||= this.#framed !== terrain.name;
      this.redraw();
    }
    this.#framed = terrain.name;
  }

  /** What is known of the ground of a document: no other dataset's, and none of another place. */
  #sampledFor(document) {
    const { name, ground } = this.#sampled ?? {};
    return ground && name === document.terrain?.name && isOf(ground.area, document, this.frame) ? ground : null;
  }

  /** The plan's route in metres: its path, or its waypoints, or the best so far. */
  wayOf(plan) {
    const route = plan.result ? (plan.result.path?.points ?? plan.result.waypoints) : plan.latest?.waypoints;
    return this.#way(route);
  }

  #way(route) {
    if (!route || !this.frame || (('lat' in route[0]) !== this.frame.geodetic)) return null;
    const known = this.#ways.get(route);
    if (known?.frame === this.frame) return known.way;
    const way = new Way(route.map(this.frame.to));
    this.#ways.set(route, { frame: this.frame, way });
    return way;
  }

  /** The ground below a plan's route: see `beneath`. */
  #below(plan, way) {
    return beneath(way, this.ground, plan.above && sameGround(this.draft.document, plan.scenario) ? plan.above : null);
  }

  /** What a way passes, looked for once. */
  #passed(way) {
    const known = this.#passes;
    if (known.way !== way || known.threats !== this.#threats) this.#passes = { way, threats: this.#threats, found: passes(way, this.#threats) };
    return this.#passes.found;
  }

  #waypoints(plan) {
    return this.#way(plan.result?.waypoints ?? plan.latest?.waypoints);
  }

  #draw() {
    const { document } = this.draft;
    if (!document) return;
    this.frame = frameOf(document, this.frame);
    const key = [document.terrain, this.frame, JSON.stringify(extentOf(document, this.frame)), this.#sampled];
    if (!this.#groundKey || key.some((part, at) => part !== this.#groundKey[at])) {
      this.ground = groundOf(document, this.frame, this.#sampledFor(document));
      this.#groundKey = key;
    }
    // An incumbent moves nothing but the route.
    const scenery = [document, this.ground, this.selected, this.world?.colours];
    const moved = this.#fresh || !this.#scenery || scenery.some((part, at) => part !== this.#scenery[at]);
    this.#scenery = scenery;
    if (moved) this.#threats = threatsOf(document, this.frame, this.ground);
    if (this.world && moved) {
      const ceiling = ceilingOf(document, this.ground);
      if (this.#fresh) this.world.exaggeration = this.exaggerate?.(this.ground, ceiling) ?? 1;
      this.world.show(this.ground, this.#threats, ceiling, this.#fresh);
      this.#fresh = false;
      this.#drawEnds(document);
      this.tools?.show();
    }
    this.#drawRoutes();
  }

  #drawEnds(document) {
    const lift = 0;
    const labels = [];
    const ends = {};
    for (const end of ['start', 'target']) {
      const position = document[end];
      if (!axes(document).every((axis) => Number.isFinite(position?.[axis]))) continue;
      const place = this.frame.to(position);
      ends[end] = place;
      labels.push({ place: { ...place, z: place.z + lift }, text: end === 'start' ? 'Start' : 'Target', kind: `end ${end}` });
    }
    this.world.ends(ends);
    const named = this.#threats.map((threat) => ({
      place: { ...(threat.center ?? middleOf(threat.ring)), z: threat.high },
      text: threat.name || `threat ${threat.index}`,
      kind: threat.index === this.selected ? 'threat chosen' : 'threat',
    }));
    this.world.labels.set([...labels, ...named]);
  }

  #drawRoutes() {
    const colours = palette();
    const { plan } = this;
    const way = plan ? this.wayOf(plan) : null;
    const waypoints = plan ? this.#waypoints(plan) : null;
    const broken = plan?.result && !plan.result.feasible;
    const color = broken ? colours.fault : colours.route;
    const others = [...this.compared.values()].flatMap((other) => {
      const path = this.wayOf(other.plan);
      return path ? [{ way: path, below: this.#below(other.plan, path), color: other.color, name: other.name, id: other.plan.id }] : [];
    });
    if (this.world) {
      if (plan && !plan.result && plan.latest && this.#trailed !== plan.latest) {
        if (this.#trailed) this.world.past(this.#way(this.#trailed.waypoints)?.points, colours.route);
        this.#trailed = plan.latest;
      }
      const lines = new Map();
      for (const other of others) lines.set(other.id, { points: other.way.drawn, color: other.color, width: 2.5 });
      // Where a route enters what it must not, it is inside of it, and has to be seen.
      if (way) lines.set('route', { points: way.drawn, color, width: 4, through: broken ? 0.9 : undefined });
      if (this.#scrubbed) lines.set('then', { points: this.#scrubbed.points, color: colours.mean, width: 2.5 });
      this.world.routes(lines);
      this.world.dress(waypoints?.points.slice(1, -1) ?? [], way?.drawn ?? null, color);
      this.world.faults(this.#faultPlaces(waypoints).map(({ place }) => place));
      this.world.canvas.setAttribute('aria-label', describe({ document: this.draft.document, ground: this.ground, threats: this.#threats, plan, way, compared: others.length }));
    }
    const { min, max } = this.draft.document.altitude ?? {};
    this.strip.show(way && {
      route: way, below: this.#below(plan, way), passed: this.#passed(way), color, others,
      faults: this.#faultPlaces(waypoints).map(({ s, place }) => ({ s, z: place.z })),
      band: Number.isFinite(min) && Number.isFinite(max) ? { min, max } : null,
      dots: waypoints ? waypoints.points.map((point, k) => ({ s: plan.result?.path ? way.nearest(point).distance : waypoints.flown[k], z: point.z })) : [],
    });
  }

  #drawSearch() {
    const { plan } = this;
    this.chart.show({
      points: plan?.points ?? [],
      bound: plan?.result?.bound.lower ?? null,
      color: palette().route,
      others: [...this.compared.values()].map((other) => ({ name: other.name, points: other.plan.points, color: other.color })),
    });
  }

  /** Marks the place so far along the route in scene and strip, and its leg in the table. */
  mark(distance) {
    const way = this.plan && this.wayOf(this.plan);
    const place = way && distance !== null ? way.at(distance) : null;
    this.world?.mark(place);
    this.strip.mark(place ? distance : null);
    this.acts.marked(place && { ...place, distance, ground: this.#below(this.plan, way)(distance) });
    const waypoints = place && this.#waypoints(this.plan);
    this.acts.legMarked(waypoints ? legOf(waypoints, waypoints.nearest(place).distance) : null);
  }

  /** Marks the middle of a leg. */
  markLeg(k) {
    const waypoints = this.plan && this.#waypoints(this.plan);
    const way = this.plan && this.wayOf(this.plan);
    if (k === null || !waypoints) {
      this.mark(null);
      return;
    }
    this.mark(way.nearest(waypoints.at((waypoints.flown[k] + waypoints.flown[k + 1]) / 2)).distance);
  }

  /** Where the pointer is in the scene; marks the route near it. */
  pointAt(pixel) {
    const way = this.plan && this.wayOf(this.plan);
    if (!pixel || !way) {
      this.mark(null);
      return;
    }
    let [best, off] = [null, NEAR_PX];
    const parts = Math.min(400, way.points.length * 20);
    for (let k = 0; k <= parts; k += 1) {
      const s = (way.length * k) / parts;
      const at = this.world.onScreen(way.at(s));
      const gap = at ? Math.hypot(at.x - pixel.x, at.y - pixel.y) : Infinity;
      if (gap < off) [best, off] = [s, gap];
    }
    this.mark(best);
  }

  /** Shows the best route as it was at an iteration, and fainter the incumbents of `trail`; null for now. */
  scrub(iteration, trail = []) {
    const then = iteration === null ? null : this.plan?.incumbents.filter((one) => one.iteration <= iteration).at(-1);
    if (this.world && this.plan?.result) this.#trace(trail);
    const way = then ? this.#way(then.waypoints) : null;
    if (way === this.#scrubbed) return;
    this.#scrubbed = way;
    this.redraw();
  }

  #trace(trail) {
    const faded = trail.at(-1) ?? null;
    if (faded === this.#faded) return;
    const from = trail.indexOf(this.#faded) + 1;
    if (!from) this.world.past(null);
    for (const one of trail.slice(from)) this.world.past(this.#way(one.waypoints)?.points ?? null, palette().route);
    this.#faded = faded;
  }

  /** Brings one violation forward. */
  place(violation) {
    this.#fault = violation;
    const waypoints = this.#waypoints(this.plan);
    const found = this.#locate(violation, waypoints);
    this.#drawRoutes();
    if (found) {
      this.mark(found.s);
      this.world?.canvas.scrollIntoView({ block: 'nearest' });
    }
  }

  #faultPlaces(waypoints) {
    const violations = this.plan?.result?.checks.violations ?? [];
    if (!waypoints) return [];
    return (this.#fault ? [this.#fault] : violations).flatMap((violation) => this.#locate(violation, waypoints) ?? []);
  }

  /** Where a violation is: nearest to the threat on its leg, or where the leg turns, or its middle. */
  #locate({ kind, where, message }, waypoints) {
    const [, what, digits] = where.match(/^(leg|waypoint) (\d+)$/) ?? [];
    if (!what) return null;
    const k = Number(digits);
    const { points, flown } = waypoints;
    if (!points[k + (what === 'leg' ? 1 : 0)]) return null;
    let s = what === 'waypoint' || kind === 'turn' ? flown[k] : (flown[k] + flown[k + 1]) / 2;
    const [, number] = message.match(/enters threat (\d+)/) ?? [];
    const threat = number && this.#threats.find((one) => one.index === Number(number));
    if (threat) s = flown[k] + new Way([points[k], points[k + 1]]).nearest(threat.center ?? middleOf(threat.ring)).distance;
    if (kind === 'terrain' || kind === 'altitude') s = this.#worst(waypoints, flown[k], flown[k + 1]) ?? s;
    return { s, place: waypoints.at(s) };
  }

  /** Between two distances, where the band is left farthest. */
  #worst(way, from, to) {
    const { min = 0, max = Infinity } = this.draft.document.altitude ?? {};
    let [best, most] = [null, 0];
    for (let k = 0; k <= 60; k += 1) {
      const s = from + ((to - from) * k) / 60;
      const { x, y, z } = way.at(s);
      const above = z - this.ground.at(x, y);
      const beyond = Math.max(min - above, above - max);
      if (beyond > most) [best, most] = [s, beyond];
    }
    return best;
  }
}

const middleOf = (ring) => ({ x: ring.reduce((sum, p) => sum + p.x, 0) / ring.length, y: ring.reduce((sum, p) => sum + p.y, 0) / ring.length });

/** The leg that lies so far along. */
function legOf({ flown }, distance) {
  const next = flown.findIndex((s) => s > distance);
  return Math.max(0, (next === -1 ? flown.length - 1 : next) - 1);
}
