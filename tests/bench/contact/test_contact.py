"""`bench contact`: the arithmetic of its figures against closed forms, and one real trial of each mode."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.bench.contact import bench as contact
from glotouch_bt.bench.contact.square import TrueSquare, rectangle
from glotouch_bt.perception.touch import fit_kind, polygon_distance
from glotouch_bt.robot import Pose

SIDES = np.array([0.06, 0.06])


@given(
    yaw=st.floats(-np.pi, np.pi), x=st.floats(-0.1, 0.1), y=st.floats(-0.1, 0.1), u=st.floats(-0.029, 0.029),
    off=st.floats(-0.01, 0.02), side=st.integers(0, 3),
)  # fmt: skip
def test_distance_from_a_face_is_how_far_off_it_is(yaw, x, y, u, off, side) -> None:
    corners = rectangle(np.array([x, y]), SIDES, yaw)
    a, b = corners[side], corners[(side + 1) % 4]
    out = np.array([(b - a)[1], -(b - a)[0]]) / 0.06
    inside = -min(0.03 - abs(u), -off) if off < 0 else off
    point = 0.5 * (a + b) + u * (b - a) / 0.06 + off * out
    assert polygon_distance(corners, point[None])[0] == pytest.approx(inside, abs=1e-12)


def test_distance_from_a_corner_is_round() -> None:
    corners = rectangle(np.zeros(2), SIDES, 0.0)
    np.testing.assert_allclose(polygon_distance(corners, np.array([[0.033, 0.034]])), [0.005], atol=1e-12)


@pytest.mark.parametrize("radius", [0.0, 0.006])
def test_a_square_is_fitted_to_what_touched_it(radius: float) -> None:
    """Points, or balls outside of it, four a side."""
    u = np.linspace(-0.02, 0.02, 4)
    faces = [np.column_stack([u, np.full(4, 0.03 + radius)]) @ np.array([[c, s], [-s, c]]) for c, s in
             ((1, 0), (0, 1), (-1, 0), (0, -1))]  # fmt: skip
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    fit = fit_kind(np.concatenate(faces) @ turn + (0.02, -0.03), radius, "box")
    np.testing.assert_allclose(fit.centre_K_m, [0.02, -0.03], atol=2e-5)
    np.testing.assert_allclose(fit.size_m, SIDES, atol=1e-4)


def test_the_true_square_stands_as_its_pose_says() -> None:
    square = TrueSquare.section(Pose.planar((0.6, 0.1, -0.2), 0.4), SIDES, -0.18)
    np.testing.assert_allclose(square.corners_B_m, rectangle(np.array([0.6, 0.1]), SIDES, 0.4), atol=1e-12)
    np.testing.assert_allclose(square.sides_m, SIDES)
    assert square.yaw_rad == pytest.approx(0.4)


def test_a_leaning_square_is_compared_at_the_height_of_the_contacts() -> None:
    """Leaning by a about y, its section at height h is displaced by h tan(a), and longer by 1 / cos(a) along x."""
    lean, height = np.radians(3.0), 0.018
    pose = Pose(np.array([0.6, 0.1, -0.2]), np.array([np.cos(0.5 * lean), 0.0, np.sin(0.5 * lean), 0.0]))
    square = TrueSquare.section(pose, SIDES, -0.2 + height)
    np.testing.assert_allclose(square.centre_B_m, [0.6 + height * np.tan(lean), 0.1], atol=1e-12)
    np.testing.assert_allclose(square.sides_m, [0.06 / np.cos(lean), 0.06], rtol=1e-12)


def row(tool: str, square: str, seed: int, value: float, cause: str = "") -> dict[str, Any]:
    return {"tool": tool, "square": square, "seed": seed, "cause": cause, **dict.fromkeys(contact.METRICS, value)}


def test_a_trial_that_failed_counts() -> None:
    rows = [row("probe", "fixed", 0, 0.2), row("probe", "fixed", 1, 0.4), row("probe", "fixed", 2, 0, "not_traced")]
    summary = contact.summarise(rows)
    assert summary["probe"]["centre_error_mm"]["mean"] == pytest.approx(0.3)
    assert (summary["probe"]["traced"]["rate"], summary["probe"]["traced"]["n"]) == (pytest.approx(2 / 3), 3)
    assert summary["not_traced"] == ["fixed probe seed 2: not_traced"]


def test_every_mode_is_tried_on_every_seed(tmp_path: Path) -> None:
    campaign = contact.ContactCampaign(seeds=(3, 4), per_side=5, out=tmp_path)
    asked = [
        (t.folder, t.identity["mission"], t.identity["seed"], t.identity["settings"]["contacts"])
        for t in campaign.trials()
    ]
    assert len(asked) == len(set(asked)) == 8
    assert {a[3] for a in asked} == {"20"}


def test_settings_are_those_of_the_probes_mission(tmp_path: Path) -> None:
    campaign = contact.ContactCampaign(seeds=(3,), per_side=4, out=tmp_path, settings={"press": "0"})
    for asked in (t.identity for t in campaign.trials()):
        assert asked["settings"].get("press") == ("0" if asked["mission"] == "contact_probe" else None)
