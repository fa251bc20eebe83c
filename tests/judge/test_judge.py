"""The judge agrees with correct results and finds every falsification."""

import contextlib
import copy
import io
import json
import tempfile
import unittest
from pathlib import Path

import honest
import judge as command
from scenario import read_scenario
from verdict import judge

SCENARIO = {
    "start": {"x": 0, "y": 0, "z": 1},
    "target": {"x": 300, "y": 0, "z": 60},
    "area": {"min": {"x": -50, "y": -100}, "max": {"x": 350, "y": 150}},
    "threats": [
        {"kind": "cylinder", "name": "radar", "center": {"x": 150, "y": -40}, "radius": 40, "influence": 100},
        {
            "kind": "polygon",
            "vertices": [{"x": 50, "y": 80}, {"x": 100, "y": 80}, {"x": 75, "y": 120}],
            "margin": 60,
            "top": 45,
        },
        {"kind": "cylinder", "name": "high", "center": {"x": 250, "y": 20}, "radius": 15, "influence": 20, "base": 90},
    ],
    "altitude": {"min": 10, "max": 100},
    "vehicle": {"max_turn_deg": 60, "max_climb_deg": 45, "cruise_speed": 15, "fuel_per_km": 1000},
    "weights": {"fuel": 0.5, "threat": 1, "altitude": 1},
    "planner": {"algorithm": "tms-sba", "waypoints": 2, "seed": 7},
}
FREE = [(60.0, 30.0, 50.0), (200.0, 40.0, 50.0)]
PEAKS = {
    "kind": "peaks",
    "base": 0,
    "peaks": [{"center": {"x": 150, "y": 60}, "height": 30, "spread": {"x": 90, "y": 70}}],
}
GRID = {
    "kind": "grid",
    "origin": {"x": -50, "y": -100},
    "cell": 50,
    "columns": 9,
    "rows": 6,
    "elevations": [0.2 * ((7 * node) % 5) for node in range(54)],
}
# Figures that only the result can know.
UNKNOWABLE = ("elapsed_ms", "mean_cost", "feasible_fraction", "best_violation", "timing") + tuple(
    f"convergence.{index}." for index in range(3)
)


def leaves(document, path=()):
    """The paths of all numbers in a document."""
    if isinstance(document, dict):
        return [leaf for key, value in document.items() for leaf in leaves(value, (*path, key))]
    if isinstance(document, list):
        return [leaf for index, value in enumerate(document) for leaf in leaves(value, (*path, index))]
    return [path] if isinstance(document, (int, float)) and not isinstance(document, bool) else []


def put(document, path, change):
    """A copy of a document with `change` applied to the value at `path`."""
    changed = copy.deepcopy(document)
    place = changed
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = change(place[path[-1]])
    return changed


class Case(unittest.TestCase):
    def complaints(self, result, **changes):
        return judge(read_scenario(SCENARIO | changes), result).disagreements

    def agrees(self, result, **changes):
        self.assertEqual(self.complaints(result, **changes), [])

    def found(self, result, fragment, **changes):
        complaints = self.complaints(result, **changes)
        self.assertTrue(any(fragment in complaint for complaint in complaints), f"{fragment!r} not in {complaints}")


