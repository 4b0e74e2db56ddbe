"""Search policies by their name in missions."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from types import MappingProxyType

from glotouch_bt.perception.search.policies.descent import RandomDescent
from glotouch_bt.perception.search.policies.expectation import ExpectedFind
from glotouch_bt.perception.search.policies.frontier import PAPER_PASSES, NearestFrontier
from glotouch_bt.perception.search.policies.policy import SearchPolicy
from glotouch_bt.plugins import POLICIES as GROUP
from glotouch_bt.plugins import load_plugin, plugins
from glotouch_bt.robot import UnknownName

POLICIES: MappingProxyType[str, Callable[[int], SearchPolicy]] = MappingProxyType(
    {
        "expected_find": lambda seed: ExpectedFind(),
        "nearest_frontier": lambda seed: NearestFrontier(passes=PAPER_PASSES, turn_m=0.0),
        "random_descent": RandomDescent,
    }
)
"""Factories from a seed. expected_find: own policy, the default. nearest_frontier, random_descent: baselines of the
paper."""


def policy_names() -> tuple[str, ...]:
    """Return the names of all policies: those of `POLICIES`, then those that other packages have installed."""
    return tuple(dict.fromkeys((*POLICIES, *plugins(GROUP))))


@lru_cache(maxsize=8)
def search_policy(name: str, seed: int = 0) -> SearchPolicy:
    """Return the policy of a name, cached because policies are stateless.

    Args:
        name: See `policy_names`.
        seed: Seed of its random draws, if any.

    Raises:
        UnknownName: Unknown policy.
        BadInput: The policy of another package cannot be imported.
    """
    if name in POLICIES:
        return POLICIES[name](seed)
    outside = plugins(GROUP)
    if name not in outside:
        raise UnknownName("search policy", name, policy_names())
    policy: SearchPolicy = load_plugin(outside[name])(seed)
    return policy
