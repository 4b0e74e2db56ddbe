"""Tops of parts of an object, and the likelihood of a height that may be one of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from glotouch_bt.perception.recognition import TargetModel
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.scalars import height_ratio, whole_share
from glotouch_bt.perception.recognition.model.tops import TOPS, tops_within
from tests.perception.recognition.conftest import as_mesh
from tests.support.acquisition import IDEAL, acquire

PARAMS = LikelihoodParams()


def post_and_mast() -> trimesh.Trimesh:
    """A block 40 mm wide and 60 mm high, with a mast of 90 mm height 35 mm beside its middle."""
    block = trimesh.creation.box((0.04, 0.04, 0.06))
    block.apply_translation((0, 0, 0.03))
    plate = trimesh.creation.box((0.05, 0.012, 0.02))
    plate.apply_translation((0.02, 0, 0.01))
    mast = trimesh.creation.cylinder(0.004, 0.09)
    mast.apply_translation((0.035, 0, 0.045))
    return trimesh.util.concatenate([block, plate, mast])


def test_tops_grow_with_the_disc() -> None:
    tops = tops_within(post_and_mast(), 0.045)
    assert len(tops) == TOPS
    limits = 0.045 * np.arange(1, TOPS + 1) / TOPS
    assert tops == pytest.approx(np.where(limits < 0.031, 0.06, 0.09), abs=1e-9)


def test_a_sphere_has_one_top(solids) -> None:
    assert tops_within(solids.sphere(0.03).as_trimesh(), 0.03) == pytest.approx(np.full(TOPS, 0.06), abs=1e-4)


@pytest.fixture(scope="module")
def masted():
    mesh = as_mesh(post_and_mast(), "mast")
    touched, _ = acquire(mesh, (0.0, 0.0, 0.3), IDEAL, np.random.default_rng(0))
    return TargetModel.from_mesh(mesh), touched.candidate


def test_the_lower_top_of_a_partly_traced_object_fits_better_than_any_other_height(masted) -> None:
    model, candidate = masted
    part = replace(candidate, contour=replace(candidate.contour, size_m=(0.041, 0.040)))
    assert whole_share(model, part, PARAMS) < whole_share(model, candidate, PARAMS)

    def ratio(height_m: float) -> float:
        return height_ratio(model, replace(part, height_m=height_m, top_touched=True), PARAMS)

    assert ratio(0.060) > max(ratio(0.052), ratio(0.068), ratio(0.080)) + 0.5
    assert ratio(0.090) > ratio(0.060)


def test_a_leaning_object_is_higher_not_lower(masted) -> None:
    model, candidate = masted
    high, low = (
        height_ratio(model, replace(candidate, height_m=model.height_m + d, top_touched=True), PARAMS)
        for d in (2.5e-3, -2.5e-3)
    )
    assert high > low


def test_the_density_of_a_height_is_one_in_all(masted) -> None:
    model, candidate = masted
    heights = np.linspace(0.018, 0.115, 4000)
    ratio = [height_ratio(model, replace(candidate, height_m=h, top_touched=True), PARAMS) for h in heights.tolist()]
    assert np.exp(ratio).mean() == pytest.approx(1.0, abs=0.02)
