"""Recognition and planning on touches of generated solids: `python tests/support/touched_shapes.py --shapes 1000`.

Each shape is loaded as a file, traced, squeezed where the skills would squeeze it, compared with its own STL beside one
other object, and its grasp is planned. An exception is a failure. The command prints the counts and each traceback.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
import traceback
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from glotouch_backends.rizon4 import XENSE_GRIPPER
from glotouch_bt.motion import FeltSpace
from glotouch_bt.perception.recognition import (
    MATCHERS,
    Belief,
    Closure,
    PadSpec,
    ProbeTouch,
    TargetModel,
    enough,
    expected_gain,
    infer_belief,
    wanted,
)
from glotouch_bt.perception.touch import TouchSequence, TouchSet
from glotouch_bt.robot.scene import Mesh, load_mesh
from glotouch_skills.common.planning import ClosureParams, Option, best_rates, options, plan_grasp
from glotouch_skills.take.object_check import widths_m
from tests.support.acquisition import HARSH, NOMINAL, Disturbance, squeeze, traced, true_gel
from tests.support.any_shape import KINDS, drawn

PAD = PadSpec(XENSE_GRIPPER.pad_window_m, XENSE_GRIPPER.pad_shape, XENSE_GRIPPER.pad_depth_m)
CLOSURES = 8
"""Most closures of a trial."""
CONFIDENCE = 0.97
"""Sufficient probability. Source: default of `touch_next`."""


@dataclass(frozen=True)
class Touched:
    """Result of one shape.

    Attributes:
        kind: Kind of the shape.
        height_m: Its height.
        right: It is the best candidate for its own STL.
        accepted: The best candidate was accepted.
        closures: Closures made.
        fitted: The grasp is planned from the STL.
    """

    kind: str
    height_m: float
    right: bool
    accepted: bool
    closures: int
    fitted: bool


@lru_cache(maxsize=2)
def shape(seed: int, number: int) -> tuple[str, Mesh]:
    """Write the shape of a number and load it as the program does; return its kind and mesh."""
    kind = KINDS[number % len(KINDS)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{kind.__name__}_{number}.stl"
        drawn(np.random.default_rng([seed, number]), kind).export(path)
        return kind.__name__, load_mesh(path)


def try_shape(seed: int, number: int, disturbance: Disturbance | None = None) -> Touched:
    """Recognise the shape of a number by closures chosen as `touch_next` does, and plan its grasp."""
    rng = np.random.default_rng([seed, number, 1])
    kind, mesh = shape(seed, number)
    _, other = shape(seed, number + 1)
    noise = disturbance or (NOMINAL, HARSH)[number % 2]
    model = TargetModel.from_mesh(mesh, PAD)
    solids = (mesh, other)
    poses = [np.array([0.09 * (2 * i - 1), *rng.uniform(-0.05, 0.05, 1), rng.uniform(-np.pi, np.pi)]) for i in (0, 1)]
    both = enumerate(zip(solids, poses, strict=True))
    candidates = [traced(m.as_trimesh(), q, noise, rng, i, contacts=True) for i, (m, q) in both]
    touchsets = tuple(TouchSet(c, ()) for c in candidates)
    gel, bias = true_gel(PAD, noise, rng), rng.uniform(-1, 1) * noise.aperture_bias_m
    datum = rng.normal(0, noise.datum_sd_m)
    params = ClosureParams() if number % 3 else ClosureParams(layers=1)
    for _ in range(CLOSURES):
        belief = infer_belief(model, touchsets)
        check_belief(belief)
        if enough(belief, CONFIDENCE, frozenset()):
            break
        chosen = choose(belief, params)
        if chosen is None:
            break
        index = chosen.closure.candidate
        at, height = chosen.at, chosen.closure.height_m
        layer, poses[index] = squeeze(
            solids[index].as_trimesh(),
            poses[index],
            at.position_K_m,
            at.yaw_K_rad,
            height,
            datum,
            bias,
            noise,
            gel,
            rng,
        )
        more = TouchSequence(at.position_K_m, at.yaw_K_rad, (layer,))
        touchsets = tuple(replace(t, sequences=(*t.sequences, more)) if t.candidate.index == index else t
                          for t in touchsets)  # fmt: skip
    ranking = MATCHERS["likelihood"](model, touchsets)
    if ranking.next_touch is not None:
        assert np.isfinite(ranking.next_touch.gain_nats)
    if number % 4 == 0:
        MATCHERS["paper"](model, touchsets)
    best = next(t for t in touchsets if t.candidate.index == ranking.best.index)
    fitted = False
    if best.layers:
        plan = plan_grasp(best, ranking.best, mesh, model, XENSE_GRIPPER)
        fitted = plan.source == "fitted"
        assert plan.opening_m <= XENSE_GRIPPER.stroke_m
        widths_m(model, float(plan.position_K_m[2]))
    return Touched(
        kind, model.height_m, ranking.best.index == 0, ranking.accepted, sum(len(t.layers) for t in touchsets), fitted
    )


def check_belief(belief: Belief) -> None:
    """Check that the probabilities are some, and that the probe's touches have gains."""
    shares = np.array([*(m.probability for m in belief.ranking.matches), belief.ranking.p_absent])
    assert np.isfinite(shares).all()
    assert abs(float(shares.sum()) - 1.0) < 1e-6
    probes = [ProbeTouch(m.index, part) for m in belief.ranking.matches for part in ("outline", "top")]
    assert np.isfinite(expected_gain(belief, probes)).all()


