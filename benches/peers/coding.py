"""Routes as positions of a search: heights are above ground, start and target are left out.

Both codings match noctule's: spherical vectors (docs/EQUATIONS.md, Eq. 16-22) and plain
waypoints. Standard library only: the peers spend their time in their own searches, and a position
has only about thirty numbers.
"""

import math


class Spherical:
    name = "spherical"

    def __init__(self, scenario, waypoints):
        start, target = scenario["start"], scenario["target"]
        self.start = start
        dx, dy, dz = (target[axis] - start[axis] for axis in "xyz")
        self.distance, self.course = math.hypot(dx, dy), math.atan2(dy, dx)
        vehicle, self.band = scenario["vehicle"], scenario["altitude"]
        turn, climb = (math.radians(vehicle[key]) for key in ("max_turn_deg", "max_climb_deg"))
        self.steepest = math.tan(climb)
        self.start_height = start["z"] - elevation(scenario, start["x"], start["y"])
        legs = waypoints + 1
        straight = math.hypot(self.distance, dz) / legs
        level = math.pi / 2
        self.lower = [0.0, -turn, level - climb] * legs
        self.upper = [2.0 * straight, turn, level + climb] * legs
        # Straight ahead; gliding to the middle of the band is part of the coding.
        self.straight = [straight, 0.0, level] * legs

    def decode(self, position):
        x, y, height, heading = 0.0, 0.0, self.start_height, 0.0
        low, high = self.band["min"], self.band["max"]
        chain = []
        for idx in range(0, len(position), 3):
            amplitude, turn, polar = position[idx : idx + 3]
            heading += turn
            level = amplitude * math.sin(polar)
            x += level * math.cos(heading)
            y += level * math.sin(heading)
            steepest = level * self.steepest
            glide = min(max((low + high) / 2 - height, -steepest), steepest)
            height = min(max(height + glide + amplitude * math.cos(polar), low), high)
            chain.append((x, y, height))
        # Rotated and scaled so that the end lies on the target.
        reach = math.hypot(x, y)
        scale, rotation = 1.0, self.course
        if reach >= 1e-9:
            scale, rotation = self.distance / reach, self.course - math.atan2(y, x)
        cos, sin = scale * math.cos(rotation), scale * math.sin(rotation)
        return [
            [self.start["x"] + x * cos - y * sin, self.start["y"] + x * sin + y * cos, height]
            for x, y, height in chain[:-1]
        ]


class Cartesian:
    name = "cartesian"

    def __init__(self, scenario, waypoints):
        start, target = scenario["start"], scenario["target"]
        area, band = scenario["area"], scenario["altitude"]
        self.lower = [area["min"]["x"], area["min"]["y"], band["min"]] * waypoints
        self.upper = [area["max"]["x"], area["max"]["y"], band["max"]] * waypoints
        shares = [(idx + 1) / (waypoints + 1) for idx in range(waypoints)]
        # As high as the climb angle allows, up to the middle of the band.
        leg = math.hypot(target["x"] - start["x"], target["y"] - start["y"]) / (waypoints + 1)
        climb = leg * math.tan(math.radians(scenario["vehicle"]["max_climb_deg"]))
        height = start["z"] - elevation(scenario, start["x"], start["y"])
        self.straight = []
        for share in shares:
            middle = (band["min"] + band["max"]) / 2
            height = min(max(middle, height - climb), height + climb)
            kept = min(max(height, band["min"]), band["max"])
            flat = [start[axis] + share * (target[axis] - start[axis]) for axis in "xy"]
            self.straight += [*flat, kept]

    def decode(self, position):
        return [list(map(float, position[idx : idx + 3])) for idx in range(0, len(position), 3)]


CODINGS = [Spherical, Cartesian]


def elevation(scenario, x, y):
    """The ground's elevation, for the terrain kinds of the shipped paper scenarios."""
    ground = scenario.get("terrain", {"kind": "flat", "elevation": 0})
    if ground["kind"] == "flat":
        return ground["elevation"]
    if ground["kind"] != "peaks":
        raise SystemExit(f"benches/peers: no terrain of kind {ground['kind']} here")
    total = ground["base"]
    for peak in ground["peaks"]:
        center, spread = peak["center"], peak["spread"]
        distance = ((x - center["x"]) / spread["x"]) ** 2 + ((y - center["y"]) / spread["y"]) ** 2
        total += peak["height"] * math.exp(-distance)
    return total
