"""The measures and cost of a polyline: Eq. 1-9 and the constraints, evaluated continuously along every leg."""

import math
from dataclasses import dataclass

import geometry as geo
from quadrature import pieces
from threats import leg_integral, leg_samples, route_clearance


@dataclass
class Zone:
    """The zone around an end of the route in which the altitude band does not apply."""

    centre: tuple
    ramp: float
    floor: float
    ceiling: float

    def span(self, a, b):
        """The range of `t` where the leg is in the zone, not limited to [0, 1]; None when its line never enters it."""
        if geo.horizontal(a, b) == 0.0:
            return (-math.inf, math.inf) if geo.horizontal(a, self.centre) <= self.ramp else None
        return geo.circle_crossings(a, b, self.centre, self.ramp) or None


def zones(scenario):
    """The terminal zones of start and target."""
    found = []
    for end in (scenario.start, scenario.target):
        height = end[2] - scenario.ground.elevation(end[0], end[1])
        missing = max(0.0, scenario.min_height - height, height - scenario.max_height)
        ramp = 2.0 * missing / math.tan(math.radians(scenario.max_climb))
        found.append(Zone(end, ramp, min(0.0, height), max(scenario.max_height, height)))
    return found


def sections(a, b, both):
    """The leg's consecutive parts `(low, high, zones)`, with those of `both` zones that apply there."""
    spans = [(zone, zone.span(a, b)) for zone in both]
    spans = [(zone, span) for zone, span in spans if span is not None]
    cuts = [t for _, span in spans for t in span]
    found = []
    for low, high in pieces(0.0, 1.0, cuts):
        middle = 0.5 * (low + high)
        found.append((low, high, [zone for zone, span in spans if span[0] <= middle <= span[1]]))
    return found


@dataclass
class Heights:
    """Heights above ground of a route: extremes outside the zones, and the excess over each limit (<= 0: kept)."""

    least: float | None
    greatest: float | None
    below_ground: float
    below_band: float
    above_band: float


def heights(points, scenario):
    """Measures `Heights` along a route."""
    least, greatest = math.inf, -math.inf
    below_ground = below_band = above_band = -math.inf
    both = zones(scenario)
    for a, b in zip(points, points[1:]):
        for low, high, within in sections(a, b, both):
            if (high - low) * geo.distance(a, b) < 1e-9 and high - low < 1.0:
                continue
            bottom, top = scenario.ground.heights(geo.lerp(a, b, low), geo.lerp(a, b, high))
            if within:
                below_ground = max(below_ground, min(zone.floor for zone in within) - bottom)
                above_band = max(above_band, top - max(zone.ceiling for zone in within))
            else:
                least, greatest = min(least, bottom), max(greatest, top)
                below_ground = max(below_ground, -bottom)
                below_band = max(below_band, scenario.min_height - bottom)
                above_band = max(above_band, top - scenario.max_height)
    outside = least <= greatest
    return Heights(least if outside else None, greatest if outside else None, below_ground, below_band, above_band)


@dataclass
class Angles:
    """Greatest turn and climb angles in degrees, and the shortest leg in metres."""

    turn: float
    climb: float
    leg: float


def angles(points):
    """Measures `Angles` of a polyline."""
    legs = list(zip(points, points[1:]))
    return Angles(
        max(abs(turn) for turn in geo.turns(points)),
        max(abs(geo.climb(a, b)) for a, b in legs),
        min(geo.distance(a, b) for a, b in legs),
    )


def length(points):
    """Length of a polyline in space."""
    return math.fsum(geo.distance(a, b) for a, b in zip(points, points[1:]))


def cost(points, scenario, leg_price=leg_integral, shrink=0.0):
    """The weighted terms of Eq. 1 and their sum for the route S, P1..PN, T.

    `leg_price` defines how a threat is charged along a leg; `shrink` narrows the threats' heights (for tolerances).
    """
    threat = math.fsum(
        leg_price(threat, a, b, shrink) for threat in scenario.threats for a, b in zip(points, points[1:])
    )
    middle = 0.5 * (scenario.max_height + scenario.min_height)
    altitude = math.fsum(abs(z - scenario.ground.elevation(x, y) - middle) for x, y, z in points[1:-1])
    terms = {
        "fuel": scenario.weights["fuel"] * scenario.fuel_per_metre * length(points),
        "threat": scenario.weights["threat"] * threat / 5.0,
        "altitude": scenario.weights["altitude"] * altitude,
    }
    return terms | {"total": math.fsum(terms.values())}


def sampled_cost(points, scenario, shrink=0.0):
    """`cost`, with the threats charged by the paper's five samples per leg."""
    return cost(points, scenario, leg_samples, shrink)


@dataclass
class Faults:
    """The kinds of violation that a route certainly has, and those that it has when judged with no slack."""

    certain: dict
    possible: dict


def faults(points, scenario, smoothed=False):
    """Every kind of violation of a route with its amount, in metres or degrees.

    A route within a thousandth of a tolerance's edge is `possible` and not `certain`. `smoothed` judges the samples of
    the smoothed path: 0.05 degrees more of climb, and neither area nor leg length.
    """
    found = Faults({}, {})
    metres, high = scenario.slack, scenario.height_slack
    nearness = 0.1 if high > metres else 1e-3
    measured, along = angles(points), heights(points, scenario)

    def add(kind, amount, slack, edge=1e-3):
        if amount > slack * (1.0 - edge):
            found.possible[kind] = max(amount, found.possible.get(kind, amount))
        if amount > slack * (1.0 + edge):
            found.certain[kind] = max(amount, found.certain.get(kind, amount))

    for threat in scenario.threats:
        # Just below `top`, within the tolerance for lengths, a route counts as above the threat.
        for shrink, kinds in ((0.0, found.possible), (metres, found.certain)):
            clear = route_clearance(threat, points, shrink)
            if clear is not None and clear < -metres:
                kinds["threat"] = max(-clear, kinds.get("threat", 0.0))
    add("terrain", along.below_ground, high, nearness)
    add("altitude", max(along.below_band, along.above_band), high, nearness)
    if along.above_band <= high and "terrain" in found.certain:
        # A route below ground is also below the band; reporting it once is enough.
        found.certain.pop("altitude", None)
    add("turn", measured.turn - scenario.max_turn, 1e-6)
    add("climb", measured.climb - scenario.max_climb, 0.05 if smoothed else 1e-6)
    if not smoothed:
        add("leg", scenario.min_leg - measured.leg, metres)
        if scenario.area is None:
            # An area chosen by the service is not checked; a route may leave it.
            found.possible["area"] = 0.0
        else:
            add("area", max((_outside(point, scenario.area) for point in points[1:-1]), default=0.0), metres)
    return found


def _outside(point, area):
    """How far a point is beyond the area's nearest side, negative inside."""
    return max(area[0] - point[0], area[1] - point[1], point[0] - area[2], point[1] - area[3])
