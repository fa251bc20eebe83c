"""The exported routes, and their results."""

import json
import os
import pathlib

EXPORTS = pathlib.Path(os.environ["NOCTULE_EXPORTS"])
NAMES = sorted(path.stem for path in EXPORTS.glob("*.svg"))
assert len(NAMES) == 5, NAMES


class Route:
    """A result with its altitudes above both datums."""

    def __init__(self, name):
        self.name = name
        self.result = json.loads(self.file("json").read_text())
        scenario = pathlib.Path(__file__).parent / "scenarios" / f"{name}.json"
        self.scenario = json.loads(scenario.read_text())
        self.undulation = self.result["frame"]["undulation"]
        self.above_sea = self.result["frame"]["altitude_datum"] == "msl"

    def file(self, extension):
        return EXPORTS / f"{self.name}.{extension}"

    def msl(self, altitude):
        return altitude if self.above_sea else altitude - self.undulation

    def ellipsoid(self, altitude):
        return altitude + self.undulation if self.above_sea else altitude

    def path(self, datum):
        """(longitude, latitude, altitude) of each sample."""
        height = getattr(self, datum)
        points = self.result["path"]["points"]
        return [(point["lon"], point["lat"], height(point["alt"])) for point in points]

    def waypoints(self, datum):
        height = getattr(self, datum)
        points = self.result["waypoints"]
        return [(point["lon"], point["lat"], height(point["alt"])) for point in points]


def routes():
    return [Route(name) for name in NAMES]


def off(one, other):
    """The distance between two positions: degrees, metres."""
    turn = abs(one[0] - other[0]) % 360
    degrees = max(min(turn, 360 - turn), abs(one[1] - other[1]))
    return degrees, abs(one[2] - other[2])


def assert_same(case, found, expected, degrees=1e-9, metres=1e-3):
    case.assertEqual(len(found), len(expected))
    for one, other in zip(found, expected):
        apart = off(one, other)
        case.assertLessEqual(apart[0], degrees, (one, other))
        case.assertLessEqual(apart[1], metres, (one, other))
