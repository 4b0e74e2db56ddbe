"""Descriptions of missions, subtrees and skills for the reference pages and for programs."""

from __future__ import annotations

import pytest

from glotouch_bt.mission.export import describe_mission, describe_subtree
from glotouch_bt.mission.read import shipped


@pytest.mark.parametrize("name", sorted(shipped("subtrees")))
def test_every_shipped_subtree_can_be_described(name: str) -> None:
    found = describe_subtree(shipped("subtrees")[name])
    assert found["name"] == name
    assert found["description"]
    assert all(p["type"] for p in found["parameters"])


def test_a_subtree_says_which_keys_a_mission_can_share() -> None:
    found = describe_subtree(shipped("subtrees")["squeeze_all"])
    assert found["reads"] == ["candidates", "jaw_zero"]
    assert found["writes"] == ["candidate", "touchset", "touchsets"]


def test_a_mission_is_described_by_its_head() -> None:
    found = describe_mission(shipped("")["retrieve"])
    assert (found["name"], found["parameters"][0]["default"]) == ("retrieve", "wukong")
    assert found["world"]
