"""Forget where the probe has been: what it passed without touching anything may not have been free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillRun


class SearchAnew(Skill):
    """After a search with a probe that had slipped or was lost: keep the objects that were traced, forget the rest.

    SUCCESS: `map` holds the traced objects and no place that was passed or given up.
    """

    NOTHING_SEARCHED = Failure("nothing_searched", "there is no map yet", advice="sweep first, with guarded_sweep")

    before = In(SearchMap, "what has been explored so far", key="map", required=False)
    map = Out(SearchMap, "the traced objects only")

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD
        if self.before is None:
            raise self.NOTHING_SEARCHED("there is no map yet")
        nowhere = np.zeros((0, 2))
        nowhere.setflags(write=False)
        self.map = replace(self.before, path_K_m=nowhere, dropped=nowhere)
