"""Threats: the clearance of a leg, and the cost of flying there (Eq. 4-5)."""

import math

import geometry as geo
from quadrature import integrate_pieces, pieces

# Absolute precision of the threat integral of one leg, per metre of influence and of leg.
PRECISION = 1e-11


class Band:
    """The heights [base, top) in which a threat exists; None is unbounded."""

    def __init__(self, base=None, top=None):
        self.base = -math.inf if base is None else base
        self.top = math.inf if top is None else top

    def holds(self, z, shrink=0.0):
        """Whether height `z` is in the band narrowed by `shrink` at each limit."""
        return self.base + shrink <= z < self.top - shrink

    def part(self, a, b, shrink=0.0):
        """The closed range of `t` where the leg is in the band, None when it never is; touching `top` does not count.

        A negative `shrink` widens the band.
        """
        base, top = self.base + shrink, self.top - shrink
        low, high = min(a[2], b[2]), max(a[2], b[2])
        if max(low, base) >= top or high < base:
            return None
        if low == high:
            return (0.0, 1.0)
        rise = b[2] - a[2]
        ends = sorted(((max(low, base) - a[2]) / rise, (min(high, top) - a[2]) / rise))
        return (max(0.0, ends[0]), min(1.0, ends[1]))


class Cylinder:
    """A disc of `radius` that must not be entered, within one of `influence` that costs, both in metres."""

    def __init__(self, name, centre, radius, influence, band):
        self.name, self.centre, self.radius, self.influence, self.band = name, centre, radius, influence, band

    def clearance_at(self, point):
        """Horizontal metres from `point` to the disc, negative inside, whatever the height."""
        return geo.horizontal(self.centre, point) - self.radius

    def clearance_between(self, a, b):
        """Least `clearance_at` on the segment from `a` to `b`."""
        return geo.to_segment(self.centre, a, b) - self.radius

    def price_at(self, point):
        """T of Eq. 5 at `point`, whatever the height."""
        return max(0.0, self.influence - geo.horizontal(self.centre, point))

    def kinks(self, a, b):
        """The `t` where the price along the leg is not smooth; None when the leg is never near."""
        crossings = geo.circle_crossings(a, b, self.centre, self.influence)
        closest = geo.nearest_parameter(a, b, self.centre)
        if self.price_at(geo.lerp(a, b, closest)) == 0.0:
            return None
        return [*crossings, closest]


