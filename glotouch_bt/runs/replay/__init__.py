"""A run done again from its record, without a robot: every fit, match and decision of it, beside what it was then."""

from glotouch_bt.runs.replay.decisions import replay_decisions
from glotouch_bt.runs.replay.run import replay
from glotouch_bt.runs.replay.summary import as_dict, as_lines, decision_as_dict

__all__ = ["as_dict", "as_lines", "decision_as_dict", "replay", "replay_decisions"]
