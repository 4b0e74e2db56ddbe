"""Run `bench match`: acquire TouchSets with the real skills, or read recorded ones, and let every matcher decide."""

from __future__ import annotations

import csv
import json
import math
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.bench.match.acquire import acquire_layout
from glotouch_bt.bench.match.closures import CLOSURE_COLUMNS, closures_to_confidence
from glotouch_bt.bench.match.dataset import Layout, layout_files, read_layout
from glotouch_bt.bench.match.methods import DEFAULT
from glotouch_bt.bench.match.plots import plot_all
from glotouch_bt.bench.match.summary import summarise
from glotouch_bt.bench.match.timing import time_matching
from glotouch_bt.bench.match.trials import PAIR_COLUMNS, TRIAL_COLUMNS, decide, models_of
from glotouch_bt.mission import load_mission
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import load_folder, stream
from glotouch_bt.runs import RunRequest

IN_THE_BOX = 5
"""Objects in a layout. From a larger folder, each seed draws this many."""
LAYOUT_COLUMNS = ("seed", "conditions", "ended", "objects", "touched", "nameless", "closures", "stable", "sim_s")
OnRow = Callable[[Mapping[str, Any], int, int], None]


@dataclass(frozen=True)
class MatchCampaign:
    """Settings of the campaign.

    Attributes:
        seeds: One layout each; with `dataset`, their number is the number of layouts to read.
        conditions: Path or shipped name.
        objects: Folder of STL files instead of the world's.
        strangers: Folder of STL files that are never in the box, used as absent targets; or None.
        dataset: Folder of recorded TouchSets to use instead of acquiring; it defines `seeds` and `conditions`.
        methods: Names of the matchers to compare.
        backend: Registered name of a simulation.
        out: Folder of the campaign.
        mission: Path or shipped name of a mission that squeezes every candidate.
    """

    seeds: tuple[int, ...]
    conditions: str
    objects: Path | None
    strangers: Path | None
    dataset: Path | None
    methods: tuple[str, ...]
    backend: str
    out: Path
    mission: str = "touch_all"

    @property
    def folder(self) -> Path:
        """Return the folder of the STLs.

        Raises:
            BadInput: No such folder.
        """
        return load_mission(self.mission, {}, objects=self.objects).world.objects.folder

    def check(self) -> None:
        """Check the settings before anything is written.

        Raises:
            BadInput: A folder holds nothing usable.
        """
        load_folder(self.folder)
        if self.strangers is not None:
            load_folder(self.strangers)
        if self.dataset is not None:
            layout_files(self.dataset)

    def request(self, seed: int) -> RunRequest:
        """Return the mission request for a layout; create its folder of objects if it is a drawn subset."""
        box = objects_of(self.folder, seed, self.out / "objects") if self.objects else None
        count = len(list((box or self.folder).glob("*.[sS][tT][lL]")))
        return RunRequest(
            mission=self.mission, backend=self.backend, seed=seed, settings={"expected_objects": str(count)},
            objects=box, conditions=self.conditions, out=self.out / "runs" / f"s{seed:04d}",
        )  # fmt: skip


def objects_of(folder: Path, seed: int, copies: Path) -> Path:
    """Return the folder, or one below `copies` with `IN_THE_BOX` of its STLs drawn by the seed."""
    files = sorted(p for p in folder.iterdir() if p.suffix.lower() == ".stl")
    if len(files) <= IN_THE_BOX:
        return folder
    mine = copies / f"s{seed:04d}"
    mine.mkdir(parents=True, exist_ok=True)
    for i in stream(seed, "which objects").permutation(len(files))[:IN_THE_BOX]:
        shutil.copyfile(files[i], mine / files[i].name)
    return mine


def layout_task(campaign: MatchCampaign, seed: int, file: Path | None) -> dict[str, Any]:
    """Acquire or read one layout and decide on it. A failed acquisition is a row; bad input raises.

    Raises:
        BadInput: The recording or an STL cannot be used.
    """
    try:
        layout = read_layout(file) if file else acquire_layout(campaign.request(seed), campaign.out / "touchsets")
    except BadInput:
        raise
    except Exception as e:
        layout = Layout(seed, Path(campaign.conditions).stem, (), (), f"traceback {type(e).__name__}: {e}")
    decided = decide(layout, campaign.folder, campaign.strangers, campaign.methods)
    closures: list[dict[str, Any]] = []
    if DEFAULT in campaign.methods and layout.touched:
        present = [n for n in layout.objects if layout.of(n)]
        models = models_of(layout, campaign.folder, present) if present else {}
        closures = closures_to_confidence(layout, models)
    layers = [layer for t in layout.touched for layer in t.touchset.layers]
    row: dict[str, Any] = {
        "seed": layout.seed, "conditions": layout.conditions, "ended": layout.ended, "objects": len(layout.objects),
        "touched": len({t.name for t in layout.touched} - {None}),
        "nameless": sum(t.name is None for t in layout.touched), "closures": len(layers),
        "stable": sum(layer.stable for layer in layers), "sim_s": layout.sim_s,
    }  # fmt: skip
    return {"layout": row, "trials": decided.trials, "pairs": decided.pairs, "closures": closures}


