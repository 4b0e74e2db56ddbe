"""Which closure would tell most about "which candidate, or none, is the target". Pure."""

from glotouch_bt.perception.recognition.likelihood import Belief, believe, closure_options, expected_gain, identify

__all__ = ["Belief", "believe", "closure_options", "expected_gain", "identify"]
