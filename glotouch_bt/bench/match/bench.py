"""Run `bench match`: acquire TouchSets with the real skills, or read recorded ones, and let every matcher decide."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

from glotouch_bt.bench.match.acquire import acquire_layout
from glotouch_bt.bench.match.closures import CLOSURE_COLUMNS, closures_to_confidence
from glotouch_bt.bench.match.dataset import Layout, layout_files, read_layout, write_layout
from glotouch_bt.bench.match.methods import DEFAULT, TOUCHED
from glotouch_bt.bench.match.plots import plot_all
from glotouch_bt.bench.match.summary import summarise
from glotouch_bt.bench.match.synthetic import handled_objects, sampled_layout
from glotouch_bt.bench.match.timing import time_matching
from glotouch_bt.bench.match.trials import PAIR_COLUMNS, TRIAL_COLUMNS, decide, models_of
from glotouch_bt.campaign import (
    Campaign,
    OnRow,
    Row,
    Trial,
    crashed,
    digest,
    folder_digests,
    run_trials,
    silent,
    write_summary,
    write_table,
)
from glotouch_bt.escaped_text import finite
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import conditions_name, load_conditions
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import load_folder, stl_files, stream
from glotouch_bt.runs import RunRequest

IN_THE_BOX = 5
"""Objects in a layout. From a larger folder, each seed draws this many."""
LAYOUT_COLUMNS = ("seed", "conditions", "ended", "objects", "touched", "nameless", "closures", "stable", "sim_s")


@dataclass(frozen=True, kw_only=True)
class MatchCampaign(Campaign):
    """Settings of the campaign: one layout a seed, on which the mission squeezes every candidate.

    Attributes:
        methods: Names of the matchers to compare.
        strangers: Folder of STL files that are never in the box, used as absent targets; or None.
        dataset: Folder of recorded TouchSets to use instead; it defines seeds (except their number) and conditions.
        sampled: Touch standing objects without a robot instead of running the mission.
        gel_images: Take gel images with every closure; needs `sampled`.
        touched: Compare the method `TOUCHED`, too, which knows each object by one handling only; needs `sampled`.
        in_the_box: Objects in a layout. From a larger folder, each seed draws this many.
    """

    mission: str = "touch_all"
    methods: tuple[str, ...]
    strangers: Path | None = None
    dataset: Path | None = None
    sampled: bool = False
    gel_images: bool = False
    touched: bool = False
    in_the_box: int = IN_THE_BOX

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
        if self.touched and (not self.sampled or self.strangers is not None):
            raise BadInput("--touched: needs --sampled, and cannot be combined with --strangers")
        if self.gel_images and not self.sampled:
            raise BadInput("--gel-images: needs --sampled")
        if self.in_the_box > IN_THE_BOX and not self.sampled:
            raise BadInput(f"--in-box {self.in_the_box}: more than {IN_THE_BOX} objects need --sampled")
        if self.strangers is not None:
            load_folder(self.strangers)
        if self.dataset is not None:
            layout_files(self.dataset)

    def box(self, seed: int) -> Path | None:
        """Return the folder of a layout's objects, created if it is a drawn subset; None: the world's."""
        if self.objects is None:
            return None
        return objects_of(self.folder, seed, self.out / "objects", self.in_the_box)

    def layout_trial(self, seed: int, file: Path | None = None) -> Trial:
        """Return the trial that acquires the layout of a seed, or reads it from a file."""
        name = f"s{seed:04d}" if file is None else file.stem
        content = {"strangers": folder_digests(self.strangers), "file": file and digest(file.read_bytes())}
        run, failed = partial(layout_task, self, seed, file), partial(failed_task, self, seed)
        return self.trial(
            f"layouts/{name}", run, failed, seed=seed, methods=self.methods, sampled=self.sampled,
            gel_images=self.gel_images, touched=self.touched, in_the_box=self.in_the_box, inputs=content
        )  # fmt: skip

    def layout_request(self, seed: int) -> RunRequest:
        """Return the mission request for a layout."""
        box = self.box(seed)
        count = len(stl_files(box or self.folder))
        return self.request(seed, f"runs/s{seed:04d}", settings={"expected_objects": str(count)}, objects=box)


def objects_of(folder: Path, seed: int, copies: Path, count: int = IN_THE_BOX) -> Path:
    """Return the folder, or one below `copies` with `count` of its STLs drawn by the seed."""
    files = list(stl_files(folder).values())
    if len(files) <= count:
        return folder
    mine = copies / f"s{seed:04d}"
    mine.mkdir(parents=True, exist_ok=True)
    for i in stream(seed, "which objects").permutation(len(files))[:count]:
        shutil.copyfile(files[i], mine / files[i].name)
    return mine


def layout_task(campaign: MatchCampaign, seed: int, file: Path | None) -> dict[str, Any]:
    """Acquire or read one layout and decide on it.

    Raises:
        BadInput: The recording or an STL cannot be used.
    """
    handled: dict[str, TouchSet] = {}
    if file is not None:
        layout = read_layout(file)
    elif campaign.sampled:
        world = load_mission(campaign.mission, {}, objects=campaign.box(seed)).world
        conditions = load_conditions(campaign.conditions)
        layout = sampled_layout(campaign.backend, world, conditions, seed, images=campaign.gel_images)
        write_layout(campaign.out / "touchsets", layout)
        if campaign.touched:
            handled = handled_objects(campaign.backend, world, conditions, seed)
    else:
        layout = acquire_layout(campaign.layout_request(seed), campaign.out / "touchsets")
    return _decided(campaign, layout, handled)


def failed_task(campaign: MatchCampaign, seed: int, error: Exception) -> dict[str, Any]:
    """Return the result of a layout that raised or whose process was lost: nothing was touched."""
    return _decided(campaign, Layout(seed, conditions_name(campaign.conditions), (), (), crashed(error)["cause"]))


def _decided(
    campaign: MatchCampaign, layout: Layout, handled: Mapping[str, TouchSet] = MappingProxyType({})
) -> dict[str, Any]:
    names = (*campaign.methods, TOUCHED) if handled else campaign.methods
    decided = decide(layout, campaign.folder, campaign.strangers, names, handled)
    closures: list[dict[str, Any]] = []
    if DEFAULT in campaign.methods and layout.touched and not campaign.sampled:
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


def _untimed(error: Exception) -> dict[str, Any]:
    return {}


def run_campaign(campaign: MatchCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Decide on every layout, write CSVs, plots and summary.json, and return the summary.

    The rows that `on_row` receives have the number of correct decisions.

    Raises:
        BadInput: A setting cannot be used.
    """
    campaign.check()
    files = layout_files(campaign.dataset)[: len(campaign.seeds)] if campaign.dataset else []
    todo: list[tuple[int, Path | None]] = [(-1, f) for f in files] or [(seed, None) for seed in campaign.seeds]
    trials = [campaign.layout_trial(seed, file) for seed, file in todo]
    done = run_trials(
        executor,
        trials,
        campaign,
        lambda found, n, total: on_row(_progress(found), n, total),
        write=partial(_write, campaign.out),
    )
    rows, layouts = _tables(done)
    compared = (*campaign.methods, TOUCHED) if campaign.touched else campaign.methods
    recorded = files or sorted((campaign.out / "touchsets").glob("s[0-9]*.json"))
    run = partial(timing_task, recorded[:3], campaign.folder, campaign.methods)
    timing = campaign.trial("timing", run, _untimed, methods=campaign.methods, files=recorded[:3])
    timed = run_trials(executor, [timing], campaign, whole=True, before=len(done))[0] if recorded else {}
    figures: dict[str, Any] = finite(
        summarise(rows["trials"], rows["pairs"], rows["closures"], compared)
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
            "sampled": campaign.sampled,
            "gel_images": campaign.gel_images,
            "strangers": sorted({t["target"] for t in rows["trials"] if t["kind"] == "stranger"}),
            "mission": campaign.mission,
            "backend": campaign.backend,
        }
    )
    figures = write_summary(campaign.out, figures)
    plot_all(campaign.out, figures, rows["trials"], rows["closures"])
    return figures


def _tables(done: Sequence[Row]) -> tuple[dict[str, list[Row]], list[Row]]:
    """Return the rows of trials, pairs and closures, and those of the layouts, by seed."""
    done = sorted(done, key=lambda d: int(d["layout"]["seed"]))
    return {part: [r for d in done for r in d[part]] for part in ("trials", "pairs", "closures")}, [
        d["layout"] for d in done
    ]


def _write(folder: Path, done: Sequence[Row]) -> None:
    rows, layouts = _tables(done)
    write_table(folder, "layouts.csv", LAYOUT_COLUMNS, layouts)
    write_table(folder, "trials.csv", TRIAL_COLUMNS, rows["trials"])
    write_table(folder, "pairs.csv", PAIR_COLUMNS, rows["pairs"])
    write_table(folder, "closures.csv", CLOSURE_COLUMNS, rows["closures"])


def _progress(done: Mapping[str, Any]) -> dict[str, Any]:
    present = [t for t in done["trials"] if t["kind"] == "present"]
    names = dict.fromkeys(t["method"] for t in present)
    right = {n: sum(bool(t["right"]) for t in present if t["method"] == n) for n in names}
    return dict(done["layout"]) | {"right": right}
