"""`glotouch test` and `glotouch bench fuzz`: are a mission's tests enough, and does the checker stand anything."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands.terminal import guarded


@guarded
def mission_tests(
    mission: Annotated[str, typer.Argument(metavar="MISSION", help="path of a mission file, or a shipped name")],
    tests: Annotated[list[str] | None, typer.Argument(metavar="TESTS...", help="test files or folders")] = None,
    coverage: Annotated[
        float | None,
        typer.Option(
            "--coverage-min", min=0.0, max=100.0, metavar="PERCENT", help="fail if fewer outcomes are exercised"
        ),
    ] = None,
) -> int:
    """Run a mission's tests, say which outcomes of each leaf they exercise."""
    from glotouch_bt.mission import load_mission
    from glotouch_bt.robot import BadInput

    try:
        import pytest
    except ImportError as e:
        raise BadInput("glotouch test needs pytest, which is not installed here: pip install pytest") from e
    load_mission(mission)
    words = [*(tests or []), "-q", "-p", "no:cacheprovider", "--glotouch-coverage"]
    words += [] if coverage is None else ["--glotouch-coverage-min", str(coverage)]
    code = int(pytest.main(words))
    if code == int(pytest.ExitCode.NO_TESTS_COLLECTED):
        raise BadInput(
            f"no tests in {', '.join(tests or ['this folder'])} (docs/tutorial.md shows how they are written)"
        )
    return code if code in (0, 1) else 2


@guarded
def bench_fuzz(
    trials: Annotated[int, typer.Option(min=1, help="documents")] = 20_000,
    seed: Annotated[int, typer.Option(min=0, help="of all of them")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="where the summary and what broke something go")
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="print summary.json on stdout, nothing else")] = False,
) -> int:
    """Random and spoilt missions and fault plans: no traceback, no hang, no code run, nothing wrong accepted."""
    from glotouch_bt.commands.options import bench_folder
    from glotouch_bt.commands.terminal import console
    from glotouch_bt.validation.fuzz import BAD, FuzzCampaign, run_campaign

    campaign = FuzzCampaign(trials, seed, bench_folder(out, "fuzz"))

    def show(done: int, total: int, counts: Mapping[str, int]) -> None:
        bad = sum(counts.get(name, 0) for name in BAD)
        sys.stderr.write(f"[{done}/{total}] {bad} bad\n")

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        summary = run_campaign(campaign, pool, show)
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    else:
        _print_fuzz(console, summary, campaign.out)
    return 1 if summary["failures"] else 0


def _print_fuzz(console: Any, summary: Mapping[str, Any], out: Path) -> None:
    kinds = list(summary["counts"])
    classes = sorted({c for found in summary["counts"].values() for c in found})
    rows = [(c, *(str(summary["counts"][k].get(c, 0)) for k in kinds)) for c in classes]
    console.print_table(f"{summary['trials']} documents, seed {summary['seed']}", ("what came of it", *kinds), rows)
    bad = summary["bad"]
    sys.stdout.write(f"bad: {len(summary['failures'])} ({100 * bad['lo']:.3f} .. {100 * bad['hi']:.3f} %)\n")
    sys.stdout.write(f"{out / 'summary.json'}\n")
