"""Lean, sparse traces, one-sided closures and noisy pads, each against a simulation or a closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy
import trimesh

from glotouch_bt.perception.recognition import PadSpec, TargetModel
from glotouch_bt.perception.recognition.evidence import LayerEvidence, contact_tops
from glotouch_bt.perception.recognition.likelihood.background import log_generic_widths
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.scalars import HEIGHTS_M, RISE_SHARE, contour_ratio, height_ratio
from glotouch_bt.perception.recognition.model import TIP_RADIUS_M, traced_tips
from glotouch_bt.perception.touch import fit_contour
from tests.perception.recognition.conftest import as_mesh
from tests.support.acquisition import IDEAL, acquire

PARAMS = LikelihoodParams()


def bent_bar() -> trimesh.Trimesh:
    """Two arms of 60 mm, 20 mm wide and high, at 90 degrees: neither a circle nor a rectangle."""
    arms = [trimesh.creation.box((0.060, 0.020, 0.020)), trimesh.creation.box((0.020, 0.060, 0.020))]
    for arm, middle in zip(arms, ((0.0, -0.020, 0.010), (-0.020, 0.0, 0.010)), strict=True):
        arm.apply_translation(middle)
    return trimesh.util.concatenate(arms)


@pytest.fixture(scope="module")
def bar():
    solid = bent_bar()
    touched, _ = acquire(as_mesh(solid, "bent bar"), (0.0, 0.0, 0.0), IDEAL, np.random.default_rng(0))
    return solid, TargetModel.from_mesh(as_mesh(solid, "bent bar")), touched.candidate


def test_a_top_raised_by_a_lean_is_expected(solids) -> None:
    mesh = solids.box(0.080, 0.040, 0.060)
    touched, _ = acquire(mesh, (0.0, 0.0, 0.3), IDEAL, np.random.default_rng(0))
    model = TargetModel.from_mesh(mesh)

    def ratio(height_m: float) -> float:
        return height_ratio(model, replace(touched.candidate, height_m=height_m, top_touched=True), PARAMS)

    for lean_deg in (3.0, 8.0):
        lean = math.radians(lean_deg)
        higher_m = 0.060 * math.cos(lean) + 0.080 * math.sin(lean)  # standing on its short edge
        assert ratio(higher_m) > ratio(2 * 0.060 - higher_m)
        assert ratio(higher_m) > math.log(0.3)
    assert ratio(0.060) > 2.0


def test_the_height_of_leaning_objects_against_random_draws(solids) -> None:
    mesh = solids.box(0.080, 0.040, 0.060)
    touched, _ = acquire(mesh, (0.0, 0.0, 0.3), IDEAL, np.random.default_rng(0))
    model, rng, n = TargetModel.from_mesh(mesh), np.random.default_rng(1), 400_000
    scaled = (1 + PARAMS.scale_sd * rng.standard_normal(n)) * model.height_m
    lean = rng.exponential(PARAMS.lean_rad, n)
    rise = lean * RISE_SHARE * float(np.mean(model.outline.likely.size_m))
    offset = 2 * PARAMS.offset_sd_m * rng.standard_normal(n)
    drawn = scaled + rise + offset + PARAMS.height_sd_m * rng.standard_normal(n)
    edges = np.linspace(0.057, 0.069, 13)
    share = np.histogram(drawn, edges)[0] / n
    fine = np.linspace(edges[0], edges[-1], 12 * 40 + 1)
    # Without the parts of another top: of a wholly traced object, never taken lower.
    p = replace(PARAMS, contour_outlier=1e-9, height_lower=1e-9)
    ratios = [height_ratio(model, replace(touched.candidate, height_m=float(h), top_touched=True), p) for h in fine]
    density = (np.exp(ratios) - 0.01) / 0.99 / (HEIGHTS_M[1] - HEIGHTS_M[0])
    predicted = [float(np.trapezoid(density[40 * i : 40 * i + 41], fine[40 * i : 40 * i + 41])) for i in range(12)]
    assert predicted == pytest.approx(share, abs=0.004)


def test_a_trace_of_an_irregular_solid_tells_as_much_as_traces_scatter(bar) -> None:
    solid, model, candidate = bar
    rng = np.random.default_rng(3)
    own, longer = [], []
    for _ in range(12):
        tips = traced_tips(solid, rng.normal(0, 2e-3, 2), 12, rng.uniform(0, 2 * math.pi))
        contour = fit_contour(tips + rng.normal(0, 3e-4, tips.shape), TIP_RADIUS_M)
        own.append(contour_ratio(model, replace(candidate, contour=contour), PARAMS))
        size = contour.size_m[0] + 0.015, contour.size_m[1] + 0.015
        longer.append(contour_ratio(model, replace(candidate, contour=replace(contour, size_m=size)), PARAMS))
    assert np.median(own) > 2.5
    assert np.median(longer) < 0.0


def test_a_trace_of_few_contacts_tells_less(bar) -> None:
    solid, model, candidate = bar
    tips = traced_tips(solid, np.zeros(2), 12, 0.2)
    few = replace(candidate, contour=fit_contour(tips[:4], TIP_RADIUS_M))
    wrong = replace(few, contour=replace(few.contour, covariance=np.zeros((0, 0))))
    assert contour_ratio(model, few, PARAMS) > contour_ratio(model, wrong, PARAMS) - 1e-9


@pytest.mark.parametrize("width_m", [0.045, 0.060, 0.075])
def test_an_upper_bound_of_any_width_against_random_draws(solids, width_m: float) -> None:
    touched, _ = acquire(solids.box(0.080, 0.060, 0.060), (0.0, 0.0, 0.0), IDEAL, np.random.default_rng(0))
    none = (None, None)
    below = LayerEvidence(0, 0, 0.060, 1.0, False, 0.0, 0.0, 0.02, none, (1e-4, 1e-4))
    bound = LayerEvidence(0, 1, width_m, 0.35, True, 0.0, 0.0, 0.03, none, (1e-4, 0.0))
    rng = np.random.default_rng(0)
    own = 0.060 + 2.5e-3 * rng.standard_cauchy(1_000_000)
    drawn = float(np.mean(own < width_m)) / PARAMS.width_range_m  # the target's bound has no upper limit either
    expected = (1 - PARAMS.width_outlier) * drawn + PARAMS.width_outlier / PARAMS.width_range_m
    found = math.exp(log_generic_widths((below, bound), touched.candidate, PARAMS)[1])
    assert found == pytest.approx(expected, rel=0.05)


def smooth_noise(rng: np.random.Generator, rms_m: float, spec: PadSpec) -> np.ndarray:
    """Return a part of a Gaussian field with a correlation length of 5 mm."""
    rows, cols = spec.shape
    pitch = np.array(spec.window_m[::-1]) / spec.shape
    field = scipy.ndimage.gaussian_filter(rng.standard_normal((3 * rows, 3 * cols)), 5e-3 / math.sqrt(2) / pitch)
    return np.asarray(rms_m / field.std() * field[rows : 2 * rows, cols : 2 * cols])


def test_a_small_contact_is_found_in_smooth_noise() -> None:
    spec, rng = PadSpec(), np.random.default_rng(0)
    rows, cols = spec.shape
    z, x = np.meshgrid(np.arange(rows) * 0.0285 / rows, np.arange(cols) * 0.0172 / cols, indexing="ij")
    bump = 6e-4 * np.exp(-0.5 * ((z - 0.014) ** 2 + (x - 0.008) ** 2) / 1.5e-3**2)
    noise = [smooth_noise(rng, 1e-4, spec) for _ in range(400)]
    found = np.array(contact_tops([n + bump for n in noise], [1e-4] * len(noise), spec))
    assert np.mean(found > 0) > 0.9  # 0.69 if the whole patch had to exceed the threshold
    assert float(np.median(found)) == pytest.approx(6e-4, abs=1.5e-4)
    assert np.mean(np.array(contact_tops(noise, [1e-4] * len(noise), spec)) > 0) < 0.08


def test_a_large_shallow_patch_of_noise_is_not_taken_for_the_contact() -> None:
    """A deep contact whose mean is above the noise: what is shallower than the noise is none of its patch."""
    depth = np.zeros((35, 20))
    depth[2:12, 2:12] = 1e-3
    depth[16:, :] = 3.5e-5
    depth[20, 5:9] = depth[21, 5:9] = depth[22, 5:9] = 6e-5
    assert contact_tops([depth], [4.4e-5], PadSpec()) == pytest.approx([1e-3])
