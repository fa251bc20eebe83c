// The ground in the scene: a shaded mesh with its contours, or a ruled plane where it is flat.

import { BufferAttribute, BufferGeometry, Color, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial } from './vendor/three.js';
import { drawnBySoftware } from './graphics.js';
import { ramp } from './palette.js';
import { step } from './words.js';

const CONTOURS = 14;
const MOST_PIECES = drawnBySoftware() ? 12000 : 60000;
// From the north-west and above, as maps have it.
const SUN = [-0.5, 0.6, 0.62];

/** Draws a ground into a group, ever the same one: what was drawn before is given back first. */
export class Relief {
  group = new Group();
  #ranges = null;

  /** Whether it is in motion where that is hard: with fewer triangles then, and without the thinner contours. */
  set coarse(yes) {
    for (const child of this.group.children) {
      if (child.name === 'contours') child.visible = !yes;
      if (child.name === 'ground' && this.#ranges) child.geometry.setDrawRange(...(yes ? this.#ranges.coarse : this.#ranges.fine));
    }
  }

  draw(ground, colours) {
    this.clear();
    if (ground.mesh) this.#hills(ground, colours);
    else this.#plain(ground, colours);
  }

  clear() {
    this.#ranges = null;
    for (const child of [...this.group.children]) {
      child.geometry.dispose();
      child.material.dispose();
      this.group.remove(child);
    }
  }

  #hills(ground, colours) {
    const { columns, rows, xs, ys, zs } = ground.mesh;
    const geometry = new BufferGeometry();
    const positions = new Float32Array(xs.length * 3);
    for (let k = 0; k < xs.length; k += 1) positions.set([xs[k], ys[k], zs[k]], k * 3);
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    geometry.setAttribute('color', new BufferAttribute(shades(ground, colours), 3));
    // Twice: of all nodes, and of every other one.
    const [fine, coarse] = [facesOf(columns, rows, 1), facesOf(columns, rows, 2)];
    const faces = new Uint32Array(fine.length + coarse.length);
    faces.set(fine);
    faces.set(coarse, fine.length);
    geometry.setIndex(new BufferAttribute(faces, 1));
    this.#ranges = { fine: [0, fine.length], coarse: [fine.length, coarse.length] };
    geometry.setDrawRange(...this.#ranges.fine);
    const material = new MeshBasicMaterial({ vertexColors: true, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    const mesh = new Mesh(geometry, material);
    mesh.name = 'ground';
    this.group.add(mesh);
    this.#skirt(ground, colours);
    // Rough ground has so many lines that they hide it: they stand farther apart there.
    let spacing = step(ground.greatest - ground.least || 1, CONTOURS);
    let lines = contours(ground, spacing);
    while (lines.minor.length + lines.major.length > MOST_PIECES * 6) {
      spacing *= 2;
      lines = contours(ground, spacing);
    }
    this.#lines('contours', lines.minor, colours.contour, 0.28);
    this.#lines('index contours', lines.major, colours.contour, 0.55);
  }

  /** The sides of the block, down to one level. */
  #skirt({ mesh: { columns, rows, xs, ys, zs }, least, greatest, extent }, colours) {
    const bottom = least - Math.max((greatest - least) * 0.12, (extent.max.x - extent.min.x) * 0.012);
    const edge = [];
    for (let column = 0; column < columns; column += 1) edge.push(column);
    for (let row = 1; row < rows; row += 1) edge.push(row * columns + columns - 1);
    for (let column = columns - 2; column >= 0; column -= 1) edge.push((rows - 1) * columns + column);
    for (let row = rows - 2; row >= 0; row -= 1) edge.push(row * columns);
    const positions = new Float32Array(edge.length * 6);
    const faces = [];
    edge.forEach((k, at) => {
      positions.set([xs[k], ys[k], zs[k], xs[k], ys[k], bottom], at * 6);
      if (at) faces.push(2 * at - 2, 2 * at - 1, 2 * at, 2 * at - 1, 2 * at + 1, 2 * at);
    });
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    geometry.setIndex(faces);
    const mesh = new Mesh(geometry, new MeshBasicMaterial({ color: colours.skirt, side: DoubleSide }));
    mesh.name = 'skirt';
    this.group.add(mesh);
  }

  #plain(ground, colours) {
    const { min, max } = ground.extent;
    const z = ground.least;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array([min.x, min.y, z, max.x, min.y, z, max.x, max.y, z, min.x, max.y, z]), 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const material = new MeshBasicMaterial({ color: colours['ramp-1'], side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    const mesh = new Mesh(geometry, material);
    mesh.name = 'ground';
    this.group.add(mesh);
    const cell = step(Math.max(max.x - min.x, max.y - min.y), 10);
    const rules = [];
    for (let x = Math.ceil(min.x / cell) * cell; x <= max.x; x += cell) rules.push(x, min.y, z, x, max.y, z);
    for (let y = Math.ceil(min.y / cell) * cell; y <= max.y; y += cell) rules.push(min.x, y, z, max.x, y, z);
    this.#lines('rules', rules, colours.contour, 0.3);
    this.#lines('edge', [min.x, min.y, z, max.x, min.y, z, max.x, min.y, z, max.x, max.y, z, max.x, max.y, z, min.x, max.y, z, min.x, max.y, z, min.x, min.y, z], colours.contour, 0.7);
  }

  #lines(name, coordinates, color, opacity) {
    if (!coordinates.length) return;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(coordinates), 3));
    const lines = new LineSegments(geometry, new LineBasicMaterial({ color, transparent: true, opacity, depthWrite: false }));
    lines.name = name;
    this.group.add(lines);
  }
}

