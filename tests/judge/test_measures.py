"""Hand-worked examples of everything the judge measures."""

import math
import unittest

import geometry as geo
import route
from ground import Grid, Peaks
from quadrature import integrate, integrate_pieces, kronrod
from scenario import Unsupported, read_scenario
from spline import Spline
from threats import Band, Cylinder, Polygon, leg_clearance, leg_integral, leg_samples, route_clearance

SQUARE = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]


def document(**changes):
    """A scenario document on flat ground without threats."""
    return {
        "start": {"x": 0, "y": 0, "z": 0},
        "target": {"x": 1000, "y": 0, "z": 0},
        "area": {"min": {"x": -100, "y": -500}, "max": {"x": 1100, "y": 500}},
        "altitude": {"min": 0, "max": 100},
        "vehicle": {"max_turn_deg": 60, "max_climb_deg": 45},
        "planner": {"algorithm": "tms-sba", "waypoints": 1, "seed": 7},
    } | changes


def cylinder(radius=5.0, influence=5.0, base=None, top=None):
    return Cylinder("c", (0.0, 0.0), radius, influence, Band(base, top))


def square(margin=5.0, base=None, top=None, ring=SQUARE):
    return Polygon("p", ring, margin, Band(base, top))


class Quadrature(unittest.TestCase):
    def test_the_rule_is_exact_for_polynomials_of_degree_22(self):
        for power in range(23):
            value, _ = kronrod(lambda x: x**power, 0.0, 1.0)
            self.assertAlmostEqual(value, 1.0 / (power + 1), delta=1e-15)

    def test_smooth_and_kinked(self):
        self.assertAlmostEqual(integrate(math.exp, 0.0, 1.0, 1e-13), math.e - 1.0, delta=1e-13)
        self.assertAlmostEqual(integrate_pieces(abs, -1.0, 2.0, [0.0], 1e-13), 2.5, delta=1e-13)
        self.assertAlmostEqual(integrate(lambda x: abs(x - 0.3), 0.0, 1.0, 1e-12), 0.29, delta=1e-11)


class Turns(unittest.TestCase):
    def check(self, points, expected):
        found = geo.turns([(*point, 0.0) if len(point) == 2 else point for point in points])
        self.assertEqual(len(found), len(expected))
        for value, known in zip(found, expected):
            self.assertAlmostEqual(value, known, delta=1e-9)

    def test_signs(self):
        self.check([(0, 0), (1, 0), (1, 1)], [0, 90])
        self.check([(0, 0), (1, 0), (1, -1)], [0, -90])
        self.check([(0, 0), (1, 1), (2, 2)], [0, 0])

    def test_wraps_at_the_west(self):
        self.check([(0, 0), (-1, 1), (-2, 0)], [0, 90])
        self.check([(0, 0), (-1, -1), (-2, 0)], [0, -90])

    def test_a_vertical_leg_keeps_the_heading(self):
        self.check([(0, 0, 0), (1, 0, 0), (1, 0, 9), (1, 1, 9)], [0, 0, 90])
        self.check([(0, 0, 0), (0, 0, 9), (1, 1, 9)], [0, 0])

    def test_climb(self):
        self.assertAlmostEqual(geo.climb((0, 0, 0), (3, 4, 5)), 45.0)
        self.assertAlmostEqual(geo.climb((0, 0, 5), (0, 0, 0)), -90.0)


