"""KML against the OGC's schema; GPX, whose schema no package has, against the element order that it requires."""

import pathlib
import unittest

import pykml
from lxml import etree

from exports import routes

SCHEMA = pathlib.Path(pykml.__file__).parent / "schemas" / "ogckml22.xsd"
GPX = "{http://www.topografix.com/GPX/1/1}"

# The children of each element in order, GPX 1.1.
POINT = ["ele", "time", "magvar", "geoidheight", "name", "cmt", "desc", "src", "link", "sym", "type", "fix"]
ORDER = {
    "gpx": ["metadata", "wpt", "rte", "trk", "extensions"],
    "metadata": ["name", "desc", "author", "copyright", "link", "time", "keywords", "bounds"],
    "wpt": POINT,
    "trk": ["name", "cmt", "desc", "src", "link", "number", "type", "extensions", "trkseg"],
    "trkseg": ["trkpt", "extensions"],
    "trkpt": POINT,
}


class Schemas(unittest.TestCase):
    def test_kml(self):
        schema = etree.XMLSchema(etree.parse(str(SCHEMA)))
        for route in routes():
            with self.subTest(route.name):
                document = etree.parse(str(route.file("kml")))
                self.assertTrue(schema.validate(document), schema.error_log)

    def test_gpx(self):
        for route in routes():
            with self.subTest(route.name):
                root = etree.parse(str(route.file("gpx"))).getroot()
                self.assertEqual(root.get("version"), "1.1")
                self.assertTrue(root.get("creator"))
                for element in root.iter():
                    tag = element.tag.removeprefix(GPX)
                    children = [child.tag.removeprefix(GPX) for child in element]
                    places = [ORDER[tag].index(child) for child in children]
                    self.assertEqual(places, sorted(places), tag)
