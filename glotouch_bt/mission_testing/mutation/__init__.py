"""TODO door of glotouch_bt/mission_testing/mutation."""

from glotouch_bt.mission_testing.mutation.rerun import mutate
from glotouch_bt.mission_testing.mutation.score import MutationScore
from glotouch_bt.mission_testing.mutation.search import ScriptMaker

__all__ = ["MutationScore", "ScriptMaker", "mutate"]
