"""LiftWitness asks the referee at every lift. A referee that fails does not end the mission."""

from types import SimpleNamespace
from typing import Any

from glotouch_bt.mission.record.run_summary import NullRecord
from glotouch_bt.robot import BackendError
from glotouch_bt.runs.lift_witness import LiftWitness


def referee(*answers: Any) -> Any:
    left = list(answers)

    def objects() -> Any:
        answer = left.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    return SimpleNamespace(objects=objects)


def test_every_lift_is_noted_with_what_the_jaws_hold() -> None:
    apple, train = (SimpleNamespace(name=n, in_gripper=g) for n, g in (("apple", False), ("train", True)))
    witness = LiftWitness(NullRecord(), referee([apple, train], [apple], BackendError("killed")))
    witness.event("grasp", 1.0, {"node": "grasp"})
    for stamp_s in (2.0, 3.0, 4.0):
        witness.event("lift", stamp_s, {"node": "lift"})
    assert [lift["object"] for lift in witness.lifted] == ["train", None, None]
    assert witness.lifted[0] == {"stamp_s": 2.0, "node": "lift", "object": "train"}


def test_without_a_referee_nothing_is_known() -> None:
    witness = LiftWitness(NullRecord(), None)
    witness.event("lift", 2.0, {"node": "lift"})
    assert witness.lifted == []
