"""Components of a solid that the probe takes for separate objects, against solids whose components are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from glotouch_bt.perception.recognition.model.components import component_outlines


def block(x: float, y: float, low: float, high: float, at: tuple[float, float] = (0.0, 0.0)) -> trimesh.Trimesh:
    solid = trimesh.creation.box([x, y, high - low])
    solid.apply_translation([*at, 0.5 * (low + high)])
    return solid


def posts(gap_m: float, plate_m: float) -> trimesh.Trimesh:
    """Four posts of 12 mm, 40 mm high and `gap_m` apart, and a plate of 5 mm whose lower side is at `plate_m`."""
    off = 0.5 * gap_m + 0.006
    four = [block(0.012, 0.012, 0.0, 0.04, (x * off, y * off)) for x in (-1, 1) for y in (-1, 1)]
    return trimesh.util.concatenate([block(2 * off, 2 * off, plate_m, plate_m + 0.005), *four])


def test_what_hangs_together_has_no_feet() -> None:
    assert component_outlines(block(0.06, 0.04, 0.0, 0.05)) == ()


def test_a_channel_has_two_walls() -> None:
    """Walls of 60 mm x 10 mm, 30 mm apart, on a floor of 5 mm, which the ball passes above."""
    walls = [block(0.06, 0.01, 0.0, 0.05, (0.0, y)) for y in (-0.02, 0.02)]
    outlines = component_outlines(trimesh.util.concatenate([block(0.06, 0.05, 0.0, 0.005), *walls]))
    assert len(outlines) == 2
    middles = sorted((o.as_box.centre_m.tolist() for o in outlines), key=lambda c: c[1])
    np.testing.assert_allclose(middles, [[0.0, -0.02], [0.0, 0.02]], atol=2e-3)
    for o in outlines:
        assert o.p_box > 0.5
        np.testing.assert_allclose(o.as_box.size_m, [0.06, 0.01], atol=3e-3)


@pytest.mark.parametrize(
    ("gap_m", "plate_m", "components"),
    [(0.030, 0.0, 4), (0.008, 0.0, 0), (0.030, 0.035, 0)],
    ids=["the ball passes between", "it does not", "the shaft meets the plate above"],
)
def test_posts_are_apart_if_the_probe_passes_between_them(gap_m: float, plate_m: float, components: int) -> None:
    assert len(component_outlines(posts(gap_m, plate_m))) == components
