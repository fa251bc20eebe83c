"""Elevations at random points of many files: the program's against those computed from GDAL's samples.

GDAL makes the files, says where their samples lie, and prints the samples as plain numbers; PROJ converts
degrees to the files' reference systems. The bilinear interpolation between four samples is done here, because
gdallocationinfo has it only since GDAL 3.10.
"""

import array
import json
import pathlib
import random
import subprocess
import sys

POINTS = 1000
# Shares of the range of the four samples around a point, and of a metre; the program stores single precision.
SHARE, FLOOR, ROUNDING = 1e-6, 1e-9, 2.0**-15

PROGRAM, SOURCE, SCRATCH = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


def run(*command, text=None):
    """The standard output of a program that must succeed."""
    done = subprocess.run([str(part) for part in command], input=text, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))} failed:\n{done.stderr}")
    return done.stdout


def make():
    """The files, each with its reference system and its peculiarity."""

    def translated(name, *options):
        run("gdal_translate", "-q", *options, SOURCE, SCRATCH / name)
        return SCRATCH / name

    def warped(name, *options):
        run("gdalwarp", "-q", "-overwrite", *options, SOURCE, SCRATCH / name)
        return SCRATCH / name

    point = ("-mo", "AREA_OR_POINT=Point")
    utm = ("-t_srs", "EPSG:32616", "-tr", "60", "60", "-r", "cubic")
    tiled = ("-co", "TILED=YES", "-co", "BLOCKXSIZE=64", "-co", "BLOCKYSIZE=128")
    yield "degrees, area, int32, deflate", SOURCE, "EPSG:4326"
    yield "degrees, point, int16, LZW tiles", translated(
        "point.tif", *point, "-ot", "Int16", *tiled, "-co", "COMPRESS=LZW", "-co", "PREDICTOR=2"), "EPSG:4326"
    # One of its tiles unpacks to exactly as many bytes as a reader's buffer may have.
    yield "degrees, area, int32, LZW tiles of 64", translated(
        "small.tif", "-co", "TILED=YES", "-co", "BLOCKXSIZE=64", "-co", "BLOCKYSIZE=64", "-co", "COMPRESS=LZW", "-co", "PREDICTOR=2"
    ), "EPSG:4326"
    yield "degrees, area, float32, LZW strips", translated(
        "strips.tif", "-ot", "Float32", "-co", "COMPRESS=LZW", "-co", "PREDICTOR=3"), "EPSG:4326"
    utm_file = warped("utm.tif", *utm, "-ot", "Float32", *tiled, "-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=3")
    yield "UTM, area, float32, deflate tiles", utm_file, "EPSG:32616"
    run("gdal_translate", "-q", *point, "-co", "BIGTIFF=YES", "-co", "ENDIANNESS=BIG", utm_file, SCRATCH / "utm-point.tif")
    yield "UTM, point, float32, big-endian BigTIFF", SCRATCH / "utm-point.tif", "EPSG:32616"
    yield "Albers of NAD 83, area, int32, zstd", warped(
        "albers.tif", "-t_srs", "EPSG:5070", "-tr", "80", "70", "-r", "bilinear", "-co", "COMPRESS=ZSTD"), "EPSG:5070"
    yield "Mercator of the web, area, float64", warped(
        "mercator.tif", "-t_srs", "EPSG:3857", "-r", "bilinear", "-ot", "Float64"), "EPSG:3857"
    yield "degrees, area, uint16, one strip", translated("strip.tif", "-ot", "UInt16", "-co", "BLOCKYSIZE=344"), "EPSG:4326"
    yield "degrees, area, cloud-optimised", translated("cog.tif", "-of", "COG", "-co", "BLOCKSIZE=128"), "EPSG:4326"
    yield "ESRI ASCII, corner", translated("corner.asc", "-of", "AAIGrid"), "EPSG:4326"
    text = (SCRATCH / "corner.asc").read_text()
    lines = text.splitlines()
    head = {line.split()[0]: float(line.split()[1]) for line in lines[:6]}
    middle = [f"{axis}llcenter {head[f'{axis}llcorner'] + head['cellsize'] / 2!r}" for axis in "xy"]
    centre = SCRATCH / "centre.asc"
    centre.write_text("\n".join([*lines[:2], *middle, *lines[4:]]) + "\n")
    yield "ESRI ASCII, centre", centre, "EPSG:4326"
    rectangles = ("-of", "AAIGrid", "-outsize", "200", "300", "-r", "bilinear", "-co", "FORCE_CELLSIZE=NO")
    yield "ESRI ASCII, dx and dy", translated("rectangles.asc", *rectangles), "EPSG:4326"
    warped("tile.tif", "-te", -85 - 1 / 2400, 36 - 1 / 2400, -84 + 1 / 2400, 37 + 1 / 2400, "-ts", 1201, 1201,
           "-r", "bilinear", "-ot", "Int16", "-dstnodata", "-32768")
    run("gdal_translate", "-q", "-of", "SRTMHGT", SCRATCH / "tile.tif", SCRATCH / "N36W085.hgt")
    yield "SRTM tile, mostly no data", SCRATCH / "N36W085.hgt", "EPSG:4326"


