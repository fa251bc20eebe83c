"""Needs no packages: python3 -m unittest discover benches/peers"""

import json
import math
import pathlib
import random
import unittest

import tangents
from coding import Cartesian, Spherical

FILE = pathlib.Path(__file__).parents[2] / "scenarios/paper-2.json"


class Coding(unittest.TestCase):
    def test_every_spherical_position_keeps_the_turn_limit(self):
        scenario = json.loads(FILE.read_text())
        coding = Spherical(scenario, 10)
        draw = random.Random(1)
        for _ in range(100):
            position = [draw.uniform(*ends) for ends in zip(coding.lower, coding.upper)]
            free = coding.decode(position)
            self.assertEqual(len(free), 10)
            ends = [[scenario[end][axis] for axis in "xyz"] for end in ("start", "target")]
            route = [ends[0], *free, ends[1]]
            legs = [(b[0] - a[0], b[1] - a[1]) for a, b in zip(route, route[1:])]
            for one, other in zip(legs, legs[1:]):
                cross = one[0] * other[1] - one[1] * other[0]
                dot = one[0] * other[0] + one[1] * other[1]
                self.assertLess(abs(math.degrees(math.atan2(cross, dot))), 60 + 1e-6)

    def test_the_straight_position_is_straight_in_both_codings(self):
        scenario = json.loads(FILE.read_text())
        for kind in (Spherical, Cartesian):
            coding = kind(scenario, 10)
            for idx, (x, y, z) in enumerate(coding.decode(coding.straight)):
                self.assertAlmostEqual(x, 200 + (idx + 1) * 600 / 11, delta=1e-6)
                self.assertAlmostEqual(y, 100 + (idx + 1) * 700 / 11, delta=1e-6)
                self.assertTrue(0 <= z <= 200)


class Tangents(unittest.TestCase):
    def test_around_one_disc(self):
        # Two tangents of 5-3-4 triangles and the arc between them.
        expected = 8 + 3 * (math.pi - 2 * math.acos(3 / 5))
        self.assertAlmostEqual(tangents.shortest((-5, 0), (5, 0), [(0, 0, 3)]), expected)

    def test_a_clear_way_is_straight(self):
        self.assertAlmostEqual(tangents.shortest((0, 0), (3, 4), []), 5)
        self.assertAlmostEqual(tangents.shortest((0, 0), (3, 4), [(9, 9, 1)]), 5)

    def test_no_way_leads_between_overlapping_discs(self):
        discs = [(0, -2, 2.5), (0, 2, 2.5)]
        around = tangents.shortest((-8, 0), (8, 0), discs)
        self.assertGreater(around, 16 + 1)


if __name__ == "__main__":
    unittest.main()
