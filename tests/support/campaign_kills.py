"""Kill workers, schedulers and clients of a campaign at random moments, and compare its rows with an undisturbed run.

    python -m tests.support.campaign_kills --trials 1000 --kills 40 --seed 0 --cluster --out DIR

Without `--cluster` the campaign runs in worker processes of the client; with it, on a dask scheduler and two workers,
which are processes of their own. Whatever is killed is started again, as a batch queue does.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import numpy as np

from glotouch_bt.campaign import TRIAL, ClusterPool, WorkerPool
from tests.support.short_trials import run_short, short_campaign, short_trials

ROUNDS = 60_000
"""Work of a trial: about 0.05 s."""


def client(out: Path, trials: int, cluster: str | None) -> None:
    """Run the campaign, or what is left of it."""
    campaign = short_campaign(out, resume=True)
    with WorkerPool(2) if cluster is None else ClusterPool(cluster, 2) as pool:
        run_short(campaign, pool, short_trials(campaign, trials, ROUNDS))


def descendants(pid: int) -> list[int]:
    """Return the processes below a process, nearest first."""
    parents: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        with suppress(OSError, ValueError):
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            if fields[0] != "Z":
                parents.setdefault(int(fields[1]), []).append(int(entry.name))
    found = list(parents.get(pid, []))
    for child in found:
        found += parents.get(child, [])
    return found


def command_line(pid: int) -> bytes:
    """Return the command line of a process; empty if it has ended."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    return b""


class Processes:
    """The processes of a campaign by their role; a dead one is started again."""

    def __init__(self, out: Path, trials: int, cluster: bool) -> None:
        address = []
        self.words: dict[str, list[str]] = {}
        if cluster:
            with socket.socket() as probe:
                probe.bind(("127.0.0.1", 0))
                port = str(probe.getsockname()[1])
            address = ["--address", f"tcp://127.0.0.1:{port}"]
            scheduler = ["--host", "127.0.0.1", "--port", port, "--no-dashboard"]
            worker = [address[1], "--no-nanny", "--nthreads", "1", "--no-dashboard"]
            self.words["scheduler"] = [sys.executable, "-m", "distributed.cli.dask_scheduler", *scheduler]
            for name in ("worker 1", "worker 2"):
                self.words[name] = [sys.executable, "-m", "distributed.cli.dask_worker", *worker]
        this = [sys.executable, "-m", "tests.support.campaign_kills", "--trials", str(trials), "--out", str(out)]
        self.words["client"] = [*this, "--client", *address]
        self.running: dict[str, subprocess.Popen[bytes]] = {}
        self.journal = out / "journal"
        self.log = (out.parent / f"{out.name}.log").open("wb")

    def look(self) -> bool:
        """Start what is dead; return True when the client has ended well."""
        for name, words in self.words.items():
            process = self.running.get(name)
            if process is None or process.poll() is not None:
                if name == "client" and process is not None and process.returncode == 0:
                    return True
                self.running[name] = subprocess.Popen(words, stdout=self.log, stderr=self.log, start_new_session=True)
        return False

    def victims(self, rng: np.random.Generator) -> dict[str, int]:
        """Return a process to kill for each role: the command itself, one below it, and one that runs a trial."""
        found = {}
        for name, process in self.running.items():
            role = name.split()[0]
            found[role] = process.pid
            below = [p for p in descendants(process.pid) if b"resource_tracker" not in command_line(p)]
            if below:
                found[f"below {role}"] = int(rng.choice(below))
        with suppress(OSError, ValueError, IndexError):
            what, _, pid = self.journal.read_text().splitlines()[-1].split()
            if what == "begin" and command_line(int(pid)):
                found["trial"] = int(pid)
        return found

    def end(self) -> None:
        """Kill everything."""
        for process in self.running.values():
            for pid in (*descendants(process.pid), process.pid):
                with suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
            process.wait()
        self.log.close()


def disturb(out: Path, trials: int, kills: int, seed: int, cluster: bool) -> Counter[str]:
    """Run the campaign under kills, spread over its whole length; return the number of kills by role."""
    rng = np.random.default_rng(seed)
    at = sorted(rng.uniform(0.02, 0.97, kills) * trials)
    counted: Counter[str] = Counter()
    processes = Processes(out, trials, cluster)
    try:
        while not processes.look():
            threading.Event().wait(0.05)
            done = sum(1 for _ in out.glob(f"t*/{TRIAL}"))
            if at and done >= at[0]:
                at.pop(0)
                threading.Event().wait(rng.uniform(0.0, 0.2))
                victims = processes.victims(rng)
                # every role as often as the others; trials are killed in between, not at their end
                role = min(victims, key=lambda r: (counted[r], rng.random()))
                with suppress(OSError):
                    os.kill(victims[role], signal.SIGKILL)
                    counted[role] += 1
    finally:
        processes.end()
    return counted


def main() -> None:
    """Compare, and print the result as JSON."""
    words = argparse.ArgumentParser()
    words.add_argument("--trials", type=int, default=1000)
    words.add_argument("--kills", type=int, default=40)
    words.add_argument("--seed", type=int, default=0)
    words.add_argument("--out", type=Path, required=True)
    words.add_argument("--cluster", action="store_true")
    words.add_argument("--client", action="store_true")
    words.add_argument("--address")
    given = words.parse_args()
    if given.client:
        return client(given.out, given.trials, given.address)
    calm, wild = given.out / "calm", given.out / "wild"
    began = time.perf_counter()
    client(calm, given.trials, None)
    calm_s = time.perf_counter() - began
    wild.mkdir(parents=True)
    killed = disturb(wild, given.trials, given.kills, given.seed, given.cluster)
    wild_s = time.perf_counter() - began - calm_s
    rows = [(folder / "trials.csv").read_bytes() for folder in (calm, wild)]
    journal = Counter(line.split()[0] for line in (wild / "journal").read_text().splitlines())
    same = rows[0] == rows[1]
    folders = sum(1 for _ in wild.glob(f"t*/{TRIAL}"))
    lost = sum(len(json.loads(f.read_text())) for f in wild.glob("t*/.lost.json"))
    report = {
        "trials": given.trials, "rows": rows[1].count(b"\n") - 1, "folders": folders, "rows_equal_to_the_byte": same,
        "kills": killed.total(), "killed": dict(killed), "attempts": journal["begin"], "lost_attempts_noted": lost,
        "calm_s": round(calm_s, 1), "wild_s": round(wild_s, 1),
    }  # fmt: skip
    sys.stdout.write(json.dumps(report, indent=2) + "\n")
    sys.exit(0 if same and folders == given.trials else 1)


if __name__ == "__main__":
    main()
