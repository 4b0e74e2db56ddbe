"""Unusable input is refused with a sentence, or counts as no evidence; it never makes a ranking confident."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from glotouch_bt.perception.model_cache import target_model
from glotouch_bt.perception.recognition import MATCHERS, TargetModel
from glotouch_bt.robot import BadInput, ParamError
from glotouch_bt.robot.scene.meshes import load_mesh
from tests.support.acquisition import NOMINAL, acquire


def box(*size_m: float) -> trimesh.Trimesh:
    return trimesh.creation.box(size_m)


def apart(by_m: float) -> trimesh.Trimesh:
    return box(0.03, 0.03, 0.05).apply_translation([by_m, 0, 0])


def doubled_sheet() -> trimesh.Trimesh:
    """A closed surface without inside: a tilted sheet, its back a copy of its front."""
    front = np.array(
        [[[0, 0, 0], [0.05, 0, 0.02], [0.05, 0.05, 0.04]], [[0, 0, 0], [0.05, 0.05, 0.04], [0, 0.05, 0.02]]]
    )
    both = np.concatenate([front, front[:, ::-1]])
    return trimesh.Trimesh(**trimesh.triangles.to_kwargs(both))


@pytest.mark.parametrize(
    ("solid", "words"),
    [
        (box(0.5, 0.4, 0.4), r"0\.5 m large; STL files must be in METRES"),
        (box(60.0, 40.0, 50.0), r"millimetres\? then scale it by 0\.001 to 0\.06 m"),
        (box(0.003, 0.002, 0.003), "thick"),
        (box(0.05, 0.05, 0.0), "thick|volume|watertight"),
        (doubled_sheet(), "watertight|no volume|no inside"),
        (trimesh.util.concatenate([box(0.04, 0.04, 0.05), apart(0.1)]), "2 separate bodies"),
    ],
    ids=["huge", "millimetres", "tiny", "flat", "sheet", "two bodies"],
)  # fmt: skip
def test_an_stl_that_cannot_be_a_target(solid: trimesh.Trimesh, words: str, tmp_path: Path) -> None:
    solid.export(tmp_path / "odd.stl")
    with pytest.raises(BadInput, match=words) as caught:
        load_mesh(tmp_path / "odd.stl")
    assert "odd.stl" in str(caught.value)


def test_a_solid_too_low_to_be_traced(solids, tmp_path: Path) -> None:
    with pytest.raises(ParamError, match="high enough"):
        target_model(solids.box(0.06, 0.04, 0.008), folder=tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def felt(solids):
    meshes = [solids.box(0.080, 0.040, 0.060), solids.cylinder(0.025, 0.070)]
    sets = [acquire(m, (0.1 * i, 0.0, 0.4), NOMINAL, np.random.default_rng(50 + i), i)[0] for i, m in enumerate(meshes)]
    return meshes, sets


def broken(touchset, **layer):
    return replace(
        touchset,
        sequences=tuple(
            replace(s, layers=tuple(replace(x, **{k: v(x) for k, v in layer.items()}) for x in s.layers))
            for s in touchset.sequences
        ),
    )


BROKEN = {
    "NaN depth": {
        "left_m": lambda x: np.full_like(x.left_m, np.nan), "right_m": lambda x: np.full_like(x.right_m, np.nan)
    },
    "infinite depth": {
        "left_m": lambda x: np.full_like(x.left_m, np.inf), "right_m": lambda x: np.full_like(x.right_m, np.inf)
    },
    "wrong shapes": {"left_m": lambda x: np.zeros(7), "right_m": lambda x: np.zeros((2, 2, 2))},
    "no plateau": {"stable": lambda x: False},
    "NaN aperture": {"aperture_m": lambda x: float("nan")},
    "NaN yaw": {"yaw_rad": lambda x: float("nan")},
}  # fmt: skip


@pytest.mark.parametrize("matcher", sorted(MATCHERS))
@pytest.mark.parametrize("how", sorted(BROKEN))
def test_a_broken_touchset_is_no_evidence_and_spoils_no_other(felt, matcher: str, how: str) -> None:
    meshes, (good, other) = felt
    model = TargetModel.from_mesh(meshes[0])
    alone = MATCHERS[matcher](model, [broken(good, **BROKEN[how])])
    assert not alone.accepted
    assert any(why in alone.reasons[-1] for why in ("no evidence", "no closure felt"))
    assert alone.best.evidence == 0
    beside = MATCHERS[matcher](model, [good, broken(other, **BROKEN[how])])
    assert beside.best.index == good.candidate.index
    assert {m.index: m.evidence for m in beside.matches}[other.candidate.index] == 0
    assert sum(m.probability for m in beside.matches) + beside.p_absent == pytest.approx(1.0)


def test_maps_too_coarse_are_refused(felt) -> None:
    meshes, (good, _) = felt
    coarse = broken(good, left_m=lambda x: np.full((3, 3), 1e-3), right_m=lambda x: np.full((3, 3), 1e-3))
    with pytest.raises(ParamError, match="depth"):
        MATCHERS["likelihood"](TargetModel.from_mesh(meshes[0]), [coarse])
