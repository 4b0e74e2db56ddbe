"""remember: touches of known solids are stored, grow, and are refused if they are of something else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from py_trees.common import Status
from pydantic import ValidationError

from glotouch_bt.mission_testing import stand_in
from glotouch_bt.perception import read_touched, touched_path
from glotouch_bt.perception.touch import Contact
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene.meshes import load_mesh
from glotouch_skills.common.planning import find_target
from glotouch_skills.recognise.match import MatchTarget
from glotouch_skills.recognise.remember import Remember
from tests.support.acquisition import NOMINAL, acquire

POSES = {"first": (0.03, -0.02, 0.4), "again": (-0.05, 0.04, 1.2)}


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def solids(tmp_path_factory):
    path = tmp_path_factory.mktemp("stl")
    trimesh.creation.box((0.070, 0.036, 0.060)).export(path / "block.stl")
    trimesh.creation.cylinder(0.026, 0.055, sections=96).export(path / "can.stl")
    return {name: load_mesh(path / f"{name}.stl") for name in ("block", "can")}


def touched(mesh, seed: int, pose=POSES["first"], index: int = 0):
    return acquire(mesh, pose, NOMINAL, np.random.default_rng(seed), index)[0]


@pytest.fixture
def run(bench):
    def run_one(touchset, name="thing"):
        b = bench()
        skill = b.make(Remember, inputs={"touchset": touchset}, object=name)
        b.run(skill)
        return b, skill

    return run_one


def test_what_was_felt_is_stored_and_found_again(run, bench, solids) -> None:
    _, skill = run(touched(solids["block"], 1))
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.stored == "touched/thing.json"
    b = bench()
    sets = (touched(solids["can"], 2, index=0), touched(solids["block"], 3, POSES["again"], index=1))
    match = b.make(MatchTarget, inputs={"touchsets": sets}, target="touched:thing")
    b.run(match)
    assert match.status is Status.SUCCESS, match.feedback_message
    assert match.plan.candidate == 1
    assert np.linalg.norm(match.plan.position_K_m[:2] - POSES["again"][:2]) < 0.03


def test_another_encounter_grows_the_model(run, bench, solids) -> None:
    run(touched(solids["block"], 1))
    gripper = bench().arm.description.gripper
    objects = bench().world.objects
    before = find_target("touched:thing", objects, gripper).model.certainty
    _, skill = run(touched(solids["block"], 5, POSES["again"]))
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.encounters == 2
    after = find_target("touched:thing", objects, gripper).model.certainty
    assert after.height_sd_m < before.height_sd_m
    first, second = (e.contour for e in read_touched("thing").encounters)
    np.testing.assert_allclose(second.centre_K_m, first.centre_K_m, atol=4e-3)


def test_another_object_does_not_spoil_the_model(run, solids) -> None:
    run(touched(solids["block"], 1))
    _, skill = run(touched(solids["can"], 2))
    assert skill.status is Status.FAILURE
    assert skill.reason.code == "other_object"
    assert len(read_touched("thing").encounters) == 1


def test_too_little_is_not_stored(run, solids) -> None:
    touchset = touched(solids["block"], 1)
    few = replace(touchset, sequences=(replace(touchset.sequences[0], layers=touchset.sequences[0].layers[:2]),))
    untopped = replace(touchset, candidate=replace(touchset.candidate, top_touched=False))
    for given in (few, untopped):
        _, skill = run(given)
        assert skill.reason.code == "too_little_felt"


def test_remember__not_as_traced__an_object_that_moved_while_it_was_traced(run, solids) -> None:
    """The outline is 25 mm wider than the block, across which the jaws closed."""
    touchset = touched(solids["block"], 1)
    long_m, short_m = touchset.candidate.contour.size_m
    wider = replace(touchset.candidate.contour, size_m=(long_m, short_m + 0.025))
    contact = stand_in(Contact, tip_K_m=np.array([0.0, 0.0, 0.018]))
    candidate = replace(touchset.candidate, contour=wider, contacts=(contact,))
    _, skill = run(replace(touchset, candidate=candidate))
    assert skill.reason.code == "not_as_traced"
    assert not touched_path("thing").exists()


def test_the_report_says_what_is_known(run, solids) -> None:
    b, _ = run(touched(solids["block"], 1))
    sections = [fields for kind, fields in b.events if kind == "report"]
    assert any("touched:thing" in str(s) for s in sections), [k for k, _ in b.events]


@pytest.mark.parametrize("name", ["", "a/b", "..", "thing 2", "x" * 65, "thing\n"])
def test_a_name_that_no_file_can_have_is_refused_before_the_run(name: str) -> None:
    with pytest.raises(BadInput):
        touched_path(name)
    with pytest.raises(ValidationError):
        Remember.Params(object=name)
