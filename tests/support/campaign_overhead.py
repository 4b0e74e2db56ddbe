"""Measure what a campaign costs: the overhead of a trial, and two workers against two independent processes.

    python -m tests.support.campaign_overhead --out DIR

Times are wall times, taken in turn and repeated, and processor times, which other work on the machine does not change.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

from glotouch_bt.campaign import WorkerPool
from tests.support.short_trials import run_short, short_campaign, short_trials, work

WARM = 2
"""Trials that start the workers and are not measured."""


def cpu_s() -> float:
    """Return the processor time of the children that have ended, and of this process."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_CHILDREN, resource.RUSAGE_SELF))
    return sum(r.ru_utime + r.ru_stime for r in both)


def campaign_s(out: Path, trials: int, rounds: int, workers: int) -> tuple[float, float]:
    """Return the wall and the processor time of a campaign whose workers have started."""
    campaign = short_campaign(out)
    stamps: list[float] = []
    before = cpu_s()
    with WorkerPool(workers) as pool:
        list(pool.map(partial(time.sleep), [0.5] * WARM * workers))  # imports
        began = time.perf_counter()
        run_short(campaign, pool, short_trials(campaign, trials, rounds), lambda *_: stamps.append(time.perf_counter()))
    return stamps[-1] - began, cpu_s() - before


def independent_s(out: Path, trials: int, rounds: int) -> tuple[float, float]:
    """Return the same for two processes that share the trials and know nothing of each other."""
    before = cpu_s()
    words = [sys.executable, "-m", "tests.support.campaign_overhead", "--out", str(out), "--loop", str(trials // 2)]
    processes = [
        subprocess.Popen(
            [*words, "--rounds", str(rounds)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,  # as the workers: Linux shares out the processor by session
        )
        for _ in range(2)
    ]
    for p in processes:
        assert p.stdout is not None
        p.stdout.readline()
    began = time.perf_counter()
    for p in processes:
        assert p.stdin is not None
        p.stdin.write("go\n")
        p.stdin.flush()
    for p in processes:
        assert p.stdout is not None
        p.stdout.readline()
    took_s = time.perf_counter() - began
    for p in processes:
        p.communicate()
    return took_s, cpu_s() - before


def loop(out: Path, trials: int, rounds: int) -> None:
    """Run trials without a campaign, after a word on stdin."""
    out.mkdir(parents=True, exist_ok=True)
    print("ready", flush=True)
    sys.stdin.readline()
    for n in range(trials):
        work(n, rounds, "", out)
    print("done", flush=True)


def main() -> None:
    """Measure and print JSON."""
    words = argparse.ArgumentParser()
    words.add_argument("--out", type=Path, required=True)
    words.add_argument("--loop", type=int)
    words.add_argument("--rounds", type=int, default=2_000_000)
    words.add_argument("--trials", type=int, default=20)
    words.add_argument("--repeats", type=int, default=3)
    given = words.parse_args()
    if given.loop is not None:
        return loop(given.out, given.loop, given.rounds)
    empty_wall, empty_cpu = campaign_s(given.out / "empty", 300, 0, 1)
    _, start_cpu = campaign_s(given.out / "start", 1, 0, 1)
    pairs = []
    for n in range(given.repeats):
        two = campaign_s(given.out / f"two{n}", given.trials, given.rounds, 2)
        apart = independent_s(given.out / f"apart{n}", given.trials, given.rounds)
        pairs.append({"campaign_wall_s": two[0], "independent_wall_s": apart[0], "efficiency": apart[0] / two[0]})
        pairs[-1] |= {"campaign_cpu_s": two[1], "independent_cpu_s": apart[1]}
    report = {
        "overhead_wall_ms": 1e3 * empty_wall / 300, "overhead_cpu_ms": 1e3 * (empty_cpu - start_cpu) / 299,
        "pairs": pairs, "median_efficiency": statistics.median(p["efficiency"] for p in pairs),
    }  # fmt: skip
    sys.stdout.write(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