class CylinderThreat(unittest.TestCase):
    def test_a_chord_of_the_soft_zone(self):
        # Influence 5, passing the axis at distance 3: the chord runs from -4 to 4, and the integral of 5 -
        # sqrt(9 + s^2) is 40 - (4 * 5 + 9 asinh(4/3)) = 20 - 9 ln 3.
        known = 20.0 - 9.0 * math.log(3.0)
        threat = cylinder(radius=2.0)
        self.assertAlmostEqual(leg_integral(threat, (-50.0, 3.0, 0.0), (70.0, 3.0, 0.0)), known, delta=1e-9)
        # Climbing at 45 degrees the same chord is sqrt(2) longer.
        climbing = leg_integral(threat, (-50.0, 3.0, 0.0), (70.0, 3.0, 120.0))
        self.assertAlmostEqual(climbing, known * math.sqrt(2.0), delta=1e-9)
        # Half of it for a leg that ends abreast of the axis.
        self.assertAlmostEqual(leg_integral(threat, (-50.0, 3.0, 0.0), (0.0, 3.0, 0.0)), known / 2.0, delta=1e-9)

    def test_the_cost_keeps_growing_towards_the_axis(self):
        self.assertAlmostEqual(leg_integral(cylinder(), (-9.0, 0.0, 0.0), (9.0, 0.0, 0.0)), 25.0, delta=1e-9)

    def test_a_leg_far_from_the_origin_is_integrated_as_fast(self):
        away = (3_000_016.2, 3_000_024.7)
        ring = [(x + away[0], y + away[1]) for x, y in ((0.0, 0.0), (1.5, 0.1), (1.4, 1.6), (0.1, 1.3))]
        here = square(margin=0.3, ring=[(x - away[0], y - away[1]) for x, y in ring])
        there = square(margin=0.3, ring=ring)
        for a, b in (((-1.0, -0.12), (2.0, -0.07)), ((-0.5, 1.7), (2.0, 1.5)), ((1.6, -1.0), (1.7, 2.0))):
            near = leg_integral(here, (*a, 0.0), (*b, 0.0))
            ends = [(x + away[0], y + away[1], 0.0) for x, y in (a, b)]
            self.assertGreater(near, 0.05)
            self.assertAlmostEqual(leg_integral(there, *ends), near, delta=1e-7)

    def test_a_vertical_leg(self):
        self.assertAlmostEqual(leg_integral(cylinder(), (3.0, 0.0, 0.0), (3.0, 0.0, 10.0)), 20.0, delta=1e-9)
        limited = cylinder(base=2.0, top=6.0)
        self.assertAlmostEqual(leg_integral(limited, (3.0, 0.0, 0.0), (3.0, 0.0, 10.0)), 8.0, delta=1e-9)

    def test_a_tangent_leg(self):
        a, b = (-50.0, 5.0, 0.0), (70.0, 5.0, 0.0)
        self.assertEqual(leg_clearance(cylinder(), a, b), 0.0)
        self.assertEqual(leg_integral(cylinder(), a, b), 0.0)

    def test_five_samples(self):
        # Of the samples at -10, -5, 0, 5, 10 along the chord at distance 3, only the middle one is within 5: T = 2,
        # times a fifth of 20 m.
        self.assertAlmostEqual(leg_samples(cylinder(), (-10.0, 3.0, 0.0), (10.0, 3.0, 0.0)), 8.0)

    def test_over_the_top(self):
        threat = cylinder(radius=2.0, top=10.0)
        self.assertIsNone(leg_clearance(threat, (-50.0, 0.0, 10.0), (50.0, 0.0, 10.0)))
        self.assertEqual(leg_integral(threat, (-50.0, 0.0, 10.0), (50.0, 0.0, 10.0)), 0.0)
        self.assertEqual(leg_samples(threat, (-50.0, 0.0, 10.0), (50.0, 0.0, 10.0)), 0.0)
        self.assertEqual(leg_clearance(threat, (-50.0, 0.0, 9.0), (50.0, 0.0, 9.0)), -2.0)
        # Rising from the ground 10 m before the axis at 45 degrees: below the top until abreast of it.
        self.assertAlmostEqual(leg_clearance(threat, (-10.0, 3.0, 0.0), (20.0, 3.0, 30.0)), 1.0)
        # Twice as steep: the top is reached 5 m before the axis, at hypot(5, 3) from it.
        clear = leg_clearance(threat, (-10.0, 3.0, 0.0), (20.0, 3.0, 60.0))
        self.assertAlmostEqual(clear, math.hypot(5.0, 3.0) - 2.0)
        self.assertEqual(leg_integral(threat, (-10.0, 3.0, 0.0), (20.0, 3.0, 60.0)), 0.0)

    def test_under_the_base(self):
        threat = cylinder(base=10.0)
        self.assertIsNone(leg_clearance(threat, (-50.0, 0.0, 9.9), (50.0, 0.0, 9.9)))
        self.assertEqual(leg_clearance(threat, (-50.0, 0.0, 10.0), (50.0, 0.0, 10.0)), -5.0)
        # The leg touches the base at its end only: that point counts.
        self.assertEqual(leg_clearance(threat, (-50.0, 0.0, 9.0), (9.0, 0.0, 10.0)), 4.0)

    def test_the_least_of_the_legs(self):
        points = [(-50.0, 9.0, 0.0), (0.0, 8.0, 0.0), (50.0, 9.0, 0.0)]
        self.assertAlmostEqual(route_clearance(cylinder(), points), 3.0)


