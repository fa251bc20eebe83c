"""A clamped B-spline in space, evaluated by de Boor's algorithm."""

from bisect import bisect_right
from math import dist

# Points tabulated between two consecutive knots; also the resolution at which the curve is searched.
_PER_SPAN = 16
_GOLDEN = 0.6180339887498949


class Spline:
    """The curve with `degree`, `knots` and `control` points."""

    def __init__(self, degree, knots, control):
        self.degree, self.knots, self.control = degree, knots, control

    def faults(self):
        """What is wrong with the knots; nothing if they are those of a clamped spline."""
        degree, knots, count = self.degree, self.knots, len(self.control)
        if degree < 1 or count < degree + 1:
            return [f"{count} control points are too few for degree {degree}"]
        if len(knots) != count + degree + 1:
            return [f"{len(knots)} knots, {count + degree + 1} belong to {count} control points of degree {degree}"]
        found = []
        if any(after < before for before, after in zip(knots, knots[1:])):
            found.append("knots decrease")
        if knots[0] != knots[degree] or knots[-1] != knots[-degree - 1]:
            found.append("the first and last knots are not repeated degree + 1 times")
        if not knots[0] < knots[-1]:
            found.append("knots span nothing")
        if any(knots[i] == knots[i + degree] for i in range(1, len(knots) - degree - 1)):
            found.append("an inner knot is repeated more than degree times: the curve may jump")
        return found

    def at(self, u):
        """The point at parameter `u` between the first and the last knot."""
        p, knots = self.degree, self.knots
        span = min(max(bisect_right(knots, u) - 1, p), len(self.control) - 1)
        points = [self.control[span - p + i] for i in range(p + 1)]
        for level in range(1, p + 1):
            for i in range(p, level - 1, -1):
                left = knots[span - p + i]
                width = knots[span + 1 + i - level] - left
                share = (u - left) / width if width > 0.0 else 0.0
                rest = 1.0 - share
                (ax, ay, az), (bx, by, bz) = points[i - 1], points[i]
                points[i] = (rest * ax + share * bx, rest * ay + share * by, rest * az + share * bz)
        return points[p]

    def table(self):
        """Parameters along the whole curve, dense within every knot span, with their points."""
        marks = sorted(set(self.knots))
        found = [
            low + (high - low) * step / _PER_SPAN for low, high in zip(marks, marks[1:]) for step in range(_PER_SPAN)
        ]
        found.append(marks[-1])
        return [(u, self.at(u)) for u in found]

    def walk(self, samples, tolerance):
        """Non-decreasing parameters at which the curve passes within `tolerance` of each sample in turn.

        For each sample the first such place is used, which leaves most of the curve to the others. The second value
        is the nearest approach to a sample that was missed, None when none was.
        """
        table = self.table()
        found, here, least = [], 0, self.knots[0]
        for sample in samples:
            nearest = None
            for index in range(here, len(table) - 1):
                (low, start), (high, end) = table[index], table[index + 1]
                # A stretch of the curve cannot be nearer than this to a point far from both its ends.
                if min(dist(start, sample), dist(end, sample)) > 2.0 * dist(start, end) + tolerance:
                    continue
                u, away = self._approach(sample, max(low, least), high)
                nearest = away if nearest is None else min(nearest, away)
                if away <= tolerance:
                    found.append(u)
                    here, least = index, u
                    break
            else:
                return found, float("inf") if nearest is None else nearest
        return found, None

    def _approach(self, sample, low, high):
        """The parameter between two others where the curve is nearest to a point, by golden sections, and how near."""
        ends = [(dist(self.at(u), sample), u) for u in (low, high)]
        a, b = low, high
        c, d = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
        at_c, at_d = dist(self.at(c), sample), dist(self.at(d), sample)
        while min(at_c, at_d, ends[0][0], ends[1][0]) > 1e-9 and b - a > 1e-15 * max(1.0, abs(b)):
            if at_c < at_d:
                b, d, at_d = d, c, at_c
                c = b - _GOLDEN * (b - a)
                at_c = dist(self.at(c), sample)
            else:
                a, c, at_c = c, d, at_d
                d = a + _GOLDEN * (b - a)
                at_d = dist(self.at(d), sample)
            if c >= d:
                break
        away, u = min([*ends, (at_c, c), (at_d, d)])
        return u, away