class Truth(Case):
    def test_on_every_ground(self):
        for terrain in (None, PEAKS, GRID):
            self.agrees(honest.result(SCENARIO | {"terrain": terrain}, FREE), terrain=terrain)

    def test_by_the_papers_quadrature(self):
        planner = SCENARIO["planner"] | {"parameters": {"quadrature": "paper"}}
        result = honest.result(SCENARIO | {"planner": planner}, FREE)
        self.assertNotAlmostEqual(result["cost"]["threat"], result["cost_integral"]["threat"], delta=1e-3)
        self.agrees(result, planner=planner)
        for cost in ("cost", "cost_integral"):
            changed = put(result, (cost, "threat"), lambda x: x + 1e-2)
            self.found(changed, f"{cost}.threat", planner=planner)

    def test_of_an_infeasible_route(self):
        for free, kind in (
            ([(60.0, 30.0, 50.0), (150.0, -10.0, 50.0)], "threat"),
            ([(100.0, 40.0, 120.0), (200.0, 40.0, 50.0)], "altitude"),
            ([(100.0, 40.0, -3.0), (200.0, 40.0, 50.0)], "terrain"),
            ([(100.0, 140.0, 50.0), (200.0, 140.0, 60.0)], "threat"),
            ([(100.0, 149.0, 60.0), (200.0, 40.0, 60.0)], "turn"),
            ([(100.0, 155.0, 60.0), (200.0, 155.0, 60.0)], "area"),
            ([(100.0, 40.0, 60.0), (101.0, 40.0, 60.0)], "leg"),
            ([(60.0, 30.0, 50.0), (299.0, 0.0, 50.0)], "climb"),
        ):
            result = honest.result(SCENARIO, free)
            self.assertIn(kind, [violation["kind"] for violation in result["checks"]["violations"]])
            self.agrees(result)

    def test_of_rounded_heights(self):
        # At the middle of the band and with free fuel, the only cost left comes from rounding heights.
        nothing = {"weights": {"fuel": 0, "threat": 1, "altitude": 1}, "threats": []}
        result = honest.result(SCENARIO | nothing, [(x, y, 55.0) for x, y, _ in FREE])
        self.assertEqual(result["cost"]["total"], 0.0)
        for off, is_told in ((1e-12, False), (1e-6, True)):
            complaints = self.complaints(put(result, ("cost", "altitude"), lambda _, off=off: off), **nothing)
            self.assertEqual(any("cost.altitude" in complaint for complaint in complaints), is_told)

    def test_of_a_route_outside_an_area_chosen_by_the_service(self):
        # The scenario gives no area, so a false claim cannot be told from a true one.
        result = honest.result(SCENARIO, [(100.0, 155.0, 60.0), (200.0, 155.0, 60.0)])
        self.assertIn("area", [violation["kind"] for violation in result["checks"]["violations"]])
        self.assertEqual(self.complaints(result, area=None), self.complaints(result))


