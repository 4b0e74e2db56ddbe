"""Replay a run from its record without a robot, and compare every event and decision with the recorded ones."""

from glotouch_bt.runs.replay.decisions import replay_decisions
from glotouch_bt.runs.replay.run import replay
from glotouch_bt.runs.replay.summary import as_dict, as_lines, decision_as_dict