/** Two triangles for each square between the nodes of every `stride`th column and row, and the last ones. */
function facesOf(columns, rows, stride) {
  const [wide, high] = [columns, rows].map((count) => Math.ceil((count - 1) / stride));
  const faces = new Uint32Array(wide * high * 6);
  for (let row = 0; row < high; row += 1) {
    for (let column = 0; column < wide; column += 1) {
      const [w, e] = [column * stride, Math.min((column + 1) * stride, columns - 1)];
      const [s, n] = [row * stride * columns, Math.min((row + 1) * stride, rows - 1) * columns];
      faces.set([s + w, s + e, n + w, s + e, n + e, n + w], (row * wide + column) * 6);
    }
  }
  return faces;
}

/** Height and light of each node as a colour. */
function shades(ground, colours) {
  const { columns, rows, xs, ys, zs } = ground.mesh;
  const tint = ramp(colours);
  const color = new Color();
  const out = new Float32Array(xs.length * 3);
  const span = ground.greatest - ground.least || 1;
  // Slopes are drawn steeper on wide ground than they are, or it would look flat.
  const width = Math.abs(xs[columns - 1] - xs[0]) || 1;
  const steep = Math.min(4, Math.max(1, (0.18 * width) / span));
  for (let row = 0; row < rows; row += 1) {
    for (let column = 0; column < columns; column += 1) {
      const k = row * columns + column;
      const [w, e] = [column ? k - 1 : k, column + 1 < columns ? k + 1 : k];
      const [s, n] = [row ? k - columns : k, row + 1 < rows ? k + columns : k];
      const dx = ((zs[e] - zs[w]) / (xs[e] - xs[w])) * steep;
      const dy = ((zs[n] - zs[s]) / (ys[n] - ys[s])) * steep;
      const light = (SUN[2] - SUN[0] * dx - SUN[1] * dy) / Math.hypot(dx, dy, 1) / Math.hypot(...SUN);
      tint((zs[k] - ground.least) / span, color).multiplyScalar(0.42 + 0.8 * Math.max(light, 0));
      out.set([color.r, color.g, color.b], k * 3);
    }
  }
  return out;
}

/** Pieces of lines of equal height over the triangles of the mesh: `major` ones at every fifth height. */
function contours(ground, spacing) {
  const { columns, rows, xs, ys, zs } = ground.mesh;
  const [minor, major] = [[], []];
  const cut = (pieces, a, b, level) => {
    const t = (level - zs[a]) / (zs[b] - zs[a]);
    pieces.push(xs[a] + t * (xs[b] - xs[a]), ys[a] + t * (ys[b] - ys[a]), level);
  };
  const triangle = (a, b, c) => {
    const low = Math.min(zs[a], zs[b], zs[c]);
    const high = Math.max(zs[a], zs[b], zs[c]);
    for (let n = Math.ceil(low / spacing); n * spacing < high; n += 1) {
      const pieces = n % 5 === 0 ? major : minor;
      const level = n * spacing;
      for (const [p, q] of [[a, b], [b, c], [c, a]]) {
        if (zs[p] < level !== zs[q] < level) cut(pieces, p, q, level);
      }
      // Two of the three sides are cut, or none: never an odd end.
    }
  };
  for (let row = 0; row + 1 < rows; row += 1) {
    for (let column = 0; column + 1 < columns; column += 1) {
      const k = row * columns + column;
      triangle(k, k + 1, k + columns);
      triangle(k + 1, k + columns + 1, k + columns);
    }
  }
  return { minor, major };
}
