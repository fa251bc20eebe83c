"""The judge's exact measures against dense samples, on random legs, shapes and grounds of fixed seeds."""

import math
import random
import unittest

import geometry as geo
import route
from scenario import read_scenario
from test_measures import document
from threats import Band, Cylinder, Polygon, leg_clearance, leg_integral

STEPS = 2000


def star(chance):
    """A simple ring around the origin, usually not convex."""
    count = chance.randint(3, 9)
    angles = sorted(chance.uniform(0.0, 2.0 * math.pi) for _ in range(count))
    reach = [chance.uniform(5.0, 40.0) for _ in angles]
    return [(far * math.cos(angle), far * math.sin(angle)) for angle, far in zip(angles, reach)]


def spot(chance, height=50.0):
    """A random point around the origin."""
    return chance.uniform(-60.0, 60.0), chance.uniform(-60.0, 60.0), chance.uniform(0.0, height)


class AgainstSamples(unittest.TestCase):
    def test_threats(self):
        for seed in range(60):
            chance = random.Random(seed)
            band = Band(chance.choice([None, 10.0]), chance.choice([None, 30.0]))
            shapes = [
                Polygon(None, star(chance), chance.uniform(0.0, 30.0), band),
                Cylinder(None, (0.0, 0.0), 20.0, chance.uniform(20.0, 40.0), band),
            ]
            a, b = spot(chance), spot(chance)
            points = [geo.lerp(a, b, (step + 0.5) / STEPS) for step in range(STEPS)]
            points = [point for point in points if band.holds(point[2])]
            width = geo.distance(a, b) / STEPS
            for threat in shapes:
                with self.subTest(seed=seed, kind=type(threat).__name__):
                    clear = leg_clearance(threat, a, b)
                    sampled = min((threat.clearance_at(point) for point in points), default=None)
                    if sampled is None:
                        self.assertIsNone(clear)
                    else:
                        self.assertLessEqual(clear, sampled + 1e-9)
                        self.assertAlmostEqual(clear, sampled, delta=width)
                    total = width * math.fsum(threat.price_at(point) for point in points)
                    # The ends of the band are located only to a sample's width, and the price may jump there.
                    self.assertAlmostEqual(leg_integral(threat, a, b), total, delta=width * (threat.influence + 1.0))

    def test_heights(self):
        for seed in range(20):
            chance = random.Random(seed)
            peaks = [
                {
                    "center": {"x": chance.uniform(-60.0, 60.0), "y": chance.uniform(-60.0, 60.0)},
                    "height": chance.uniform(5.0, 60.0),
                    "spread": {"x": chance.uniform(10.0, 40.0), "y": chance.uniform(10.0, 40.0)},
                }
                for _ in range(4)
            ]
            grid = {"kind": "grid", "origin": {"x": -60, "y": -60}, "cell": 10, "columns": 13, "rows": 13}
            grid["elevations"] = [chance.uniform(0.0, 15.0) for _ in range(169)]
            for terrain in ({"kind": "peaks", "base": -5, "peaks": peaks}, grid):
                with self.subTest(seed=seed, terrain=terrain["kind"]):
                    self.check_heights(terrain, [spot(chance) for _ in range(4)])

    def check_heights(self, terrain, points):
        ends = {"start": dict(zip("xyz", points[0])), "target": dict(zip("xyz", points[-1]))}
        scenario = read_scenario(document(terrain=terrain, altitude={"min": 20, "max": 40}, **ends))
        found = route.heights(points, scenario)
        zones = route.zones(scenario)
        outside, underground = [], -math.inf
        for a, b in zip(points, points[1:]):
            for step in range(STEPS):
                point = geo.lerp(a, b, (step + 0.5) / STEPS)
                height = point[2] - scenario.ground.elevation(point[0], point[1])
                within = [zone for zone in zones if geo.horizontal(zone.centre, point) <= zone.ramp]
                underground = max(underground, min((zone.floor for zone in within), default=0.0) - height)
                if not within:
                    outside.append(height)
        # Samples are less than 0.1 m apart, and the slopes of ground and legs are below a few metres per metre.
        self.assertAlmostEqual(found.below_ground, underground, delta=0.4)
        self.assertGreaterEqual(found.below_ground, underground - 1e-6)
        if not outside:
            self.assertIsNone(found.least)
            return
        for exact, sampled, sign in ((found.least, min(outside), 1.0), (found.greatest, max(outside), -1.0)):
            self.assertAlmostEqual(exact, sampled, delta=0.4)
            self.assertLessEqual(sign * exact, sign * sampled + 1e-6)


if __name__ == "__main__":
    unittest.main()
