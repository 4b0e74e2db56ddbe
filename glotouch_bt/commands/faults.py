"""`glotouch faults` and `glotouch bench faults`: what can be made to go wrong, and what comes of it."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands.terminal import guarded


@guarded
def faults(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="one fault")] = None,
    json_: Annotated[bool, typer.Option("--json", help="print JSON on stdout, nothing else")] = False,
) -> None:
    """List the faults a plan may ask for (glotouch run --faults FILE), or describe one."""
    from glotouch_bt.commands.terminal import console
    from glotouch_bt.faults import CATALOGUE
    from glotouch_bt.mission.read import shipped
    from glotouch_bt.robot import UnknownName

    if name is not None and name not in CATALOGUE:
        raise UnknownName("fault", name, CATALOGUE)
    kinds = [CATALOGUE[name]] if name else list(CATALOGUE.values())
    if json_:
        described = [k.as_dict() for k in kinds]
        sys.stdout.write(json.dumps(described[0] if name else described, indent=2) + "\n")
        return
    if name is None:
        rows = [(k.name, k.channel, "yes" if k.recoverable else "no", k.summary, k.seen_by) for k in kinds]
        console.print_table("faults", ("name", "channel", "recoverable", "what it does", "who should see it"), rows)
        sys.stdout.write(f"shipped plans: {', '.join(shipped('faults')) or 'none'}\n")
        return
    kind = kinds[0]
    where = " (simulation only)" if kind.channel == "world" else ""
    sys.stdout.write(f"{kind.name}: {kind.summary}{where}\n")
    sys.stdout.write(f"channel {kind.channel}; seen by {kind.seen_by}; ")
    sys.stdout.write(f"{'recoverable' if kind.recoverable else 'ends the mission'}\n")
    rows5 = [(p["name"], p["unit"] or "", str(p["default"]), p["valid"], p["description"]) for p in kind.parameters()]
    if rows5:
        console.print_table("parameters (with: {...})", ("name", "unit", "default", "valid", "what it is"), rows5)


@guarded
def bench_faults(
    mission: Annotated[
        str | None,
        typer.Option(
            help="a mission with `target` and `expected_objects` (retrieve); with --exhaustive any (calibrate)"
        ),
    ] = None,
    set_: Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission parameter")] = None,
    fault: Annotated[list[str] | None, typer.Option(help="only these classes (default: all that are tried)")] = None,
    skill: Annotated[list[str] | None, typer.Option(help="only in these skills (default: eight)")] = None,
    trials: Annotated[int, typer.Option(min=1, help="seeds per cell")] = 3,
    seed: Annotated[int, typer.Option(min=0, help="first seed")] = 0,
    conditions: Annotated[str, typer.Option(help="disturbances: ideal, nominal, harsh, or a file")] = "nominal",
    objects: Annotated[
        Path | None, typer.Option(metavar="DIR", help="folder of watertight STL files in metres")
    ] = None,
    few: Annotated[int, typer.Option(min=1, help="only the first so many objects are in the box: it is quicker")] = 2,
    backend: Annotated[str, typer.Option(help="a registered simulation backend")] = "mujoco",
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="where trials and summary go")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="keep the trials that are in --out already")] = False,
    keep: Annotated[bool, typer.Option("--keep", help="keep the records of trials that ended well, too")] = False,
    exhaustive: Annotated[
        bool, typer.Option("--exhaustive", help="instead: fail the n-th call of the seam, n = 0, 1, ... (see --stride)")
    ] = False,
    stride: Annotated[int, typer.Option(min=1, help="with --exhaustive: every so many calls")] = 1,
    json_: Annotated[bool, typer.Option("--json", help="print summary.json on stdout, nothing else")] = False,
) -> None:
    """Break a mission on purpose: each class of fault in each skill, beside the unfaulted run of the same seed."""
    from glotouch_bt.commands.options import bench_folder, check_names, read_settings
    from glotouch_bt.commands.terminal import fault_tables as console_faults
    from glotouch_bt.mission import load_mission
    from glotouch_bt.robot import GlotouchError
    from glotouch_bt.validation.faults import (
        Exhaustive,
        FaultCampaign,
        chosen_cases,
        chosen_skills,
        few_objects,
        run_campaign,
        run_exhaustive,
    )

    settings = read_settings(set_)
    mission = mission or ("calibrate" if exhaustive else "retrieve")
    check_names(conditions, backend)
    cases = chosen_cases(fault or ())
    skills = chosen_skills(skill or (), cases)
    world = load_mission(mission, settings, objects=objects).world
    if exhaustive:
        study = Exhaustive(mission, settings, backend, seed, stride, bench_folder(out, "faults-exhaustive"))
        found = run_exhaustive(study, lambda n, name: print(f"{name}: call {n}", file=sys.stderr))
        if json_:
            sys.stdout.write(json.dumps(found, indent=2) + "\n")
        else:
            console_faults.print_exhaustive(found, study.out)
        return
    folder = bench_folder(out, "faults")
    box, names = few_objects(world.objects, few, folder / "objects")
    settings = {"target": names[0], "expected_objects": str(len(names))} | settings
    load_mission(mission, settings, objects=box)
    campaign = FaultCampaign(
        mission=mission,
        settings=settings,
        cases=cases,
        skills=skills,
        seeds=tuple(range(seed, seed + trials)),
        conditions=conditions,
        objects=box,
        backend=backend,
        out=folder,
        resume=resume,
        keep=keep,
    )

    def show(row: Mapping[str, Any], done: int, total: int) -> None:
        what = f"{row['class']} in {row['skill']}" if row["skill"] else "unfaulted"
        said = f"{row['verdict']} {row.get('cause') or ''}" if row["effective"] else "altered nothing"
        sys.stderr.write(f"[{done}/{total}] seed {row['seed']} {what}: {said} ({row['wall_s']:.0f} s)\n")

    try:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            summary = run_campaign(campaign, pool, show)
    except BrokenProcessPool as e:
        raise GlotouchError(f"a trial ended its process; go on with --resume --out {folder}") from e
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    else:
        console_faults.print_faults(summary, campaign.out)
