// A route as a way: how far along it each of its places lies, over ground.

/** Of more points than this no eye can tell the line from that of fewer. */
const MOST_DRAWN = 600;
/** Cosine of the bend that is left out at most. */
const BEND = Math.cos(Math.PI / 60);

export class Way {
  #drawn = null;

  constructor(points) {
    this.points = points;
    this.flown = [0];
    for (let k = 1; k < points.length; k += 1) {
      this.flown.push(this.flown[k - 1] + Math.hypot(points[k].x - points[k - 1].x, points[k].y - points[k - 1].y));
    }
    this.length = this.flown.at(-1) ?? 0;
    const heights = points.map((p) => p.z);
    this.least = heights.reduce((a, b) => Math.min(a, b), Infinity);
    this.greatest = heights.reduce((a, b) => Math.max(a, b), -Infinity);
  }

  /** Its points as far as its line needs them, which without a graphics processor takes long to draw. */
  get drawn() {
    this.#drawn ??= thinned(this.points);
    return this.#drawn;
  }

  /** The points `low` and `high` between which the place so far along it lies, and its share `t` of the way from one to the other. */
  locate(distance) {
    const { points, flown } = this;
    let [low, high] = [0, points.length - 1];
    while (high - low > 1) {
      const half = (low + high) >> 1;
      if (flown[half] <= distance) low = half;
      else high = half;
    }
    const leg = flown[high] - flown[low];
    return { low, high, t: leg > 0 ? Math.min(Math.max((distance - flown[low]) / leg, 0), 1) : 0 };
  }

  /** The place so far along it. */
  at(distance) {
    const { low, high, t } = this.locate(distance);
    const [a, b] = [this.points[low], this.points[high]];
    return { x: a.x + (b.x - a.x) * t, y: a.y + (b.y - a.y) * t, z: a.z + (b.z - a.z) * t };
  }

  /** How far along it lies what is nearest to a place, and how far off that is. */
  nearest({ x, y }) {
    let [best, off] = [0, Infinity];
    for (let k = 0; k + 1 < this.points.length; k += 1) {
      const [a, b] = [this.points[k], this.points[k + 1]];
      const [dx, dy] = [b.x - a.x, b.y - a.y];
      const square = dx * dx + dy * dy;
      const t = square > 0 ? Math.min(Math.max(((x - a.x) * dx + (y - a.y) * dy) / square, 0), 1) : 0;
      const gap = Math.hypot(a.x + dx * t - x, a.y + dy * t - y);
      if (gap < off) [best, off] = [this.flown[k] + t * Math.sqrt(square), gap];
    }
    return { distance: best, off };
  }
}

/** Both ends and every so many between them, and more where the route bends. */
function thinned(points) {
  const every = Math.ceil(points.length / MOST_DRAWN);
  if (every === 1) return points;
  const kept = [points[0]];
  let [last, heading] = [0, towards(points[0], points[1])];
  for (let k = 1; k + 1 < points.length; k += 1) {
    const next = towards(points[k], points[k + 1]);
    const cosine = next.reduce((sum, part, axis) => sum + part * heading[axis], 0);
    if (k - last < every && cosine >= BEND) continue;
    kept.push(points[k]);
    [last, heading] = [k, next];
  }
  return [...kept, points.at(-1)];
}

function towards(a, b) {
  const way = [b.x - a.x, b.y - a.y, b.z - a.z];
  const length = Math.hypot(...way) || 1;
  return way.map((part) => part / length);
}
