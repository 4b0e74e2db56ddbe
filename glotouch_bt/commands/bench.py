"""`glotouch bench ...`: the experiments of `glotouch_bt.study` from the command line."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands.options import (
    Conditions,
    Json,
    Objects,
    Out,
    Seed,
    Trials,
    Workers,
    bench_folder,
    check_names,
    read_settings,
)
from glotouch_bt.commands.terminal import guarded

bench = typer.Typer(
    name="bench",
    help="Experiments: many trials, every one counted, with intervals.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


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
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission parameter or backend option")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="keep the trials that --out holds already")] = False,
    workers: Workers = 2,
    out: Out = None,
    json_: Json = False,
) -> None:
    """The whole mission for every target on every seed."""
    from glotouch_bt.bench import RetrieveCampaign, run_campaign, targets_of
    from glotouch_bt.commands.terminal import bench_tables as console_bench
    from glotouch_bt.mission import load_mission
    from glotouch_bt.robot import BadInput

    names = tuple(target) if target else targets_of(objects) if objects else ()
    # A mission's default target need not be among other objects: check it with one that is.
    settings = read_settings(set_)
    if "target" in settings:
        raise BadInput("--set target: the targets of a campaign are given by --target")
    world = load_mission(mission, settings | ({"target": names[0]} if names else {}), objects=objects).world
    campaign = RetrieveCampaign(
        mission=mission,
        targets=names or targets_of(world.objects.folder),
        seeds=tuple(range(seed, seed + trials)),
        conditions=conditions,
        objects=objects,
        backend=backend,
        out=bench_folder(out, "retrieve"),
        settings=settings,
        resume=resume,
    )

    def show(row: dict[str, Any], done: int, total: int) -> None:
        verdict = row["cause"] or "retrieved"
        sys.stderr.write(f"[{done}/{total}] {row['target']} seed {row['seed']}: {verdict}\n")

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        summary = run_campaign(campaign, pool, show)
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    else:
        console_bench.print_retrieve(summary, campaign.out)


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
    from glotouch_bt.bench import SpeedStudy, run_study
    from glotouch_bt.commands.terminal import bench_tables as console_bench
    from glotouch_bt.robot import BadInput

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
        out=bench_folder(out, "speed"),
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
        console_bench.print_speed(summary, study.out)


@bench.command()
@guarded
def search(
    policies: Annotated[str, typer.Option(help="search policies, comma-separated; the first is reported on")] = (
        "expected_find,nearest_frontier,random_descent"
    ),
    trials: Annotated[int, typer.Option(min=0, help="missions per policy, each on a layout of its own")] = 100,
    planar: Annotated[int, typer.Option(min=0, help="layouts explored in the plane alone")] = 0,
    seed: Seed = 0,
    conditions: Conditions = "nominal",
    objects: Objects = None,
    backend: Annotated[str, typer.Option(help="a registered simulation backend")] = "mujoco",
    workers: Workers = 2,
    out: Out = None,
    resume: Annotated[bool, typer.Option("--resume", help="keep the missions that are in --out already")] = False,
    recorded: Annotated[
        list[Path] | None,
        typer.Option(metavar="DIR", help="score the runs recorded below, too; they are not run again"),
    ] = None,
    json_: Json = False,
) -> None:
    """How soon every object is found, by policy: the mission, and its planar stand-in on the same and more layouts."""
    from glotouch_bt.bench.search import SearchCampaign, run_campaign
    from glotouch_bt.commands.terminal import bench_tables as console_bench

    check_names(conditions, backend)
    campaign = SearchCampaign(
        policies=tuple(p.strip() for p in policies.split(",") if p.strip()),
        seeds=tuple(range(seed, seed + trials)),
        planar_seeds=tuple(range(seed, seed + planar)),
        conditions=conditions,
        objects=objects,
        backend=backend,
        out=bench_folder(out, "search"),
        resume=resume,
        recorded=tuple(recorded or ()),
    )

    def show(row: Mapping[str, Any], done: int, total: int) -> None:
        sys.stderr.write(
            f"[{done}/{total}] {row['simulator']} {row['policy']} seed {row['seed']}: "
            f"{len(row['discovered_m'])} found, {row['travel_m']:.2f} m, {row['ended']}\n"
        )

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        summary = run_campaign(campaign, pool, show)
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    else:
        console_bench.print_search(summary, campaign.out)


@bench.command()
@guarded
def match(
    phases: Annotated[int, typer.Option(min=1, help="layouts; each gives a decision per object")] = 24,
    seed: Seed = 400,
    conditions: Conditions = "nominal",
    objects: Objects = None,
    strangers: Annotated[
        Path | None, typer.Option(metavar="DIR", help="folder of STL files that are not in the box, as targets")
    ] = None,
    dataset: Annotated[
        Path | None, typer.Option(metavar="DIR", help="recorded TouchSets, instead of acquiring (their own conditions)")
    ] = None,
    method: Annotated[list[str] | None, typer.Option(help="only these matchers (default: all)")] = None,
    backend: Annotated[str, typer.Option(help="a registered simulation backend")] = "mujoco",
    workers: Workers = 2,
    out: Out = None,
    json_: Json = False,
) -> None:
    """Which touched object is the target: the matchers and the paper's ablation on TouchSets of the real skills."""
    from glotouch_bt.bench.match import MatchCampaign, chosen, run_campaign
    from glotouch_bt.commands.terminal import bench_tables as console_bench

    check_names(conditions, backend)
    campaign = MatchCampaign(
        seeds=tuple(range(seed, seed + phases)),
        conditions=conditions,
        objects=objects,
        strangers=strangers,
        dataset=dataset,
        methods=chosen(method or ()),
        backend=backend,
        out=bench_folder(out, "match"),
    )

    def show(row: Mapping[str, Any], done: int, total: int) -> None:
        right = ", ".join(f"{name} {n}" for name, n in row["right"].items())
        sys.stderr.write(
            f"[{done}/{total}] seed {row['seed']}: {row['ended']}, {row['touched']} of {row['objects']} touched; "
            f"right: {right or 'none'}\n"
        )

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        summary = run_campaign(campaign, pool, show)
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    else:
        console_bench.print_match(summary, campaign.out)


