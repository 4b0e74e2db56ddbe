"""The search policies by name, as missions call them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from types import MappingProxyType

from glotouch_bt.perception.search.policies.descent import RandomDescent
from glotouch_bt.perception.search.policies.expectation import ExpectedFind
from glotouch_bt.perception.search.policies.frontier import PAPER_PASSES, NearestFrontier
from glotouch_bt.perception.search.policies.policy import SearchPolicy
from glotouch_bt.robot import UnknownName

POLICIES: MappingProxyType[str, Callable[[int], SearchPolicy]] = MappingProxyType(
    {
        "expected_find": lambda seed: ExpectedFind(),
        "nearest_frontier": lambda seed: NearestFrontier(passes=PAPER_PASSES, turn_m=0.0),
        "random_descent": RandomDescent,
    }
)
"""expected_find: ours (the default). nearest_frontier, random_descent: the paper's, as baselines. Each is made with a
seed."""


@lru_cache(maxsize=8)
def search_policy(name: str, seed: int = 0) -> SearchPolicy:
    """The policy of that name; stateless, so one does for all.

    Args:
        name: See `POLICIES`.
        seed: Of what it draws, if it draws anything.

    Raises:
        UnknownName: There is none of that name.
    """
    if name not in POLICIES:
        raise UnknownName("search policy", name, tuple(POLICIES))
    return POLICIES[name](seed)
