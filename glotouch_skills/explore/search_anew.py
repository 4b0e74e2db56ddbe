"""Search again: what was searched without a sound probe, or for one object more than was expected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param


class SearchAnewParams(SkillParams):
    """Parameters of `search_anew`."""

    more_objects: int = param(
        "Look for so many objects beyond the candidates, and keep what was searched; 0: forget what was searched",
        default=0,
        ge=0,
        le=20,
    )


class SearchAnew(Skill):
    """Keep the candidates and clear the rest of the map, after a search with a slipped or lost probe.

    A place that such a probe passed without contact may not be free. With `more_objects` the searched places are kept,
    and the map expects more objects than there are candidates, and no fewer than before: if one object was traced as
    two, the search ended too early. An unknown number becomes a known one.

    What was traced and is no candidate any more does not count: it turned out to be a part of another one, or is gone.

    SUCCESS: `map` has the candidates.
    """

    Params = SearchAnewParams
    params: SearchAnewParams

    NOTHING_SEARCHED = Failure("nothing_searched", "there is no map yet", advice="sweep first, with guarded_sweep")

    before = In(SearchMap, "what has been explored so far", key="map", required=False)
    candidates = In(tuple, "candidates now; not given: everything traced", element=Candidate, required=False)
    map = Out(SearchMap, "where to search now")
    found = Out(int, "number of candidates")

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD
        if self.before is None:
            raise self.NOTHING_SEARCHED("there is no map yet")
        belief = self.before if self.candidates is None else self.before.only_with(self.candidates)
        self.found = belief.found
        if self.params.more_objects:
            self.map = replace(belief, expected=max(belief.expected or 0, belief.found + self.params.more_objects))
            return
        nowhere = np.zeros((0, 2))
        nowhere.setflags(write=False)
        self.map = replace(belief, path_K_m=nowhere, dropped=nowhere)