@bench.command()
@guarded
def contact(
    trials: Trials = 20,
    seed: Seed = 100,
    conditions: Conditions = "nominal",
    per_side: Annotated[int, typer.Option(min=1, max=15, help="contacts per side")] = 4,
    workers: Workers = 2,
    out: Out = None,
    json_: Json = False,
) -> None:
    """Calibration square traced by probe and by bare gripper, bolted down and free: errors and the paper's."""
    from glotouch_bt.bench.contact import ContactCampaign, run_campaign
    from glotouch_bt.commands.terminal import bench_tables as console_bench

    check_names(conditions, "mujoco")
    campaign = ContactCampaign(
        tuple(range(seed, seed + trials)), conditions, per_side, "mujoco", bench_folder(out, "contact")
    )

    def show(row: dict[str, Any], done: int, total: int) -> None:
        said = row["cause"] or f"centre {row['centre_error_mm']:.2f} mm"
        sys.stderr.write(f"[{done}/{total}] {row['tool']} {row['square']} seed {row['seed']}: {said}\n")

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        summary = run_campaign(campaign, pool, show)
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    else:
        console_bench.print_contact(summary, campaign.out)


@bench.command()
@guarded
def detection(
    conditions: Annotated[
        list[str] | None, typer.Option(help="disturbances, may be repeated (default: nominal and harsh)")
    ] = None,
    trials: Annotated[int, typer.Option(min=1, help="synthetic pushes of each kind and force")] = 100,
    seed: Seed = 100,
    hours: Annotated[float, typer.Option(min=0.001, help="synthetic signal per kind of move, h")] = 2.0,
    minutes: Annotated[float, typer.Option(min=0.1, help="simulated free motion under guard, min")] = 31.0,
    pushes: Annotated[int, typer.Option(min=1, help="simulated pushes of 0.6 N")] = 40,
    robots: Annotated[int, typer.Option(min=1, help="simulated robots, on the first seeds")] = 1,
    backend: Annotated[str, typer.Option(help="a registered simulation backend")] = "mujoco",
    out: Out = None,
    json_: Json = False,
) -> None:
    """The guard's false alarms while the arm moves freely, and the smallest pushes it finds."""
    from glotouch_bt.bench.detection import DetectionStudy, run_study, table

    profiles = tuple(conditions or ("nominal", "harsh"))
    for profile in profiles:
        check_names(profile, backend)
    seeds = tuple(range(seed, seed + trials))
    study = DetectionStudy(profiles, seeds, hours, minutes, pushes, robots, backend, bench_folder(out, "detection"))
    summary = run_study(study, lambda line: print(line, file=sys.stderr))
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    else:
        sys.stdout.write("\n".join(table(summary)) + f"\n{study.out / 'summary.json'}\n")
