"""Collects what was compared and where a result disagrees."""

from contextlib import contextmanager

RELATIVE = 1e-6
# Absolute tolerance per unit of a figure's scale.
ABSOLUTE = 1e-9


class Report:
    """The findings on one result."""

    def __init__(self):
        self.compared = 0
        self.disagreements = []

    @property
    def passed(self):
        return not self.disagreements

    def that(self, holds, message):
        """Records `message` as a disagreement unless `holds`."""
        self.compared += 1
        if not holds:
            self.disagreements.append(message)
        return bool(holds)

    def same(self, what, claimed, expected):
        """Records a disagreement unless two values are equal."""
        return self.that(claimed == expected, f"{what}: claimed {claimed!r}, expected {expected!r}")

    def near(self, what, claimed, low, scale, high=None):
        """Records a disagreement unless the claimed figure equals the recomputed one or lies between `low` and `high`.

        None is a figure too, equal only to itself. `scale` is the magnitude of the quantities behind the figure.
        """
        high = low if high is None else high
        if claimed is None or low is None:
            return self.same(what, claimed, low)
        if isinstance(claimed, bool) or not isinstance(claimed, (int, float)):
            return self.that(False, f"{what}: claimed {claimed!r}, which is no number; recomputed {low!r}")
        low, high = min(low, high), max(low, high)
        expected = min(max(claimed, low), high)
        size = max(abs(claimed), abs(expected))
        error = abs(claimed - expected)
        relative = error / size if size > 0.0 else 0.0
        return self.that(
            error <= RELATIVE * size + ABSOLUTE * scale,
            f"{what}: claimed {claimed!r}, recomputed {expected!r}, relative difference {relative:.3g}",
        )

    @contextmanager
    def section(self, name):
        """Turns a missing or malformed part of a result into a disagreement."""
        try:
            yield
        except KeyError as error:
            self.that(False, f"{name}: {error} is missing")
        except (TypeError, ValueError, IndexError, AttributeError, ZeroDivisionError, OverflowError) as error:
            self.that(False, f"{name}: ill-formed ({type(error).__name__}: {error})")
