"""CZML, read by czml3 and, in Node, by Cesium itself."""

import json
import os
import pathlib
import subprocess
import unittest

import czml3

from exports import assert_same, routes

NPM = pathlib.Path(os.environ["NOCTULE_NPM"]).resolve()


class Scenes(unittest.TestCase):
    def test_czml3(self):
        for route in routes():
            with self.subTest(route.name):
                text = route.file("czml").read_text()
                document = czml3.Document.model_validate({"packets": json.loads(text)})
                packets = {packet.id: packet for packet in document.packets}
                values = packets["vehicle"].position.cartographicDegrees.values
                rows = [values[at:at + 4] for at in range(0, len(values), 4)]
                assert_same(self, [row[1:] for row in rows], route.path("ellipsoid"))
                times = [row[0] for row in rows]
                self.assertEqual(times, sorted(times))
                self.assertAlmostEqual(times[-1], route.result["path"]["duration_s"], delta=1e-3)
                threats = [name for name in packets if name.startswith("threat-")]
                self.assertEqual(len(threats), len(route.scenario["threats"]))

    def test_cesium(self):
        files = [str(route.file("czml").resolve()) for route in routes()]
        done = subprocess.run(["node", "read_czml.mjs", *files], cwd=NPM, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        for route, scene in zip(routes(), json.loads(done.stdout)):
            with self.subTest(route.name):
                path = route.path("ellipsoid")
                assert_same(self, [scene["first"], scene["last"]], [path[0], path[-1]], 1e-8, 2e-3)
                self.assertAlmostEqual(scene["seconds"], route.result["path"]["duration_s"], delta=2e-3)
                cylinders = [t for t in route.scenario["threats"] if t["kind"] == "cylinder"]
                self.assertEqual(scene["radii"], [threat["radius"] for threat in cylinders])
                self.assertEqual(scene["polygons"], len(route.scenario["threats"]) - len(cylinders))
