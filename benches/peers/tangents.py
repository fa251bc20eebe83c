"""The shortest way around discs in the plane: Dijkstra over the graph of their common tangents."""

import heapq
import math
from itertools import combinations

SLACK = 1e-7


def shortest(start, target, discs):
    """Its length; `discs` are (x, y, radius) and may overlap. None when there is no way."""
    ends = [(*start, 0.0), (*target, 0.0)]
    circles = ends + list(discs)
    graph, on_circle = {}, {idx: [] for idx in range(len(circles))}

    def edge(one, other, length):
        graph.setdefault(one, []).append((other, length))
        graph.setdefault(other, []).append((one, length))

    for i, j in combinations(range(len(circles)), 2):
        for angle_i, angle_j, length in tangents(circles[i], circles[j]):
            a, b = at(circles[i], angle_i), at(circles[j], angle_j)
            if all(away(disc, a, b) >= disc[2] - SLACK for disc in discs):
                one, other = (i, angle_i), (j, angle_j)
                on_circle[i].append(one)
                on_circle[j].append(other)
                edge(one, other, length)
    for idx, nodes in on_circle.items():
        nodes.sort(key=lambda node: node[1])
        for one, other in zip(nodes, nodes[1:] + nodes[:1]):
            span = (other[1] - one[1]) % math.tau
            if len(nodes) > 1 and (idx < 2 or arc_is_free(circles[idx], one[1], span, discs)):
                edge(one, other, circles[idx][2] * span)

    queue, done = [(0.0, node) for node in on_circle[0]], set()
    while queue:
        length, node = heapq.heappop(queue)
        if node[0] == 1:
            return length
        if node not in done:
            done.add(node)
            for other, step in graph[node]:
                heapq.heappush(queue, (length + step, other))
    return None


def tangents(one, other):
    """The angles at which a common tangent touches both circles, and its length."""
    dx, dy = other[0] - one[0], other[1] - one[1]
    distance, along = math.hypot(dx, dy), math.atan2(dy, dx)
    found = set()
    # Both circles on the same side of the tangent, or on opposite sides.
    for side in (1, -1):
        share = (one[2] - side * other[2]) / distance if distance > 0 else 2.0
        if abs(share) < 1:
            length = distance * math.sqrt(1 - share * share)
            for turn in (math.acos(share), -math.acos(share)):
                there = along + turn if side == 1 else along + turn + math.pi
                found.add(((along + turn) % math.tau, there % math.tau, length))
    return found


def at(circle, angle):
    return (circle[0] + circle[2] * math.cos(angle), circle[1] + circle[2] * math.sin(angle))


def away(disc, a, b):
    """Distance of the disc's centre from the segment."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    square = dx * dx + dy * dy
    along = ((disc[0] - a[0]) * dx + (disc[1] - a[1]) * dy) / square if square else 0.0
    along = min(max(along, 0.0), 1.0)
    return math.hypot(a[0] + along * dx - disc[0], a[1] + along * dy - disc[1])


def arc_is_free(circle, begin, span, discs):
    """Whether no other disc covers part of the arc: neither end inside one, no crossing in between."""
    for disc in discs:
        if disc == circle:
            continue
        dx, dy = disc[0] - circle[0], disc[1] - circle[1]
        distance = math.hypot(dx, dy)
        if distance >= disc[2] + circle[2] or distance + disc[2] <= circle[2]:
            continue
        # The disc covers the angles within `half` of its own direction.
        cosine = (distance**2 + circle[2] ** 2 - disc[2] ** 2) / (2 * distance * circle[2])
        half = math.acos(min(max(cosine, -1.0), 1.0))
        into = (math.atan2(dy, dx) - half - begin) % math.tau
        if into < span - SLACK or into > math.tau - 2 * half + SLACK:
            return False
    return True
