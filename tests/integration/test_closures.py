"""Closures on real dynamics: what they do to a free object, against what they report."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh
from py_trees.common import Status

from glotouch_backends.mujoco import MujocoBackend
from glotouch_bt.mission.read.worlds import load_conditions, load_world
from glotouch_bt.robot import HOLD, ObjectSet, Tare
from glotouch_skills.recognise.squeeze import Squeeze

SIZE = (0.070, 0.040, 0.050)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("boxes")
    box = trimesh.creation.box(SIZE)
    box.apply_translation((0, 0, 0.5 * SIZE[2]))
    box.export(path / "box.stl")
    return path


def squeeze(bench, found, folder, off_m: float, turn_rad: float):
    """Squeeze a box that stands `off_m` across and `turn_rad` from where it was traced; (layers, true moves, peak).

    A true move is (slide along y_P, turn), of the mesh's frame, from the opening before a closure to its plateau.
    """
    world = load_world("container_five")
    world = dataclasses.replace(world, objects=dataclasses.replace(world.objects, folder=folder, names=("box",)))
    assert isinstance(world.objects, ObjectSet)
    backend = MujocoBackend()
    with backend.open(world, load_conditions("nominal"), 3, {"layout": {"box": (0.0, off_m, turn_rad)}}) as robot:
        referee = backend.referee(robot)
        b = bench().on(world, robot)
        ticket = robot.start(Tare())
        while not ticket.done:
            b.pass_time(HOLD)
        candidate = found.box((0.0, 0.0), SIZE[:2], 0.0, SIZE[2])
        skill = b.make(Squeeze, inputs={"candidate": candidate, "known": (candidate,)}, layers=2)
        moves, before, closing = [], referee.objects()[0].pose_B_O, False
        while b.tick(skill) is Status.RUNNING:
            target = b.context.command.gripper
            if target is None:
                continue
            now = referee.objects()[0].pose_B_O
            if target.aperture_m == 0.0 and not closing:
                before, closing = now, True
            elif target.aperture_m > 0.0 and closing:
                y_P = b.arm.pose_B_P.rotation[:, 1]
                moves.append((float((now.position_m - before.position_m) @ y_P), now.yaw_rad - before.yaw_rad))
                closing = False
        assert skill.status is Status.SUCCESS, skill.feedback_message
        return skill.touchset.layers, np.array(moves), b.of_kind("object_moved"), referee.peak_force_N()


def test_a_box_off_the_middle_is_centred_and_says_so(bench, found, folder) -> None:
    layers, moves, events, peak = squeeze(bench, found, folder, 0.005, 0.0)
    assert len(layers) == len(moves) == 6
    assert 0.003 < abs(moves[0, 0]) < 0.006, "the first closure pushes it; giving way takes some of it"
    np.testing.assert_allclose([layer.slide_m for layer in layers], moves[:, 0], atol=0.0012)
    assert len(events) >= 1
    assert events[0]["height_m"] == layers[0].height_m
    assert abs(moves[1:, 0]).max() < 0.001, "it is centred from then on"
    assert all(layer.stable for layer in layers)
    assert peak < 20.0


def test_a_box_askew_is_turned_and_says_so(bench, found, folder) -> None:
    layers, moves, events, peak = squeeze(bench, found, folder, 0.0, np.deg2rad(6.0))
    turned = np.rad2deg(moves[:, 1])
    said = np.rad2deg([layer.turn_rad for layer in layers])
    k = int(np.argmax(abs(turned)))
    assert abs(turned[k]) > 2.0
    assert said[k] * turned[k] > 0, "the right way"
    assert said[k] == pytest.approx(turned[k], rel=0.6)
    assert events
    assert peak < 20.0


@pytest.fixture(scope="module")
def slabs(tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("slabs")
    section = [(-0.0015, 0.0), (0.0015, 0.0), (0.006, 0.080), (-0.006, 0.080)]
    slab = trimesh.convex.convex_hull([(x, y, z) for x in (-0.030, 0.030) for y, z in section])
    slab.export(path / "slab.stl")
    return path


def test_a_slab_that_topples_is_reported_and_the_skill_ends(bench, found, slabs) -> None:
    """A slab on a foot 3 mm wide tips wherever pads push it: their lower edge is 7 mm up, and 0.45 x 7 mm > 1.5 mm."""
    world = load_world("container_five")
    world = dataclasses.replace(world, objects=dataclasses.replace(world.objects, folder=slabs, names=("slab",)))
    backend = MujocoBackend()
    with backend.open(world, load_conditions("nominal"), 3, {"layout": {"slab": (0.0, 0.014, 0.0)}}) as robot:
        referee = backend.referee(robot)
        b = bench().on(world, robot)
        ticket = robot.start(Tare())
        while not ticket.done:
            b.pass_time(HOLD)
        candidate = found.box((0.0, 0.0), (0.060, 0.012), 0.0, 0.080)  # traced 14 mm from where it stands now
        skill = b.make(Squeeze, inputs={"candidate": candidate, "known": (candidate,)}, layers=2, side_gap_m=0.030)
        tilt = 0.0
        while b.tick(skill) is Status.RUNNING:
            tilt = max(tilt, float(np.arccos(np.clip(referee.objects()[0].pose_B_O.rotation[2, 2], -1.0, 1.0))))
        moved = b.of_kind("object_moved")
        assert tilt > np.deg2rad(10.0), "else this tests nothing"
        assert moved
        assert max(abs(m["slide_m"]) for m in moved) > 0.005
        assert skill.status is not Status.RUNNING
        assert b.arm.pose_B_P.position_m[2] > world.container.pose_B_K.position_m[2] + 0.12, "the hand is high again"
        assert b.arm.aperture_m > 0.03
        assert referee.peak_force_N() < 20.0
