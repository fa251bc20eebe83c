"""The judgement of one result: every figure of the document is compared with its definition."""

import math

import geometry as geo
import route
from report import ABSOLUTE, Report
from spline import Spline
from threats import route_clearance

KINDS = {"threat", "altitude", "terrain", "turn", "climb", "leg", "area"}
STOP_REASONS = {"iterations", "converged", "time-limit", "cancelled"}
# How far the spline may violate limits between its samples, metres: at threats, and in height.
SPLINE_THREAT, SPLINE_HEIGHT = 1e-3, 1e-2
# Points of the spline examined between two samples.
SPLINE_STEPS = 20


def judge(scenario, result):
    """Compares everything in `result` with what follows from `scenario`; a `Report`."""
    report = Report()
    parts = (
        ("heading", _heading),
        ("waypoints", _waypoints),
        ("legs", _legs),
        ("cost", _cost),
        ("checks.waypoints", _waypoint_checks),
        ("checks.violations", _violations),
        ("path", _path),
        ("bound", _bound),
        ("convergence", _convergence),
        ("timing", _timing),
    )
    for name, part in parts:
        with report.section(name):
            part(report, scenario, result)
    return report


def _points(documents):
    """The points of a list, as tuples of numbers."""
    found = [(point["x"], point["y"], point["z"]) for point in documents]
    for point in found:
        if any(isinstance(value, bool) or not isinstance(value, (int, float)) for value in point):
            raise ValueError(f"{point} is no point")
    return found


def _heading(report, scenario, result):
    if scenario.algorithm is not None:
        report.same("algorithm", result["algorithm"], scenario.algorithm)
    if scenario.seed is not None:
        report.same("seed", result["seed"], scenario.seed)
    report.that(isinstance(result["seed"], int) and 0 <= result["seed"] < 2**53, f"seed: {result['seed']!r}")
    report.that(result["stop_reason"] in STOP_REASONS, f"stop_reason: {result['stop_reason']!r} is not known")
    report.that(isinstance(result["feasible"], bool), f"feasible: {result['feasible']!r} is no boolean")
    report.that(bool(result["engine_version"]), "engine_version: empty")
    digest = result["scenario_sha256"]
    report.that(len(digest) == 64 and set(digest) <= set("0123456789abcdef"), f"scenario_sha256: {digest!r}")


def _waypoints(report, scenario, result):
    points = _points(result["waypoints"])
    report.same("waypoints: count", len(points), scenario.waypoints + 2)
    report.same("waypoints: first", points[0], scenario.start)
    report.same("waypoints: last", points[-1], scenario.target)


def _legs(report, scenario, result):
    points = _points(result["waypoints"])
    turns = geo.turns(points)
    report.same("legs: count", len(result["legs"]), len(points) - 1)
    for index, (leg, a, b, turn) in enumerate(zip(result["legs"], points, points[1:], turns)):
        report.near(f"legs[{index}].length", leg["length"], geo.distance(a, b), scenario.scale)
        if abs(abs(turn) - 180.0) < 1e-6 and abs(leg["turn_deg"]) > 179.0:
            turn = abs(turn) if leg["turn_deg"] > 0.0 else -abs(turn)
        report.near(f"legs[{index}].turn_deg", leg["turn_deg"], turn, 180.0)
        report.near(f"legs[{index}].climb_deg", leg["climb_deg"], geo.climb(a, b), 90.0)


def _cost(report, scenario, result):
    points = _points(result["waypoints"])
    if scenario.paper_quadrature:
        _terms(report, "cost", result["cost"], points, scenario, route.sampled_cost)
        _terms(report, "cost_integral", result["cost_integral"], points, scenario, route.cost)
    else:
        _terms(report, "cost", result["cost"], points, scenario, route.cost)


def _terms(report, name, claimed, points, scenario, price):
    """Compares the terms of a cost; a route along a threat's `top` or `base` may be rounded to either side."""
    hair = 1e-9 * scenario.scale
    low, high = price(points, scenario), None
    if scenario.threats and any(threat.band.base > -1e300 or threat.band.top < 1e300 for threat in scenario.threats):
        low, high = (price(points, scenario, shrink=shrink) for shrink in (hair, -hair))
    # Heights are given above sea level: where the middle of the band costs nothing, their rounding still does.
    rounded = scenario.weights["altitude"] * max(abs(point[2]) for point in points)
    scale = max(low["total"], rounded)
    for term in ("fuel", "threat", "altitude", "total"):
        report.near(f"{name}.{term}", claimed[term], low[term], scale, high and high[term])


def _waypoint_checks(report, scenario, result):
    _checks(report, "checks.waypoints", result["checks"]["waypoints"], _points(result["waypoints"]), scenario)


