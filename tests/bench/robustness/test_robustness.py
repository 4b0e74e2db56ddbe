"""The sweep of the axes: every axis changes what is felt, seeds are paired, rows count every decision."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace

import numpy as np
import pytest

from glotouch_bt.bench.match.synthetic import sample_layout
from glotouch_bt.bench.retrieve import summarise
from glotouch_bt.bench.robustness import AXES, RobustnessCampaign, missions, run_campaign, run_missions
from glotouch_bt.bench.robustness.axes import changed
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.robot import BadInput, Conditions, load_backend

WORLD = load_mission("touch_all", {}).world
ONE = replace(WORLD, objects=replace(WORLD.objects, names=("apple",)))


def touched(conditions: Conditions, seed: int = 3):
    return sample_layout(load_backend("mujoco").touch_sampler(ONE, conditions, seed), seed, conditions.name).touched


def numbers(layout) -> np.ndarray:
    out = []
    for t in layout:
        c = t.touchset.candidate
        out += [*c.contour.centre_K_m, *c.contour.size_m, c.height_m]
        for layer in t.touchset.layers:
            out += [layer.aperture_m, *np.nan_to_num(layer.left_m).ravel()[::50], *layer.noise_m]
    return np.array(out)


@pytest.fixture(scope="module")
def nominal():
    return numbers(touched(load_conditions("nominal")))


@pytest.mark.parametrize("axis", AXES)
def test_every_axis_changes_what_is_felt(axis, nominal) -> None:
    known = {f.name for f in fields(Conditions)}
    assert set(AXES[axis].fields) <= known
    far = max(AXES[axis].levels, key=lambda v: abs(v - 1.0) if 1.0 in AXES[axis].levels else abs(v))
    felt = numbers(touched(load_conditions(changed("nominal", axis, far))))
    assert felt.shape == nominal.shape  # the same stances
    assert np.abs(felt - nominal).max() > 1e-6


def test_the_same_seed_gives_the_same_touches(nominal) -> None:
    assert np.array_equal(numbers(touched(load_conditions("nominal"))), nominal)


def test_widths_of_an_ideal_box_are_those_of_its_stl() -> None:
    """Independent truth: the apple is as wide as its mesh at the height of the closure, within the gel's law."""
    (apple,) = (t for t in touched(load_conditions("ideal")) if t.name == "apple")
    mesh = next(m for m in WORLD.objects.folder.glob("apple.stl"))
    import trimesh

    solid = trimesh.load(mesh)
    for layer in apple.touchset.layers:
        rows, cols = layer.left_m.shape
        assert layer.stable
        assert (rows, cols) == (35, 20)
        width = layer.aperture_m + float(np.nanmax(layer.left_m)) + float(np.nanmax(layer.right_m))
        low, high = layer.height_m - 0.0143, layer.height_m + 0.0143  # the window of the pads
        z = np.linspace(max(low, 1e-3), min(high, float(solid.bounds[1, 2]) - 1e-3), 15)
        spans = [np.ptp(s.vertices[:, :2], axis=0).max() for h in z if (s := solid.section([0, 0, 1], [0, 0, h]))]
        assert width <= max(spans) + 5e-4
        assert width >= 0.9 * max(spans) - 1e-3


@pytest.mark.study
def test_a_campaign_writes_its_points_picture_and_summary(tmp_path) -> None:
    campaign = RobustnessCampaign(seeds=(0,), axes=("depth_gain",), out=tmp_path)
    with ThreadPoolExecutor(1) as pool:
        summary = run_campaign(campaign, pool)
    points = summary["axes"]["depth_gain"]
    assert [p["level"] for p in points] == list(AXES["depth_gain"].levels)
    assert summary["failed"] == 0
    assert all(0.0 <= p["accepted"]["mean"] <= p["right"]["mean"] <= 1.0 for p in points)
    assert json.loads((tmp_path / "summary.json").read_text())["axes"]["none"][0]["accepted"]["n"] == 1
    assert (tmp_path / "robustness.png").stat().st_size > 10_000
    assert len((tmp_path / "points.csv").read_text().splitlines()) == 2 + len(points)


def test_missions_at_every_level_have_the_same_seeds_and_targets(tmp_path, monkeypatch) -> None:
    asked = []

    def retrieve(point, executor, on_row):
        asked.append(point)
        on_row({"target": "apple", "seed": 0, "cause": ""}, 1, 1)
        return summarise([{"target": "apple", "seed": 0, "status": "success", "correct": True}])

    monkeypatch.setattr(missions, "run_campaign", retrieve)
    rows = []
    campaign = RobustnessCampaign(seeds=(0,), axes=("gel_stiffness",), conditions="realistic", out=tmp_path)
    with ThreadPoolExecutor(1) as pool:
        summary = run_missions(campaign, pool, lambda row, *_: rows.append(row["level"]))
    assert [p.conditions for p in asked][:2] == ["realistic", "realistic+gel_stiffness_factor=0.3,0.3"]
    assert {(p.seeds, p.per_seed, p.targets) for p in asked} == {((0,), 1, asked[0].targets)}
    assert rows == [0.0, *AXES["gel_stiffness"].levels]
    assert summary["axes"]["gel_stiffness"][2]["success"]["rate"] == 1.0
    assert (tmp_path / "robustness.png").stat().st_size > 5_000


def test_unknown_axes_and_backends_are_refused(tmp_path) -> None:
    with pytest.raises(BadInput, match="--axis weather: must be among"):
        RobustnessCampaign(seeds=(0,), axes=("weather",), out=tmp_path)
    campaign = RobustnessCampaign(seeds=(0,), axes=(), out=tmp_path, backend="fake")
    with ThreadPoolExecutor(1) as pool, pytest.raises(BadInput):
        run_campaign(campaign, pool)
