"""The study of single measures: each can be switched off, and quantities are paired by world."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support.ablation import summarise, touches

EACH = """
from glotouch_bt.lazy import load_all
from glotouch_bt.mission import load_mission
from tests.support.ablation import MEASURES, SCHEDULE
load_mission("retrieve", {}); load_all()
for changes in MEASURES.values():
    for change in changes:
        change()
import numpy as np
from glotouch_bt.motion import FeltSpace
from glotouch_bt.perception.recognition import schedule
from glotouch_skills.common.planning import squeeze_motion, touch_options
from glotouch_skills.recognise.touch_next import TouchNextParams
params = TouchNextParams(target="apple")
assert (params.travel_speed_m_s, params.min_gain_nats, params.settle_s) == (0.1, 0.0, 0.5)
assert schedule.pays_now(None, None, set()) and schedule.EXCLUDED_SHARE == 0.0
assert not schedule.is_sure(None, 0.9)
assert (touch_options.FAST_RISE_RATIO, squeeze_motion.OPENING_M_S, params.side_gap_m) == (1.0, 0.03, 0.03)
felt = FeltSpace()
felt.add(np.zeros((1, 3)))
assert len(felt.columns(1.0)) == 0 and felt.free_down_to(np.zeros((1, 2)), 1.0) == np.inf
"""


def test_each_measure_can_be_switched_off() -> None:
    subprocess.run([sys.executable, "-c", EACH], check=True)


def test_differences_are_paired_by_world() -> None:
    def row(seed: int, time_s: float, *, right: bool = True, closures: float = 2.0) -> dict[str, object]:
        status = "success" if right else "failure"
        end = {"status": status, "correct": right, "retrieved": seed == 2 and not right}
        counts = {"closures_target": closures, "closures_other": 0.5, "contacts_target": 8.0, "contacts_other": 4.0}
        return {"seed": seed, "sim_time_s": time_s, "peak_force_N": 9.0, **end, **counts}

    found = summarise({
        "none": [row(1, 100.0), row(2, 200.0), row(3, 300.0)],
        "fast": [row(1, 110.0, closures=4.0), row(2, 220.0, right=False), row(3, 330.0)],
    })  # fmt: skip
    assert found["sim_s"] == {"none": 200.0, "fast": 220.0}
    assert found["more_s"]["fast"]["difference"] == pytest.approx(20.0), "of the worlds in which both succeed"
    assert found["wrong"] == {"none": 0, "fast": 1}
    assert found["more_s"]["none"]["difference"] == 0.0
    assert found["difference"]["fast"]["only_a"] == 1
    assert found["closures_target"]["fast"] == pytest.approx(8.0 / 3.0)


def test_a_campaign_without_a_pair_has_no_difference() -> None:
    found = summarise({name: [{"seed": 1, "status": "traceback"}] for name in ("none", "fast")})
    assert "more_s" not in found
    assert found["success"]["fast"]["rate"] == 0.0


def test_touches_are_counted_by_object() -> None:
    result = {
        "ranking": {"matches": [{"index": 2, "evidence": 3.0}, {"index": 0, "evidence": 1.0}]},
        "candidates": [{"index": 0, "contacts": 4}, {"index": 1, "contacts": 6}, {"index": 2, "contacts": 9}],
    }
    assert touches(result) == {
        "closures_target": 3.0, "closures_other": 1.0, "contacts_target": 9, "contacts_other": 5.0,
    }  # fmt: skip
    assert set(touches({}).values()) == {None}