def choose(belief: Belief, p: ClosureParams) -> Option | None:
    """Return the closure that `touch_next` would make, were there no neighbours or walls."""
    found = options(belief.touchsets, None, np.array([0.0, 0.0, 0.15]), FeltSpace(), XENSE_GRIPPER, p)
    if not found:
        return None
    closures: list[Closure] = [c for o in found for c in (o.closure, *o.after)]
    gains = np.split(expected_gain(belief, closures), np.cumsum([1 + len(o.after) for o in found])[:-1])
    assert all(np.isfinite(g).all() for g in gains)
    first = wanted(belief, CONFIDENCE, frozenset())
    rates = best_rates(found, gains) + np.array([1e3 * (o.closure.candidate in first) for o in found])
    return found[int(np.argmax(rates))]


def main() -> int:
    """Try shapes; return 1 if one ended in an exception."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--shapes", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    options_ = parser.parse_args()
    results: list[Touched] = []
    failed: Counter[str] = Counter()
    start = time.perf_counter()
    numbers = range(options_.first, options_.first + options_.shapes)
    with ProcessPoolExecutor(options_.workers) as pool:
        for n, found in zip(numbers, pool.map(partial(_attempt, options_.seed), numbers, chunksize=10), strict=True):
            if isinstance(found, Touched):
                results.append(found)
                continue
            failed[found.strip().splitlines()[-1]] += 1
            sys.stderr.write(f"shape {n} of seed {options_.seed}:\n{found}\n")
    kinds = sorted({r.kind for r in results})
    table = {k: _rates([r for r in results if r.kind == k]) for k in kinds}
    summary = {
        "shapes": options_.shapes,
        "seed": options_.seed,
        "exceptions": failed,
        "exceptions_total": failed.total(),
        "all": _rates(results),
    } | table
    sys.stdout.write(json.dumps(summary | {"wall_s": round(time.perf_counter() - start)}, indent=1) + "\n")
    return 1 if failed else 0


def _attempt(seed: int, number: int) -> Touched | str:
    """Try a shape; return its result, or the traceback."""
    try:
        return try_shape(seed, number)
    except Exception:
        return traceback.format_exc()


def _rates(results: list[Touched]) -> dict[str, float]:
    n = max(len(results), 1)
    return {
        "n": len(results),
        "right": round(sum(r.right for r in results) / n, 3),
        "accepted": round(sum(r.accepted and r.right for r in results) / n, 3),
        "wrong": round(sum(r.accepted and not r.right for r in results) / n, 3),
        "closures": round(sum(r.closures for r in results) / n, 2),
        "fitted": round(sum(r.fitted for r in results) / n, 3),
    }


if __name__ == "__main__":
    sys.exit(main())
