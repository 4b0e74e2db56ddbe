"""Every term of the paper's loss against hand-worked cases."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.recognition.paper import TERMS, PaperParams
from glotouch_bt.perception.recognition.paper.matcher import depth_loss, mode_loss
from glotouch_bt.perception.recognition.paper.observation import PaperObservation, SequenceReading, coupled_probability
from glotouch_bt.perception.recognition.paper.residuals import cross_sums, huber, joined, sequence_sums
from glotouch_bt.robot import ParamError

UNIT = PaperParams(huber=1.5, w_absolute=1.0, w_centred=1.0, w_vertical=1.0, w_cross=1.0, coverage=1.0, bias=1.0)
NO_BIAS = np.zeros(1)


def column(*r: float) -> np.ndarray:
    """(H, 1) residuals in units at a single hypothesis."""
    return np.array(r, dtype=np.float32)[:, None]


def family(name: str, r: np.ndarray, w: np.ndarray, bias_m: np.ndarray = NO_BIAS, p: PaperParams = UNIT) -> float:
    return float(sequence_sums(r, w, bias_m, p.only(name)).loss(bias_m, p.only(name))[0, 0])


def reading(k: int, along: float, heights: list[float], weights: list[float]) -> SequenceReading:
    n = len(heights)
    return SequenceReading(
        k, 0.0, along, np.full(n, 0.05), np.array(heights), np.array(weights), np.ones(n, dtype=bool), np.zeros(n),
        0.1, 1.0,
    )  # fmt: skip


def observed(rho: list[float], q: list[float]) -> PaperObservation:
    return PaperObservation((), 0.0, np.array(rho), np.array(q), 1.0)


@pytest.mark.parametrize(("r", "expected"), [(0.0, 0.0), (0.5, 0.25), (-1.5, 2.25), (3.0, 6.75), (-10.0, 27.75)])
def test_huber_values(r: float, expected: float) -> None:
    """r^2 up to c = 1.5, then 2 c |r| - c^2."""
    assert huber(np.float32([r]), 1.5)[0] == pytest.approx(expected)


@given(st.floats(-20, 20), st.floats(0.1, 5))
def test_huber_is_even_smooth_and_never_above_the_square(r: float, c: float) -> None:
    v = float(huber(np.float32([r]), c)[0])
    assert v == float(huber(np.float32([-r]), c)[0])
    assert v <= r * r + 1e-4
    d = 1e-2
    slope = float(huber(np.float32([c + d]), c)[0] - huber(np.float32([c - d]), c)[0]) / (2 * d)
    assert slope == pytest.approx(2 * c, rel=0.02, abs=0.02)


def test_absolute_family() -> None:
    """sqrt((1 * 1 + 0.5 * 6.75) / 1.5)."""
    assert family("absolute", column(1.0, 3.0), np.array([1.0, 0.5])) == pytest.approx(math.sqrt(4.375 / 1.5))


def test_absolute_family_with_a_bias() -> None:
    """A bias of one unit (2 mm) takes 1 off each residual; its own penalty is lambda_b |b| / b_0."""
    bias = np.array([UNIT.unit_m])
    assert family("absolute", column(1.0, 2.0), np.ones(2), bias) == pytest.approx(math.sqrt(0.5))
    p = UNIT.only("bias")
    assert family("bias", column(1.0), np.ones(1), np.array([0.003]), p) == pytest.approx(0.003 / p.bias_unit_m)


def test_centred_family_does_not_see_a_common_offset() -> None:
    """Residuals 0, 1, 2 about their mean: +-1, RMS sqrt(2 / 3)."""
    assert family("centred", column(0.0, 1.0, 2.0), np.ones(3)) == pytest.approx(math.sqrt(2 / 3))
    assert family("centred", column(5.0, 6.0, 7.0), np.ones(3)) == pytest.approx(math.sqrt(2 / 3), abs=1e-5)


def test_vertical_family_weighs_a_pair_by_its_weaker_layer() -> None:
    """Steps 1 (weight 0.4) and 0.5 (weight 1)."""
    r, w = column(0.0, 1.0, 1.5), np.array([0.4, 1.0, 1.0])
    assert family("vertical", r, w) == pytest.approx(math.sqrt((0.4 * 1 + 1 * 0.25) / 1.4))


def test_one_layer_has_no_shape() -> None:
    for name in ("centred", "vertical"):
        assert family(name, column(2.0), np.ones(1)) == 0.0


def test_cross_family_compares_neighbours_at_the_same_height() -> None:
    """Tracks at -2, 0, 2 cm: differences of neighbours only, and only where both have the layer."""
    a = reading(0, 0.02, [0.02, 0.04], [1.0, 1.0])
    b = reading(1, -0.02, [0.02, 0.04], [1.0, 1.0])
    c = reading(2, 0.0, [0.02], [0.5])
    residuals = [column(1.0, 9.0), column(0.0, 9.0), column(0.5)]
    p = UNIT.only("cross")
    cross = cross_sums([a, b, c], residuals, p)
    assert cross is not None
    sums = [sequence_sums(r, x.weight, NO_BIAS, p) for r, x in zip(residuals, (a, b, c), strict=True)]
    assert joined(sums, cross).loss(NO_BIAS, p)[0, 0] == pytest.approx(0.5)
    assert joined(sums, None).loss(NO_BIAS, p)[0, 0] == 0.0
    far = [reading(0, 0.0, [0.02], [1.0]), reading(1, 0.02, [0.03], [1.0])]
    assert cross_sums(far, [column(0.0), column(1.0)], p) is None


def test_coverage_is_the_part_without_support() -> None:
    """One of four layers has no predicted width; residuals of the others are all there is to compare."""
    r = column(0.0, 1.0, np.nan, 0.0)
    assert family("coverage", r, np.ones(4)) == pytest.approx(0.25)
    assert family("absolute", r, np.ones(4)) == pytest.approx(math.sqrt(1 / 3))
    assert family("vertical", r, np.ones(4)) == pytest.approx(1.0)  # the gap breaks the chain of differences


def test_a_pose_without_any_support_is_no_hypothesis() -> None:
    assert family("absolute", column(np.nan, np.nan), np.ones(2)) == math.inf


def test_all_families_add_up() -> None:
    r, w = column(0.3, -1.0, 2.5), np.array([1.0, 0.4, 1.0])
    bias = np.array([1e-3])
    full = float(sequence_sums(r, w, bias, UNIT).loss(bias, UNIT)[0, 0])
    parts = sum(family(t, r, w, bias) for t in ("absolute", "centred", "vertical", "coverage", "bias"))
    assert full == pytest.approx(parts, rel=1e-5)


@pytest.mark.parametrize(
    ("travel", "turn", "expected"),
    [
        (0.012, math.radians(15), 0.5),  # both at their scale: sqrt(1/2 1/2)
        (0.024, math.radians(7.5), 8 / 9),  # sigma(3 log 2) = 2^3 / (1 + 2^3)
        (0.024, math.radians(30), math.sqrt(8) / 9),  # one for, one against: sqrt(8/9 1/9)
        (0.024, math.pi, math.sqrt(8 / 9 / (1 + (0.5 / 15) ** 3))),  # half a turn is none: the floor of 0.5 deg
    ],
)
def test_coupled_probability(travel: float, turn: float, expected: float) -> None:
    positions = np.array([[0.0, 0.0], [0.3, 0.4], [1.0, 0.0]]) * 0
    positions[:, 0] = [0.1, 0.1 + travel / 2, 0.1 + travel]
    yaws = np.array([0.3, 0.3, 0.3 + turn])
    c, s = math.cos(0.7), math.sin(0.7)
    for at in (positions, positions @ np.array([[c, s], [-s, c]])):
        assert coupled_probability(at, yaws, PaperParams()) == pytest.approx(expected, rel=1e-6)


def test_coupled_probability_of_degenerate_sets() -> None:
    p = PaperParams()
    assert coupled_probability(np.zeros((3, 2)), np.zeros(3), p) < 0.01  # no travel: the floor of 0.1 mm
    assert coupled_probability(np.zeros((1, 2)), np.zeros(1), p) < 0.01
    assert coupled_probability(np.zeros((0, 2)), np.zeros(0), p) == 0.0


def test_depth_term() -> None:
    """median log(1 + (dr / sigma)^2) = log 2 over the two felt sequences; mean q = 0.5; I = 0.06 / 0.08."""
    p = PaperParams(depth_sd=0.05, depth_eps=0.02)
    seen = observed([0.15, 0.25, math.nan], [1.0, 0.5, 0.0])
    assert depth_loss(seen, 0.2, 0.06, p) == pytest.approx(math.log(2) * 0.5 * 0.75)
    assert depth_loss(seen, 0.2, 0.0, p) == 0.0
    assert depth_loss(observed([math.nan], [0.0]), 0.2, 0.06, p) == 0.0


def test_fewer_valid_patches_lower_the_depth_term() -> None:
    """A fault of the formula, kept: docs/explanation/paper_matcher.md."""
    many, few = observed([0.4], [1.0]), observed([0.4], [0.25])
    assert depth_loss(few, 0.1, 0.05, PaperParams()) == pytest.approx(0.25 * depth_loss(many, 0.1, 0.05, PaperParams()))


def test_mode_term() -> None:
    p = PaperParams(mode=2.0)
    assert mode_loss(0.25, 0.6, p) == pytest.approx(2.0 * 0.36 * 0.75)
    assert mode_loss(0.0, 0.0, p) == 0.0  # a round model is never punished


def test_switches() -> None:
    p = PaperParams()
    assert p.only(*TERMS) == p
    assert p.without("mode") == p.width_depth()
    assert p.only(*(set(TERMS) - {"depth", "mode"})) == p.width_only()
    assert list(p.ablation()) == ["width", "+ depth", "+ mode (full)"]
    assert p.only("depth").w_absolute == 0.0
    with pytest.raises(ParamError, match="one of absolute"):
        p.only("colour")
    with pytest.raises(ParamError, match="colour"):
        p.without("colour")


@pytest.mark.parametrize(
    "bad",
    [
        {"unit_m": 0.0}, {"huber": math.nan}, {"shift_steps": 4}, {"z0_steps": 0}, {"scales": ()}, {"scales": (0.1,)},
        {"unilateral": 1.5}, {"mode": -1.0}, {"branch": "both"}, {"depth_sd": 0.0},
    ],
)  # fmt: skip
def test_bad_parameters_are_refused(bad: dict[str, object]) -> None:
    with pytest.raises(ParamError):
        replace(PaperParams(), **bad)