class PolygonThreat(unittest.TestCase):
    def test_of_points(self):
        for point, known in (((15, 5), 5), ((13, 14), 5), ((5, 5), -5), ((5, 2), -2), ((10, 5), 0)):
            self.assertAlmostEqual(square().clearance_at(point), known)

    def check(self, a, b, known, ring=SQUARE):
        for first, last in ((a, b), (b, a)):
            clear = square(ring=ring).clearance_between((*first, 0.0), (*last, 0.0))
            self.assertAlmostEqual(clear, known, delta=1e-9)

    def test_of_legs(self):
        self.check((-5, 13), (15, 13), 3)
        self.check((-5, 2), (15, 2), -2)
        self.check((-5, -5), (15, 15), -5)
        self.check((4, 4.5), (6, 4.5), -4.5)
        self.check((20, 5), (30, 5), 10)
        self.check((-5, 0), (15, 0), 0)
        self.check((-5, 5), (5, 15), 0)
        # Across a corner, 0.4 m deep along the diagonal: deepest abreast of the corner, at (0.4, 9.6) / 2 from it.
        self.check((-4, 5.6), (4.4, 14), -0.2)
        self.check((3, 5), (3, 5), -3)

    def test_a_notch_is_not_entered(self):
        notched = [(0, 0), (10, 0), (10, 10), (6, 10), (6, 2), (4, 2), (4, 10), (0, 10)]
        self.check((5, 20), (5, 4), 1, notched)
        self.check((-5, 6), (15, 6), -2, notched)

    def test_a_repeated_first_vertex_is_dropped(self):
        self.assertEqual(square(ring=[*SQUARE, SQUARE[0]]).ring, SQUARE)

    def test_beside_it(self):
        # 4 m beside an edge of 10 m with a margin of 5: 10 * 1 abreast of it, plus twice the integral over 0..3
        # of 5 - sqrt(16 + s^2) at its ends, 15/2 - 8 ln 2 each.
        known = 10.0 + 15.0 - 16.0 * math.log(2.0)
        self.assertAlmostEqual(leg_integral(square(), (-20.0, -4.0, 0.0), (30.0, -4.0, 0.0)), known, delta=1e-9)

    def test_across_it(self):
        # The margin twice, 5^2 / 2 each, and its full value over the 10 m inside.
        self.assertAlmostEqual(leg_integral(square(), (-20.0, 5.0, 0.0), (30.0, 5.0, 0.0)), 75.0, delta=1e-9)

    def test_grazing_its_margin(self):
        self.assertEqual(leg_integral(square(), (-20.0, -5.0, 0.0), (30.0, -5.0, 0.0)), 0.0)
        # A corner at (0, 0) passed at distance 4.9: the same chord as for a disc of 5.
        half = math.sqrt(25.0 - 4.9**2)
        known = 2.0 * (5.0 * half - 0.5 * (half * 5.0 + 4.9**2 * math.asinh(half / 4.9)))
        a = (-4.9 * math.sqrt(0.5) - 500.0, -4.9 * math.sqrt(0.5) + 500.0, 0.0)
        b = (a[0] + 1000.0, a[1] - 1000.0, 0.0)
        self.assertAlmostEqual(leg_integral(square(), a, b), known, delta=1e-8)

    def test_without_margin_it_costs_nothing(self):
        self.assertEqual(leg_integral(square(margin=0.0), (-20.0, 5.0, 0.0), (30.0, 5.0, 0.0)), 0.0)


