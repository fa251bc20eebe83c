// How high the ground is, in the metres of a frame; and the part of it that a scenario is about.

import { axes } from './frame.js';
import { drawnBySoftware } from './graphics.js';
import { finite, radiiOf } from './sizes.js';

/** Nodes of drawn ground along its longer side, at most. */
const FINEST = drawnBySoftware() ? 121 : 301;
const PEAKS_NODES = 161;

/**
 * The ground of a document: `extent` {min, max}, `at(x, y)`, `least`, `greatest`, and for other than flat ground
 * `mesh`: `columns` x `rows` nodes in `xs`, `ys`, `zs`. `sampled` is what the service says of a dataset; the ground has a mark of that
 * name where it is of such samples, and `guessed` where it has none.
 */
export function groundOf(document, frame, sampled = null) {
  const terrain = document.terrain ?? { kind: 'flat' };
  const kinds = { flat, peaks, grid, dataset: () => (sampled ? fromSamples(sampled, document, frame) : null) };
  let ground = null;
  try {
    ground = kinds[terrain.kind]?.(terrain, document, frame) ?? null;
  } catch {
    // A document under the pencil may lack anything; the service says what.
  }
  return ground ?? { ...flat({}, document, frame), sampled: true, guessed: true };
}

/** What is drawn: the document's own area, else a box round everything. */
export function extentOf(document, frame) {
  const [first, second] = axes(document);
  const { min, max } = document.area ?? {};
  if ([min?.[first], min?.[second], max?.[first], max?.[second]].every(Number.isFinite)) {
    const corners = [min, max, { [first]: min[first], [second]: max[second] }, { [first]: max[first], [second]: min[second] }];
    return boxOf(corners.map(frame.to), 0);
  }
  const places = [];
  const add = (p, around = 0) => {
    if (!Number.isFinite(p?.[first]) || !Number.isFinite(p?.[second])) return;
    const { x, y } = frame.to(p);
    places.push({ x: x - around, y: y - around }, { x: x + around, y: y + around });
  };
  add(document.start);
  add(document.target);
  for (const threat of document.threats ?? []) {
    if (threat.kind === 'polygon') threat.vertices?.forEach((vertex) => add(vertex, finite(threat.margin)));
    else add(threat.center, radiiOf(threat).influence);
  }
  return boxOf(places.length ? places : [{ x: -500, y: -500 }, { x: 500, y: 500 }], 0.12);
}

/** Whether what lies in `area` is of the place that a document is about. */
export function isOf(area, document, frame) {
  const [there, here] = [extentOf({ ...document, area }, frame), extentOf(document, frame)];
  return ['x', 'y'].every((axis) => there.min[axis] < here.max[axis] && here.min[axis] < there.max[axis]);
}

function boxOf(places, margin) {
  const [xs, ys] = [places.map((p) => p.x), places.map((p) => p.y)];
  const box = { min: { x: Math.min(...xs), y: Math.min(...ys) }, max: { x: Math.max(...xs), y: Math.max(...ys) } };
  const room = Math.max(box.max.x - box.min.x, box.max.y - box.min.y, 1) * margin;
  return { min: { x: box.min.x - room, y: box.min.y - room }, max: { x: box.max.x + room, y: box.max.y + room } };
}

function flat({ elevation = 0 }, document, frame) {
  const height = finite(elevation);
  return { extent: extentOf(document, frame), at: () => height, least: height, greatest: height, mesh: null };
}

function peaks({ base = 0, peaks: all }, document, frame) {
  const bells = all.map(({ center, height, spread }) => ({ ...frame.to(center), height, sx: spread.x, sy: spread.y }))
    .filter(({ x, y, height, sx, sy }) => [x, y, height, sx, sy].every(Number.isFinite) && sx && sy);
  const at = (x, y) =>
    bells.reduce((sum, bell) => sum + bell.height * Math.exp(-(((x - bell.x) / bell.sx) ** 2) - ((y - bell.y) / bell.sy) ** 2), finite(base));
  const extent = extentOf(document, frame);
  const [wide, high] = [extent.max.x - extent.min.x, extent.max.y - extent.min.y];
  const cell = Math.max(wide, high) / (PEAKS_NODES - 1);
  const [columns, rows] = [Math.max(2, Math.round(wide / cell) + 1), Math.max(2, Math.round(high / cell) + 1)];
  const place = (column, row) => ({ x: extent.min.x + (wide * column) / (columns - 1), y: extent.min.y + (high * row) / (rows - 1) });
  return meshed(columns, rows, (column, row) => {
    const { x, y } = place(column, row);
    return { x, y, z: at(x, y) };
  }, at, extent);
}

