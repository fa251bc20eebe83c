"""Degrees are projected where PROJ projects them, and a frame that does not follow from its scenario is reported."""

import unittest

from earth import Earth, earth_of

# PROJ 9.5.1: +proj=topocentric at 36.59 N, 84.25 W, 300 m, after +proj=cart; both ends are 300 m high.
PLACES = [
    (36.59, -84.25, 0.0, 0.0),
    (36.7, -84.1, 13404.6365421, 12217.8378893),
    (37.4, -83.6, 57554.5696035, 90087.6698741),
    (35.9, -85.0, -67709.2827861, -76302.4512395),
]
SCENARIO = {
    "frame": "wgs84",
    "start": {"lat": 36.5, "lon": 179.9, "alt": 100},
    "target": {"lat": 36.6, "lon": -179.9, "alt": 300},
    "area": {"min": {"lat": 36.4, "lon": 179.8}, "max": {"lat": 36.8, "lon": -179.8}},
    "altitude": {"min": 0, "max": 100},
    "vehicle": {"min_leg": 5},
}
FRAME = {
    "kind": "wgs84",
    "altitude_datum": "msl",
    "origin": {"lat": 36.6, "lon": 180.0, "alt": 200},
    "undulation": -5.0,
}


class TestEarth(unittest.TestCase):
    def test_places_are_projected_as_by_proj(self):
        plane = Earth(36.59, -84.25, 300.0, [])
        for lat, lon, x, y in PLACES:
            east, north = plane.local(lat, lon)
            self.assertAlmostEqual(east, x, delta=1e-6)
            self.assertAlmostEqual(north, y, delta=1e-6)

    def test_a_scenario_becomes_a_local_one(self):
        earth = earth_of(SCENARIO, {"frame": FRAME})
        self.assertEqual(earth.complaints, [])
        self.assertEqual(earth.height, 195.0)
        flat = earth.scenario(SCENARIO)
        self.assertEqual(flat["frame"], "local")
        self.assertEqual(flat["vehicle"], SCENARIO["vehicle"])
        self.assertEqual(flat["start"]["z"], 100)
        self.assertLess(flat["start"]["x"], -8e3)
        self.assertGreater(flat["target"]["x"], 8e3)
        area = flat["area"]
        # The northern side is the shorter one, and parallels curve towards the pole.
        self.assertAlmostEqual(area["max"]["x"], earth.local(36.8, -179.8)[0], delta=1e-6)
        self.assertAlmostEqual(area["max"]["y"], earth.local(36.8, 180.0)[1], delta=1e-6)
        self.assertAlmostEqual(area["min"]["y"], earth.local(36.4, 179.8)[1], delta=1e-6)

    def test_a_wrong_frame_is_reported(self):
        falsehoods = [
            {"altitude_datum": "ellipsoid"},
            {"undulation": 900.0},
            {"origin": FRAME["origin"] | {"alt": 201}},
            {"origin": FRAME["origin"] | {"lat": 36.60001}},
            {"origin": FRAME["origin"] | {"lon": -179.99}},
        ]
        for falsehood in falsehoods:
            with self.subTest(falsehood):
                self.assertTrue(earth_of(SCENARIO, {"frame": FRAME | falsehood}).complaints)

    def test_the_local_frame_has_no_plane(self):
        self.assertIsNone(earth_of({}, {}))


if __name__ == "__main__":
    unittest.main()
