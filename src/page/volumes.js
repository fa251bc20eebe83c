// Threats in the scene: a core that is never entered and a soft zone that costs, from base to top.

import {
  BufferAttribute, BufferGeometry, Group, InstancedMesh, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial, ShapeUtils, Vector2,
} from './vendor/three.js';
import { finite, radiiOf } from './sizes.js';

const ROUND = 48;
/** From so many threats on, they are drawn with fewer sides. */
const MANY = 60;
// Where the light comes from, seen from above.
const SUN = Math.PI * 0.75;
const ARC = Math.PI / 10;
// All is seen through; then cores leave their depths, so that a route behind one is drawn faintly.
const ORDER = { cores: 2, zones: 3, 'core outlines': 4, 'zone outlines': 4, 'core depths': 4.5 };

/** Draws threats, given in metres of the frame, into a group. */
export class Volumes {
  group = new Group();
  #many = false;
  #fine = prism(circle({ x: 0, y: 0 }, 1, ROUND), 0, 1);
  #coarse = prism(circle({ x: 0, y: 0 }, 1, ROUND / 2), 0, 1);
  #plain = prism(circle({ x: 0, y: 0 }, 1, ROUND / 4), 0, 1);

  /** Whether they are in motion where that is hard: many have fewer sides then, no outlines, and hide nothing. */
  set coarse(yes) {
    if (!this.#many) return;
    for (const child of this.group.children) {
      if (child.isInstancedMesh) child.geometry = yes ? this.#plain : this.#coarse;
      if (child.isLineSegments || child.name === 'core depths') child.visible = !yes;
    }
  }

  /** `threats` as `threatsOf` gives them. */
  draw(threats, ground, colours) {
    this.clear();
    this.#many = threats.length > MANY;
    const round = threats.filter((threat) => threat.center);
    if (round.length) {
      this.#cylinders('cores', round, (threat) => threat.radius, solid(colours.core));
      this.#cylinders('zones', round.filter((threat) => threat.influence > threat.radius), (threat) => threat.influence, soft(colours.zone));
    }
    for (const threat of threats.filter((one) => one.ring)) {
      this.#prism('cores', threat, threat.ring, solid(colours.core));
      if (threat.margin > 0) this.#prism('zones', threat, widened(threat.ring, threat.margin), soft(colours.zone));
    }
    this.#footprints(threats, ground, colours);
  }

  clear() {
    for (const child of [...this.group.children]) {
      if (!child.isInstancedMesh) child.geometry.dispose();
      child.material.dispose();
      child.dispose?.();
      this.group.remove(child);
    }
  }

  #cylinders(name, threats, radius, material) {
    if (!threats.length) {
      material.dispose();
      return;
    }
    const mesh = new InstancedMesh(this.#many ? this.#coarse : this.#fine, material, threats.length);
    const matrix = new Matrix4();
    threats.forEach((threat, at) => {
      const r = radius(threat);
      matrix.makeScale(r, r, threat.high - threat.low).setPosition(threat.center.x, threat.center.y, threat.low);
      mesh.setMatrixAt(at, matrix);
    });
    mesh.frustumCulled = false;
    if (name === 'cores') {
      const hiding = new InstancedMesh(mesh.geometry, hidden(), threats.length);
      hiding.instanceMatrix = mesh.instanceMatrix;
      hiding.frustumCulled = false;
      this.#add('core depths', hiding);
    }
    this.#add(name, mesh);
  }

  #prism(name, threat, ring, material) {
    const geometry = prism(ring, threat.low, threat.high);
    if (name === 'cores') this.#add('core depths', new Mesh(geometry, hidden()));
    this.#add(name, new Mesh(geometry, material));
  }

  #add(name, mesh) {
    mesh.name = name;
    mesh.renderOrder = ORDER[name];
    this.group.add(mesh);
  }

  /** The outlines on the ground, and those of the cores at their tops. */
  #footprints(threats, ground, colours) {
    const [cores, zones] = [[], []];
    const many = this.#many;
    const sides = many ? 20 : 64;
    for (const threat of threats) {
      const ring = threat.ring ?? circle(threat.center, threat.radius, sides);
      const lift = (ground.extent.max.x - ground.extent.min.x) / 2000;
      outline(cores, ring, ({ x, y }) => ground.at(x, y) + lift);
      if (!many) outline(cores, ring, () => threat.high);
      if (threat.low > ground.least) outline(cores, ring, () => threat.low);
      const wide = threat.ring ? (threat.margin > 0 ? widened(threat.ring, threat.margin) : null) : threat.influence > threat.radius && circle(threat.center, threat.influence, sides);
      if (wide) outline(zones, wide, ({ x, y }) => ground.at(x, y) + lift);
    }
    for (const [name, coordinates, color, opacity] of [['core outlines', cores, colours.core, 0.9], ['zone outlines', zones, colours.zone, 0.75]]) {
      if (!coordinates.length) continue;
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(new Float32Array(coordinates), 3));
      const lines = new LineSegments(geometry, new LineBasicMaterial({ color, transparent: true, opacity, depthWrite: false }));
      this.#add(name, lines);
    }
  }
}

const solid = (color) => new MeshBasicMaterial({ color, vertexColors: true, transparent: true, opacity: 0.66, depthWrite: false });
const hidden = () => new MeshBasicMaterial({ colorWrite: false, transparent: true });
const soft = (color) => new MeshBasicMaterial({ color, transparent: true, opacity: 0.16, depthWrite: false });