class Ground(unittest.TestCase):
    def test_the_summit_of_a_peak(self):
        ground = Peaks(10.0, [(200.0, 333.3, 7.0, 90.0, 70.0)])
        least, greatest = ground.heights((0.0, 0.0, 300.0), (1000.0, 0.0, 300.0))
        self.assertAlmostEqual(least, 290.0 - 200.0 * math.exp(-0.01), delta=1e-9)
        self.assertAlmostEqual(greatest, 290.0, delta=1e-9)

    def test_climbing_with_the_slope_of_a_peak(self):
        ground = Peaks(0.0, [(100.0, 0.0, 0.0, 50.0, 50.0)])
        a, b = (-100.0, 0.0, 20.0), (0.0, 0.0, 120.0)
        least, _ = ground.heights(a, b)
        fine = min(120.0 + x - ground.elevation(x, 0.0) for x in (-100.0 + 1e-3 * step for step in range(100_001)))
        self.assertAlmostEqual(least, fine, delta=1e-6)

    def test_a_cell_of_a_grid_is_a_saddle(self):
        ground = Grid((0.0, 0.0), 10.0, 2, 2, [0.0, 10.0, 10.0, 0.0])
        least, greatest = ground.heights((0.0, 0.0, 50.0), (10.0, 10.0, 50.0))
        self.assertAlmostEqual(least, 45.0)
        self.assertAlmostEqual(greatest, 50.0)

    def test_rows_run_from_south_to_north(self):
        ground = Grid((100.0, 200.0), 10.0, 3, 2, [0.0, 1.0, 2.0, 10.0, 11.0, 12.0])
        self.assertEqual(ground.extent(), (100.0, 200.0, 120.0, 210.0))
        for x, y, known in ((100, 200, 0), (120, 200, 2), (100, 210, 10), (115, 205, 6.5), (120, 210, 12)):
            self.assertAlmostEqual(ground.elevation(x, y), known)

    def test_a_ridge_of_nodes_is_met_between_waypoints(self):
        ground = Grid((0.0, 0.0), 10.0, 4, 2, [0.0, 7.0, 0.0, 0.0, 0.0, 7.0, 0.0, 0.0])
        self.assertEqual(ground.heights((0.0, 5.0, 20.0), (30.0, 5.0, 20.0)), (13.0, 20.0))


