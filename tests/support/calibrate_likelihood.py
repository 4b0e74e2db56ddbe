"""Calibrate the likelihood: `python tests/support/calibrate_likelihood.py --objects DIR --runs DIR`.

Boxes of objects are touched without a robot (`Backend.touch_sampler`): the shipped five, every folder of `--objects`;
`--runs` takes folders of recorded missions with their truth. Every object of a box is the target once, present and
removed, after four closures and after all. Slope, offset and the twin's parameters that give the truth the highest mean
probability are printed, with the rates of both settings. Every set of data has the same weight.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

sys.path.insert(0, str(Path(__file__).parents[2]))

from glotouch_backends.rizon4 import XENSE_GRIPPER
from glotouch_bt.bench.match import Layout, sampled_layout
from glotouch_bt.bench.match.acquire import layout_of
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.perception import model_for
from glotouch_bt.perception.recognition import PadSpec, TargetModel
from glotouch_bt.perception.recognition.likelihood import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.pair import Pair, compare, read_touchset
from glotouch_bt.perception.recognition.likelihood.posterior import probabilities, ratios
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.report import read_run
from glotouch_bt.robot import ParamError
from glotouch_bt.robot.scene import load_mesh

PAD = PadSpec(XENSE_GRIPPER.pad_window_m, XENSE_GRIPPER.pad_shape, XENSE_GRIPPER.pad_depth_m)
FEW = 4
"""Closures after which a decision is judged, besides all of them."""
FITTED = ("slope", "offset", "twin", "twin_slope", "twin_fit")
MIN_P = 1e-4
"""Least probability of the truth that counts, so that single boxes do not decide."""


@dataclass(frozen=True)
class Problem:
    """A decision: the candidates' pairs, and the index of the target among them, or None."""

    pairs: tuple[Pair, ...]
    target: int | None


@lru_cache(maxsize=256)
def model_of(folder: Path, name: str, stance: str) -> TargetModel:
    """Return the model of an object of a folder, with the sides on which it may stand."""
    return model_for(load_mesh(folder / f"{name}.stl"), XENSE_GRIPPER, stance)


def first_closures(touchset: TouchSet, count: int) -> TouchSet:
    """Return a TouchSet with the first closures: the lowest of every sequence, then the next ones."""
    places = sorted((h, k) for k, s in enumerate(touchset.sequences) for h in range(len(s.layers)))[:count]
    kept = (
        replace(s, layers=tuple(layer for h, layer in enumerate(s.layers) if (h, k) in places))
        for k, s in enumerate(touchset.sequences)
    )
    return replace(touchset, sequences=tuple(s for s in kept if s.layers))


def problems(layout: Layout, folder: Path, count: int | None, stance: str) -> Iterator[Problem]:
    """Yield every decision on a box, with the target present and removed."""
    p = LikelihoodParams()
    felt = [t for t in layout.touched if t.name and any(layer.stable for layer in t.touchset.layers)]
    sets = [t.touchset if count is None else first_closures(t.touchset, count) for t in felt]
    for k, touched in enumerate(felt):
        model = model_of(folder, str(touched.name), stance)
        pairs = tuple(
            compare(model, read_touchset(replace(s, candidate=replace(s.candidate, index=i)), PAD, p), p)
            for i, s in enumerate(sets)
        )
        yield Problem(pairs, k)
        if len(pairs) > 1:
            yield Problem(pairs[:k] + pairs[k + 1 :], None)


def sampled(folder: Path | None, seed: int, conditions: str) -> dict[str, list[Problem]]:
    """Return the decisions on one box that is touched without a robot."""
    world = load_mission("touch_all", {}, objects=folder).world
    layout = sampled_layout("mujoco", world, load_conditions(conditions), seed)
    name = folder.name if folder else "five"
    return {
        f"{name}, {n or 'all'} closures": list(problems(layout, world.objects.folder, n, world.objects.stance))
        for n in (FEW, None)
    }


