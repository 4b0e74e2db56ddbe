"""Search policies: interchangeable rules for the next sweep."""

from glotouch_bt.perception.search.policies.expectation import ExpectationParams, ExpectedFind
from glotouch_bt.perception.search.policies.frontier import PAPER_PASSES, NearestFrontier
from glotouch_bt.perception.search.policies.policy import SearchPolicy, Stretch
from glotouch_bt.perception.search.policies.registry import POLICIES, policy_names, search_policy