class Falsehood(Case):
    def setUp(self):
        self.truth = honest.result(SCENARIO, FREE)

    def test_every_figure_is_compared(self):
        for path in leaves(self.truth):
            name = ".".join(map(str, path)) + "."
            if any(part in name for part in UNKNOWABLE):
                continue
            if path[:2] == ("path", "points") and path[2] not in (0, 30, 31, 60):
                continue
            changed = put(self.truth, path, lambda x: x * (1.0 + 1e-4) if x else x + 1e-4)
            self.assertNotEqual(self.complaints(changed), [], f"{name} may be anything")

    def test_every_part_is_required(self):
        for part in self.truth:
            if part == "plan_id":
                continue
            changed = copy.deepcopy(self.truth)
            del changed[part]
            self.found(changed, "missing")

    def test_clearances(self):
        self.assertIsNone(self.truth["checks"]["waypoints"]["clearance"][2]["distance"])
        place = ("checks", "waypoints", "clearance")
        self.found(put(self.truth, (*place, 2, "distance"), lambda _: 5.0), "clearance[2].distance")
        self.found(put(self.truth, (*place, 0, "distance"), lambda _: None), "clearance[0].distance")
        self.found(put(self.truth, (*place, 0, "name"), lambda _: "other"), "clearance[0].name")
        self.found(put(self.truth, place, lambda x: x[:2]), "clearance: count")

    def test_a_waypoint_in_a_threat(self):
        self.found(put(self.truth, ("waypoints", 2, "y"), lambda _: -30.0), "violations: threat by")

    def test_a_feasible_claim_for_a_true_infeasible_route(self):
        result = honest.result(SCENARIO, [(60.0, 30.0, 50.0), (150.0, -10.0, 50.0)])
        self.assertFalse(result["feasible"])
        self.found(result | {"feasible": True}, "feasible: claimed")
        self.found(put(result, ("checks", "violations"), lambda _: []), "threat by")
        self.found(put(result, ("checks", "violations", 0, "kind"), lambda _: "climb"), "climb is claimed")
        self.found(result | {"path": self.truth["path"]}, "path: present")

    def test_an_infeasible_claim_for_a_feasible_route(self):
        self.found(self.truth | {"feasible": False}, "the waypoints violate nothing")
        violation = {"kind": "turn", "where": "leg 2", "amount": 1.0, "message": "61 degrees"}
        self.found(put(self.truth, ("checks", "violations"), lambda _: [violation]), "turn is claimed")
        self.found(self.truth | {"path": None}, "path: null")

    def test_the_number_of_waypoints(self):
        self.found(put(self.truth, ("waypoints",), lambda x: x[:2] + x[3:]), "waypoints: count")

    def test_a_path_below_ground(self):
        self.found(put(self.truth, ("path", "points", 30, "z"), lambda _: -1.0), "violate terrain")

    def test_a_path_out_of_the_band(self):
        self.found(put(self.truth, ("path", "points", 30, "z"), lambda _: 101.0), "altitude by")

    def test_a_path_in_a_threat(self):
        self.found(put(self.truth, ("path", "points", 45, "y"), lambda _: -20.0), "violate threat")

    def test_a_path_that_turns_too_much(self):
        self.found(put(self.truth, ("path", "points", 30, "y"), lambda y: y + 8.0), "turn by")

    def test_a_path_that_climbs_too_much(self):
        self.found(put(self.truth, ("path", "points", 30, "z"), lambda z: z + 8.0), "climb by")

    def test_a_path_of_few_points(self):
        self.found(put(self.truth, ("path", "points"), lambda x: x[::2] + x[-1:]), "samples")

    def test_a_path_backwards(self):
        self.found(put(self.truth, ("path", "points"), lambda x: x[::-1]), "path.points: first")

    def test_samples_out_of_order(self):
        swapped = put(self.truth, ("path", "points"), lambda x: [*x[:30], x[31], x[30], *x[32:]])
        self.found(swapped, "the spline passes it by")

    def test_a_spline_that_dips_into_a_threat_between_samples(self):
        """Two samples whose polyline clears a disc that the curve cuts."""
        disc = {"kind": "cylinder", "center": {"x": 73.0, "y": 33.5}, "radius": 0.1}
        near = SCENARIO | {"threats": [disc]}
        points = self.truth["path"]["points"]
        middle = [0.5 * (points[20][axis] + points[21][axis]) for axis in "xyz"]
        control = [tuple(place.values()) for place in self.truth["path"]["control_points"]]
        curve = honest.Spline(3, [0.0] * 4 + [1.0] * 4, control)
        count = len(points) - 1
        arc = curve.at(20.5 / count)
        # The disc's rim is 0.2 mm off the chord, and the curve bulges towards it by several millimetres.
        bulge = honest.geo.distance(arc, middle)
        self.assertGreater(bulge, 3e-3)
        away = [(arc[axis] - middle[axis]) / honest.geo.horizontal(arc, middle) for axis in range(2)]
        disc["center"] = {"x": middle[0] + 0.1002 * away[0], "y": middle[1] + 0.1002 * away[1]}
        result = honest.result(near, FREE)
        self.found(result, "the spline is", threats=[disc])

    def test_a_spline_that_leaves_the_band_between_samples(self):
        """Samples as far apart as the whole route, and a limit that they keep but the curve does not."""
        ends = {"start": {"x": 0, "y": 0, "z": 20}, "target": {"x": 300, "y": 0, "z": 20}, "threats": []}
        planner = SCENARIO["planner"] | {"smoothing": {"spacing": 200.0}}
        result = honest.result(SCENARIO | ends | {"planner": planner}, FREE)
        self.assertTrue(result["feasible"])
        top = max(place["z"] for place in result["path"]["points"])
        lower = {"altitude": {"min": 10, "max": top + 0.005}}
        complaints = self.complaints(result, planner=planner, **ends, **lower)
        self.assertFalse(any("path.points: violate" in complaint for complaint in complaints))
        self.assertTrue(any("out of its heights" in complaint for complaint in complaints), complaints)

    def test_a_spline_other_than_the_samples(self):
        path = self.truth["path"]
        control = [place | {"z": place["z"] + 1.0 * (index == 1)} for index, place in enumerate(path["control_points"])]
        self.found(self.truth | {"path": path | {"control_points": control}}, "the spline passes it by")

    def test_knots(self):
        self.found(put(self.truth, ("path", "knots"), lambda x: x[:-1]), "knots")
        self.found(put(self.truth, ("path", "degree"), lambda _: 2), "path.degree")

    def test_the_curve_of_convergence(self):
        self.found(put(self.truth, ("convergence", 2, "best_cost"), lambda x: x + 6.0), "worsens")
        self.found(put(self.truth, ("convergence", 2, "best_cost"), lambda _: None), "worsens")
        self.found(put(self.truth, ("convergence", 2, "evaluations"), lambda _: 150), "evaluations fall")
        self.found(put(self.truth, ("convergence", 1, "iteration"), lambda _: 2), "iterations are not")
        self.found(put(self.truth, ("convergence",), lambda x: x[:2]), "last best_cost")
        self.found(put(self.truth, ("convergence",), lambda _: []), "ill-formed")
        self.found(put(self.truth, ("evaluations",), lambda x: x + 1), "last evaluations")

    def test_the_bound(self):
        self.found(put(self.truth, ("bound", "lower"), lambda x: 1.2 * x), "above the total")
        self.found(put(self.truth, ("bound", "gap"), lambda _: None), "bound.gap")

    def test_an_unproven_convergence(self):
        converged = put(self.truth, ("stop_reason",), lambda _: "converged")
        self.found(converged, "asked for 0.0")
        for asked, sound in [(2.0 * self.truth["bound"]["gap"], True), (0.5 * self.truth["bound"]["gap"], False)]:
            planner = SCENARIO["planner"] | {"parameters": {"gap": asked}}
            self.assertEqual(self.complaints(converged, planner=planner) == [], sound, asked)

    def test_values_that_are_no_numbers(self):
        self.found(put(self.truth, ("cost", "total"), lambda _: "471"), "no number")
        self.found(put(self.truth, ("waypoints", 1, "x"), lambda _: "100"), "ill-formed")
        self.found(put(self.truth, ("legs",), lambda _: None), "ill-formed")
        self.assertNotEqual(self.complaints([]), [])


