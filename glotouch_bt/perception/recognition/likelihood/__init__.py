"""Marginal likelihood of a TouchSet given an STL, against a background of other objects. Pure."""

from glotouch_bt.perception.recognition.likelihood.belief import (
    Belief,
    believe,
    closure_options,
    expected_gain,
    identify,
    ranked,
)

__all__ = ["Belief", "believe", "closure_options", "expected_gain", "identify", "ranked"]