def recorded(run: Path) -> dict[str, list[Problem]]:
    """Return the decisions on a recorded mission."""
    record = read_run(run)
    folder, stance = Path(record.of_run("objects", "folder")), str(record.of_run("objects", "stance"))
    return {f"runs {run.parent.name}": list(problems(layout_of(record), folder, None, stance))}


def posterior(problem: Problem, p: LikelihoodParams) -> tuple[np.ndarray, float]:
    """Return the probabilities of the candidates and of none, from pairs of the present parameters."""
    now = LikelihoodParams()
    pairs = [
        replace(
            x,
            log_ratio=p.offset + p.slope / now.slope * (x.log_ratio - now.offset),
            log_twin=x.log_twin * p.twin_slope / now.twin_slope,
        )
        for x in problem.pairs
    ]
    return probabilities(ratios(pairs, p), p)


def cost(values: np.ndarray, sets: dict[str, list[Problem]]) -> float:
    """Return the mean cost of the truth, nats: the mean over all sets, present and removed targets alike."""
    try:
        p = replace(LikelihoodParams(), **dict(zip(FITTED, values.tolist(), strict=True)))
    except ParamError:
        return 1e3
    means = []
    for found in sets.values():
        costs: dict[bool, list[float]] = {True: [], False: []}
        for x in found:
            shares, absent = posterior(x, p)
            costs[x.target is None].append(-np.log(max(absent if x.target is None else shares[x.target], MIN_P)))
        means += [float(np.mean(c)) for c in costs.values() if c]
    return float(np.mean(means))


def rates(found: list[Problem], p: LikelihoodParams) -> str:
    """Return the rates of one set in words."""
    n = {True: 0, False: 0}
    right = accepted = wrong = taken = 0
    for x in found:
        shares, _ = posterior(x, p)
        best = int(np.argmax(shares))
        sure = shares[best] >= p.accept and x.pairs[best].fit is not None
        n[x.target is None] += 1
        right += best == x.target
        accepted += sure and best == x.target
        wrong += sure and x.target is not None and best != x.target
        taken += sure and x.target is None
    return f"right {right}/{n[False]}, accepted {accepted}, wrong accepted {wrong}; absent taken {taken}/{n[True]}"


def main() -> None:
    """Touch, read, fit and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boxes", type=int, default=24)
    parser.add_argument("--seed", type=int, default=500)
    parser.add_argument("--conditions", default="realistic")
    parser.add_argument("--objects", type=Path, action="append", default=[])
    parser.add_argument("--runs", type=Path, action="append", default=[], help="a folder of recorded runs")
    args = parser.parse_args()
    for folder in (*args.objects, *args.runs):
        if not folder.is_dir():
            parser.error(f"{folder}: no such folder")
    sets: dict[str, list[Problem]] = {}
    with ProcessPoolExecutor(os.cpu_count()) as executor:
        jobs = [
            executor.submit(sampled, folder, args.seed + k, args.conditions)
            for folder in (None, *args.objects)
            for k in range(args.boxes)
        ]
        jobs += [executor.submit(recorded, run.parent) for d in args.runs for run in sorted(d.glob("*/run.mcap"))]
        for job in jobs:
            for name, found in job.result().items():
                sets.setdefault(name, []).extend(found)
    if not any(sets.values()):
        parser.error("no decision to learn from: give --boxes or --runs")
    now = LikelihoodParams()
    start = np.array([getattr(now, name) for name in FITTED])
    best = minimize(cost, start, args=(sets,), method="Nelder-Mead", options={"maxiter": 300}).x
    for title, values in (("present", start), ("best", best)):
        print(f"{title}: {cost(values, sets):.3f} nats", dict(zip(FITTED, values.round(3).tolist(), strict=True)))
        for name, found in sets.items():
            print(f"   {name}: {rates(found, replace(now, **dict(zip(FITTED, values.tolist(), strict=True))))}")


if __name__ == "__main__":
    main()
