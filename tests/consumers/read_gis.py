"""GeoJSON, KML and GPX, read by GDAL; GPX also by gpxpy."""

import json
import math
import subprocess
import unittest

import gpxpy

from exports import assert_same, routes


def features(file, *arguments):
    """The features that GDAL reads from a file, as GeoJSON with all digits."""
    command = ["ogr2ogr", "-f", "GeoJSON", "-lco", "COORDINATE_PRECISION=12", "/vsistdout/", str(file), *arguments]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    if done.stderr.strip():
        raise AssertionError(f"{file}: {done.stderr}")
    return json.loads(done.stdout)["features"]


def lines(features):
    """All positions of the lines among the features; pieces are joined without their cuts."""
    found = []
    for feature in features:
        geometry = feature["geometry"]
        if geometry["type"] == "LineString":
            found.append(geometry["coordinates"])
        elif geometry["type"] == "MultiLineString":
            pieces = [piece[:] for piece in geometry["coordinates"]]
            for before, after in zip(pieces, pieces[1:]):
                before.pop()
                after.pop(0)
            found.append([position for piece in pieces for position in piece])
    return found


def ring_of(geometry):
    if geometry["type"] == "Polygon":
        return geometry["coordinates"][0]
    return [corner for polygon in geometry["coordinates"] for corner in polygon[0]]


def distance(center, position):
    """Metres on the WGS 84 ellipsoid between a centre and a position at most some kilometres away."""
    radius, squared_eccentricity = 6378137, 0.00669437999014
    latitude = math.radians((center["lat"] + position[1]) / 2)
    w = math.sqrt(1 - squared_eccentricity * math.sin(latitude) ** 2)
    turn = (position[0] - center["lon"] + 180) % 360 - 180
    east = radius / w * math.cos(latitude) * math.radians(turn)
    north = radius * (1 - squared_eccentricity) / w**3 * math.radians(position[1] - center["lat"])
    return math.hypot(east, north)


class Maps(unittest.TestCase):
    def test_files_are_read_without_a_warning(self):
        for route in routes():
            for extension in ("geojson", "kml", "gpx"):
                with self.subTest(f"{route.name}.{extension}"):
                    command = ["ogrinfo", "-ro", "-al", "-so", str(route.file(extension))]
                    done = subprocess.run(command, check=True, capture_output=True, text=True)
                    self.assertEqual(done.stderr.strip(), "")

    def test_the_geoid_slopes_gently_from_the_origin(self):
        for route in routes():
            with self.subTest(route.name):
                frame = route.result["frame"]
                for point, height in zip(route.result["path"]["points"], route.geoid("trkpt")):
                    slope = 3e-4 * distance(frame["origin"], (point["lon"], point["lat"]))
                    self.assertLessEqual(abs(height - frame["undulation"]), slope + 1e-3)

    def test_geojson(self):
        for route in routes():
            with self.subTest(route.name):
                found = features(route.file("geojson"))
                (line,) = lines(found)
                assert_same(self, line, route.path("ellipsoid"))
                points = [f["geometry"]["coordinates"] for f in found if f["geometry"]["type"] == "Point"]
                assert_same(self, points, route.waypoints("ellipsoid"))
                self.threats(route, found)

    def test_kml(self):
        for route in routes():
            with self.subTest(route.name):
                title = route.scenario.get("name", "Noctule plan")
                (line,) = lines(features(route.file("kml"), title))
                assert_same(self, line, route.path("msl"))
                points = [f["geometry"]["coordinates"] for f in features(route.file("kml"), "Waypoints")]
                assert_same(self, points, route.waypoints("msl"))
                if route.scenario["threats"]:
                    self.threats(route, features(route.file("kml"), "Threats"))

    def test_gpx(self):
        for route in routes():
            with self.subTest(route.name):
                heights = ["--config", "GPX_ELE_AS_25D", "YES"]
                (line,) = lines(features(route.file("gpx"), "tracks", *heights))
                assert_same(self, line, route.path("msl"))
                marks = features(route.file("gpx"), "waypoints", *heights)
                points = [mark["geometry"]["coordinates"] for mark in marks]
                assert_same(self, points, route.waypoints("msl"))

    def test_gpx_has_times(self):
        for route in routes():
            with self.subTest(route.name):
                gpx = gpxpy.parse(route.file("gpx").read_text())
                points = gpx.tracks[0].segments[0].points
                path = [(point.longitude, point.latitude, point.elevation) for point in points]
                assert_same(self, path, route.path("msl"))
                took = (points[-1].time - points[0].time).total_seconds()
                self.assertAlmostEqual(took, route.result["path"]["duration_s"], delta=2e-3)
                times = [point.time for point in points]
                self.assertEqual(times, sorted(times))

    def threats(self, route, found):
        """Polygon corners match the scenario's; circles have 73 positions or more, all of them on the circle."""
        polygons = [f for f in found if f["geometry"]["type"] in ("Polygon", "MultiPolygon")]
        self.assertEqual(len(polygons), len(route.scenario["threats"]))
        for feature, threat in zip(polygons, route.scenario["threats"]):
            ring = ring_of(feature["geometry"])
            if threat["kind"] == "polygon":
                corners = {(c["lon"], c["lat"]) for c in threat["vertices"]}
                near = lambda c, r: abs((c[0] - r[0] + 180) % 360 - 180) < 1e-9 and abs(c[1] - r[1]) < 1e-9
                for corner in corners:
                    self.assertTrue(any(near(corner, r) for r in ring), (corner, ring))
            else:
                self.assertGreaterEqual(len(ring), 73)
                for position in ring:
                    apart = distance(threat["center"], position)
                    self.assertAlmostEqual(apart / threat["radius"], 1, delta=1e-3)
                self.assertEqual(float(feature["properties"]["radius"]), threat["radius"])
