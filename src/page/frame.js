// Between a document's coordinates and metres east, north and up about one place, in which everything is drawn.

const A = 6378137;
const F = 1 / 298.257223563;
const E2 = F * (2 - F);

/** Whether a document speaks of latitudes and longitudes. */
export const isGeodetic = (document) => document?.frame === 'wgs84';

/** The names of its coordinates. */
export const axes = (document) => (isGeodetic(document) ? ['lat', 'lon', 'alt'] : ['x', 'y', 'z']);

/**
 * The frame of a document. `to` makes metres of a position, `from` a position of metres; heights are those of the
 * document's datum in both. `before` is kept while it serves, so that nothing jumps as things are moved.
 */
export function frameOf(document, before = null) {
  const [first, second] = axes(document);
  const middle = [first, second].map((axis) => {
    const box = [document.area?.min?.[axis], document.area?.max?.[axis]].filter(Number.isFinite);
    const ends = box.length === 2 ? box : [document.start?.[axis], document.target?.[axis]].filter(Number.isFinite);
    // Across the antimeridian the east is the smaller one: of an area always, of start and target where they are nearer that way.
    if (axis === 'lon' && (ends === box ? box[1] < box[0] : Math.abs(ends[1] - ends[0]) > 180)) ends[ends[0] < ends[1] ? 0 : 1] += 360;
    return ends.length ? ends.reduce((sum, value) => sum + value, 0) / ends.length : 0;
  });
  const geodetic = isGeodetic(document);
  if (before && before.geodetic === geodetic) {
    const away = before.to({ [first]: middle[0], [second]: middle[1] });
    if (Math.hypot(away.x, away.y) < 20000) return before;
  }
  return geodetic ? tangentPlane(...middle) : shifted(...middle);
}

function shifted(x, y) {
  return {
    geodetic: false,
    to: (p) => ({ x: p.x - x, y: p.y - y, z: p.z ?? 0 }),
    from: (p) => ({ x: p.x + x, y: p.y + y, z: p.z }),
    step: () => ({ across: 1, along: 1 }),
  };
}

/** East and north of the plane that touches the ellipsoid at `lat`, `lon`; up is the altitude itself. */
function tangentPlane(lat, lon) {
  const origin = earthCentred(lat, lon);
  const [sinLat, cosLat] = [Math.sin(radians(lat)), Math.cos(radians(lat))];
  const [sinLon, cosLon] = [Math.sin(radians(lon)), Math.cos(radians(lon))];
  const to = (p) => {
    const at = earthCentred(p.lat, p.lon);
    const [dx, dy, dz] = [at[0] - origin[0], at[1] - origin[1], at[2] - origin[2]];
    return { x: -sinLon * dx + cosLon * dy, y: -sinLat * (cosLon * dx + sinLon * dy) + cosLat * dz, z: p.alt ?? 0 };
  };
  // Metres a degree, here: the start of a Newton iteration, whose steps close on it by a factor of thousands.
  const curve = Math.sqrt(1 - E2 * sinLat * sinLat);
  const north = radians((A * (1 - E2)) / curve ** 3);
  const east = radians(A / curve) * cosLat;
  const from = (p) => {
    const found = { lat, lon, alt: p.z };
    for (let round = 0; round < 6; round += 1) {
      const at = to(found);
      found.lat += (p.y - at.y) / north;
      found.lon += (p.x - at.x) / east;
    }
    // Beyond the antimeridian they count on from the other side.
    found.lon -= 360 * Math.round(found.lon / 360);
    return found;
  };
  return { geodetic: true, to, from, step: () => ({ across: east, along: north }) };
}

function earthCentred(lat, lon) {
  const [sinLat, cosLat] = [Math.sin(radians(lat)), Math.cos(radians(lat))];
  const normal = A / Math.sqrt(1 - E2 * sinLat * sinLat);
  return [normal * cosLat * Math.cos(radians(lon)), normal * cosLat * Math.sin(radians(lon)), normal * (1 - E2) * sinLat];
}

const radians = (degrees) => (degrees * Math.PI) / 180;

/** A position as it is written: to a decimetre, which is a millionth of a degree. */
export function written(document, position) {
  const [first, second, third] = axes(document);
  const plane = isGeodetic(document) ? 1e6 : 1e1;
  const round = (value, scale) => Math.round(value * scale) / scale;
  const result = { [first]: round(position[first], plane), [second]: round(position[second], plane) };
  if (position[third] !== undefined) result[third] = round(position[third], 10);
  return result;
}
