"""How often skills run at most: every loop has a limit, and a for_each has n items, a number not known."""

from __future__ import annotations

from dataclasses import dataclass

from glotouch_bt.mission.spec import ForEachSettings, NodeSpec, RepeatSettings, RetrySettings


@dataclass(frozen=True)
class Runs:
    """A number of runs: a polynomial in n, the items of each for_each.

    Attributes:
        terms: Coefficient of n to the power of its place.
    """

    terms: tuple[int, ...] = ()

    def __add__(self, other: Runs) -> Runs:
        longest = max(len(self.terms), len(other.terms))
        pairs = zip(*(t + (0,) * (longest - len(t)) for t in (self.terms, other.terms)), strict=True)
        return Runs(tuple(a + b for a, b in pairs))

    def times(self, factor: int) -> Runs:
        """So many times as often."""
        return Runs(tuple(factor * t for t in self.terms))

    def per_item(self) -> Runs:
        """Once for each item."""
        return Runs((0, *self.terms))

    @property
    def fixed(self) -> int:
        """The largest coefficient."""
        return max(self.terms, default=0)

    def __str__(self) -> str:
        words = [str(t) + (f" n^{i}" if i > 1 else " n" if i else "") for i, t in enumerate(self.terms) if t]
        return " + ".join(words) or "0"


def worst_case(node: NodeSpec) -> Runs:
    """Runs of skills at most, if each loop is made to its limit."""
    if node.kind == "skill":
        return Runs((1,))
    below = Runs()
    for child in node.children:
        below = below + worst_case(child)
    settings = node.settings
    if isinstance(settings, RetrySettings):
        return below.times(settings.attempts)
    if isinstance(settings, RepeatSettings):
        return below.times(settings.times or settings.limit)
    return below.per_item() if isinstance(settings, ForEachSettings) else below