/** Walls and a lid over a ring, seen from outside, lighter where the sun is. */
function prism(ring, low, high) {
  const corners = ring.map(({ x, y }) => new Vector2(x, y));
  if (ShapeUtils.isClockWise(corners)) corners.reverse();
  const [positions, colors] = [[], []];
  const shade = (light) => colors.push(light, light, light);
  corners.forEach((a, at) => {
    const b = corners[(at + 1) % corners.length];
    positions.push(a.x, a.y, low, b.x, b.y, low, b.x, b.y, high, a.x, a.y, low, b.x, b.y, high, a.x, a.y, high);
    // The outward normal is to the right of a wall that runs counter-clockwise.
    const light = 0.72 + 0.2 * Math.cos(Math.atan2(a.x - b.x, b.y - a.y) - SUN);
    for (let corner = 0; corner < 6; corner += 1) shade(light);
  });
  for (const face of ShapeUtils.triangulateShape(corners, [])) {
    for (const corner of face) {
      positions.push(corners[corner].x, corners[corner].y, high);
      shade(1.1);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute('color', new BufferAttribute(new Float32Array(colors), 3));
  return geometry;
}

/** Threats of a document in metres of the frame: `base` and `top`, null for none, and `low` and `high` between which they are drawn. */
export function threatsOf(document, frame, ground) {
  const ceiling = ceilingOf(document, ground);
  const drawn = [];
  (document.threats ?? []).forEach((threat, index) => {
    const base = Number.isFinite(threat.base) ? threat.base : ground.least;
    const top = Number.isFinite(threat.top) ? threat.top : ceiling;
    // Above all that is drawn it would be out of sight, and its outlines on the ground look like a threat there.
    const low = Math.min(base, ceiling);
    const common = { index, name: threat.name, base: limit(threat.base), top: limit(threat.top), low, high: Math.max(base < ceiling ? top : ceiling, low + 1e-3) };
    if (threat.kind === 'polygon') {
      const ring = (threat.vertices ?? []).filter(isPlace).map(frame.to);
      if (ring.length >= 3) drawn.push({ ...common, ring, margin: finite(threat.margin), center: null });
    } else if (isPlace(threat.center) && radiiOf(threat).radius > 0) {
      drawn.push({ ...common, center: frame.to(threat.center), ...radiiOf(threat) });
    }
  });
  return drawn;
}

const limit = (height) => (Number.isFinite(height) ? height : null);

/** Up to where a threat without a top is drawn. */
export function ceilingOf(document, ground) {
  const band = document.altitude?.max;
  const ends = [document.start, document.target].map((end) => end?.z ?? end?.alt).filter(Number.isFinite);
  return Math.max(ground.greatest + (Number.isFinite(band) ? band : 100), ...ends) + 0.02 * (ground.greatest - ground.least);
}

const isPlace = (place) => ['x', 'lat'].some((axis) => Number.isFinite(place?.[axis])) && ['y', 'lon'].some((axis) => Number.isFinite(place?.[axis]));

/** A circle as a ring of places. */
export function circle(center, radius, sides = 64) {
  return Array.from({ length: sides }, (_, at) => {
    const angle = (2 * Math.PI * at) / sides;
    return { x: center.x + radius * Math.cos(angle), y: center.y + radius * Math.sin(angle) };
  });
}

/** The ring moved outwards by `margin`, with round corners. */
export function widened(ring, margin) {
  const points = ShapeUtils.isClockWise(ring.map(({ x, y }) => new Vector2(x, y))) ? [...ring].reverse() : ring;
  const wide = [];
  points.forEach((b, at) => {
    const a = points[(at + points.length - 1) % points.length];
    const c = points[(at + 1) % points.length];
    // Headings of the outward normals: the ring runs counter-clockwise, so they point to its right.
    const before = Math.atan2(-(b.x - a.x), b.y - a.y);
    const after = Math.atan2(-(c.x - b.x), c.y - b.y);
    let turn = after - before;
    while (turn <= -Math.PI) turn += 2 * Math.PI;
    while (turn > Math.PI) turn -= 2 * Math.PI;
    if (turn < 0) {
      const half = before + turn / 2;
      const reach = margin / Math.max(Math.cos(turn / 2), 0.2);
      wide.push({ x: b.x + reach * Math.cos(half), y: b.y + reach * Math.sin(half) });
      return;
    }
    const steps = Math.max(1, Math.ceil(turn / ARC));
    for (let k = 0; k <= steps; k += 1) {
      const angle = before + (turn * k) / steps;
      wide.push({ x: b.x + margin * Math.cos(angle), y: b.y + margin * Math.sin(angle) });
    }
  });
  return wide;
}

/** The ring as pieces, its long sides cut so that they follow what `height` says. */
function outline(into, ring, height) {
  ring.forEach((a, at) => {
    const b = ring[(at + 1) % ring.length];
    const cuts = ring.length < 20 ? 12 : 1;
    for (let k = 0; k < cuts; k += 1) {
      const place = (t) => ({ x: a.x + (b.x - a.x) * t, y: a.y + (b.y - a.y) * t });
      const [p, q] = [place(k / cuts), place((k + 1) / cuts)];
      into.push(p.x, p.y, height(p), q.x, q.y, height(q));
    }
  });
}