class TerminalZones(unittest.TestCase):
    """Start and target at heights outside the band, which is 10 to 100 m unless given."""

    def measure(self, points, **changes):
        scenario = read_scenario(document(**({"altitude": {"min": 10, "max": 100}} | changes)))
        return route.heights([scenario.start, *points, scenario.target], scenario)

    def test_the_ramp_is_twice_the_missing_height(self):
        # 10 m are missing at 45 degrees: a ramp of 20 m. Rising by one in twenty, the route is at 1 m at its end.
        found = self.measure([(200.0, 0.0, 10.0), (800.0, 0.0, 10.0)])
        self.assertAlmostEqual(found.least, 1.0)
        self.assertAlmostEqual(found.below_band, 9.0)
        self.assertAlmostEqual(found.below_ground, 0.0)

    def test_a_steeper_climb_is_clear(self):
        found = self.measure([(20.0, 0.0, 10.0), (980.0, 0.0, 10.0)])
        self.assertAlmostEqual(found.least, 10.0)
        self.assertAlmostEqual(found.below_band, 0.0)

    def test_from_above_the_band(self):
        start = {"x": 0, "y": 0, "z": 150}
        found = self.measure([(50.0, 0.0, 100.0), (980.0, 0.0, 10.0)], start=start)
        self.assertAlmostEqual(found.above_band, 0.0)
        found = self.measure([(30.0, 0.0, 170.0), (200.0, 0.0, 60.0), (980.0, 0.0, 10.0)], start=start)
        self.assertAlmostEqual(found.above_band, 170.0 - 110.0 * 70.0 / 170.0 - 100.0)

    def test_a_route_within_the_zones(self):
        found = self.measure([(8.0, 0.0, 5.0)], target={"x": 15, "y": 0, "z": 0})
        self.assertIsNone(found.least)
        self.assertIsNone(found.greatest)
        self.assertLessEqual(found.below_ground, 0.0)

    def test_standing_slightly_below_ground(self):
        # The zone is 0.1 m wide: a route that is above ground at its edge has not been below it.
        start, altitude = {"x": 0, "y": 0, "z": -0.05}, {"min": 0, "max": 100}
        found = self.measure([(50.0, 0.0, 49.95), (500.0, 0.0, 50.0)], start=start, altitude=altitude)
        self.assertAlmostEqual(found.below_ground, 0.0)
        self.assertAlmostEqual(found.least, 0.0)
        found = self.measure([(50.0, 0.0, 4.95), (500.0, 0.0, 50.0)], start=start, altitude=altitude)
        self.assertAlmostEqual(found.below_ground, 0.04)

    def test_the_ramp_begins_at_the_ground_of_a_grid(self):
        terrain = {"kind": "grid", "origin": {"x": 0, "y": -50}, "cell": 1000, "columns": 2, "rows": 2}
        terrain["elevations"] = [100.0, 0.0, 100.0, 0.0]
        found = self.measure(
            [(100.0, 0.0, 120.0)],
            area=None,
            terrain=terrain,
            start={"x": 0, "y": 0, "z": 100},
            target={"x": 1000, "y": 0, "z": 50},
        )
        # The ramp is 20 m long: at its end the route is at 104 over ground at 98.
        self.assertAlmostEqual(found.least, 6.0)

    def test_the_ramp_begins_at_the_ground_of_a_peak(self):
        terrain = {"kind": "peaks", "base": 0, "peaks": []}
        terrain["peaks"].append({"center": {"x": 0, "y": 0}, "height": 100, "spread": {"x": 90, "y": 90}})
        start = {"x": 0, "y": 0, "z": 100}
        found = self.measure([(20.0, 0.0, 105.0), (980.0, 0.0, 15.0)], terrain=terrain, start=start)
        # At the ramp's end, 20 m away, the ground has fallen as the Gaussian does.
        self.assertAlmostEqual(found.least, 105.0 - 100.0 * math.exp(-((20.0 / 90.0) ** 2)), delta=1e-9)
        self.assertAlmostEqual(found.below_band, 10.0 - found.least)


class Faults(unittest.TestCase):
    def check(self, free, expected, **changes):
        scenario = read_scenario(document(**changes))
        found = route.faults([scenario.start, *free, scenario.target], scenario)
        self.assertEqual(set(found.certain), expected)
        # Below ground the band is left as well.
        self.assertEqual(set(found.possible) - ({"altitude"} if "terrain" in expected else set()), expected)

    def test_each_kind(self):
        disc = {"kind": "cylinder", "center": {"x": 300, "y": 0}, "radius": 20}
        ring = {"kind": "polygon", "vertices": [{"x": x, "y": y} for x, y in ((250, -9), (350, -9), (300, 60))]}
        self.check([(500, 0, 50)], set())
        self.check([(500, 0, 50)], {"threat"}, threats=[disc])
        self.check([(500, 0, 50)], set(), threats=[disc | {"top": 28}])
        self.check([(500, 0, 50)], {"threat"}, threats=[disc | {"top": 28.1}])
        self.check([(500, 0, 50)], {"threat"}, threats=[ring])
        self.check([(500, 0, 110)], {"altitude"})
        self.check([(500, 0, -1)], {"terrain"})
        self.check([(500, 300, 50)], {"turn"})
        self.check([(500, 0, 50)], {"climb"}, vehicle={"max_climb_deg": 5})
        self.check([(5, 0, 2)], {"leg"})
        self.check([(1150, 0, 50)], {"area", "turn"})

    def test_touching_is_clear(self):
        disc = {"kind": "cylinder", "center": {"x": 300, "y": 20}, "radius": 20}
        ring = {"kind": "polygon", "vertices": [{"x": x, "y": y} for x, y in ((250, 0), (350, 0), (300, 60))]}
        self.check([(500, 0, 50)], set(), threats=[disc, ring])

    def test_the_last_leg_counts_towards_the_climb(self):
        self.check([(960, 0, 50)], {"climb"})


