// The altitude strip: ground and band along the route, threats that it passes, its waypoints, and the path; and the routes laid over it.

import { eachFrame } from './dom.js';
import { onSchemeChange, palette } from './palette.js';
import { decimalsOf, metres, number, step, threatName } from './words.js';

const SAMPLES = 400;
/** Of threats so many are named in words. */
const NAMED = 5;
/** So wide a stretch has room for a name, in pixels for each of its letters. */
const LETTER_PX = 7;
const LINE_PX = 14;
const ALONE = 'along the route, above the datum';
const TOGETHER = 'ground and band of the route in front; dotted, the ground of the others';
const EDGE = { left: 46, right: 12, top: 10, bottom: 20 };

export class Strip {
  #shown = null;
  #marked = null;
  #draw = eachFrame(() => this.#paint());

  /** `caption` says what is drawn; `pointed(distance)` is told where along the route the pointer is; null where it is not. */
  constructor(canvas, caption, pointed) {
    Object.assign(this, { canvas, caption });
    canvas.addEventListener('pointermove', (event) => {
      const scales = this.#scales();
      if (!scales) return;
      const share = (event.offsetX - EDGE.left) / scales.wide;
      const distance = share * this.#shown.length;
      pointed(distance >= 0 && distance <= this.#shown.route.length ? distance : null);
    });
    canvas.addEventListener('pointerleave', () => pointed(null));
    new ResizeObserver(() => this.#draw()).observe(canvas);
    onSchemeChange(() => this.#draw());
  }

  /**
   * `route` is a `Way`, `below(distance)` has the ground under it as `z`; `dots` the waypoints on it; `band` heights above ground, or
   * null; `passed` what `passes` finds; `others` routes with a `name`, `color`, `way` and `below`.
   */
  show(shown) {
    if (!shown) {
      this.#shown = null;
      this.canvas.setAttribute('aria-label', 'No route yet');
    } else {
      const { route, below } = shown;
      const others = shown.others.map((other) => ({ ...other, profile: profileOf(other.way, other.below) }));
      const length = [route, ...others.map(({ way }) => way)].reduce((most, way) => Math.max(most, way.length), 1e-9);
      this.#shown = { ...shown, others, length, profile: profileOf(route, below) };
      this.canvas.setAttribute('aria-label', inWords(this.#shown));
    }
    this.caption.textContent = shown?.others.length ? TOGETHER : ALONE;
    this.#draw();
  }

  /** Marks a distance along the route. */
  mark(distance) {
    this.#marked = distance;
    this.#draw();
  }

  #scales() {
    if (!this.#shown) return null;
    const { profile, route, band, others, length } = this.#shown;
    const heights = [route.least, route.greatest, ...others.flatMap((other) => [other.way.least, other.way.greatest])];
    let [low, high] = [Infinity, -Infinity];
    for (const { z } of profile) {
      low = Math.min(low, z);
      high = Math.max(high, z + (band ? Math.min(band.max, 4 * (route.greatest - route.least) + band.min + 50) : 0));
    }
    for (const { z } of others.flatMap((other) => other.profile)) low = Math.min(low, z);
    low = Math.min(low, ...heights);
    high = Math.max(high, ...heights);
    const room = Math.max((high - low) * 0.06, 1);
    [low, high] = [low - room, high + room];
    const [wide, tall] = [this.canvas.clientWidth - EDGE.left - EDGE.right, this.canvas.clientHeight - EDGE.top - EDGE.bottom];
    return { low, high, wide, tall, x: (s) => EDGE.left + (s / length) * wide, y: (z) => EDGE.top + tall * (1 - (z - low) / (high - low)) };
  }

  #paint() {
    const { canvas } = this;
    const ratio = devicePixelRatio;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
    const scales = this.#scales();
    const colours = palette();
    pen.font = '11px ui-sans-serif, system-ui, sans-serif';
    if (!scales || scales.wide < 40) {
      pen.fillStyle = colours.faint;
      pen.textAlign = 'left';
      pen.textBaseline = 'middle';
      pen.fillText('The profile of the route appears here once there is one.', EDGE.left, canvas.clientHeight / 2);
      return;
    }
    this.#axes(pen, scales, colours);
    const { profile, route, band, dots, others, color, faults } = this.#shown;
    pen.save();
    pen.beginPath();
    pen.rect(EDGE.left, EDGE.top - 6, scales.wide, scales.tall + 6);
    pen.clip();
    if (band) {
      trace(pen, profile.map(({ s, z }) => [scales.x(s), scales.y(z + band.max)]));
      for (const { s, z } of [...profile].reverse()) pen.lineTo(scales.x(s), scales.y(z + band.min));
      fill(pen, colours.band);
    }
    this.#threats(pen, scales, colours);
    trace(pen, profile.map(({ s, z }) => [scales.x(s), scales.y(z)]));
    pen.lineTo(scales.x(profile.at(-1).s), scales.y(scales.low));
    pen.lineTo(scales.x(0), scales.y(scales.low));
    fill(pen, colours.ground);
    this.#names(pen, scales, colours);
    for (const other of others) {
      trace(pen, other.profile.map(({ s, z }) => [scales.x(s), scales.y(z)]));
      pen.setLineDash([1, 4]);
      stroke(pen, other.color, 1);
      pen.setLineDash([]);
      trace(pen, other.way.points.map(({ z }, k) => [scales.x(other.way.flown[k]), scales.y(z)]));
      stroke(pen, other.color, 1.5);
    }
    trace(pen, route.points.map(({ z }, k) => [scales.x(route.flown[k]), scales.y(z)]));
    stroke(pen, color, 2);
    pen.restore();
    for (const { s, z } of dots) dot(pen, scales.x(s), scales.y(z), 3, '#fff', color);
    for (const { s, z } of faults) dot(pen, scales.x(s), scales.y(z), 6, colours.fault, '#fff');
    if (this.#marked !== null) {
      const { z } = route.at(this.#marked);
      trace(pen, [[scales.x(this.#marked), EDGE.top], [scales.x(this.#marked), EDGE.top + scales.tall]]);
      stroke(pen, colours.faint, 1);
      dot(pen, scales.x(this.#marked), scales.y(z), 5, color, colours.ink);
    }
  }

  /** From base to top where the route's place on the map is within: what it is beside, over or under there. */
  #threats(pen, { low, high, x, y }, colours) {
    for (const { threat, core, from, to } of this.#shown.passed) {
      const [left, wide] = [x(from), Math.max(x(to) - x(from), 1.5)];
      const { top, bottom } = between(threat, low, high, y);
      pen.fillStyle = core ? colours.core : colours.zone;
      pen.globalAlpha = core ? 0.24 : 0.13;
      pen.fillRect(left, top, wide, bottom - top);
      pen.globalAlpha = 0.9;
      for (const limit of [threat.base, threat.top]) if (limit !== null && limit > low && limit < high) pen.fillRect(left, y(limit) - 0.5, wide, 1);
      pen.globalAlpha = 1;
    }
  }

  /** Each threat's once, where its widest stretch has room for it. */
  #names(pen, { low, high, x, y }, colours) {
    const widest = new Map();
    for (const { threat, from, to } of this.#shown.passed) if (!(widest.get(threat)?.wide >= to - from)) widest.set(threat, { from, wide: to - from });
    Object.assign(pen, { fillStyle: colours.ink, textAlign: 'left', textBaseline: 'top' });
    for (const [threat, { from, wide }] of widest) {
      const name = threatName(threat, threat.index);
      const { top, bottom } = between(threat, low, high, y);
      const ground = this.#shown.below(from + wide / 2).z;
      if (Math.min(bottom, y(ground)) - top > LINE_PX && x(from + wide) - x(from) > name.length * LETTER_PX) pen.fillText(name, x(from) + 3, top + 3);
    }
  }

  #axes(pen, { low, high, wide, tall, x, y }, colours) {
    pen.fillStyle = colours.faint;
    pen.textAlign = 'right';
    pen.textBaseline = 'middle';
    const rise = step(high - low, 4);
    for (let z = Math.ceil(low / rise) * rise; z <= high; z += rise) {
      trace(pen, [[EDGE.left, y(z)], [EDGE.left + wide, y(z)]]);
      stroke(pen, colours.line, 1);
      pen.fillText(number(z, decimalsOf(rise)), EDGE.left - 6, y(z));
    }
    pen.textAlign = 'center';
    pen.textBaseline = 'top';
    const { length } = this.#shown;
    const far = length >= 10000;
    const way = step(length, Math.max(3, wide / 110));
    for (let s = 0; s <= length; s += way) {
      pen.fillText(far ? `${+(s / 1000).toFixed(2)} km` : `${number(s, decimalsOf(way))} m`, Math.max(x(s), EDGE.left + 8), EDGE.top + tall + 5);
    }
  }
}

/** Where base and top of a threat are on the canvas, as far as they are on it. */
function between({ base, top }, low, high, y) {
  const within = (z) => y(Math.min(Math.max(z, low), high));
  return { top: within(top ?? high), bottom: within(base ?? low) };
}

/** The ground below a way, at places evenly spaced along it. */
function profileOf(way, below) {
  return Array.from({ length: SAMPLES + 1 }, (_, k) => {
    const s = (way.length * k) / SAMPLES;
    return { s, z: below(s).z };
  });
}

function inWords({ route, profile, passed, others }) {
  const [low, high] = [Math.min(...profile.map((p) => p.z)), Math.max(...profile.map((p) => p.z))];
  const heights = (way) => `from ${number(way.least, 0)} to ${number(way.greatest, 0)} m`;
  const laid = others.map(({ name, way }) => `; laid over, ${name}, ${metres(way.length)}, ${heights(way)}`);
  const names = [...new Set(passed.map(({ threat }) => threat))].map((threat) => threatName(threat, threat.index));
  const more = names.length > NAMED ? ` and ${names.length - NAMED} more` : '';
  const past = names.length ? `; beside, over or under ${names.slice(0, NAMED).join(', ')}${more}` : '';
  return `Altitude along ${metres(route.length)}: ground from ${number(low, 0)} to ${number(high, 0)} m, route ${heights(route)}${past}${laid.join('')}`;
}

function trace(pen, points) {
  pen.beginPath();
  points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
}

function stroke(pen, color, width) {
  pen.strokeStyle = color;
  pen.lineWidth = width;
  pen.lineJoin = 'round';
  pen.stroke();
}

function fill(pen, color) {
  pen.closePath();
  pen.fillStyle = color;
  pen.fill();
}

function dot(pen, x, y, radius, color, rim) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 7);
  pen.fillStyle = color;
  pen.fill();
  stroke(pen, rim, 1.5);
}