def timing_task(files: Sequence[Path], folder: Path, names: Sequence[str]) -> dict[str, Any]:
    """Run `time_matching` on recorded layouts."""
    return time_matching([read_layout(f) for f in files], folder, names)


def run_campaign(campaign: MatchCampaign, executor: Executor, on_row: OnRow | None = None) -> dict[str, Any]:
    """Decide on every layout, write CSVs, plots and summary.json, and return the summary.

    Args:
        campaign: Settings.
        executor: Any `concurrent.futures` executor.
        on_row: Called with (row, done, total) after each layout; the row has the number of correct decisions.

    Raises:
        BadInput: A setting cannot be used.
    """
    campaign.check()
    campaign.out.mkdir(parents=True, exist_ok=True)
    files = layout_files(campaign.dataset)[: len(campaign.seeds)] if campaign.dataset else []
    todo: list[tuple[int, Path | None]] = [(-1, f) for f in files] or [(seed, None) for seed in campaign.seeds]
    futures = [executor.submit(layout_task, campaign, seed, file) for seed, file in todo]
    done: list[dict[str, Any]] = []
    try:
        for future in as_completed(futures):
            done.append(future.result())
            if on_row is not None:
                on_row(_progress(done[-1]), len(done), len(futures))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    done.sort(key=lambda d: d["layout"]["seed"])
    rows = {part: [r for d in done for r in d[part]] for part in ("trials", "pairs", "closures")}
    layouts = [d["layout"] for d in done]
    recorded = files or sorted((campaign.out / "touchsets").glob("s[0-9]*.json"))
    timed = executor.submit(timing_task, recorded[:3], campaign.folder, campaign.methods).result() if recorded else {}
    figures: dict[str, Any] = _finite(
        summarise(rows["trials"], rows["pairs"], rows["closures"], campaign.methods)
        | {
            "timing": timed,
            "conditions": ", ".join(sorted({x["conditions"] for x in layouts})),
            "seeds": [x["seed"] for x in layouts],
            "layouts": len(layouts),
            "ended": {e: sum(x["ended"] == e for x in layouts) for e in sorted({x["ended"] for x in layouts})},
            "objects": sum(x["objects"] for x in layouts),
            "touched": sum(x["touched"] for x in layouts),
            "nameless": sum(x["nameless"] for x in layouts),
            "recorded": campaign.dataset is not None,
            "strangers": sorted({t["target"] for t in rows["trials"] if t["kind"] == "stranger"}),
            "mission": campaign.mission,
            "backend": campaign.backend,
        }
    )
    _write(campaign.out / "layouts.csv", LAYOUT_COLUMNS, layouts)
    _write(campaign.out / "trials.csv", TRIAL_COLUMNS, rows["trials"])
    _write(campaign.out / "pairs.csv", PAIR_COLUMNS, rows["pairs"])
    _write(campaign.out / "closures.csv", CLOSURE_COLUMNS, rows["closures"])
    (campaign.out / "summary.json").write_text(json.dumps(figures, indent=2, allow_nan=False) + "\n")
    plot_all(campaign.out, figures, rows["trials"], rows["closures"])
    return figures


def _progress(done: Mapping[str, Any]) -> dict[str, Any]:
    present = [t for t in done["trials"] if t["kind"] == "present"]
    names = dict.fromkeys(t["method"] for t in present)
    right = {n: sum(bool(t["right"]) for t in present if t["method"] == n) for n in names}
    return dict(done["layout"]) | {"right": right}


def _finite(value: Any) -> Any:
    """Replace non-finite numbers by None, for JSON."""
    if isinstance(value, Mapping):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _write(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    with path.open("w", newline="") as f:
        table = csv.DictWriter(f, columns, extrasaction="ignore")
        table.writeheader()
        table.writerows(rows)