function grid({ origin, cell, columns, rows, elevations }, document, frame) {
  if (!(columns >= 2 && rows >= 2 && cell > 0) || elevations.length !== columns * rows || !elevations.every(Number.isFinite)) return null;
  const corner = frame.to(origin);
  const at = bilinear(columns, rows, elevations, (x, y) => [(x - corner.x) / cell, (y - corner.y) / cell]);
  const stride = Math.ceil((Math.max(columns, rows) - 1) / (FINEST - 1));
  const [wide, high] = [fewer(columns, stride), fewer(rows, stride)];
  const node = (column, row) => {
    const [c, r] = [Math.min(column * stride, columns - 1), Math.min(row * stride, rows - 1)];
    return { x: corner.x + c * cell, y: corner.y + r * cell, z: elevations[r * columns + c] };
  };
  return meshed(wide, high, node, at);
}

const fewer = (count, stride) => Math.ceil((count - 1) / stride) + 1;

/** Of what the service sampled over a box of the document's own coordinates. */
function fromSamples({ area, columns, rows, elevations }, document, frame) {
  const [first, second] = axes(document);
  // The first index runs west to east, which is x, or the longitude.
  const [across, along] = first === 'lat' ? [second, first] : [first, second];
  // Across the antimeridian the east is the smaller one.
  const turn = first === 'lat' && area.max.lon < area.min.lon ? 360 : 0;
  const span = (axis) => area.max[axis] - area.min[axis] + (axis === 'lon' ? turn : 0);
  const known = elevations.filter(Number.isFinite);
  const lowest = known.length ? known.reduce((a, b) => Math.min(a, b)) : 0;
  const filled = elevations.map((z) => z ?? lowest);
  const at = bilinear(columns, rows, filled, (x, y) => {
    const p = frame.from({ x, y, z: 0 });
    if (turn && p.lon < area.min.lon - 1) p.lon += turn;
    return [((p[across] - area.min[across]) / span(across)) * (columns - 1), ((p[along] - area.min[along]) / span(along)) * (rows - 1)];
  });
  const node = (column, row) => {
    const p = {
      [across]: area.min[across] + (span(across) * column) / (columns - 1),
      [along]: area.min[along] + (span(along) * row) / (rows - 1),
    };
    return { ...frame.to(p), z: filled[row * columns + column] };
  };
  const around = (x, y) => {
    const middle = frame.from({ x, y, z: 0 });
    const step = [(0.5 * span(across)) / (columns - 1), (0.5 * span(along)) / (rows - 1)];
    const places = [-1, 0, 1].flatMap((i) => [-1, 0, 1].map((j) => frame.to({ ...middle, [across]: middle[across] + i * step[0], [along]: middle[along] + j * step[1] })));
    return Math.max(...places.map((place) => at(place.x, place.y)));
  };
  return { ...meshed(columns, rows, node, at), around, sampled: true };
}

/** Elevation between nodes; beyond the edges that of the edge goes on. `cells` makes columns and rows of a place. */
function bilinear(columns, rows, elevations, cells) {
  const within = (value, most) => Math.min(Math.max(value, 0), most);
  return (x, y) => {
    const [u, v] = cells(x, y);
    const [cu, cv] = [within(u, columns - 1), within(v, rows - 1)];
    const [c, r] = [Math.min(Math.floor(cu), columns - 2), Math.min(Math.floor(cv), rows - 2)];
    const [s, t] = [cu - c, cv - r];
    const k = r * columns + c;
    return (
      (elevations[k] * (1 - s) + elevations[k + 1] * s) * (1 - t) + (elevations[k + columns] * (1 - s) + elevations[k + columns + 1] * s) * t
    );
  };
}

function meshed(columns, rows, node, at, extent) {
  const count = columns * rows;
  const mesh = { columns, rows, xs: new Float32Array(count), ys: new Float32Array(count), zs: new Float32Array(count) };
  let [least, greatest] = [Infinity, -Infinity];
  const box = { min: { x: Infinity, y: Infinity }, max: { x: -Infinity, y: -Infinity } };
  for (let k = 0; k < count; k += 1) {
    const { x, y, z } = node(k % columns, Math.floor(k / columns));
    mesh.xs[k] = x;
    mesh.ys[k] = y;
    mesh.zs[k] = z;
    least = Math.min(least, z);
    greatest = Math.max(greatest, z);
    box.min.x = Math.min(box.min.x, x);
    box.min.y = Math.min(box.min.y, y);
    box.max.x = Math.max(box.max.x, x);
    box.max.y = Math.max(box.max.y, y);
  }
  return { extent: extent ?? box, at, least, greatest, mesh };
}
