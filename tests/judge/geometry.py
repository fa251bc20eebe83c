"""Plane and space geometry of points, segments and rings, in metres.

A point is a tuple `(x, y)` or `(x, y, z)`; a leg is a pair of 3-D points, along which `t` runs over [0, 1].
"""

import math


def lerp(a, b, t):
    """The point at `t` on the leg from `a` to `b`; exact at both ends."""
    if t == 1.0:
        return b
    return tuple(p + t * (q - p) for p, q in zip(a, b))


def horizontal(a, b):
    """Horizontal distance of two points."""
    return math.hypot(b[0] - a[0], b[1] - a[1])


def distance(a, b):
    """Distance of two points in space."""
    return math.dist(a, b)


def nearest_parameter(a, b, point):
    """The `t` in [0, 1] at which the horizontal leg from `a` to `b` is nearest to `point`."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    squared = dx * dx + dy * dy
    if squared == 0.0:
        return 0.0
    t = ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / squared
    return min(1.0, max(0.0, t))


def to_segment(point, a, b):
    """Horizontal distance of `point` from the segment `a`, `b`."""
    t = nearest_parameter(a, b, point)
    return math.hypot(point[0] - a[0] - t * (b[0] - a[0]), point[1] - a[1] - t * (b[1] - a[1]))


def circle_crossings(a, b, centre, radius):
    """The two `t` (not limited to [0, 1]) where the line through `a`, `b` crosses a circle; `()` when it does not.

    A line that touches gives the same `t` twice.
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = math.hypot(dx, dy)
    if length == 0.0:
        return ()
    ux, uy = dx / length, dy / length
    px, py = centre[0] - a[0], centre[1] - a[1]
    along, across = px * ux + py * uy, px * uy - py * ux
    if abs(across) > radius:
        return ()
    half = math.sqrt((radius - across) * (radius + across))
    return ((along - half) / length, (along + half) / length)


def line_crossing(a, b, c, d, offset=0.0):
    """The `t` where the line `a`, `b` is at the signed distance `offset` to the left of `c`, `d`; None if parallel."""
    ex, ey = d[0] - c[0], d[1] - c[1]
    length = math.hypot(ex, ey)
    if length == 0.0:
        return None
    start = (ex * (a[1] - c[1]) - ey * (a[0] - c[0])) / length
    slope = (ex * (b[1] - a[1]) - ey * (b[0] - a[0])) / length
    return None if slope == 0.0 else (offset - start) / slope


def inside_ring(point, ring):
    """Whether `point` lies inside the simple `ring`, by the even-odd rule; either answer on the ring itself."""
    x, y = point[0], point[1]
    inside = False
    for (x1, y1), (x2, y2) in edges(ring):
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
            inside = not inside
    return inside


def edges(ring):
    """The edges of a ring, as pairs of vertices."""
    return list(zip(ring, ring[1:] + ring[:1]))


def segments_distance(a, b, c, d):
    """Horizontal distance of two segments, 0 when they meet."""
    t, u = line_crossing(a, b, c, d), line_crossing(c, d, a, b)
    if t is not None and u is not None and 0.0 <= t <= 1.0 and 0.0 <= u <= 1.0:
        return 0.0
    return min(to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b))


def headings(points):
    """Heading of each leg in degrees, counter-clockwise from east.

    A leg shorter than 1e-9 m horizontally keeps the heading before it, None while there is none.
    """
    found, last = [], None
    for a, b in zip(points, points[1:]):
        if horizontal(a, b) >= 1e-9:
            last = math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))
        found.append(last)
    return found


def turns(points):
    """Signed heading change at each leg's start in degrees, left positive, in (-180, 180]; the first is 0."""
    course = headings(points)
    found = [0.0]
    for before, after in zip(course, course[1:]):
        found.append(0.0 if before is None or after is None else wrap(after - before))
    return found


def wrap(angle):
    """The angle in degrees, normalised to (-180, 180]."""
    angle = math.fmod(angle, 360.0)
    if angle > 180.0:
        return angle - 360.0
    return angle + 360.0 if angle <= -180.0 else angle


def climb(a, b):
    """The climb angle of a leg in degrees, up positive; 0 for a leg of zero length."""
    return math.degrees(math.atan2(b[2] - a[2], horizontal(a, b)))
