"""match: synthetic squeezes of known solids, recognised or not."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from py_trees.common import Status

from glotouch_bt.perception import recognition
from glotouch_bt.perception.recognition import Ranking
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene.meshes import load_mesh
from glotouch_skills.common.planning.target import load_target
from glotouch_skills.recognise.match import MatchTarget
from tests.support.acquisition import IDEAL, acquire

POSE = (0.03, -0.02, 0.4)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("stl")
    trimesh.creation.box((0.060, 0.036, 0.060)).export(path / "block.stl")
    trimesh.creation.cylinder(0.026, 0.055, sections=96).export(path / "can.stl")
    return path


@pytest.fixture(scope="module")
def touchsets(folder, found):
    """Ideal squeezes of the block (0) and the can (1)."""
    made = []
    for i, name in enumerate(("block", "can")):
        touchset, _ = acquire(load_mesh(folder / f"{name}.stl"), POSE, IDEAL, np.random.default_rng(i), i)
        contour = touchset.candidate.contour
        thing = found.round if contour.kind == "round" else found.box
        size = contour.radius_m if contour.kind == "round" else contour.size_m
        contacts = thing(tuple(contour.centre_K_m), size).contacts
        made.append(replace(touchset, candidate=replace(touchset.candidate, contacts=contacts)))
    return tuple(made)


@pytest.fixture
def make(bench, folder):
    def make_one(target, touchsets, **inputs):
        b = bench()
        b.context.world = replace(b.world, objects=replace(b.world.objects, folder=folder))
        inputs |= {} if touchsets is None else {"touchsets": touchsets}
        return b, b.make(MatchTarget, inputs=inputs, target=target)

    return make_one


@pytest.mark.parametrize(("target", "index"), [("block", 0), ("can", 1)])
def test_the_target_is_recognised_and_its_grasp_planned(make, touchsets, target: str, index: int) -> None:
    b, skill = make(target, touchsets)
    b.run(skill)
    assert skill.ranking.best.index == index
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.plan.candidate == index
    assert np.linalg.norm(skill.plan.position_K_m[:2] - POSE[:2]) < 0.03
    assert not [c for c in b.commands if c.motion is not None]


@pytest.mark.parametrize("none", [None, ()])
def test_match__no_touch(make, none) -> None:
    b, skill = make("block", none)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_touch")


def test_match__not_recognised(make, touchsets) -> None:
    """Two alike: whichever is best, it is not surely the target. The ranking is written all the same."""
    twin = replace(touchsets[0], candidate=replace(touchsets[0].candidate, index=1))
    b, skill = make("block", (touchsets[0], twin))
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "not_recognised")
    assert len(skill.ranking.matches) == 2
    assert skill.reason.message.startswith("no candidate is surely block: ")


@pytest.mark.parametrize(
    ("postponed", "rival", "accepted"), [(1, 0.09, False), (0, 0.09, True), (None, 0.09, True), (1, 0.02, True)]
)
def test_what_was_put_off_may_be_the_target_instead(
    make, touchsets, monkeypatch: pytest.MonkeyPatch, postponed: int | None, rival: float, accepted: bool
) -> None:
    matcher = recognition.MATCHERS["likelihood"]

    def doubting(*args: object) -> Ranking:
        ranking = matcher(*args)
        assert ranking.accepted
        first, second = ranking.matches
        matches = replace(first, probability=0.98 - rival), replace(second, probability=rival)
        return replace(ranking, matches=matches)

    monkeypatch.setattr(recognition, "MATCHERS", {"likelihood": doubting})
    b, skill = make("block", touchsets, **({} if postponed is None else {"postponed": postponed}))
    b.run(skill)
    assert (skill.status is Status.SUCCESS) == accepted, skill.feedback_message
    assert skill.ranking.accepted == accepted
    if not accepted:
        assert "with probability 0.09; not yet measured: 1" in skill.reason.message


def test_an_identical_object_is_named(make, touchsets, folder, tmp_path) -> None:
    """The box holds a second block under another name: the reasons say that touch cannot tell them apart."""
    for name in ("block", "can"):
        shutil.copyfile(folder / f"{name}.stl", tmp_path / f"{name}.stl")
    shutil.copyfile(folder / "block.stl", tmp_path / "brick.stl")
    twin = replace(touchsets[0], candidate=replace(touchsets[0].candidate, index=1))
    b, skill = make("block", (touchsets[0], twin))
    b.context.world = replace(b.world, objects=replace(b.world.objects, folder=tmp_path))
    b.run(skill)
    assert skill.ranking.reasons[-1] == "brick has exactly the shape of the target"
    assert "brick has exactly the shape of the target" in skill.reason.message


def test_broken_off(make, touchsets) -> None:
    b, skill = make("block", touchsets)
    b.run(skill, 1)
    b.preempt(skill)


def test_a_target_is_a_name_or_a_path(folder) -> None:
    assert load_target("can", folder).digest == load_target(str(folder / "can.stl"), folder / "elsewhere").digest
    with pytest.raises(BadInput, match="has no spoon"):
        load_target("spoon", folder)
    with pytest.raises(BadInput, match="empty name"):
        load_target("", folder)
    with pytest.raises(BadInput, match="no such STL file"):
        load_target("gone.stl", folder)