class Samples:
    """What GDAL reads from a file."""

    def __init__(self, path):
        info = json.loads(run("gdalinfo", "-json", path))
        self.columns, self.rows = info["size"]
        self.transform = info["geoTransform"]
        self.floor = ROUNDING if info["bands"][0]["type"] == "Float64" else FLOOR
        self.no_data = info["bands"][0].get("noDataValue")
        plain = SCRATCH / "plain"
        run("gdal_translate", "-q", "-of", "ENVI", "-ot", "Float64", path, plain)
        self.values = array.array("d", plain.read_bytes())

    def node(self, column, row):
        return self.values[row * self.columns + column]

    def elevation(self, x, y):
        """Bilinear elevation, and the range of the four samples; a pixel's value holds at its middle."""
        west, width, _, north, _, height = self.transform
        across, down = (x - west) / width - 0.5, (y - north) / height - 0.5
        if not (0 <= across <= self.columns - 1 and 0 <= down <= self.rows - 1):
            return None, 0.0
        column, row = min(int(across), self.columns - 2), min(int(down), self.rows - 2)
        u, v = across - column, down - row
        corners = [self.node(column + i, row + j) for j in (0, 1) for i in (0, 1)]
        if self.no_data is not None and self.no_data in corners:
            return None, 0.0
        a, b, c, d = corners
        value = (a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v
        return value, max(corners) - min(corners)


def projected(places, crs):
    """Degrees converted to a reference system by PROJ."""
    if crs == "EPSG:4326":
        return [(lon, lat) for lat, lon in places]
    text = "".join(f"{lon!r} {lat!r}\n" for lat, lon in places)
    lines = run("gdaltransform", "-s_srs", "EPSG:4326", "-t_srs", crs, "-output_xy", text=text).splitlines()
    return [tuple(map(float, line.split())) for line in lines]


def compare(path, crs, draw):
    """The number of points with an elevation, and the largest deviations: metres, and shares of the tolerance."""
    samples = Samples(path)
    info = json.loads(run(PROGRAM, "terrain", "info", path))
    assert info["crs"] == crs, info
    assert (info["columns"], info["rows"]) == (samples.columns, samples.rows), info
    reach = info["degrees"]
    # A hundredth of the points lie beyond the edge or near it.
    wide = 0.005
    places = [
        (
            draw.uniform(reach["south"] - wide * (reach["north"] - reach["south"]),
                         reach["north"] + wide * (reach["north"] - reach["south"])),
            draw.uniform(reach["west"] - wide * (reach["east"] - reach["west"]),
                         reach["east"] + wide * (reach["east"] - reach["west"])),
        )
        for _ in range(POINTS)
    ]
    text = "".join(f"{lat!r} {lon!r}\n" for lat, lon in places)
    found = run(PROGRAM, "terrain", "sample", path, "--points", "-", text=text).split()
    assert len(found) == POINTS, len(found)
    known, most, worst = 0, 0.0, 0.0
    for place, at, answer in zip(places, projected(places, crs), found):
        expected, spread = samples.elevation(*at)
        assert (answer == "none") == (expected is None), f"{path} at {place}: {answer}, expected {expected}"
        if expected is not None:
            known += 1
            off = abs(float(answer) - expected)
            most, worst = max(most, off), max(worst, off / (SHARE * spread + samples.floor))
    return known, most, worst


def main():
    draw = random.Random(7)
    failed = False
    for name, path, crs in make():
        known, most, worst = compare(path, crs, draw)
        print(f"{name}: {known} of {POINTS} points have an elevation, off by at most {most:.2g} m, {worst:.2g} of what is allowed")
        failed = failed or worst > 1.0 or known < 20
    if failed:
        sys.exit("the program and GDAL do not agree")


main()
