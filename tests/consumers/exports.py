"""The exported routes, and their results."""

import json
import os
import pathlib
import xml.etree.ElementTree as xml

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
        self.above_sea = self.result["frame"]["altitude_datum"] == "msl"

    def file(self, extension):
        return EXPORTS / f"{self.name}.{extension}"

    def geoid(self, kind):
        """Heights of the geoid that the GPX states at its points of this kind, metres."""
        namespace = "{http://www.topografix.com/GPX/1/1}"
        points = xml.parse(self.file("gpx")).getroot().iter(namespace + kind)
        return [float(point.find(namespace + "geoidheight").text) for point in points]

    def path(self, datum):
        """(longitude, latitude, altitude) of each sample."""
        return self._above(datum, self.result["path"]["points"], "trkpt")

    def waypoints(self, datum):
        return self._above(datum, self.result["waypoints"], "wpt")

    def _above(self, datum, points, kind):
        geoid = self.geoid(kind)
        assert len(geoid) == len(points), (len(geoid), len(points))
        up = (datum == "ellipsoid") - (not self.above_sea)
        return [(point["lon"], point["lat"], point["alt"] + up * height) for point, height in zip(points, geoid)]


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
