"""Gives a service what generated requests would never reach: plans that have ended, and a dataset.

    seed.py URL KEY DATASET

Writes their names into files in the working directory, as dictionaries for schemathesis; and the names of plans and
datasets to be deleted into other files.
"""

import json
import sys
import urllib.request

PLANNER = {"population": 20, "iterations": 20, "seed": 7, "waypoints": 4}
LOCAL = {
    "name": "in metres",
    "start": {"x": 0, "y": 0, "z": 50},
    "target": {"x": 1000, "y": 0, "z": 50},
    "area": {"min": {"x": -200, "y": -400}, "max": {"x": 1200, "y": 400}},
    "threats": [{"kind": "cylinder", "name": "radar", "center": {"x": 500, "y": 10}, "radius": 80, "influence": 120}],
    "altitude": {"min": 0, "max": 100},
    "planner": PLANNER,
}
# A wall across the whole area.
WALL = [{"x": x, "y": y} for x, y in ((480, -500), (520, -500), (520, 500), (480, 500))]
WALLED = LOCAL | {"name": "no way", "threats": [{"kind": "polygon", "vertices": WALL}]}
DEGREES = {
    "name": "in degrees",
    "frame": "wgs84",
    "start": {"lat": 36.1, "lon": -84.9, "alt": 60},
    "target": {"lat": 36.11, "lon": -84.89, "alt": 60},
    "altitude": {"min": 0, "max": 120},
    "planner": PLANNER,
}
# How many of each may be deleted.
SPARE = 40
GRID = b"""ncols 2
nrows 2
xllcorner 0
yllcorner 0
cellsize 10
1 2
3 4
"""


def main(url, key, dataset):
    def send(method, path, body, **headers):
        headers["Authorization"] = f"Bearer {key}"
        request = urllib.request.Request(url + path, body, headers, method=method)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)

    def ended(scenario):
        headers = {"Content-Type": "application/json", "Prefer": "wait=30"}
        plan = send("POST", "/plans", json.dumps(scenario).encode(), **headers)
        while plan["status"] in ("queued", "running"):
            plan = send("GET", plan["links"]["self"], None, Prefer="wait=30")
        return plan["id"]

    write("plans", [ended(scenario) for scenario in (LOCAL, WALLED, DEGREES)])
    with open(dataset, "rb") as file:
        named = send("PUT", "/terrains/jacksboro", file.read())
    write("datasets", [named["name"]])
    write("spare-plans", [ended(LOCAL) for _ in range(SPARE)])
    write("spare-datasets", [send("PUT", f"/terrains/spare-{i}", GRID)["name"] for i in range(SPARE)])


def write(name, values):
    with open(name, "w", encoding="utf-8") as file:
        file.writelines(f'"{value}"\n' for value in values)


if __name__ == "__main__":
    main(*sys.argv[1:])