class CommandLine(unittest.TestCase):
    def run_with(self, results, *options, scenario=SCENARIO):
        with tempfile.TemporaryDirectory() as directory:
            files = []
            for index, result in enumerate(results):
                files.append(Path(directory, f"{index}.result.json"))
                files[-1].write_text(json.dumps(result))
                Path(directory, f"{index}.scenario.json").write_text(json.dumps(scenario))
            arguments = ["--pair", directory]
            if "--pair" not in options:
                arguments = ["--scenario", f"{directory}/0.scenario.json"]
                arguments += [word for file in files for word in ("--result", str(file))]
            output = io.StringIO()
            with contextlib.redirect_stdout(output), contextlib.redirect_stderr(io.StringIO()):
                status = command.main([*arguments, *(option for option in options if option != "--pair")])
            return status, output.getvalue()

    def test_agreement(self):
        truth = honest.result(SCENARIO, FREE)
        for options in (["--pair", "--summary"], ["--summary"]):
            status, output = self.run_with([truth, truth], *options)
            self.assertEqual(status, 0)
            self.assertTrue(output.endswith("2 passed, 0 failed\n"))
            self.assertIn("feasible 2/2, total mean", output)
        status, output = self.run_with([truth], "--quiet")
        self.assertEqual(output, "1 passed, 0 failed\n")

    def test_disagreement(self):
        truth = honest.result(SCENARIO, FREE)
        status, output = self.run_with([truth, put(truth, ("cost", "fuel"), lambda x: 1.01 * x)])
        self.assertEqual(status, 1)
        self.assertIn("cost.fuel: claimed", output)
        self.assertIn("relative difference 0.0099", output)
        self.assertTrue(output.endswith("1 passed, 1 failed\n"))

    def test_a_bound_that_another_result_disproves(self):
        good = honest.result(SCENARIO, FREE)
        worse = honest.result(SCENARIO, [(60.0, 30.0, 50.0), (200.0, 60.0, 50.0)])
        self.assertTrue(worse["feasible"])
        worse["bound"] = {"lower": worse["cost"]["total"], "gap": 0.0}
        for option in ([], ["--pair"]):
            status, output = self.run_with([good, worse], *option)
            self.assertEqual(status, 1)
            self.assertIn("of another result", output)

    def test_documents_that_cannot_be_judged(self):
        status, _ = self.run_with([{}], scenario=SCENARIO | {"frame": "wgs84"})
        self.assertEqual(status, 2)


if __name__ == "__main__":
    unittest.main()
