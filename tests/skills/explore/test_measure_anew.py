"""measure_anew: what is given up of the candidates that closures contradict."""

from __future__ import annotations

from py_trees.common import Status

from glotouch_bt.perception.recognition import PARTS, ProbeTouch
from glotouch_bt.perception.touch import TouchSet
from glotouch_skills.explore.measure_anew import MeasureAnew


def test_only_the_doubtful_are_measured_again(bench, found) -> None:
    things = [found.round((0.06 * i, 0.0), 0.02, index=i) for i in range(3)]
    b = bench()
    given = {
        "before_doubtful": (1,),
        "before_probed": tuple(ProbeTouch(i, part) for i in range(3) for part in PARTS),
        "felt": tuple(TouchSet(t, ()) for t in things),
    }
    skill = b.make(MeasureAnew, inputs=given)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert (skill.anew, skill.given_up, skill.doubtful) == ((1,), 1, ())
    assert {t.candidate for t in skill.probed} == {0, 2}
    assert [t.candidate.index for t in skill.touchsets] == [0, 2]


def test_nothing_is_doubtful(bench) -> None:
    b = bench()
    skill = b.make(MeasureAnew)
    b.run(skill)
    assert (skill.status, skill.anew, skill.given_up) == (Status.SUCCESS, (), 0)
