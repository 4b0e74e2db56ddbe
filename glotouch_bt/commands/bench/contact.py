"""`glotouch bench contact`: accuracy of the traced calibration square."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from glotouch_bt.commands.bench.shared import print_summary, worker_pool
from glotouch_bt.commands.shared import (
    BenchFolder,
    Conditions,
    FirstSeed,
    SummaryJson,
    Trials,
    Workers,
    bench_folder,
    check_names,
    guarded,
)


@guarded
def contact(
    trials: Trials = 20,
    seed: FirstSeed = 100,
    conditions: Conditions = "nominal",
    per_side: Annotated[int, typer.Option(min=1, max=15, help="contacts per side")] = 4,
    workers: Workers = 2,
    out: BenchFolder = None,
    json_: SummaryJson = False,
) -> None:
    """Contact: errors of a calibration square traced by probe and by bare gripper, fixed and free."""
    from glotouch_bt.bench.contact import ContactCampaign, run_campaign
    from glotouch_bt.commands.terminal import print_contact

    check_names(conditions, "mujoco")
    campaign = ContactCampaign(
        tuple(range(seed, seed + trials)), conditions, per_side, "mujoco", bench_folder(out, "contact")
    )

    def show(row: dict[str, Any], done: int, total: int) -> None:
        ending = row["cause"] or f"centre {row['centre_error_mm']:.2f} mm"
        sys.stderr.write(f"[{done}/{total}] {row['tool']} {row['square']} seed {row['seed']}: {ending}\n")

    with worker_pool(workers) as pool:
        summary = run_campaign(campaign, pool, show)
    print_summary(summary, campaign.out, print_contact, json_)
