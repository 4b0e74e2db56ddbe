"""Relief pairs, touched with and without gel images: what the images change, and what they leave alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from glotouch_bt.bench.match import MatchCampaign
from glotouch_bt.bench.match.dataset import Layout
from glotouch_bt.bench.match.synthetic import sampled_layout
from glotouch_bt.bench.match.trials import models_of
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.perception.recognition import TargetModel
from glotouch_bt.perception.recognition.likelihood import infer_belief
from glotouch_bt.perception.recognition.likelihood.relief import predicted_relief
from glotouch_bt.perception.touch import Layer, TouchSet
from glotouch_bt.robot import BadInput
from tests.support.relief_pairs import pair

pytestmark = pytest.mark.study

SEED = 4


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cylinder and its partner, which has ribs or grooves."""
    made = tmp_path_factory.mktemp("pair")
    for name, mesh in zip(("plain", "relief"), pair("round", np.random.default_rng(3)), strict=True):
        assert mesh.is_watertight
        mesh.export(made / f"{name}.stl")
    return made


def touched(folder: Path, *, images: bool) -> Layout:
    world = load_mission("touch_all", {}, objects=folder).world
    return sampled_layout("mujoco", world, load_conditions("realistic"), SEED, images=images)


@pytest.fixture(scope="module")
def layouts(folder: Path) -> tuple[Layout, Layout]:
    """The same touches without and with images."""
    return touched(folder, images=False), touched(folder, images=True)


@pytest.fixture(scope="module")
def models(folder: Path, layouts: tuple[Layout, Layout]) -> dict[str, TargetModel]:
    return models_of(layouts[0], folder)


def layers_of(layout: Layout) -> list[Layer]:
    return [layer for t in layout.touched for layer in t.touchset.layers]


def test_images_change_nothing_else(layouts: tuple[Layout, Layout]) -> None:
    for plain, seen in zip(*map(layers_of, layouts), strict=True):
        assert plain.relief is None
        assert (seen.relief is not None) == seen.stable
        assert plain.aperture_m == seen.aperture_m
        assert plain.left_m.tobytes() == seen.left_m.tobytes()
        assert plain.right_m.tobytes() == seen.right_m.tobytes()


def test_without_images_the_likelihood_is_as_before(
    layouts: tuple[Layout, Layout], models: dict[str, TargetModel]
) -> None:
    def blind(t: TouchSet) -> TouchSet:
        rest = tuple(replace(s, layers=tuple(replace(l, relief=None) for l in s.layers)) for s in t.sequences)
        return replace(t, sequences=rest)

    without, seen = ([t.touchset for t in layout.touched] for layout in layouts)
    one, two = infer_belief(models["plain"], without), infer_belief(models["plain"], [blind(t) for t in seen])
    assert [p.log_ratio for p in one.pairs] == [p.log_ratio for p in two.pairs]
    assert all("relief" not in p.terms for p in one.pairs)
    with_images = infer_belief(models["plain"], seen)
    assert [p.terms["width"] for p in with_images.pairs] == [p.terms["width"] for p in one.pairs]


@pytest.mark.parametrize("target", ["plain", "relief"])
def test_images_tell_the_pair_apart(
    target: str, layouts: tuple[Layout, Layout], models: dict[str, TargetModel]
) -> None:
    layout = layouts[1]
    names = {t.touchset.candidate.index: t.name for t in layout.touched}
    belief = infer_belief(models[target], [t.touchset for t in layout.touched])
    right, wrong = (next(p for p in belief.pairs if (names[p.index] == target) is same) for same in (True, False))
    assert names[belief.ranking.best.index] == target
    assert belief.ranking.best.probability > 0.95
    assert right.terms["relief"] > wrong.terms["relief"] + 5.0
    unknown = infer_belief(replace(models[target], mesh=None, sides=()), [t.touchset for t in layout.touched])
    assert all(p.terms["relief"] == 0.0 for p in unknown.pairs), "nothing is known of the relief without a mesh"


def test_the_prediction_agrees_with_the_images(layouts: tuple[Layout, Layout], models: dict[str, TargetModel]) -> None:
    """The images of the simulator and rays through the recogniser's own model are two ways to the same relief."""
    for t in layouts[1].touched:
        assert t.name is not None
        assert t.pose_K_O is not None
        model = models[t.name]
        measured, windows = [], []
        x, y, yaw = t.pose_K_O
        for sequence in t.touchset.sequences:
            for layer in sequence.layers:
                assert layer.relief is not None
                x_P = np.array([np.cos(layer.yaw_rad), np.sin(layer.yaw_rad)])
                along = float(x_P @ (layer.position_K_m - [x, y]))
                windows.append((layer.yaw_rad - yaw, along, layer.height_m, 1.0))
                measured.append(layer.relief[0])
        predicted = predicted_relief(model, np.array(windows)).mean(axis=(0, 2, 3))
        assert np.abs(predicted - np.mean(measured, axis=(0, 2, 3))).max() < 0.25 * predicted.max() + 0.01


def test_images_need_sampled_touches(tmp_path: Path) -> None:
    campaign = MatchCampaign(
        seeds=(1,), conditions="ideal", methods=("likelihood",), out=tmp_path, backend="mujoco", gel_images=True
    )
    with pytest.raises(BadInput, match="--gel-images"):
        campaign.check()
