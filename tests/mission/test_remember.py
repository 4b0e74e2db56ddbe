"""The mission remember, and targets that are known only by touch, before anything moves."""

from __future__ import annotations

import pytest

from glotouch_bt.mission import load_mission
from glotouch_bt.mission.spec import MissionFaults


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


def test_it_checks_and_needs_no_mesh_as_a_target() -> None:
    mission = load_mission("remember", {"name": "mug"})
    assert mission.stl_parameters == ()
    assert mission.world.objects.names == ("wukong",)


def test_a_target_that_was_never_remembered_is_found_before_the_run() -> None:
    with pytest.raises(MissionFaults, match="glotouch run remember --set name=mug") as caught:
        load_mission("retrieve", {"target": "touched:mug"})
    assert {f.code for f in caught.value.findings} == {"not_remembered"}


def test_a_damaged_model_is_found_before_the_run(tmp_path) -> None:
    (tmp_path / "touched").mkdir()
    (tmp_path / "touched" / "mug.json").write_text("{}")
    with pytest.raises(MissionFaults, match="remember the object again"):
        load_mission("retrieve", {"target": "touched:mug"})
