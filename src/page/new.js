// What buttons make anew: scenarios with nothing in them, and threats, corners and mountains for those there are.

import { axes, isGeodetic, written } from './frame.js';

export const EMPTY = {
  name: 'untitled', frame: 'local', start: { x: 100, y: 100, z: 50 }, target: { x: 900, y: 900, z: 50 },
  area: { min: { x: 0, y: 0 }, max: { x: 1000, y: 1000 } }, threats: [], terrain: { kind: 'flat', elevation: 0 }, altitude: { min: 20, max: 120 },
};

/** Where no map has been open: in the middle of the shipped ones. */
const SOMEWHERE = { lat: 36.59, lon: -84.25 };
/** Degrees to the north: of some 400 m that the ends are away from the middle, and of 3 km to the edges of the area. */
const AWAY = 0.0036;
const EDGE = 0.027;

/** A scenario in degrees with nothing in it, where `document` is, whose places `frame` turns to metres. */
export function emptyInDegrees(document, frame) {
  const { lat, lon } = isGeodetic(document) && frame ? middleOf(document, frame) : SOMEWHERE;
  return emptyAround({ lat, lon, alt: 50 }, { kind: 'flat', elevation: 0 });
}

/** The same over a dataset, in the middle of it and above all of it. */
export function emptyOver({ name, area: { min, max }, max: highest }) {
  const wide = max.lon - min.lon + (max.lon < min.lon ? 360 : 0);
  // Not to its last sample: places are written in so many digits.
  const edge = { lat: 0.49 * (max.lat - min.lat), lon: 0.49 * wide };
  const middle = { lat: (min.lat + max.lat) / 2, lon: min.lon + wide / 2, alt: Math.ceil(highest ?? 0) + 50 };
  return emptyAround(middle, { kind: 'dataset', name }, edge);
}

/** Within `most` degrees to each side of a place. */
function emptyAround({ lat, lon, alt }, terrain, most = { lat: EDGE, lon: 180 }) {
  const stretch = 1 / Math.max(0.01, Math.cos((lat * Math.PI) / 180));
  const empty = { name: 'untitled', frame: 'wgs84', altitude_datum: 'msl' };
  const edge = { lat: Math.min(EDGE, most.lat), lon: Math.min(EDGE * stretch, most.lon) };
  const away = { lat: Math.min(AWAY, edge.lat / 4), lon: Math.min(AWAY * stretch, edge.lon / 4) };
  const place = (off, side, height) => {
    const beside = lon + side * off.lon;
    return written(empty, { lat: lat + side * off.lat, lon: beside - 360 * Math.round(beside / 360), alt: height });
  };
  return {
    ...empty, start: place(away, -1, alt), target: place(away, 1, alt), area: { min: place(edge, -1), max: place(edge, 1) },
    threats: [], terrain, altitude: { min: 20, max: 120 },
  };
}

/** Between start and target; of a document that lacks one, where its frame begins. */
function middleOf({ start, target }, frame) {
  const [a, b] = [start, target].map((end) => frame.to(end ?? {}));
  const [x, y] = [(a.x + b.x) / 2, (a.y + b.y) / 2];
  return frame.from(Number.isFinite(x + y) ? { x, y, z: 0 } : { x: 0, y: 0, z: 0 });
}

/** What adds to the draft: `add(kind)` a threat, `addCorner(threat)`, and `addPeak()`. */
export function additions(draft, stage) {
  const middleBetween = (a, b) => {
    const [first, second] = axes(draft.document);
    const middle = written(draft.document, stage.frame.from({ x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, z: 0 }));
    return { [first]: middle[first], [second]: middle[second] };
  };
  return {
    add: (kind) => {
      const { x, y } = stage.middle();
      const { min, max } = stage.ground.extent;
      const size = (max.x - min.x) / 16;
      stage.addThreat(kind, kind === 'polygon' ? [{ x: x - size, y: y - size }, { x: x + size, y: y - size }, { x, y: y + size }] : [{ x, y }]);
    },
    addCorner: (index) => {
      const { vertices = [] } = draft.document.threats[index];
      const known = [vertices[0], vertices.at(-1)].filter((vertex) => axes(draft.document).slice(0, 2).every((axis) => Number.isFinite(vertex?.[axis])));
      const ends = known.length === 2 ? known.map(stage.frame.to) : [stage.middle(), stage.middle()];
      draft.set(`/threats/${index}/vertices`, [...vertices, middleBetween(...ends)]);
    },
    addPeak: () => {
      const { peaks = [] } = draft.document.terrain;
      const middle = stage.middle();
      draft.set('/terrain/peaks', [...peaks, { center: middleBetween(middle, middle), height: 100, spread: { x: 100, y: 100 } }]);
    },
  };
}
