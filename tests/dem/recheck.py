"""Routes over a shipped file, planned through the service and re-checked independently at every metre.

The file is uploaded, a scenario that names it is planned, and each point of the path (latitude, longitude,
altitude, a metre apart) is compared with the elevations that GDAL reads from the file, bilinear between four samples:
it must be inside the altitude band, above the ground, and as high as the certificate says.
"""

import array
import json
import pathlib
import subprocess
import sys
import urllib.request

SEEDS = (1, 2, 3)
# Metres: the certificate's accuracy over files, and the digits of the documents.
TOLERANCE = 1.5e-3

PROGRAM, SOURCE, SCENARIO, SCRATCH = (
    sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]), pathlib.Path(sys.argv[4]))


class Ground:
    """The samples as GDAL reads them."""

    def __init__(self, file):
        raw = SCRATCH / "recheck.raw"
        subprocess.run(["gdal_translate", "-q", "-of", "ENVI", "-ot", "Float64", file, raw], check=True)
        info = json.loads(subprocess.run(["gdalinfo", "-json", file], check=True, capture_output=True).stdout)
        self.columns, self.rows = info["size"]
        west, self.width, _, north, _, self.height = info["geoTransform"]
        # Samples hold at pixel centres.
        self.west, self.north = west + self.width / 2.0, north + self.height / 2.0
        self.samples = array.array("d", raw.read_bytes())

    def at(self, lat, lon):
        """The elevation, interpolated bilinearly."""
        x, y = (lon - self.west) / self.width, (lat - self.north) / self.height
        column, row = min(int(x), self.columns - 2), min(int(y), self.rows - 2)
        x, y = x - column, y - row
        if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
            sys.exit(f"{lat}, {lon} lies outside {SOURCE}")
        first = row * self.columns + column
        (a, b), (c, d) = self.samples[first:first + 2], self.samples[first + self.columns:first + self.columns + 2]
        return (a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y


def ask(method, address, body=None, **headers):
    """The service's response, as JSON."""
    headers = {name.replace("_", "-"): value for name, value in headers.items()}
    request = urllib.request.Request(address, data=body, method=method, headers=headers)
    with urllib.request.urlopen(request, timeout=120) as answer:
        return json.load(answer)


def planned(service, scenario):
    """The result of planning a scenario."""
    status = ask("POST", f"{service}/plans", json.dumps(scenario).encode(), content_type="application/json")
    address = service + status["links"]["self"]
    while status["status"] in ("queued", "running"):
        status = ask("GET", address, prefer="wait=30")
    return ask("GET", f"{address}/result")


def check(ground, scenario, result):
    """The number of points, and what is wrong with them."""
    points, claimed = result["path"]["points"], result["checks"]["path"]
    band = scenario["altitude"]
    heights = [point["alt"] - ground.at(point["lat"], point["lon"]) for point in points]
    least, greatest = min(heights), max(heights)
    faults = []
    if len(points) < result["path"]["length"]:
        faults.append(f"{len(points)} points on {result['path']['length']:.0f} m")
    if least < band["min"] - TOLERANCE or greatest > band["max"] + TOLERANCE:
        faults.append(f"{least} to {greatest} m above ground, allowed are {band['min']} to {band['max']}")
    if least < claimed["min_agl"] - TOLERANCE or greatest > claimed["max_agl"] + TOLERANCE:
        faults.append(f"{least} to {greatest} m above ground, claimed are {claimed['min_agl']} to {claimed['max_agl']}")
    print(f"seed {result['seed']}: {len(points)} points, {least:.3f} to {greatest:.3f} m above ground")
    return faults


def main():
    """Runs the service and the checks."""
    ground = Ground(SOURCE)
    scenario = json.loads(SCENARIO.read_text())
    name = scenario["terrain"]["name"]
    data = SCRATCH / "recheck"
    command = [PROGRAM, "serve", "--listen", "127.0.0.1:0", "--data-dir", data]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            service = process.stdout.readline().removeprefix("listening on ").strip()
            ask("PUT", f"{service}/terrains/{name}", SOURCE.read_bytes())
            faults = []
            for seed in SEEDS:
                planner = scenario["planner"] | {"seed": seed, "smoothing": {"spacing": 1}}
                result = planned(service, scenario | {"planner": planner})
                if not result["feasible"]:
                    faults.append(f"seed {seed}: no feasible route")
                    continue
                faults += [f"seed {seed}: {fault}" for fault in check(ground, scenario, result)]
        finally:
            process.terminate()
    for fault in faults:
        print(fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
