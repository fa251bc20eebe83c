"""Ground elevation, and the least and greatest height above it along a leg."""

import math

import geometry as geo
from quadrature import pieces


class Flat:
    """Level ground."""

    slack = 0.0

    def __init__(self, elevation=0.0):
        self.level = elevation

    def elevation(self, x, y):
        """Ground elevation at a point."""
        return self.level

    def heights(self, a, b):
        """Least and greatest height above ground on the segment from `a` to `b`."""
        return min(a[2], b[2]) - self.level, max(a[2], b[2]) - self.level


class Peaks:
    """Gaussian hills summed on a base: height * exp(-(dx/sx)^2 - (dy/sy)^2)."""

    # Over analytic peaks a route's height may be off by a millimetre.
    slack = 1e-3

    def __init__(self, base, hills):
        self.base, self.hills = base, hills
        spreads = [spread for hill in hills for spread in hill[3:]]
        # Finer than the specification requires of the program.
        self.step = min([5.0, *(spread / 5.0 for spread in spreads)]) / 6.0

    def elevation(self, x, y):
        """Ground elevation at a point."""
        return self.base + sum(
            height * math.exp(-(((x - cx) / sx) ** 2) - ((y - cy) / sy) ** 2) for height, cx, cy, sx, sy in self.hills
        )

    def heights(self, a, b):
        """Least and greatest height above ground on the segment from `a` to `b`.

        Steps along it and refines wherever the slope changes sign between two steps.
        """
        count = max(1, math.ceil(geo.horizontal(a, b) / self.step))
        marks = [step / count for step in range(count + 1)]
        slopes = [self._slope(a, b, t) for t in marks]
        found = [self._height(a, b, t) for t in marks]
        for low, high, before, after in zip(marks, marks[1:], slopes, slopes[1:]):
            if before * after < 0.0:
                found.append(self._height(a, b, self._level(a, b, low, high, before)))
        return min(found), max(found)

    def _height(self, a, b, t):
        x, y, z = geo.lerp(a, b, t)
        return z - self.elevation(x, y)

    def _slope(self, a, b, t):
        """The derivative of `_height` by `t`."""
        x, y, _ = geo.lerp(a, b, t)
        dx, dy = b[0] - a[0], b[1] - a[1]
        slope = b[2] - a[2]
        for height, cx, cy, sx, sy in self.hills:
            u, v = (x - cx) / sx, (y - cy) / sy
            slope += 2.0 * height * math.exp(-u * u - v * v) * (u * dx / sx + v * dy / sy)
        return slope

    def _level(self, a, b, low, high, before):
        """Where the slope, `before` at `low`, is zero between `low` and `high`."""
        for _ in range(40):
            middle = 0.5 * (low + high)
            if self._slope(a, b, middle) * before > 0.0:
                low = middle
            else:
                high = middle
        return 0.5 * (low + high)


class Grid:
    """Elevations at nodes, row by row from the south, bilinear in between; the edge continues beyond the extent."""

    slack = 0.0

    def __init__(self, origin, cell, columns, rows, elevations):
        self.origin, self.cell, self.columns, self.rows, self.nodes = origin, cell, columns, rows, elevations

    def extent(self):
        """`(x_min, y_min, x_max, y_max)` of the nodes."""
        x, y = self.origin
        return x, y, x + (self.columns - 1) * self.cell, y + (self.rows - 1) * self.cell

    def elevation(self, x, y):
        """Ground elevation at a point."""
        column, u = self._place((x - self.origin[0]) / self.cell, self.columns)
        row, v = self._place((y - self.origin[1]) / self.cell, self.rows)
        at = row * self.columns + column
        right = 1 if self.columns > 1 else 0
        up = self.columns if self.rows > 1 else 0
        south = self.nodes[at] * (1.0 - u) + self.nodes[at + right] * u
        north = self.nodes[at + up] * (1.0 - u) + self.nodes[at + up + right] * u
        return south * (1.0 - v) + north * v

    def heights(self, a, b):
        """Least and greatest height above ground on the segment from `a` to `b`, exact: a parabola over each cell."""
        found = []
        for low, high in pieces(0.0, 1.0, self._cuts(a, b, 0, self.columns) + self._cuts(a, b, 1, self.rows)):
            middle = 0.5 * (low + high)
            first, half, last = (self._height(a, b, t) for t in (low, middle, high))
            found += [first, last]
            # The parabola through three values at s = 0, 1/2, 1 is first + slope s + bend s^2.
            bend = 2.0 * (first - 2.0 * half + last)
            slope = last - first - bend
            if bend != 0.0 and 0.0 < -slope / (2.0 * bend) < 1.0:
                found.append(first - slope * slope / (4.0 * bend))
        return min(found), max(found)

    @staticmethod
    def _place(position, count):
        """The cell's index and the fraction of the way through it, for a position counted in cells."""
        position = min(max(position, 0.0), count - 1.0)
        index = max(0, min(int(position), count - 2))
        return index, position - index

    def _height(self, a, b, t):
        x, y, z = geo.lerp(a, b, t)
        return z - self.elevation(x, y)

    def _cuts(self, a, b, axis, count):
        """The `t` where the leg crosses the lines of nodes square to `axis`."""
        if a[axis] == b[axis]:
            return []
        first = (min(a[axis], b[axis]) - self.origin[axis]) / self.cell
        last = (max(a[axis], b[axis]) - self.origin[axis]) / self.cell
        lines = range(max(0, math.floor(first)), min(count - 1, math.ceil(last)) + 1)
        return [(self.origin[axis] + line * self.cell - a[axis]) / (b[axis] - a[axis]) for line in lines]