class Curves(unittest.TestCase):
    CONTROL = [(0.0, 0.0, 0.0), (1.0, 2.0, 0.0), (3.0, 2.0, 1.0), (4.0, 0.0, 4.0)]

    def test_a_bezier_arc(self):
        curve = Spline(3, [0.0] * 4 + [1.0] * 4, self.CONTROL)
        self.assertEqual(curve.faults(), [])
        for value, known in zip(curve.at(0.5), (2.0, 1.5, 0.875)):
            self.assertAlmostEqual(value, known)
        self.assertEqual(curve.at(0.0), self.CONTROL[0])
        self.assertEqual(curve.at(1.0), self.CONTROL[-1])

    def test_two_spans_of_degree_two(self):
        # At the middle knot a quadratic spline is halfway between its two neighbouring control points.
        curve = Spline(2, [0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0], self.CONTROL)
        for value, known in zip(curve.at(0.5), (2.0, 2.0, 0.5)):
            self.assertAlmostEqual(value, known)

    def test_wrong_knots(self):
        for knots in (
            [0.0] * 4 + [1.0] * 3,
            [0.0, 0.0, 0.0, 0.1, 1.0, 1.0, 1.0, 1.0],
            [0.0] * 4 + [1.0, 1.0, 1.0, 0.9],
            [0.0] * 8,
        ):
            self.assertNotEqual(Spline(3, knots, self.CONTROL).faults(), [])
        inner = [0.0] * 3 + [0.5] * 2 + [1.0] * 3
        self.assertEqual(Spline(2, inner, [*self.CONTROL, (5.0, 0.0, 4.0)]).faults(), [])
        torn = [0.0] * 2 + [0.5] * 2 + [1.0] * 2
        self.assertNotEqual(Spline(1, torn, self.CONTROL).faults(), [])

    def test_walking_the_curve(self):
        curve = Spline(3, [0.0] * 4 + [1.0] * 4, self.CONTROL)
        given = [0.0, 0.1, 0.37, 0.62, 1.0]
        samples = [curve.at(u) for u in given]
        found, missed = curve.walk(samples, 1e-6)
        self.assertIsNone(missed)
        for u, known in zip(found, given):
            self.assertAlmostEqual(u, known, delta=1e-6)
        found, missed = curve.walk([samples[0], samples[2], samples[1]], 1e-6)
        self.assertEqual(len(found), 2)
        x, y, z = samples[2]
        _, missed = curve.walk([(x, y, z + 1e-5)], 1e-6)
        self.assertGreater(missed, 1e-6)


class Documents(unittest.TestCase):
    def test_unsupported_scenarios(self):
        for changes in ({"frame": "wgs84"}, {"terrain": {"kind": "dataset", "name": "jacksboro"}}):
            with self.assertRaises(Unsupported):
                read_scenario(document(**changes))

    def test_defaults(self):
        scenario = read_scenario(document(vehicle={"min_leg": None}, altitude=None, planner={}))
        self.assertEqual((scenario.max_turn, scenario.max_climb, scenario.waypoints), (60.0, 45.0, 10))
        self.assertAlmostEqual(scenario.min_leg, 1000.0 / 110.0)
        self.assertEqual(scenario.weights, {"fuel": 1.0, "threat": 1.0, "altitude": 1.0})

    def test_the_terms_of_the_cost(self):
        disc = {"kind": "cylinder", "center": {"x": 250, "y": 3}, "radius": 2, "influence": 5}
        scenario = read_scenario(
            document(
                threats=[disc],
                start={"x": 0, "y": 0, "z": 20},
                target={"x": 1000, "y": 0, "z": 20},
                weights={"fuel": 0.5, "threat": 2.0, "altitude": 3.0},
                vehicle={"fuel_per_km": 100},
            )
        )
        found = route.cost([scenario.start, (500.0, 0.0, 20.0), scenario.target], scenario)
        threat = 2.0 * (20.0 - 9.0 * math.log(3.0)) / 5.0
        known = {"fuel": 50.0, "threat": threat, "altitude": 90.0, "total": 140.0 + threat}
        for term, value in known.items():
            self.assertAlmostEqual(found[term], value, delta=1e-9)


if __name__ == "__main__":
    unittest.main()
