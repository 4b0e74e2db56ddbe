"""Robot time that each way of saving it saves: the same missions with one of them switched off at a time. One command:

python tests/support/ablation.py --trials 30 --seed 59800 --out runs/ablation

Each one is a constant, a parameter's default or a function of the package, which gets another value in the worker
processes. Missions, worlds and seeds are those of `glotouch bench retrieve --per-seed 1`. Differences are paired by
world; those of the robot time are of worlds in which both missions succeed. The command continues where it was broken
off.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from glotouch_bt.bench import RetrieveCampaign, succeeded, targets_of
from glotouch_bt.bench.compare.paired import paired_mean, paired_rate
from glotouch_bt.bench.retrieve import COLUMNS, run_trial
from glotouch_bt.bench.statistics import wilson
from glotouch_bt.campaign import Row, Trial, WorkerPool, run_trials, write_summary, write_table
from glotouch_bt.lazy import load_all
from glotouch_bt.mission import load_mission
from glotouch_bt.runs import RunRequest
from glotouch_bt.skill import SkillParams

PACKAGES = ("glotouch_bt", "glotouch_skills", "glotouch_backends")
TRAVEL_M_S = (0.25, 0.10)
"""Speed above the contents of the container, and the paper's."""


def default(name: str, before: float, after: float) -> Callable[[], None]:
    """Change the default of every skill parameter `name` that has the default `before`."""

    def change() -> None:
        left, found = [SkillParams], 0
        while left:
            params = left.pop()
            left.extend(params.__subclasses__())
            field = params.model_fields.get(name)
            if field is not None and field.default == before:
                field.default = after
                params.model_rebuild(force=True)
                found += 1
        assert found, name

    return change


def value(place: str, name: str, after: object) -> Callable[[], None]:
    """Change a constant or a function of a module, there and in every module that has imported it, or of a class.

    Args:
        place: The module, or MODULE:CLASS.
        name: Name of the constant, function or method.
        after: What replaces it.
    """

    def change() -> None:
        module, _, cls = place.partition(":")
        if cls:
            setattr(getattr(importlib.import_module(module), cls), name, after)
            return
        before = getattr(importlib.import_module(module), name)
        for key, found in list(sys.modules.items()):
            if key.partition(".")[0] in PACKAGES and vars(found).get(name) is before:
                setattr(found, name, after)

    return change


def always(answer: bool) -> Callable[..., bool]:
    """Return a function that always gives this answer."""
    return lambda *_: answer


SCHEDULE = "glotouch_bt.perception.recognition.schedule"
CLOSURES = "glotouch_skills.common.planning.squeeze_motion"
FELT = "glotouch_bt.motion.tool_memory:FeltSpace"
MEASURES: dict[str, tuple[Callable[[], None], ...]] = {
    "none": (),
    "excluded candidates are left alone": (value(SCHEDULE, "EXCLUDED_SHARE", 0.0),),
    "measuring is put off": (value(SCHEDULE, "pays_now", always(True)),),
    "closing ends when the target is known": (value(SCHEDULE, "is_sure", always(False)),),
    "closures that tell little are left out": (default("min_gain_nats", 0.02, 0.0),),
    "fast where space was felt to be free": (
        value(FELT, "columns", lambda *_: np.zeros((0, 2))),
        value(FELT, "free_down_to", lambda *_: np.inf),
    ),
    "fast above the contents": tuple(
        default(name, *TRAVEL_M_S) for name in ("travel_speed_m_s", "speed_m_s", "free_speed_m_s")
    ),
    "fast up from a closure": (value(CLOSURES, "FAST_RISE_RATIO", 1.0),),
    "empty jaws open fast": (value(CLOSURES, "OPENING_M_S", 0.03),),
    "jaws open as far as needed": (default("side_gap_m", 0.01, 0.03),),
    "short plateau": (default("settle_s", 0.15, 0.5),),
}
"""Ways of saving robot time, and what switches each one off."""


@dataclass(frozen=True, kw_only=True)
class AblationCampaign(RetrieveCampaign):
    """Missions with one way of saving time switched off.

    Attributes:
        without: What is switched off, a key of `MEASURES`.
    """

    without: str

    @property
    def identity(self) -> dict[str, Any]:
        """See `Campaign`; a folder holds the missions without one of them."""
        return {**super().identity, "without": self.without}

    def _trial(self, target: str, seed: int) -> Trial:
        trial = super()._trial(target, seed)
        request = self.request(seed, trial.folder.name, settings={**self.settings, "target": target})
        head = {"target": target, "seed": seed, "folder": trial.folder.name}
        return replace(
            trial,
            identity={**trial.identity, "without": self.without},
            run=partial(run_without, self.without, head, request),
        )


