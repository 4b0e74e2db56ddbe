"""`bench search --count unknown`: is the stated chance that something is left right? On random planar layouts.

Every layout is explored twice: with the number of objects given, and without. In the search without it, the chance is
also compared with the truth at moments spread evenly over the sweeps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from glotouch_bt.bench.planar import Explored, assorted_world, explore
from glotouch_bt.bench.scores import shared_calibration
from glotouch_bt.bench.search.scoring import Found, TrueLayout, assign
from glotouch_bt.bench.search.trial import scene
from glotouch_bt.bench.statistics import bootstrap_mean, wilson
from glotouch_bt.campaign import Campaign, OnRow, Row, Trial, crashed, run_trials, silent, write_summary, write_table
from glotouch_bt.escaped_text import finite
from glotouch_bt.perception.search import LEFT_BELOW, policy_names, search_policy
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import stream

BUDGET_M = 25.0
"""Travel at which an exploration stops; the longest on 60 layouts was 10 m."""
MOMENTS = 8
"""Moments of a search at which the stated chance is compared with the truth."""
COLUMNS = ("seed", "count", "objects", "found", "right", "ended", "travel_m", "chance_left")


@dataclass(frozen=True, kw_only=True)
class CountCampaign(Campaign):
    """Settings of the campaign.

    Attributes:
        policy: Name of the search policy.
        left_below: Chance that something is left below which the search of an unknown number ends.
    """

    mission: str = "survey"
    policy: str = "expected_find"
    left_below: float = LEFT_BELOW

    def __post_init__(self) -> None:
        if self.policy not in policy_names():
            raise BadInput(f"--policies {self.policy}: must be among {', '.join(policy_names())}")
        if not self.seeds:
            raise BadInput("nothing to try: give --planar")

    def count_trial(self, seed: int) -> Trial:
        """Return the trial of a layout."""
        run = partial(count_trial, self.mission, seed, self.policy, self.left_below)
        given = {"seed": seed, "policy": self.policy, "left_below": self.left_below, "budget": BUDGET_M}
        return self.trial(f"count/s{seed}", run, partial(_failed, seed), **given)


def count_trial(mission: str, seed: int, policy: str, left_below: float) -> Row:
    """Explore the layout of a seed with a known and an unknown number of objects."""
    row: Row = {"seed": seed}
    for count in ("known", "unknown"):
        world = assorted_world(scene(mission, None)[0], seed)
        objects = len(world.sections)
        expected = objects if count == "known" else None
        explored = explore(world, search_policy(policy, seed), expected, budget_m=BUDGET_M, left_below=left_below)
        contours = [(t.travel_m, t.candidate.contour) for t in explored.found]
        found = [Found(travel_m, c.centre_K_m, c.kind, c.yaw_rad) for travel_m, c in contours]
        whose = assign(found, TrueLayout(world.sections, world.start_poses, world.poses))
        row |= {
            "objects": objects,
            count: {
                "found": len(found),
                "right": sum(i is not None for i in whose),
                "ended": explored.ended,
                "travel_m": explored.travel_m,
            },
        }
    row["unknown"]["chance_left"] = explored.belief.chance_left
    row["moments"] = _moments(explored, whose, objects, stream(seed, "moments"))
    return row


def _moments(
    explored: Explored, whose: Sequence[int | None], objects: int, rng: np.random.Generator
) -> list[tuple[float, bool]]:
    """Return (stated chance, something is left) at moments of the sweeps, stratified over their path."""
    sweeps = list(pairwise(explored.maps))[::2]  # the maps before and after each sweep; between them it traces
    ends = np.cumsum([len(after.path_K_m) - len(before.path_K_m) for before, after in sweeps])
    out = []
    for at in ends[-1] * (np.arange(MOMENTS) + rng.uniform(size=MOMENTS)) / MOMENTS:
        sweep = int(np.searchsorted(ends, at, side="right"))
        before, after = sweeps[sweep]
        upto = len(after.path_K_m) - int(ends[sweep] - at)
        belief = replace(before, path_K_m=after.path_K_m[:upto])
        out.append((belief.chance_left, sum(i is not None for i in whose[: before.found]) < objects))
    return out


def _failed(seed: int, error: Exception) -> Row:
    """Return the row of a trial that raised: nothing was found."""
    nothing = {"found": 0, "right": 0, "ended": crashed(error)["cause"], "travel_m": 0.0}
    return {"seed": seed, "objects": 1, "known": nothing, "unknown": nothing | {"chance_left": 0.0}, "moments": []}


def run_count_campaign(campaign: CountCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Run every trial, write trials.csv and summary.json, and return the summary."""
    trials = [campaign.count_trial(seed) for seed in campaign.seeds]
    rows = run_trials(executor, trials, campaign, on_row, write=partial(_write, campaign))
    seeds = {"seeds": {"first": campaign.seeds[0], "count": len(campaign.seeds)}}
    figures: dict[str, Any] = finite(summarise_counts(rows))
    described = campaign.described() | seeds | {"policy": campaign.policy, "left_below": campaign.left_below}
    return write_summary(campaign.out, figures | described)


def _write(campaign: CountCampaign, rows: Sequence[Row]) -> None:
    lines = [
        {"seed": r["seed"], "count": c, "objects": r["objects"], **r[c]} for r in rows for c in ("known", "unknown")
    ]
    write_table(campaign.out, "trials.csv", COLUMNS, [dict.fromkeys(COLUMNS, "") | line for line in lines])


def summarise_counts(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the summary of the rows.

    `left` compares the stated chances at the end with the share of searches that ended with something left. `stated` is
    over all moments and ends: Brier score and expected calibration error, with intervals over layouts.
    """
    out: dict[str, Any] = {"layouts": len(rows), "objects": bootstrap_mean([r["objects"] for r in rows])}
    for count in ("known", "unknown"):
        searches = [r[count] for r in rows]
        out[count] = {
            "success": wilson(sum(r[count]["right"] == r["objects"] for r in rows), len(rows)),
            "travel_m": bootstrap_mean([s["travel_m"] for s in searches]),
            "false_candidates": bootstrap_mean([s["found"] - s["right"] for s in searches]),
            "ended": dict(Counter(s["ended"] for s in searches).most_common()),
        }
    success = np.array([[r[c]["right"] == r["objects"] for c in ("unknown", "known")] for r in rows], dtype=np.float64)
    out["success_difference"] = bootstrap_mean(success[:, 0] - success[:, 1])
    left = [r["unknown"]["right"] < r["objects"] for r in rows]
    ends = [r["unknown"]["chance_left"] for r in rows]
    out["left"] = {"stated": bootstrap_mean(ends), "share": wilson(sum(left), len(left))}
    said = [(p, hit, r["seed"]) for r in rows for p, hit in r["moments"]]
    said += [(p, hit, r["seed"]) for p, hit, r in zip(ends, left, rows, strict=True)]
    p, hit, layout = (np.array(column) for column in zip(*said, strict=True))
    brier = bootstrap_mean([float(np.mean((p[layout == s] - hit[layout == s]) ** 2)) for s in np.unique(layout)])
    return out | {"stated": {"brier": brier, "calibration": shared_calibration(p, hit, layout)}}
