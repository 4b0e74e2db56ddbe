"""`glotouch bench forces`: the true peak force whatever fails."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from glotouch_bt.commands import shared

if TYPE_CHECKING:
    from glotouch_bt.campaign import Campaign
    from glotouch_bt.validation.forces import ForceCampaign

MISSIONS = ("calibrate", "contact_probe", "pick_at", "retrieve")
BACKENDS = ("mujoco", "flexiv_xense:devices=simulated")


@shared.guarded
def forces(
    mission: Annotated[
        list[str] | None, typer.Option(help=f"draw from these missions (default: {', '.join(MISSIONS)})")
    ] = None,
    backend: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[:OPTION=VALUE,...]",
            help=f"draw from these simulations (default: {', '.join(BACKENDS)}; with --following {BACKENDS[0]})",
        ),
    ] = None,
    trials: shared.Trials = 300,
    seed: shared.FirstSeed = 0,
    following: Annotated[
        bool,
        typer.Option("--following", help="instead let each joint leave its setpoint, at four rates and five moments"),
    ] = False,
    moment: Annotated[
        list[str] | None, typer.Option(help="with --following: only sweep, contact, draw, squeeze or lift")
    ] = None,
    joint: Annotated[list[int] | None, typer.Option(help="with --following: only these joints, from 0")] = None,
    conditions: shared.Conditions = "nominal",
    few: shared.FewObjects = 2,
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    resume: shared.KeepTrials = False,
    keep: Annotated[bool, typer.Option("--keep", help="also keep the records of trials without offence")] = False,
    json_: shared.SummaryJson = False,
) -> None:
    """Forces: the true peak against the hard limit, with two or three random faults in each trial."""
    from glotouch_bt.campaign import Campaign
    from glotouch_bt.commands.terminal import print_forces
    from glotouch_bt.robot import BadInput
    from glotouch_bt.validation.forces import run_campaign

    backends = _backends(backend or (BACKENDS[:1] if following else BACKENDS), conditions)
    if following and mission:
        raise BadInput("--mission: the missions of --following are fixed; choose with --moment and --joint")
    if not following and (moment or joint):
        raise BadInput("--moment, --joint: only with --following")
    share = shared.read_shard(shard)
    folder = shared.bench_folder(out, "forces-following" if following else "forces")
    seeds = (seed,) if following else tuple(range(seed, seed + trials))
    bases = [
        Campaign(
            mission="",
            backend=name,
            settings=options,
            seeds=seeds,
            out=folder,
            conditions=conditions,
            resume=resume,
            shard=share,
        )
        for name, options in backends.items()
    ]
    if following:
        campaign = _following(bases, moment or [], joint or [], keep)
    else:
        campaign = _random(bases, mission or list(MISSIONS), few, keep)

    def describe_row(row: dict[str, Any]) -> str:
        peak = row.get("peak_force_N")
        force = "peak unknown" if peak is None else f"peak {peak:.1f} N"
        ending = f"{row['status']} {row.get('cause') or ''}".strip()
        return (
            f"{row['mission']} on {row['backend']}, seed {row['seed']}: {row['faults'] or 'no fault'}: "
            f"{ending}, {force} ({row['wall_s']:.0f} s)"
        )

    summary = shared.run_in_pool(run_campaign, campaign, shared.Executors(workers, cluster, trial_limit), describe_row)
    shared.print_summary(summary, folder, print_forces, json_)


def _backends(given: list[str] | tuple[str, ...], conditions: str) -> dict[str, dict[str, str]]:
    """Return the options of each backend.

    Raises:
        BadInput: One does not exist, is given twice, or its options cannot be read.
    """
    from glotouch_bt.robot import BadInput

    found: dict[str, dict[str, str]] = {}
    for text in given:
        name, _, options = text.partition(":")
        if name in found:
            raise BadInput(f"--backend {name}: given twice")
        shared.check_names(conditions, name)
        found[name] = shared.read_settings(options.split(",") if options else [])
    return found


def _following(bases: list[Campaign], moments: list[str], joints: list[int], keep: bool) -> ForceCampaign:
    from glotouch_bt.validation.forces import ForceCampaign, chosen_joints, chosen_moments, matrix, scene_of

    chosen, numbers = chosen_moments(moments), chosen_joints(joints)
    scenes: dict[tuple[str, str], Campaign] = {}
    for base in bases:
        for moment in chosen:
            scenes.setdefault((moment.mission, base.backend), scene_of(moment, base))
    index = {key: n for n, key in enumerate(scenes)}
    cells = ((cell, index[cell.moment.mission, b.backend]) for b in bases for cell in matrix(chosen, numbers))
    return ForceCampaign(tuple(scenes.values()), keep, tuple(cells))


def _random(bases: list[Campaign], missions: list[str], few: int, keep: bool) -> ForceCampaign:
    from glotouch_bt.mission import load_mission
    from glotouch_bt.robot import BadInput
    from glotouch_bt.validation.forces import PLACE_PARAMETERS, ForceCampaign, block_scene

    stems = [Path(m).stem for m in missions]
    if twice := sorted({s for s in stems if stems.count(s) > 1}):
        raise BadInput(f"--mission {twice[0]}: given twice")
    parameters = {name: load_mission(name, {}).parameters.keys() for name in missions}
    scenes: list[Campaign] = []
    for name in missions:
        if parameters[name] >= PLACE_PARAMETERS:
            scenes += [block_scene(name, base) for base in bases]
        elif parameters[name] >= {"target", "expected_objects"}:
            box, settings = shared.put_few_in_box(name, {}, None, few, bases[0].out / "objects")
            scenes += [replace(b, mission=name, settings={**settings, **b.settings}, objects=box) for b in bases]
        else:
            scenes += [replace(b, mission=name) for b in bases]
    return ForceCampaign(tuple(scenes), keep)