@cache
def switch_off(measure: str) -> None:
    """Switch off one way of saving time in this process."""
    load_mission("retrieve", {})
    load_all()
    for change in MEASURES[measure]:
        change()


def run_without(measure: str, head: Row, request: RunRequest) -> Row:
    """Run a trial without one of them; its row has the touches, too."""
    switch_off(measure)
    row = run_trial(head, request)
    assert request.out is not None
    return row | touches(json.loads((request.out / "result.json").read_text()))


def touches(result: dict[str, Any]) -> dict[str, Any]:
    """Return the contacts of the probe and the closures on the likeliest candidate, and their means on the others.

    A closure that felt one side only counts as part of one (`Match.evidence`).
    """
    matches = (result.get("ranking") or {}).get("matches") or []
    closures = {m["index"]: m["evidence"] for m in matches}
    contacts = {c["index"]: c["contacts"] for c in result.get("candidates") or []}
    target = matches[0]["index"] if matches else None
    found: dict[str, Any] = {}
    for kind, counts in (("closures", closures), ("contacts", contacts)):
        others = [n for index, n in counts.items() if index != target]
        found[f"{kind}_target"] = counts.get(target)
        found[f"{kind}_other"] = float(np.mean(others)) if others else None
    return found


def summarise(rows: dict[str, list[Row]]) -> dict[str, Any]:
    """Return quantities by what is switched off; differences are those to the missions as shipped.

    Args:
        rows: Rows by what is switched off, in the same order of worlds; "none": as shipped.
    """
    found: dict[str, Any] = {}

    def put(quantity: str, measure: str, number: Any) -> None:
        found.setdefault(quantity, {})[measure] = number

    for measure, some in rows.items():
        pairs = list(zip(rows["none"], some, strict=True))
        worlds = [str(row["seed"]) for row in some]
        both = [i for i, pair in enumerate(pairs) if all(map(succeeded, pair))]
        if both:
            times = np.array([[row["sim_time_s"] for row in pairs[i]] for i in both])
            put("sim_s", measure, float(np.median(times[:, 1])))
            put("more_s", measure, paired_mean(times[:, 0], times[:, 1], [worlds[i] for i in both]))
        put("success", measure, wilson(sum(map(succeeded, some)), len(some)))
        before, after = ([succeeded(row) for row in side] for side in zip(*pairs, strict=True))
        put("difference", measure, paired_rate(before, after, worlds))
        put("wrong", measure, sum(bool(row.get("retrieved")) and not row.get("correct") for row in some))
        put("peak_N", measure, max(float(row.get("peak_force_N") or 0.0) for row in some))
        for name in ("closures_target", "closures_other", "contacts_target", "contacts_other"):
            if counts := [row[name] for row in some if row.get(name) is not None]:
                put(name, measure, float(np.mean(counts)))
    return found


def main(words: Sequence[str] | None = None) -> None:
    """Run the missions as shipped and without each of them, and write summary.json."""
    given = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    given.add_argument("--trials", type=int, default=30)
    given.add_argument("--seed", type=int, required=True)
    given.add_argument("--conditions", default="nominal")
    given.add_argument("--workers", type=int, default=2)
    given.add_argument("--without", choices=MEASURES, action="append", help="only these measures")
    given.add_argument("--out", type=Path, required=True)
    asked = given.parse_args(words)
    rows: dict[str, list[Row]] = {}
    for measure in dict.fromkeys(["none", *(asked.without or MEASURES)]):
        campaign = AblationCampaign(
            mission="retrieve",
            targets=targets_of(load_mission("retrieve", {}).world.objects.folder),
            per_seed=1,
            seeds=tuple(range(asked.seed, asked.seed + asked.trials)),
            conditions=asked.conditions,
            out=asked.out / measure.replace(" ", "_"),
            resume=True,
            without=measure,
        )

        def told(row: Row, done: int, total: int, measure: str = measure) -> None:
            print(f"[{done}/{total}] {measure}: {row['target']} seed {row['seed']}: {row['cause'] or 'retrieved'}")

        def write(done: Sequence[Row], out: Path = campaign.out) -> None:
            write_table(out, "trials.csv", COLUMNS, done)

        with WorkerPool(asked.workers) as pool:  # only this one is switched off in its processes
            rows[measure] = run_trials(pool, campaign.trials(), campaign, told, write=write)
    write_summary(asked.out, summarise(rows) | {"seeds": [*range(asked.seed, asked.seed + asked.trials)]})


if __name__ == "__main__":
    main()