def _checks(report, name, claimed, points, scenario):
    """Compares the figures measured on one polyline."""
    report.same(f"{name}.clearance: count", len(claimed["clearance"]), len(scenario.threats))
    for index, (entry, threat) in enumerate(zip(claimed["clearance"], scenario.threats)):
        where = f"{name}.clearance[{index}]"
        report.same(f"{where}.threat", entry["threat"], index)
        report.same(f"{where}.name", entry["name"], threat.name)
        _clearance(report, f"{where}.distance", entry["distance"], threat, points, scenario)
    heights, angles = route.heights(points, scenario), route.angles(points)
    report.near(f"{name}.min_agl", claimed["min_agl"], heights.least, scenario.scale)
    report.near(f"{name}.max_agl", claimed["max_agl"], heights.greatest, scenario.scale)
    # Each leg's direction is uncertain by the uncertainty of its ends divided by its length.
    turned = math.degrees(2.0 * scenario.hair / angles.leg) if angles.leg > 0.0 else 0.0
    report.near(f"{name}.max_turn_deg", claimed["max_turn_deg"], angles.turn, 180.0 + turned / ABSOLUTE)
    report.near(f"{name}.max_climb_deg", claimed["max_climb_deg"], angles.climb, 90.0)
    report.near(f"{name}.min_leg", claimed["min_leg"], angles.leg, scenario.scale)


def _clearance(report, where, claimed, threat, points, scenario):
    """Compares one clearance; a route along the threat's `top` or `base` may be rounded to either side."""
    hair = 1e-9 * scenario.scale
    exact = route_clearance(threat, points)
    narrow, wide = (route_clearance(threat, points, shrink) for shrink in (hair, -hair))
    if claimed is not None and exact is None and wide is not None:
        report.near(where, claimed, wide, scenario.scale)
    elif claimed is not None and wide is not None and narrow is not None:
        report.near(where, claimed, wide, scenario.scale, narrow)
    elif claimed is None and narrow is None:
        report.compared += 1
    else:
        report.near(where, claimed, exact, scenario.scale)


def _violations(report, scenario, result):
    """Feasible or not: the claimed violations must be exactly those that the waypoints have."""
    claimed = {violation["kind"] for violation in result["checks"]["violations"]}
    report.that(claimed <= KINDS, f"checks.violations: unknown kinds {sorted(claimed - KINDS)}")
    for violation in result["checks"]["violations"]:
        report.that(violation["amount"] > 0.0, f"checks.violations: amount {violation['amount']!r}")
        report.that(violation["where"] and violation["message"], f"checks.violations: {violation!r} says too little")
    found = route.faults(_points(result["waypoints"]), scenario)
    for kind, amount in found.certain.items():
        report.that(kind in claimed, f"checks.violations: {kind} by {amount:.9g} is not among {sorted(claimed)}")
    for kind in sorted(claimed - set(found.possible)):
        report.that(False, f"checks.violations: {kind} is claimed, the waypoints have none")
    if result["feasible"]:
        report.that(not found.certain, f"feasible: claimed, but the waypoints violate {_told(found.certain)}")
        report.that(not claimed, f"checks.violations: {sorted(claimed)} in a feasible result")
        report.that(result["path"] is not None, "path: null in a feasible result")
    else:
        report.that(claimed, "checks.violations: empty in an infeasible result")
        report.that(found.possible, "feasible: false, but the waypoints violate nothing")
        report.that(result["path"] is None, "path: present in an infeasible result")
        report.that(result["checks"].get("path") is None, "checks.path: present in an infeasible result")


def _told(faults):
    return ", ".join(f"{kind} by {amount:.9g}" for kind, amount in faults.items())


def _path(report, scenario, result):
    path = result["path"]
    if path is None:
        return
    points = _points(path["points"])
    total = route.length(points)
    report.same("path.points: first", points[0], scenario.start)
    report.same("path.points: last", points[-1], scenario.target)
    report.near("path.length", path["length"], total, scenario.scale)
    report.near("path.duration_s", path["duration_s"], total / scenario.cruise_speed, total / scenario.cruise_speed)
    longest = max(geo.distance(a, b) for a, b in zip(points, points[1:]))
    report.that(
        longest <= scenario.spacing + 1e-6,
        f"path.points: samples {longest!r} m apart, smoothing.spacing is {scenario.spacing!r}",
    )
    found = route.faults(points, scenario, smoothed=True)
    report.that(not found.certain, f"path.points: violate {_told(found.certain)}")
    with report.section("checks.path"):
        _checks(report, "checks.path", result["checks"]["path"], points, scenario)
    with report.section("path: spline"):
        _spline(report, scenario, path, points)


def _spline(report, scenario, path, points):
    """The curve runs through the samples in order and keeps the limits between them."""
    report.same("path.degree", path["degree"], scenario.degree)
    curve = Spline(path["degree"], path["knots"], _points(path["control_points"]))
    wrong = curve.faults()
    report.that(not wrong, f"path.knots: {'; '.join(wrong)}")
    if wrong:
        return
    ends = ((curve.knots[0], points[0], "start"), (curve.knots[-1], points[-1], "target"))
    for u, point, end in ends:
        away = geo.distance(curve.at(u), point)
        report.that(away <= 1e-6, f"path.control_points: the spline is {away:.3g} m from the {end}")
    parameters, missed = curve.walk(points, 1e-6)
    report.that(
        missed is None,
        f"path.points[{len(parameters)}]: the spline passes it by {missed} m, past {len(parameters)} samples in order",
    )
    dense, stray = _densely(curve, parameters)
    for index, threat in enumerate(scenario.threats):
        if not _within(threat, points, stray):
            continue  # continue  # beyond the reach of the curve at any height
        depth = max((-_clear(threat, point) for point in dense), default=0.0)
        report.that(depth <= SPLINE_THREAT, f"path: the spline is {depth:.3g} m inside threat {index}")
    both = route.zones(scenario)
    deepest = max((_height_fault(point, scenario, both) for point in dense), default=0.0)
    report.that(deepest <= SPLINE_HEIGHT, f"path: the spline is {deepest:.3g} m out of its heights")


