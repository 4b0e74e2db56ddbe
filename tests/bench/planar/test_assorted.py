"""Random layouts of random objects."""

from __future__ import annotations

import numpy as np

from glotouch_bt.bench.planar import assorted_world
from glotouch_bt.bench.planar.assorted import COUNT, GAP_M, MIN_SIDE_M
from glotouch_bt.mission.load import load_mission
from tests.bench.planar.conftest import TIP


def test_numbers_and_sizes_vary_and_gaps_are_kept() -> None:
    world = load_mission("survey", {}).world
    counts, sizes = set(), []
    for seed in range(3):
        made = assorted_world(world, seed)
        counts.add(len(made.sections))
        sizes += [s.box_size_m[1] for s in made.sections]
        outlines = [made.to_K(i, s.outline_m) for i, s in enumerate(made.sections)]
        for i, line in enumerate(outlines):
            assert (np.abs(line) < made.half_m + TIP).all()
            for j in set(range(len(outlines))) - {i}:
                assert made.clearance(line, j).min() + TIP > GAP_M[0] - 2e-4
        again = assorted_world(world, seed)
        np.testing.assert_array_equal(again.poses, made.poses)
    assert len(counts) > 1
    assert min(counts) >= COUNT[0]
    assert max(counts) <= COUNT[1]
    assert min(sizes) > MIN_SIDE_M - 3e-4
    assert max(sizes) > 2 * min(sizes)
