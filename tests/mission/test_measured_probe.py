"""Shipped missions touch with a probe that was measured: its compliance reaches every skill that makes contacts."""

from __future__ import annotations

from pathlib import Path

import pytest

import glotouch_missions
from glotouch_bt.mission import load_mission

MISSIONS = sorted(p.stem for p in Path(glotouch_missions.__file__).parent.glob("*.yaml"))
TAKES, MEASURES = "tool_pickup", "tool_calibrate"


@pytest.mark.parametrize("name", MISSIONS)
def test_every_taken_probe_is_measured_into_the_key_that_contacts_read(name: str) -> None:
    nodes = list(load_mission(name).spec.walk())
    skills = [n for n in nodes if n.kind == "skill"]
    if not any(n.skill == TAKES for n in skills):
        return
    measured = {n.writes["tool"].key for n in skills if n.skill == MEASURES}
    readers = {n.skill: n.reads["tool"].key for n in skills if "tool" in n.reads}
    assert set(readers.values()) <= measured, readers
    for node in nodes:
        below = [c.skill for c in node.children]
        for k, skill in enumerate(below):
            assert skill != TAKES or below[k + 1] == MEASURES, node.name
