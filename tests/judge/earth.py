"""Scenarios in degrees: projected onto the plane that the definitions are stated in, independently of the service.

The plane touches the ellipsoid in the middle of the area, at the mean altitude of start and target; every place is
projected onto it from that height, whatever stands there, and z is the altitude above the datum.
"""

import math
from dataclasses import dataclass

# WGS 84, defining parameters.
AXIS = 6378137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
# The last bit of a latitude is a billionth of a metre: the accuracy of a place written in degrees.
HAIR = 1e-9
# Points along each side of an area, used to find the greatest rectangle inside.
SIDE = 64


@dataclass
class Earth:
    """The plane of one scenario."""

    lat: float
    lon: float
    height: float  # above the ellipsoid, metres
    complaints: list  # complaints: list  # where the result's frame does not follow from the scenario

    def local(self, lat, lon):
        """East and north of the origin, metres."""
        phi, phi0 = math.radians(lat), math.radians(self.lat)
        way = math.radians(math.remainder(lon - self.lon, 360.0))
        # All differences are taken before multiplying by the earth's radius, which would lose a billionth of a
        # metre: enough to turn a path's shortest legs.
        normal, normal0 = _normal(phi), _normal(phi0)
        down, down0 = AXIS / normal, AXIS / normal0
        longer = AXIS * ECCENTRICITY_SQUARED * math.sin(phi + phi0) * math.sin(phi - phi0)
        longer /= down * down0 * (down + down0)
        half = 2.0 * math.sin(0.5 * (phi - phi0))
        cosine, sine = -half * math.sin(0.5 * (phi + phi0)), half * math.cos(0.5 * (phi + phi0))
        across = longer * math.cos(phi) + (normal0 + self.height) * cosine
        up = (1.0 - ECCENTRICITY_SQUARED) * (longer * math.sin(phi) + normal0 * sine) + self.height * sine
        round_axis = (normal + self.height) * math.cos(phi)
        east = round_axis * math.sin(way)
        inwards = across - 2.0 * round_axis * math.sin(0.5 * way) ** 2
        north = math.cos(phi0) * up - math.sin(phi0) * inwards
        return east, north

    def flat(self, document):
        """The document with every place and point projected onto the plane."""
        if isinstance(document, list):
            return [self.flat(item) for item in document]
        if not isinstance(document, dict):
            return document
        if "lat" in document and "lon" in document:
            x, y = self.local(document["lat"], document["lon"])
            return {"x": x, "y": y} | ({"z": document["alt"]} if "alt" in document else {})
        return {key: self.flat(value) for key, value in document.items()}

    def scenario(self, document):
        """A scenario document converted to the local frame."""
        flat = self.flat({key: value for key, value in document.items() if key not in ("area", "altitude_datum")})
        flat["frame"] = "local"
        if document.get("area") is not None:
            flat["area"] = self._rectangle(document["area"], flat["start"], flat["target"])
        return flat

    def result(self, document):
        """A result document converted to the local frame."""
        return self.flat({key: value for key, value in document.items() if key != "frame"})

    def _rectangle(self, area, start, target):
        """The greatest rectangle inside an area of degrees, extended to the ends, which may lie where sides bend."""
        (south, west), (north, east) = ((area[corner]["lat"], area[corner]["lon"]) for corner in ("min", "max"))
        width = (east - west) % 360.0
        steps = [step / SIDE for step in range(SIDE + 1)]
        lats = [south + step * (north - south) for step in steps]
        lons = [west + step * width for step in steps]
        ends = (start, target)
        x_min = max(self.local(lat, west)[0] for lat in lats)
        x_max = min(self.local(lat, east)[0] for lat in lats)
        y_min = max(self.local(south, lon)[1] for lon in lons)
        y_max = min(self.local(north, lon)[1] for lon in lons)
        return {
            "min": {"x": min(x_min, *(end["x"] for end in ends)), "y": min(y_min, *(end["y"] for end in ends))},
            "max": {"x": max(x_max, *(end["x"] for end in ends)), "y": max(y_max, *(end["y"] for end in ends))},
        }


def earth_of(document, result):
    """The plane of a scenario in degrees and its result; None in the local frame."""
    if document.get("frame", "local") == "local":
        return None
    frame, complaints = result["frame"], []
    datum = document.get("altitude_datum", "msl")
    origin, undulation = frame["origin"], frame["undulation"]
    if (frame["kind"], frame["altitude_datum"]) != ("wgs84", datum):
        complaints.append(f"frame: {frame['kind']} above {frame['altitude_datum']}, expected wgs84 above {datum}")
    mean = (document["start"]["alt"] + document["target"]["alt"]) / 2.0
    if abs(origin["alt"] - mean) > 1e-6:
        complaints.append(f"frame.origin.alt: {origin['alt']!r}, start and target have {mean!r} in the mean")
    area = document.get("area")
    if area is not None:
        lat = (area["min"]["lat"] + area["max"]["lat"]) / 2.0
        lon = area["min"]["lon"] + ((area["max"]["lon"] - area["min"]["lon"]) % 360.0) / 2.0
        away = math.remainder(origin["lon"] - lon, 360.0)
        if max(abs(origin["lat"] - lat), abs(away)) > 1e-9:
            complaints.append(f"frame.origin: {origin!r}, the middle of the area is {lat!r}, {lon!r}")
    # EGM96 lies between 107 m below the ellipsoid and 86 m above it.
    if not -108.0 < undulation < 87.0:
        complaints.append(f"frame.undulation: {undulation!r} is nowhere on the earth")
    height = origin["alt"] + (undulation if datum == "msl" else 0.0)
    return Earth(origin["lat"], origin["lon"], height, complaints)


def _normal(lat):
    """The distance from the axis along the normal, metres, at a latitude in radians."""
    return AXIS / math.sqrt(1.0 - ECCENTRICITY_SQUARED * math.sin(lat) ** 2)
