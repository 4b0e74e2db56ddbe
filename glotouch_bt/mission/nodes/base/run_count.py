"""The largest number of skill runs: every loop has a limit, and a for_each has n items, a number not known."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RunCount:
    """A number of runs: a polynomial in n, the number of items of each for_each.

    Attributes:
        terms: Coefficient of n to the power of its place.
    """

    terms: tuple[int, ...] = ()

    def __add__(self, other: RunCount) -> RunCount:
        longest = max(len(self.terms), len(other.terms))
        pairs = zip(*(t + (0,) * (longest - len(t)) for t in (self.terms, other.terms)), strict=True)
        return RunCount(tuple(a + b for a, b in pairs))

    def times(self, factor: int) -> RunCount:
        """Return `factor` times this number."""
        return RunCount(tuple(factor * t for t in self.terms))

    @property
    def fixed(self) -> int:
        """The largest coefficient."""
        return max(self.terms, default=0)

    def __str__(self) -> str:
        words = [str(t) + (f" n^{i}" if i > 1 else " n" if i else "") for i, t in enumerate(self.terms) if t]
        return " + ".join(words) or "0"
