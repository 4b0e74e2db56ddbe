"""`glotouch bench dataset`: TouchSets with truth, to publish."""

from __future__ import annotations

import shlex
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from glotouch_bt.commands import shared

if TYPE_CHECKING:
    from concurrent.futures import Executor


@shared.guarded
def dataset(
    conditions: Annotated[
        list[str] | None, typer.Option(help="disturbances; repeat for more (default: nominal and realistic)")
    ] = None,
    phases: Annotated[int, typer.Option(min=1, help="number of layouts for each conditions")] = 12,
    seed: shared.FirstSeed = 400,
    objects: shared.Objects = None,
    sampled: Annotated[
        bool, typer.Option("--sampled", help="touch the objects without a robot, in about a second a layout")
    ] = False,
    name: Annotated[str, typer.Option(help="name of the dataset")] = "glotouch-touchsets",
    version: Annotated[str, typer.Option(help="version of the dataset")] = "1.0",
    backend: shared.Backend = "mujoco",
    resume: shared.KeepTrials = False,
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    json_: shared.Json = False,
) -> None:
    """A dataset of TouchSets with their truth, by conditions, with a description and checksums: DIR/dataset.

    Equal commands on equal code give equal data (`digest` in dataset.json).
    """
    from glotouch_bt.bench.match import MatchCampaign, make_dataset
    from glotouch_bt.mission.read import conditions_name

    profiles = tuple(dict.fromkeys(conditions or ("nominal", "realistic")))
    for profile in profiles:
        shared.check_names(profile, backend)
    folder = shared.bench_folder(out, "dataset")
    campaigns = [
        MatchCampaign(
            seeds=tuple(range(seed, seed + phases)),
            conditions=profile,
            objects=objects,
            sampled=sampled,
            methods=(),
            backend=backend,
            out=folder / "trials" / conditions_name(profile),
            resume=resume,
        )
        for profile in profiles
    ]
    words = ["--phases", str(phases), "--seed", str(seed), *(["--sampled"] if sampled else [])]
    words += [w for profile in profiles for w in ("--conditions", profile)]
    words += [] if objects is None else ["--objects", objects.name]

    def run(given: list[MatchCampaign], pool: Executor, show: Any) -> dict[str, Any]:
        command = f"glotouch bench dataset {shlex.join(words)}"
        return make_dataset(given, pool, show, out=folder / "dataset", name=name, version=version, command=command)

    def describe_row(row: dict[str, Any]) -> str:
        return f"{row['conditions']} seed {row['seed']}: {row['ended']}, {row['touched']} of {row['objects']} touched"

    manifest = shared.run_in_pool(run, campaigns, shared.Executors(workers, cluster, trial_limit), describe_row)
    if json_:
        shared.print_json(manifest)
    else:
        made = f"{manifest['touchsets']} TouchSets, version {version}, digest {manifest['digest'][:16]}"
        sys.stdout.write(f"{folder / 'dataset'}: {made}\n")
