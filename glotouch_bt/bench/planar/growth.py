"""Run `bench growth`: how an exploration grows with the number of objects and the area of the box.

Explorations of the planar simulator, with the mission's objects repeated. Travel and planning have a slope each: the
exponent of objects, and of area, that fits all points best (ordinary least squares of the logarithms).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from glotouch_bt.bench.planar.explore import explore
from glotouch_bt.bench.planar.layout import planar_world
from glotouch_bt.bench.statistics import bootstrap_mean
from glotouch_bt.campaign import Campaign, OnRow, Row, crashed, run_trials, silent, write_summary, write_table
from glotouch_bt.mission import load_mission
from glotouch_bt.perception.search import SearchMap, SearchPolicy, Stretch, policy_names, search_policy
from glotouch_bt.robot import Array, UnknownName, World
from glotouch_bt.robot.scene import Mesh, load_folder

POINTS = ((5, 1.0), (5, 2.0), (5, 4.0), (10, 2.0), (10, 4.0), (20, 4.0))
"""Objects and area, in areas of the mission's box; more objects do not fit."""
COLUMNS = (
    "objects", "area", "seed", "ended", "found", "travel_m", "contacts", "planning_s", "plans", "longest_plan_s",
    "cause",
)  # fmt: skip
FIGURES = ("travel_m", "contacts", "planning_s")


@dataclass(frozen=True, kw_only=True)
class GrowthCampaign(Campaign):
    """Settings of the sweep. Its mission only names the world.

    Attributes:
        policy: Search policy.
    """

    mission: str = "survey"
    policy: str = "expected_find"

    def __post_init__(self) -> None:
        if self.policy not in policy_names():
            raise UnknownName("search policy", self.policy, policy_names())


@dataclass
class TimedPolicy:
    """A search policy, and the wall time of each of its plans, s."""

    policy: SearchPolicy
    plans_s: list[float] = field(default_factory=list)

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """See `SearchPolicy`."""
        began = time.perf_counter()
        try:
            return self.policy.next_stretch(belief, tip_K_m)
        finally:
            self.plans_s.append(time.perf_counter() - began)


def scaled_scene(world: World, meshes: Sequence[Mesh], objects: int, area: float) -> tuple[World, list[Mesh]]:
    """Return the world with a box of `area` times the floor, in its proportions, and `objects` meshes in turn."""
    x, y, z = world.container.interior_m
    side = area**0.5
    wide = replace(world, container=replace(world.container, interior_m=(side * x, side * y, z)))
    return wide, [meshes[i % len(meshes)] for i in range(objects)]


def growth_row(campaign: GrowthCampaign, objects: int, area: float, seed: int) -> dict[str, Any]:
    """Explore one layout.

    Raises:
        BadInput: The objects cannot be used, or do not fit.
    """
    world = load_mission(campaign.mission, {}, objects=campaign.objects).world
    meshes = load_folder(world.objects.folder, world.objects.names)
    wide, some = scaled_scene(world, meshes, objects, area)
    policy = TimedPolicy(search_policy(campaign.policy, seed))
    explored = explore(planar_world(wide, some, seed), policy, objects)
    return {
        "objects": objects, "area": area, "seed": seed, "ended": explored.ended, "found": len(explored.found),
        "travel_m": round(explored.travel_m, 6), "contacts": explored.contacts, "planning_s": sum(policy.plans_s),
        "plans": len(policy.plans_s), "longest_plan_s": max(policy.plans_s, default=0.0), "cause": "",
    }  # fmt: skip


def failed_row(objects: int, area: float, seed: int, error: Exception) -> dict[str, Any]:
    """Return the row of an exploration that raised."""
    none = dict.fromkeys(("found", "travel_m", "contacts", "planning_s", "plans", "longest_plan_s"), 0)
    cause = crashed(error)["cause"]
    return {"objects": objects, "area": area, "seed": seed, "ended": "error", **none, "cause": cause}


def run_growth(campaign: GrowthCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Explore all points, write trials.csv and summary.json, and return the summary.

    Raises:
        BadInput: A setting cannot be used.
    """
    trials = [
        campaign.trial(
            f"{objects}-objects-{area:g}-areas-s{seed}",
            partial(growth_row, campaign, objects, area, seed),
            partial(failed_row, objects, area, seed),
        )
        for objects, area in POINTS
        for seed in campaign.seeds
    ]

    write = partial(write_table, campaign.out, "trials.csv", COLUMNS)
    rows = run_trials(executor, trials, campaign, on_row, write=write)
    return write_summary(campaign.out, summarise(rows) | campaign.described() | {"policy": campaign.policy})


def summarise(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of each point, and the slopes over all points.

    Keys: points (objects, area, complete: share of explorations that found all, travel_m, contacts, planning_s: means
    with 95 % intervals, plan_s: mean wall time of a plan, longest_plan_s); slopes by figure (objects, area).
    """
    points = []
    for objects, area in POINTS:
        here = [r for r in rows if (r["objects"], r["area"]) == (objects, area)]
        points.append(
            {
                "objects": objects,
                "area": area,
                "complete": float(np.mean([r["ended"] == "complete" for r in here])),
                **{key: bootstrap_mean([float(r[key]) for r in here]) for key in FIGURES},
                "plan_s": sum(r["planning_s"] for r in here) / max(sum(r["plans"] for r in here), 1),
                "longest_plan_s": max(float(r["longest_plan_s"]) for r in here),
            }
        )
    return {"points": points, "slopes": {key: slopes(rows, key) for key in FIGURES}}


def slopes(rows: Sequence[Row], key: str) -> dict[str, float]:
    """Return the exponents a, b of the least-squares fit `value ~ objects^a area^b` over complete explorations."""
    used = [r for r in rows if r["ended"] == "complete" and r[key] > 0]
    at = np.array([[1.0, np.log(r["objects"]), np.log(r["area"])] for r in used]).reshape(-1, 3)
    if np.linalg.matrix_rank(at) < 3:
        return {"objects": float("nan"), "area": float("nan")}
    _, objects, area = np.linalg.lstsq(at, np.log([float(r[key]) for r in used]), rcond=None)[0]
    return {"objects": float(objects), "area": float(area)}
