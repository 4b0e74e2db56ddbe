"""Repair: a hole is closed, debris is dropped; a surface without an inside is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from glotouch_bt.objects import Prepared, prepare
from glotouch_bt.objects.repair import repaired
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import solid_of

BOX = trimesh.creation.box((0.05, 0.04, 0.06))
BALL = trimesh.creation.icosphere(3, 0.03)


def volume_m3(vertices: np.ndarray, faces: np.ndarray) -> float:
    stl = trimesh.Trimesh(vertices, faces, process=False).export(file_type="stl")
    return float(solid_of(Path("a.stl"), bytes(stl)).as_trimesh().volume)


@pytest.mark.parametrize("gone", range(12))
def test_a_box_without_a_triangle_is_closed(gone: int) -> None:
    vertices, faces, notes = repaired(BOX.vertices, np.delete(BOX.faces, gone, axis=0))
    assert volume_m3(vertices, faces) == pytest.approx(BOX.volume, rel=1e-6)
    assert "closed 1 hole" in notes[0]


@pytest.mark.parametrize("seed", range(25))
def test_a_ball_without_some_triangles_is_closed(seed: int) -> None:
    """Whatever is missing, holes that meet in a corner included; the volume changes by less than the holes hold."""
    rng = np.random.default_rng(seed)
    keep = rng.random(len(BALL.faces)) > 0.1
    vertices, faces, notes = repaired(BALL.vertices, rng.permutation(BALL.faces[keep]))
    assert volume_m3(vertices, faces) == pytest.approx(BALL.volume, rel=0.01)
    assert "closed" in notes[-1]


def test_a_sound_solid_is_left_as_it_is() -> None:
    vertices, faces, notes = repaired(BALL.vertices, BALL.faces)
    assert notes == ()
    assert (len(vertices), len(faces)) == (len(BALL.vertices), len(BALL.faces))


def test_corners_that_miss_each_other_are_joined_not_filled() -> None:
    rng = np.random.default_rng(0)
    corners = BALL.triangles.reshape(-1, 3) + rng.uniform(-4e-7, 4e-7, (3 * len(BALL.faces), 3))
    snapped = np.round(BALL.triangles.reshape(-1, 3), 5) + 1e-7 + 0 * corners
    vertices, _, notes = repaired(snapped, np.arange(len(snapped)).reshape(-1, 3))
    assert notes == ()
    assert len(vertices) == len(BALL.vertices)


def test_parts_that_share_a_face_become_one(tmp_path: Path) -> None:
    mirrored = trimesh.Trimesh(BOX.vertices * (1, 1, -1) + (0, 0, 0.06), BOX.faces[:, ::-1])
    both = trimesh.util.concatenate([BOX, mirrored])
    both.export(tmp_path / "a.stl")
    made = prepare(tmp_path / "a.stl")
    assert isinstance(made, Prepared), made
    assert made.volume_m3 == pytest.approx(2 * BOX.volume, rel=1e-6)


def test_debris_and_repeated_triangles_are_dropped() -> None:
    crumb = trimesh.creation.icosphere(1, 0.0008)
    crumb.apply_translation((0.08, 0.0, 0.0))
    both = trimesh.util.concatenate([BALL, crumb])
    _, faces, notes = repaired(both.vertices, np.concatenate([both.faces, BALL.faces[:5]]))
    assert len(faces) == len(BALL.faces)
    assert notes == ("dropped 5 repeated triangles", "dropped 1 fragments")


def sheet() -> trimesh.Trimesh:
    return trimesh.Trimesh(BOX.vertices, BOX.faces[:4], process=False)


def book() -> trimesh.Trimesh:
    wing = [[0, 0, 0], [0, 0, 0.05], [0.05, 0, 0], [0, 0.05, 0], [-0.05, 0, 0], [0, -0.05, 0]]
    return trimesh.Trimesh(np.array(wing, dtype=float), [[0, 1, k] for k in (2, 3, 4, 5)], process=False)


def soup() -> trimesh.Trimesh:
    rng = np.random.default_rng(1)
    return trimesh.Trimesh(rng.random((900, 3)) * 0.05, np.arange(900).reshape(-1, 3), process=False)


@pytest.mark.parametrize(
    ("made", "said"),
    [(sheet, "is not a solid"), (book, "edges at which three or more faces meet"), (soup, "is not a solid")],
)
def test_what_has_no_inside_is_refused(made, said: str) -> None:
    solid = made()
    with pytest.raises(BadInput, match=said):
        repaired(solid.vertices, solid.faces)