def _densely(curve, parameters):
    """Points of the curve between the given parameters, and how far they stray from the preceding sample."""
    found, stray = [], 0.0
    for low, high in zip(parameters, parameters[1:]):
        first = curve.at(low)
        for step in range(SPLINE_STEPS):
            point = curve.at(low + (high - low) * step / SPLINE_STEPS)
            stray = max(stray, geo.distance(first, point))
            found.append(point)
    return found, stray


def _within(threat, points, reach):
    """Whether a polyline comes within `reach` of a threat, whatever the height."""
    return any(threat.clearance_between(a, b) <= reach for a, b in zip(points, points[1:]))


def _clear(threat, point):
    """Clearance of a point of the spline; a point within the threat's heights by less than the tolerance is clear."""
    if not threat.band.holds(point[2], SPLINE_THREAT):
        return float("inf")
    return threat.clearance_at(point)


def _height_fault(point, scenario, both):
    """How far a point is outside the heights required where it is, in metres; `both` are the terminal zones."""
    within = [zone for zone in both if geo.horizontal(zone.centre, point) <= zone.ramp]
    height = point[2] - scenario.ground.elevation(point[0], point[1])
    if within:
        return max(min(zone.floor for zone in within) - height, height - max(zone.ceiling for zone in within))
    return max(-height, scenario.min_height - height, height - scenario.max_height)


def _bound(report, scenario, result):
    bound, total = result["bound"], result["cost"]["total"]
    lower, gap = bound["lower"], bound["gap"]
    if result["stop_reason"] == "converged":
        # A route that costs nothing is optimal, although its gap is not a number.
        near = total <= lower * (1.0 + scenario.gap) * (1.0 + 1e-9)
        proven = result["feasible"] and scenario.gap > 0.0 and near
        report.that(proven, f"stop_reason: converged with a gap of {gap!r}, asked for {scenario.gap!r}")
    if not result["feasible"] or not lower:
        report.same("bound.gap", gap, None)
        report.that(lower is None or lower >= 0.0, f"bound.lower: {lower!r}")
        report.that(lower is not None or not result["feasible"], "bound.lower: null in a feasible result")
        return
    report.that(0.0 < lower <= total * (1.0 + 1e-9), f"bound.lower: {lower!r} above the total {total!r}")
    report.near("bound.gap", gap, total / lower - 1.0, 1.0)


def _convergence(report, scenario, result):
    points, total = result["convergence"], result["cost"]["total"]
    numbers = [point["iteration"] for point in points]
    steps = [after - before for before, after in zip(numbers, numbers[1:])]
    # The polish may add its own point to the last iteration.
    report.that(
        numbers[0] == 0 and all(step == 1 for step in steps[:-1]) and all(step in (0, 1) for step in steps[-1:]),
        f"convergence: iterations are not 0..n in order, {numbers[:3]} to {numbers[-3:]}",
    )
    for before, after in zip(points, points[1:]):
        at = f"convergence[iteration {after['iteration']}]"
        report.that(after["evaluations"] >= before["evaluations"], f"{at}: evaluations fall")
        report.that(after["elapsed_ms"] >= before["elapsed_ms"], f"{at}: time runs back")
        if before["best_cost"] is not None:
            kept = after["best_cost"] is not None and after["best_cost"] <= before["best_cost"] * (1.0 + 1e-12)
            report.that(kept, f"{at}: best_cost worsens from {before['best_cost']!r} to {after['best_cost']!r}")
        elif after["best_cost"] is None:
            kept = after["best_violation"] <= before["best_violation"] * (1.0 + 1e-12)
            report.that(kept, f"{at}: best_violation worsens")
    for point in points:
        share = point["feasible_fraction"]
        report.that(0.0 <= share <= 1.0, f"convergence: feasible_fraction {share!r}")
        report.that(point["mean_cost"] is None or point["mean_cost"] >= 0.0, "convergence: negative mean_cost")
    last = points[-1]
    report.near("convergence: last best_cost", last["best_cost"], total if result["feasible"] else None, total)
    report.same("convergence: last evaluations", last["evaluations"], result["evaluations"])
    if result["feasible"]:
        report.that(not last["best_violation"] or last["best_violation"] < 1e-2, "convergence: last best_violation")


def _timing(report, scenario, result):
    for name in ("queued_ms", "run_ms"):
        value = result["timing"][name]
        report.that(value is None or value >= 0.0, f"timing.{name}: {value!r}")
    report.that(result["timing"]["run_ms"] is not None, "timing.run_ms: null")
