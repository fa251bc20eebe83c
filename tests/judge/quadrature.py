"""Adaptive Gauss-Kronrod integration of one variable.

The judge integrates the threat cost numerically on purpose: a closed form could share a mistake with the program
judged.
"""

# Positive nodes of the 15-point Kronrod rule on [-1, 1], outermost first, and their weights; the last is the middle.
_NODES = (
    0.991455371120812639206854697526329,
    0.949107912342758524526189684047851,
    0.864864423359769072789712788640926,
    0.741531185599394439863864773280788,
    0.586087235467691130294144691258337,
    0.405845151377397166906606412076961,
    0.207784955007898467600689403773245,
    0.0,
)
_KRONROD = (
    0.022935322010529224963732008058970,
    0.063092092629978553290700663189204,
    0.104790010322250183839876322541518,
    0.140653259715525918745189590510238,
    0.169004726639267902826583426598550,
    0.190350578064785409913256402421014,
    0.204432940075298892414161999234649,
    0.209482141084727828012999174891714,
)
# Weights of the embedded 7-point Gauss rule, on every second node.
_GAUSS = (
    0.129484966168869693270611432679082,
    0.279705391489276667901467771423780,
    0.381830050505118944950369775488975,
    0.417959183673469387755102040816327,
)
_DEEPEST = 60


def kronrod(f, a, b):
    """The 15-point estimate of the integral of `f` over [a, b] and its distance from the 7-point one."""
    middle, half = 0.5 * (a + b), 0.5 * (b - a)
    centre = f(middle)
    fine, coarse = _KRONROD[7] * centre, _GAUSS[3] * centre
    for i in range(7):
        pair = f(middle - half * _NODES[i]) + f(middle + half * _NODES[i])
        fine += _KRONROD[i] * pair
        if i % 2 == 1:
            coarse += _GAUSS[i // 2] * pair
    return fine * half, abs(fine - coarse) * abs(half)


def integrate(f, a, b, tolerance):
    """The integral of `f` over [a, b], bisected until two rules agree within the absolute `tolerance`.

    `f` should be smooth inside: split at known kinks first (see `integrate_pieces`).
    """
    total, todo = 0.0, [(a, b, tolerance, 0)]
    while todo:
        low, high, allowed, depth = todo.pop()
        value, error = kronrod(f, low, high)
        if error <= allowed or depth >= _DEEPEST:
            total += value
            continue
        middle = 0.5 * (low + high)
        todo.append((low, middle, 0.5 * allowed, depth + 1))
        todo.append((middle, high, 0.5 * allowed, depth + 1))
    return total


def integrate_pieces(f, a, b, cuts, tolerance):
    """The integral over [a, b] of an `f` that is smooth between the `cuts` (any order; those outside are ignored)."""
    return sum(integrate(f, low, high, tolerance) for low, high in pieces(a, b, cuts))


def pieces(a, b, cuts):
    """The consecutive non-empty intervals into which `cuts` divide [a, b]."""
    marks = [a, *sorted({cut for cut in cuts if a < cut < b}), b]
    return [(low, high) for low, high in zip(marks, marks[1:]) if high > low]
