"""A scenario document, as posted by a caller or returned by the service, prepared for measuring."""

import json
import math
from dataclasses import dataclass

import geometry as geo
from ground import Flat, Grid, Peaks
from threats import Band, Cylinder, Polygon

# The contract's defaults for what the caller leaves out.
DEFAULTS = {
    "altitude": {"min": 0.0, "max": 200.0},
    "vehicle": {"max_turn_deg": 60.0, "max_climb_deg": 45.0, "cruise_speed": 15.0, "fuel_per_km": 1000.0},
    "weights": {"fuel": 1.0, "threat": 1.0, "altitude": 1.0},
    "planner": {"waypoints": 10},
    "smoothing": {"degree": 3, "spacing": 5.0},
}


class Unsupported(Exception):
    """This judge cannot measure a scenario of this kind."""


@dataclass
class Scenario:
    """Everything that a result's figures depend on. Metres, degrees, metres per second."""

    start: tuple
    target: tuple
    area: tuple | None  # area: tuple | None  # x_min, y_min, x_max, y_max; None when the service chooses it
    threats: list
    ground: object
    min_height: float
    max_height: float
    max_turn: float
    max_climb: float
    min_leg: float
    cruise_speed: float
    fuel_per_metre: float
    weights: dict
    waypoints: int
    degree: int
    spacing: float
    paper_quadrature: bool
    gap: float  # gap: float  # the search may end once this gap is proven; 0 means never
    algorithm: str | None
    seed: int | None
    scale: float  # scale: float  # the diagonal of everything, used for tolerances
    hair: float = 0.0  # hair: float = 0.0  # how far projected places may be off, metres

    @property
    def slack(self):
        """The largest violation in metres that still counts as feasible."""
        return max(1e-6, 1e-9 * self.scale)

    @property
    def height_slack(self):
        """The same for heights above ground."""
        return max(self.slack, self.ground.slack)


def load(path):
    """Reads a JSON document, refusing NaN, infinities and duplicate keys."""
    with open(path, encoding="utf-8") as file:
        return json.load(file, parse_constant=_refuse_constant, object_pairs_hook=_unique)


def read_scenario(document):
    """The `Scenario` of a document. Raises `Unsupported` for scenarios that cannot be measured without the service."""
    if document.get("frame", "local") != "local":
        raise Unsupported(f"frame {document['frame']}, only local is judged")
    start, target = _point(document["start"]), _point(document["target"])
    ground = _ground(document.get("terrain") or {"kind": "flat"})
    threats = [_threat(threat) for threat in document.get("threats") or []]
    planner, vehicle = document.get("planner") or {}, _filled(document, "vehicle")
    waypoints = _filled(document, "planner")["waypoints"]
    smoothing, altitude = _filled(planner, "smoothing"), _filled(document, "altitude")
    area = _area(document.get("area"), ground)
    return Scenario(
        start=start,
        target=target,
        area=area,
        threats=threats,
        ground=ground,
        min_height=altitude["min"],
        max_height=altitude["max"],
        max_turn=vehicle["max_turn_deg"],
        max_climb=vehicle["max_climb_deg"],
        min_leg=vehicle.get("min_leg", geo.distance(start, target) / (10.0 * (waypoints + 1))),
        cruise_speed=vehicle["cruise_speed"],
        fuel_per_metre=vehicle["fuel_per_km"] / 1000.0,
        weights=_filled(document, "weights"),
        waypoints=waypoints,
        degree=smoothing["degree"],
        spacing=smoothing["spacing"],
        paper_quadrature=(planner.get("parameters") or {}).get("quadrature") == "paper",
        gap=(planner.get("parameters") or {}).get("gap", 0.0),
        algorithm=planner.get("algorithm"),
        seed=planner.get("seed"),
        scale=_diagonal(area, start, target, threats),
    )


def _filled(document, key):
    """The object `key` of a document, with `DEFAULTS` for missing members."""
    given = document.get(key) or {}
    return DEFAULTS[key] | {name: value for name, value in given.items() if value is not None}


def _point(point):
    return point["x"], point["y"], point["z"]


def _plane(point):
    return point["x"], point["y"]


def _threat(threat):
    band = Band(threat.get("base"), threat.get("top"))
    if threat["kind"] == "cylinder":
        influence = threat.get("influence")
        influence = threat["radius"] if influence is None else influence
        return Cylinder(threat.get("name"), _plane(threat["center"]), threat["radius"], influence, band)
    if threat["kind"] == "polygon":
        vertices = [_plane(vertex) for vertex in threat["vertices"]]
        return Polygon(threat.get("name"), vertices, threat.get("margin") or 0.0, band)
    raise Unsupported(f"threat of kind {threat['kind']}")


def _ground(terrain):
    if terrain["kind"] == "flat":
        return Flat(terrain.get("elevation") or 0.0)
    if terrain["kind"] == "peaks":
        hills = [
            (peak["height"], *_plane(peak["center"]), peak["spread"]["x"], peak["spread"]["y"])
            for peak in terrain.get("peaks") or []
        ]
        return Peaks(terrain.get("base") or 0.0, hills)
    if terrain["kind"] == "grid":
        shape = terrain["columns"], terrain["rows"]
        return Grid(_plane(terrain["origin"]), terrain["cell"], *shape, terrain["elevations"])
    raise Unsupported(f"terrain of kind {terrain['kind']}")


def _area(area, ground):
    """The given area, else the extent of a grid, else None."""
    if area is not None:
        return (*_plane(area["min"]), *_plane(area["max"]))
    return ground.extent() if isinstance(ground, Grid) else None


def _diagonal(area, start, target, threats):
    """The area's diagonal in metres; without an area, that of a box around everything named."""
    if area is None:
        spots = [start, target]
        for threat in threats:
            if isinstance(threat, Polygon):
                spots += threat.ring
            else:
                (x, y), reach = threat.centre, threat.influence
                spots += [(x - reach, y - reach), (x + reach, y + reach)]
        xs, ys = [spot[0] for spot in spots], [spot[1] for spot in spots]
        area = (min(xs), min(ys), max(xs), max(ys))
    return math.hypot(area[2] - area[0], area[3] - area[1])


def _refuse_constant(name):
    raise ValueError(f"{name} is not a number that JSON knows")


def _unique(pairs):
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError(f"duplicate key among {[key for key, _ in pairs]}")
    return found
