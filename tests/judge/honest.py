"""A result document built from the judge's own measures, which the self-tests then falsify."""

import json
import math

import geometry as geo
import route
from scenario import read_scenario
from spline import Spline
from threats import route_clearance


def point(place):
    """The document of a point."""
    return dict(zip("xyz", place))


def checks(points, scenario):
    """The document of the figures measured along a polyline."""
    heights, angles = route.heights(points, scenario), route.angles(points)
    return {
        "clearance": [
            {"threat": index, "name": threat.name, "distance": route_clearance(threat, points)}
            for index, threat in enumerate(scenario.threats)
        ],
        "min_agl": heights.least,
        "max_agl": heights.greatest,
        "max_turn_deg": angles.turn,
        "max_climb_deg": angles.climb,
        "min_leg": angles.leg,
    }


def smoothed(points, scenario):
    """The document of a path: one Bezier arc with the waypoints as control points, evenly sampled."""
    degree = len(points) - 1
    curve = Spline(degree, [0.0] * (degree + 1) + [1.0] * (degree + 1), points)
    count = math.ceil(1.5 * route.length(points) / scenario.spacing)
    samples = [points[0], *(curve.at(step / count) for step in range(1, count)), points[-1]]
    total = route.length(samples)
    return {
        "points": [point(place) for place in samples],
        "length": total,
        "degree": degree,
        "knots": curve.knots,
        "control_points": [point(place) for place in points],
        "duration_s": total / scenario.cruise_speed,
    }


def result(document, free):
    """A correct result document for a scenario document and the free waypoints of a route."""
    scenario = read_scenario(document)
    points = [scenario.start, *free, scenario.target]
    faults = route.faults(points, scenario).certain
    path = None if faults else smoothed(points, scenario)
    samples = path and [tuple(place.values()) for place in path["points"]]
    cost = (route.sampled_cost if scenario.paper_quadrature else route.cost)(points, scenario)
    best = None if faults else cost["total"]
    lower = 0.0 if faults else 0.9 * cost["total"]
    found = {
        "plan_id": "018f0000-0000-7000-8000-000000000000",
        "algorithm": scenario.algorithm,
        "seed": scenario.seed,
        "engine_version": "0.1.0",
        "scenario_sha256": "0" * 64,
        "feasible": not faults,
        "stop_reason": "iterations",
        "cost": cost,
        "bound": {"lower": lower, "gap": cost["total"] / lower - 1.0 if lower else None},
        "waypoints": [point(place) for place in points],
        "legs": [
            {"length": geo.distance(a, b), "turn_deg": turn, "climb_deg": geo.climb(a, b)}
            for a, b, turn in zip(points, points[1:], geo.turns(points))
        ],
        "path": path,
        "checks": {
            "waypoints": checks(points, scenario),
            "path": samples and checks(samples, scenario),
            "violations": [
                {"kind": kind, "where": "leg 1", "amount": amount, "message": f"{kind} by {amount}"}
                for kind, amount in faults.items()
            ],
        },
        "convergence": [
            _moment(0, 100, None, 3.0),
            _moment(1, 200, best and best + 5.0, 0.0 if best else 2.0),
            _moment(2, 300, best, 0.0 if best else 2.0),
            _moment(2, 350, best, 0.0 if best else 2.0),
        ],
        "timing": {"queued_ms": 0.0, "run_ms": 12.5},
        "evaluations": 350,
    }
    if scenario.paper_quadrature:
        found["cost_integral"] = route.cost(points, scenario)
    return json.loads(json.dumps(found))


def _moment(iteration, evaluations, best, violation):
    return {
        "iteration": iteration,
        "evaluations": evaluations,
        "elapsed_ms": 0.1 * evaluations,
        "best_cost": best,
        "best_violation": violation,
        "mean_cost": None if best is None else best + 50.0,
        "feasible_fraction": 0.0 if best is None else 0.5,
    }