class Polygon:
    """A ring that must not be entered, with a soft zone of `margin` metres around it."""

    radius = 0.0

    def __init__(self, name, vertices, margin, band):
        ring = [tuple(vertex) for vertex in vertices]
        if len(ring) > 1 and ring[0] == ring[-1]:
            ring.pop()
        self.name, self.ring, self.influence, self.band = name, ring, margin, band
        self.edges = geo.edges(ring)

    def clearance_at(self, point):
        """Horizontal metres from `point` to the ring, negative inside, whatever the height."""
        away = self._to_ring(point)
        return -away if geo.inside_ring(point, self.ring) else away

    def clearance_between(self, a, b):
        """Least distance of the segment from the ring, or minus its greatest depth where it enters."""
        depths = [
            self._depth(geo.lerp(a, b, low), geo.lerp(a, b, high))
            for low, high in pieces(0.0, 1.0, self._crossings(a, b))
            if geo.inside_ring(geo.lerp(a, b, 0.5 * (low + high)), self.ring)
        ]
        if depths:
            return -max(depths)
        return min(geo.segments_distance(a, b, c, d) for c, d in self.edges)

    def price_at(self, point):
        """T of Eq. 5 at `point`, whatever the height: the whole margin inside."""
        if geo.inside_ring(point, self.ring):
            return self.influence
        return max(0.0, self.influence - self._to_ring(point))

    def kinks(self, a, b):
        """The `t` where the price along the leg may not be smooth; None when the leg is never near."""
        if self.clearance_between(a, b) >= self.influence:
            return None
        near = [edge for edge in self.edges if geo.segments_distance(a, b, *edge) < self.influence]
        found = self._crossings(a, b)
        for c, d in near:
            found.append(geo.nearest_parameter(a, b, c))
            found.append(geo.nearest_parameter(a, b, d))
            found.extend(geo.circle_crossings(a, b, c, self.influence))
            found.extend(geo.circle_crossings(a, b, d, self.influence))
            found.extend(geo.line_crossing(a, b, c, d, offset) for offset in (-self.influence, self.influence))
            # Where the nearest point of the edge moves onto one of its ends: the lines perpendicular to the edge
            # there.
            for end in (c, d):
                found.append(geo.line_crossing(a, b, end, (end[0] - d[1] + c[1], end[1] + d[0] - c[0])))
        return [t for t in found if t is not None]

    def _to_ring(self, point):
        return min(geo.to_segment(point, c, d) for c, d in self.edges)

    def _crossings(self, a, b):
        """The `t` where the leg meets an edge, with slightly extended ends; an extra cut does no harm."""
        found = []
        for c, d in self.edges:
            t, u = geo.line_crossing(a, b, c, d), geo.line_crossing(c, d, a, b)
            if t is not None and u is not None and -1e-9 <= t <= 1.0 + 1e-9 and -1e-9 <= u <= 1.0 + 1e-9:
                found.append(t)
        return found

    def _depth(self, a, b):
        """The greatest distance from the ring of any point on a segment that lies inside it.

        The distance from one edge is convex along the segment, so no point of a piece is farther from an edge than the
        farther of the piece's ends: a bound for branching, until it is met within 1e-10 m.
        """
        best, todo = 0.0, [(0.0, 1.0)]
        while todo:
            low, high = todo.pop()
            first = [geo.to_segment(geo.lerp(a, b, low), c, d) for c, d in self.edges]
            last = [geo.to_segment(geo.lerp(a, b, high), c, d) for c, d in self.edges]
            best = max(best, min(first), min(last))
            if min(max(pair) for pair in zip(first, last)) > best + 1e-10 and high - low > 1e-13:
                middle = 0.5 * (low + high)
                todo += [(low, middle), (middle, high)]
        return best


def leg_clearance(threat, a, b, shrink=0.0):
    """The least horizontal distance from the threat to the part of the leg in its band; None when no part is."""
    part = threat.band.part(a, b, shrink)
    if part is None:
        return None
    return threat.clearance_between(geo.lerp(a, b, part[0]), geo.lerp(a, b, part[1]))


def route_clearance(threat, points, shrink=0.0):
    """Least `leg_clearance` of a route's legs; None when it is never in the threat's band."""
    found = (leg_clearance(threat, a, b, shrink) for a, b in zip(points, points[1:]))
    return min((value for value in found if value is not None), default=None)


def leg_integral(threat, a, b, shrink=0.0):
    """The integral of T over the 3-D length of the leg, by adaptive quadrature split where T is not smooth."""
    part = threat.band.part(a, b, shrink)
    length = geo.distance(a, b)
    if part is None or length == 0.0 or threat.influence <= 0.0 or part[1] <= part[0]:
        return 0.0
    cuts = threat.kinks(a, b)
    if cuts is None:
        return 0.0
    price = lambda t: threat.price_at(geo.lerp(a, b, t))
    # Far from the origin T is known only as precisely as the places where it is evaluated.
    rounding = 8.0 * max(math.ulp(coordinate) for end in (a, b) for coordinate in end[:2])
    return length * integrate_pieces(price, *part, cuts, max(PRECISION * threat.influence, rounding))


def leg_samples(threat, a, b, shrink=0.0):
    """The paper's five-sample form of `leg_integral`: the length times the mean of T at 0, 1/4, 1/2, 3/4 and 1."""
    total = 0.0
    for step in range(5):
        point = geo.lerp(a, b, 0.25 * step)
        if threat.band.holds(point[2], shrink):
            total += threat.price_at(point)
    return geo.distance(a, b) * total / 5.0
