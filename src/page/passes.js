// Which threats a route passes beside, over or under: from where to where along it.

/** So many places of a route are looked at: nobody sees less of it in the strip. */
const LOOKS = 600;
const HALVINGS = 12;

/**
 * The stretches of a `Way` whose places on the map are within the core or the soft zone of one of `threats`, as `threatsOf` gives them:
 * `{threat, core, from, to}`, distances along it.
 */
export function passes(way, threats) {
  const looks = Array.from({ length: LOOKS + 1 }, (_, k) => (way.length * k) / LOOKS);
  const places = looks.map((s) => way.at(s));
  const box = boxOf(places);
  return threats.filter((threat) => meets(threat, box)).flatMap((threat) => {
    const found = [];
    for (const { core, within } of zonesOf(threat)) {
      const some = stretches(way, looks, places, within);
      // The core is within the soft zone.
      if (!some.length) break;
      found.push(...some.map((stretch) => ({ threat, core, ...stretch })));
    }
    return found;
  });
}

/** The soft zone and the core of a threat as questions for places. */
function zonesOf({ center, radius, influence, ring, margin }) {
  if (!ring) {
    // Not by `hypot`, which takes many times as long.
    const round = (reach) => (p) => (p.x - center.x) ** 2 + (p.y - center.y) ** 2 <= reach * reach;
    return [...(influence > radius ? [{ core: false, within: round(influence) }] : []), { core: true, within: round(radius) }];
  }
  const box = boxOf(ring);
  const near = ({ x, y }) => x >= box.left - margin && x <= box.right + margin && y >= box.low - margin && y <= box.high + margin;
  const inside = (p) => near(p) && holds(ring, p);
  return [...(margin > 0 ? [{ core: false, within: (p) => near(p) && (holds(ring, p) || away(ring, p) <= margin) }] : []), { core: true, within: inside }];
}

function stretches(way, looks, places, within) {
  const found = [];
  let from = null;
  places.forEach((place, k) => {
    const is = within(place);
    if (is && from === null) from = k ? edge(way, looks[k], looks[k - 1], within) : 0;
    if (!is && from !== null) {
      found.push({ from, to: edge(way, looks[k - 1], looks[k], within) });
      from = null;
    }
  });
  if (from !== null) found.push({ from, to: way.length });
  return found;
}

/** Between a distance within and one beyond. */
function edge(way, within, beyond, test) {
  for (let round = 0; round < HALVINGS; round += 1) {
    const half = (within + beyond) / 2;
    if (test(way.at(half))) within = half;
    else beyond = half;
  }
  return within;
}

function boxOf(places) {
  const box = { left: Infinity, right: -Infinity, low: Infinity, high: -Infinity };
  for (const { x, y } of places) {
    box.left = Math.min(box.left, x);
    box.right = Math.max(box.right, x);
    box.low = Math.min(box.low, y);
    box.high = Math.max(box.high, y);
  }
  return box;
}

function meets({ center, influence, ring, margin }, box) {
  const own = boxOf(ring ?? [center]);
  const reach = ring ? margin : influence;
  return own.left - reach <= box.right && own.right + reach >= box.left && own.low - reach <= box.high && own.high + reach >= box.low;
}

function holds(ring, { x, y }) {
  let inside = false;
  ring.forEach((a, k) => {
    const b = ring[(k + 1) % ring.length];
    if (a.y > y !== b.y > y && x < a.x + ((y - a.y) / (b.y - a.y)) * (b.x - a.x)) inside = !inside;
  });
  return inside;
}

/** How far a place is from the sides of a ring. */
function away(ring, { x, y }) {
  return ring.reduce((least, a, k) => {
    const b = ring[(k + 1) % ring.length];
    const [dx, dy] = [b.x - a.x, b.y - a.y];
    const square = dx * dx + dy * dy;
    const t = square > 0 ? Math.min(Math.max(((x - a.x) * dx + (y - a.y) * dy) / square, 0), 1) : 0;
    return Math.min(least, Math.hypot(a.x + dx * t - x, a.y + dy * t - y));
  }, Infinity);
}
