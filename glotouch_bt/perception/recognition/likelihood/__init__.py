"""Marginal likelihood of a TouchSet given an STL, relative to a background of other objects."""

from glotouch_bt.perception.recognition.likelihood.belief import (
    Belief,
    closure_options,
    expected_gain,
    infer_belief,
    ranked,
)
from glotouch_bt.perception.recognition.likelihood.contacts import gain_of_one
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
