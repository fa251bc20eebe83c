"""Seeded random scenarios, hostile but valid: the planner must handle them without false figures or crashes.

    python3 tests/judge/generate.py SEED [--out FILE]

The same seed gives the same document. Most documents are extreme in several respects at once: scale, band, vehicle,
terrain, threats, smoothing, the algorithm's constants.
"""

import argparse
import json
import math
import random
import sys
from pathlib import Path

from scenario import read_scenario

# Ranges of the algorithms' constants.
PARAMETERS = {
    "f_min": (0.0, 10.0),
    "f_max": (0.0, 10.0),
    "loudness": (0.0, 10.0),
    "loudness_decay": (0.0, 1.0),
    "pulse_rate": (0.0, 1.0),
    "pulse_growth": (0.0, 10.0),
    "walk": (0.0, 1.0),
    "walk_numbers": (1.0, 1000.0),
    "truncation": (0.0, 0.99),
    "expansion": (1.0, 10.0),
}


def scenario(seed):
    """The scenario document of a seed."""
    return _Scene(random.Random(seed)).document(seed)


class _Scene:
    """A scenario being generated, with about `size` metres from start to target, around `offset`."""

    def __init__(self, rng):
        self.rng = rng
        self.size = rng.choice([5.0, 50.0, 800.0, 800.0, 800.0, 5e3, 1e5])
        self.offset = rng.choice([0.0, 0.0, 0.0, -1e6, 1e6, 3e6])

    def document(self, seed):
        rng = self.rng
        heading = rng.choice([rng.uniform(-math.pi, math.pi), 0.0, math.pi, math.pi / 2, -math.pi / 4])
        self.start = (self.offset + rng.uniform(0.0, 100.0), self.offset + rng.uniform(0.0, 100.0))
        self.target = (
            self.start[0] + self.size * math.cos(heading),
            self.start[1] + self.size * math.sin(heading),
        )
        area = self.area()
        terrain = self.terrain(area)
        altitude = self.altitude()
        found = {
            "name": f"random {seed}",
            "frame": "local",
            "altitude": altitude,
            "terrain": terrain,
            "vehicle": self.vehicle(),
            "weights": self.weights(),
            "planner": self.planner(seed),
        }
        if area is not None and (terrain["kind"] == "grid" or rng.random() < 0.6):
            found["area"] = {"min": _plane(area[0], area[1]), "max": _plane(area[2], area[3])}
        ends = {"start": _plane(*self.start) | {"z": 0.0}, "target": _plane(*self.target) | {"z": 0.0}}
        ground = read_scenario(found | ends).ground
        for end in ends.values():
            end["z"] = ground.elevation(end["x"], end["y"]) + self.end_height(altitude)
        found |= ends
        distance = math.dist(*(tuple(end.values()) for end in ends.values()))
        found["planner"]["smoothing"] = {
            "degree": rng.randint(1, 5),
            "spacing": max(rng.choice([0.05, 1.0, 5.0, 50.0]), distance / rng.choice([20.0, 200.0, 1000.0])),
        }
        found["threats"] = self.threats(read_scenario(found))
        return found

    def area(self):
        reach = self.size * self.rng.choice([0.05, 0.4, 2.0])
        (x0, y0), (x1, y1) = self.start, self.target
        return (min(x0, x1) - reach, min(y0, y1) - reach, max(x0, x1) + reach, max(y0, y1) + reach)

    def altitude(self):
        low = self.rng.choice([0.0, 0.0, 5.0, 100.0])
        return {"min": low, "max": low + self.rng.choice([0.5, 20.0, 200.0, 200.0, 3000.0])}

    def end_height(self, altitude):
        rng = self.rng
        return rng.choice(
            [
                0.0,
                0.0,
                -rng.uniform(0.0, 0.0999),
                altitude["min"],
                altitude["max"],
                rng.uniform(altitude["min"], altitude["max"]),
                altitude["max"] + rng.uniform(0.0, 100.0),
                max(0.0, altitude["min"] - rng.uniform(0.0, 30.0)),
            ]
        )

    def vehicle(self):
        rng = self.rng
        found = {
            "max_turn_deg": rng.choice([5.0, 15.0, 45.0, 60.0, 60.0, 90.0, 150.0, 180.0, rng.uniform(5.0, 180.0)]),
            "max_climb_deg": rng.choice([1.0, 10.0, 30.0, 45.0, 45.0, 80.0, 89.0, rng.uniform(1.0, 89.0)]),
            "cruise_speed": rng.choice([15.0, 0.01, 1e4]),
            "fuel_per_km": rng.choice([1000.0, 1000.0, 0.0, 37.5]),
        }
        if rng.random() < 0.4:
            found["min_leg"] = rng.choice([0.0, 0.0, self.size / 500.0])
        return found

    def weights(self):
        return {term: self.rng.choice([0.0, 0.5, 1.0, 1.0, 20.0]) for term in ("fuel", "threat", "altitude")}

    def planner(self, seed):
        rng = self.rng
        found = {
            "waypoints": rng.choice([1, 1, 2, 2, 3, 3, 5, 5, 10, 10, 30, 60, 200]),
            "population": rng.choice([2, 3, 10, 50]),
            "iterations": rng.choice([1, 5, 60, 150]),
            "seed": seed,
            "parameters": {},
        }
        if rng.random() < 0.1:
            found["time_limit_ms"] = rng.choice([1, 20])
        if rng.random() < 0.2:
            found["parameters"]["quadrature"] = "paper"
        if rng.random() < 0.25:
            for name, ends in PARAMETERS.items():
                if rng.random() < 0.5:
                    found["parameters"][name] = rng.choice([*ends, rng.uniform(*ends)])
        self.search(found, random.Random(f"search {seed}"))
        return found

    def search(self, planner, rng):
        """Search settings, drawn separately so that a seed's scene never changes: often the defaults."""
        if rng.random() < 0.3:
            planner["seeding"] = rng.choice(["random", "tangent"])
        if rng.random() < 0.3:
            planner["polish"] = rng.choice([False, False, True])
        if rng.random() < 0.15:
            planner["parameters"]["gap"] = rng.choice([1e-6, 0.02, 0.5, 10.0])
        if rng.random() < 0.15:
            planner["parameters"]["threads"] = rng.choice([2, 5])
        if rng.random() < 0.2:
            planner["warm_start"] = {"waypoints": [self.anywhere(rng) for _ in range(rng.choice([0, 1, 2, 5, 60]))]}

    def anywhere(self, rng):
        """An arbitrary point: it may lie in a threat, below ground or outside the area."""
        (x, y), reach = self.start[:2], 2.0 * self.size
        return _plane(x + rng.uniform(-reach, reach), y + rng.uniform(-reach, reach)) | {"z": rng.uniform(-50.0, 300.0)}

    def terrain(self, area):
        rng = self.rng
        kind = rng.choice(["flat", "flat", "peaks", "grid"])
        relief = self.size * rng.choice([0.01, 0.1, 0.5]) * rng.choice([1.0, 1.0, -1.0])
        base = rng.choice([0.0, 0.0, -300.0, 1500.0])
        if kind == "flat":
            return {"kind": "flat", "elevation": base}
        if kind == "peaks":
            return {"kind": "peaks", "base": base, "peaks": [self.peak(relief) for _ in range(rng.choice([0, 1, 4, 9]))]}
        # The grid covers the area, exactly or with some to spare.
        spare = rng.choice([0.0, 0.0, 0.3]) * self.size
        west, south, east, north = area[0] - spare, area[1] - spare, area[2] + spare, area[3] + spare
        cell = max(max(east - west, north - south) / rng.choice([1, 4, 40]), 0.01)
        columns = max(2, math.ceil((east - west) / cell - 1e-9) + 1)
        rows = max(2, math.ceil((north - south) / cell - 1e-9) + 1)
        ridge = rng.random() < 0.3
        elevations = [
            base + (relief * (column % 2) if ridge else rng.uniform(0.0, relief))
            for _ in range(rows)
            for column in range(columns)
        ]
        return {
            "kind": "grid",
            "origin": _plane(west, south),
            "cell": cell,
            "columns": columns,
            "rows": rows,
            "elevations": elevations,
        }

    def peak(self, relief):
        rng = self.rng
        # Narrower ones take minutes to judge, because the judge steps along every leg.
        spread = [max(1.0, self.size * rng.choice([0.005, 0.02, 0.1, 0.5])) for _ in range(2)]
        return {
            "center": _plane(*self.somewhere()),
            "height": relief * rng.uniform(0.1, 1.0),
            "spread": _plane(*spread),
        }

    def somewhere(self):
        """A place near the straight way from start to target."""
        share, aside = self.rng.uniform(-0.1, 1.1), self.rng.gauss(0.0, 0.15)
        dx, dy = self.target[0] - self.start[0], self.target[1] - self.start[1]
        return (self.start[0] + share * dx - aside * dy, self.start[1] + share * dy + aside * dx)

    def threats(self, blank):
        """Threats of every shape that contain neither start nor target."""
        rng, found = self.rng, []
        for index in range(rng.choice([0, 1, 2, 5, 12])):
            threat = self.cylinder() if rng.random() < 0.6 else self.polygon()
            if rng.random() < 0.35:
                heights = sorted(rng.choice([blank.start[2] + rng.uniform(-5.0, 200.0), 0.0, 100.0]) for _ in range(2))
                threat["base"] = rng.choice([None, heights[0]])
                threat["top"] = rng.choice([None, heights[1]]) if heights[1] > heights[0] else None
            if rng.random() < 0.5:
                threat["name"] = f"threat {index}"
            if self.allowed(threat, blank):
                found.append(threat)
        return found

    def cylinder(self):
        rng = self.rng
        centre = self.somewhere()
        radius = self.size * rng.choice([rng.uniform(0.01, 0.15), rng.uniform(0.1, 0.4)])
        if rng.random() < 0.15:  # touching the start, but for the last digits
            radius = math.dist(centre, self.start) * (1.0 - 1e-15)
        influence = radius * rng.choice([1.0, 1.0, 1.3, 3.0])
        return {"kind": "cylinder", "center": _plane(*centre), "radius": radius, "influence": influence}

    def polygon(self):
        rng = self.rng
        centre, reach = self.somewhere(), self.size * rng.choice([0.05, 0.15, 0.3])
        turn = rng.uniform(0.0, math.tau)
        corners = rng.choice([3, 4, 5, 9, 40])
        star = rng.random() < 0.5
        ring = []
        for corner in range(corners):
            angle = math.tau * corner / corners
            away = reach * (rng.uniform(0.3, 1.0) if star else 1.0)
            ring.append((away * math.cos(angle), away * math.sin(angle)))
        shape = rng.random()
        if shape < 0.2:  # as thin as a needle
            thin = rng.choice([1e-3, 1e-2, 0.1])
            ring = [(x, y * thin) for x, y in ring]
        elif shape < 0.5:  # vertices within straight edges
            ring = [spot for a, b in zip(ring, ring[1:] + ring[:1]) for spot in (a, ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2))]
        elif shape < 0.7:  # a U, right angles throughout
            ring = [(-1, -1), (1, -1), (1, 1), (0.4, 1), (0.4, -0.4), (-0.4, -0.4), (-0.4, 1), (-1, 1)]
            ring = [(reach * x, reach * y) for x, y in ring]
            turn = rng.choice([0.0, turn])
        cos, sin = math.cos(turn), math.sin(turn)
        vertices = [_plane(centre[0] + x * cos - y * sin, centre[1] + x * sin + y * cos) for x, y in ring]
        return {"kind": "polygon", "vertices": vertices, "margin": reach * rng.choice([0.0, 0.1, 1.0])}

    def allowed(self, threat, blank):
        """Whether the scenario's ends are clear of a threat or outside its heights."""
        document = {"start": _plane(*self.start) | {"z": 0.0}, "target": _plane(*self.target) | {"z": 0.0}}
        shape = read_scenario(document | {"threats": [threat]}).threats[0]
        for end in (blank.start, blank.target):
            touching = shape.clearance_at(end) < 0.0 and shape.band.holds(end[2])
            if touching:
                return False
        return True


def _plane(x, y):
    return {"x": x, "y": y}


def main(arguments=None):
    """Prints or writes the scenario of a seed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seed", type=int)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args(arguments)
    text = json.dumps(scenario(options.seed)) + "\n"
    if options.out:
        options.out.write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()
