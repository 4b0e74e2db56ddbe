"""`glotouch bench ...`: the experiments of `glotouch_bt.study` from the command line."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.guarded import guarded

bench = typer.Typer(
    name="bench",
    help="Experiments: many trials, every one counted, with intervals.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

Trials = Annotated[int, typer.Option(min=1, help="seeds per target")]
Seed = Annotated[int, typer.Option(min=0, help="first seed")]
Workers = Annotated[int, typer.Option(min=1, help="processes")]
Conditions = Annotated[str, typer.Option(help="disturbances: ideal, nominal, harsh, or a file")]
Objects = Annotated[Path | None, typer.Option(metavar="DIR", help="folder of watertight STL files in metres")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="where trials and summary go (default: runs/bench-...)")]
Json = Annotated[bool, typer.Option("--json", help="print summary.json on stdout, nothing else")]


def _folder(out: Path | None, name: str) -> Path:
    return out or Path("runs") / f"{time.strftime('%Y%m%d-%H%M%S')}-bench-{name}"


@bench.command()
@guarded
def retrieve(
    mission: Annotated[str, typer.Option(help="mission with a parameter `target`")] = "retrieve",
    target: Annotated[list[str] | None, typer.Option(help="only these targets (default: every object)")] = None,
    trials: Trials = 10,
    seed: Seed = 0,
    conditions: Conditions = "nominal",
    objects: Objects = None,
    backend: Annotated[str, typer.Option(help="a registered backend")] = "mujoco",
    workers: Workers = 2,
    out: Out = None,
    json_: Json = False,
) -> None:
    """The whole mission for every target on every seed."""
    from glotouch_bt import console
    from glotouch_bt.mission.load import load_mission
    from glotouch_bt.study.retrieve import Campaign, run_campaign, targets_of

    names = tuple(target) if target else targets_of(objects) if objects else ()
    # A mission's default target need not be among other objects: check it with one that is.
    world = load_mission(mission, {"target": names[0]} if names else {}, objects=objects).world
    campaign = Campaign(
        mission=mission,
        targets=names or targets_of(world.objects.folder),
        seeds=tuple(range(seed, seed + trials)),
        conditions=conditions,
        objects=objects,
        backend=backend,
        out=_folder(out, "retrieve"),
    )

    def show(row: dict[str, Any], done: int, total: int) -> None:
        verdict = row["cause"] or "retrieved"
        sys.stderr.write(f"[{done}/{total}] {row['target']} seed {row['seed']}: {verdict}\n")

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        summary = run_campaign(campaign, pool, show)
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    else:
        console.print_retrieve(summary, campaign.out)


@bench.command()
@guarded
def speed(
    mission: Annotated[str, typer.Option(help="the mission to time")] = "retrieve",
    set_: Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission parameter")] = None,
    trials: Annotated[int, typer.Option(min=1, help="seeds")] = 10,
    seed: Seed = 0,
    conditions: Conditions = "nominal",
    objects: Objects = None,
    backend: Annotated[str, typer.Option(help="a registered simulation backend")] = "mujoco",
    out: Out = None,
    json_: Json = False,
) -> None:
    """A mission's wall time against its simulated time, and against its bare solver steps."""
    from glotouch_bt import console
    from glotouch_bt.robot import BadInput
    from glotouch_bt.study.speed import SpeedStudy, run_study

    settings = {}
    for item in set_ or []:
        name, equals, value = item.partition("=")
        if not equals or not name.strip():
            raise BadInput(f"--set {item}: must be NAME=VALUE")
        settings[name.strip()] = value
    study = SpeedStudy(
        mission=mission,
        settings=settings,
        seeds=tuple(range(seed, seed + trials)),
        conditions=conditions,
        objects=objects,
        backend=backend,
        out=_folder(out, "speed"),
    )

    def show(row: Mapping[str, Any], done: int, total: int) -> None:
        sys.stderr.write(
            f"[{done}/{total}] seed {row['seed']}: {row['status']}, {row['sim_s']:.0f} s in {row['wall_s']:.1f} s "
            f"({row['realtime_factor']:.1f}x), {row['over_physics']:.2f}x the bare steps\n"
        )

    summary = run_study(study, show)
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    else:
        console.print_speed(summary, study.out)
