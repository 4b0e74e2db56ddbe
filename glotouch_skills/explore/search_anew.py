"""Clear the searched area: without a sound probe, a place passed without contact may not be free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillRun


class SearchAnew(Skill):
    """Keep the traced objects and clear the rest of the map, after a search with a slipped or lost probe.

    SUCCESS: `map` has the traced objects, but no searched or dropped place.
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
