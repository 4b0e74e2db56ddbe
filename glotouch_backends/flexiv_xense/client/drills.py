"""Kill drills on simulated devices: `python -m glotouch_backends.flexiv_xense.client.drills --trials 20 --out DIR`.

A mission runs on wall time. At a random moment the driver or the executive is killed (SIGKILL). The log of the
surviving process (the simulated cell or the driver) shows how long the arm took to stand still.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_backends.flexiv_xense.driver import WallClock

CLOCK = WallClock()
VICTIMS = ("driver", "executive")
ALLOWED_S = {"driver": 0.6, "executive": 0.4}
"""Longest time to standstill after each kill. Source: docs/guides/hardware.md, "What stops the arm"."""
OPEN_S = 180.0
"""Longest wait for the devices to open."""
AFTER_S = 15.0
"""Longest wait for the standstill after the kill."""
EXIT_S = 60.0
"""Longest wait for the executive to end."""


@dataclass(frozen=True)
class Drill:
    """One kill.

    Attributes:
        victim: driver or executive.
        moment_s: Time of the kill after the devices were ready.
        speed_m_s: Speed of the tool when the survivor began to brake.
        standstill_s: Time from the kill to standstill; None if none was logged.
        peak_force_N: Largest contact force after the kill.
        exit_code: Exit code of the executive; None if it was the victim.
    """

    victim: str
    moment_s: float
    speed_m_s: float
    standstill_s: float | None
    peak_force_N: float | None
    exit_code: int | None

    @property
    def passed(self) -> bool:
        """True if the arm stood in time and a surviving executive ended with exit code 3."""
        in_time = self.standstill_s is not None and self.standstill_s <= ALLOWED_S[self.victim]
        return in_time and self.exit_code in (None, 3)


def _lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def _event(
    path: Path, name: str, chosen: Callable[[Mapping[str, Any]], bool] = lambda _: True
) -> dict[str, Any] | None:
    return next((e for e in _lines(path) if e["event"] == name and chosen(e)), None)


def _await(found: Callable[[], dict[str, Any] | None], limit_s: float) -> dict[str, Any] | None:
    until = time.monotonic() + limit_s
    while (event := found()) is None and time.monotonic() < until:
        CLOCK.sleep_until(CLOCK.now_s() + 0.02)
    return event


def _children(pid: int) -> list[int]:
    found: list[int] = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        found.extend(int(c) for c in (task / "children").read_text().split())
    return found


def _end(pids: list[int]) -> None:
    """Terminate the remaining processes of a trial."""
    for pid in pids:
        try:
            os.kill(pid, signal.SIGTERM)
        except ProcessLookupError:
            continue


def run_drill(victim: str, moment_s: float, mission: str, seed: int, folder: Path, settings: list[str],
              objects: Path | None = None) -> Drill:  # fmt: skip
    """Run one mission and kill one process."""
    folder.mkdir(parents=True, exist_ok=True)
    driver_log, cell_log = folder / "driver.jsonl", folder / "cell.jsonl"
    options = ["devices=simulated", "pace=real", f"log={driver_log}", *settings]
    words = [word for option in options for word in ("--set", option)]
    command = [sys.executable, "-m", "glotouch_bt.cli", "run", mission, "--backend", "flexiv_xense"]
    command += ["--seed", str(seed), "--out", str(folder / "run"), *words]
    command += [] if objects is None else ["--objects", str(objects)]
    with (folder / "executive.txt").open("wb") as out:
        executive = subprocess.Popen(command, stdout=out, stderr=out, start_new_session=True)
    opened = _await(lambda: _event(driver_log, "opened"), OPEN_S)
    if opened is None:
        executive.kill()
        raise RuntimeError(f"the devices did not open: {(folder / 'executive.txt').read_text()[-500:]}")
    CLOCK.sleep_until(CLOCK.now_s() + moment_s)
    if executive.poll() is not None:  # the mission ended before the kill; counts as not passed
        return Drill(victim, moment_s, float("nan"), None, None, executive.returncode)
    others = [pid for pid in _children(executive.pid) if pid != opened["pid"]]
    killed_s = time.monotonic()
    os.kill(opened["pid"] if victim == "driver" else executive.pid, signal.SIGKILL)
    if victim == "driver":
        speed, standstill, peak = _after_driver(cell_log)
        code: int | None = executive.wait(EXIT_S)
    else:
        speed, standstill, peak = _after_executive(driver_log, killed_s)
        executive.wait()
        code = None
        _await(lambda: _event(driver_log, "released"), AFTER_S)
    _end(others)
    return Drill(victim, moment_s, speed, standstill, peak, code)


def _after_driver(cell_log: Path) -> tuple[float, float | None, float | None]:
    """Return speed, time to standstill and peak force by the cell, whose link ends at the moment of the kill."""
    still = _await(lambda: _event(cell_log, "standstill"), AFTER_S)
    lost = _event(cell_log, "client lost")
    speed = float("nan") if lost is None else lost["speed_m_s"]
    return (speed, None, None) if still is None else (speed, still["after_s"], still["peak_force_N"])


def _after_executive(driver_log: Path, killed_s: float) -> tuple[float, float | None, float | None]:
    """Return the same by the driver's log, on this machine's monotonic clock. An earlier hold counts from the kill."""

    def later(e: Mapping[str, Any]) -> bool:
        return bool(e["monotonic_s"] >= killed_s)

    _await(lambda: _event(driver_log, "client lost", later), AFTER_S)
    still, silent = _event(driver_log, "standstill", later), _event(driver_log, "no command", later)
    if still is None and silent is None:  # the arm stood already, held before the kill
        return 0.0, 0.0, 0.0
    speed = 0.0 if silent is None else silent["speed_m_s"]
    return (speed, None, None) if still is None else (speed, still["monotonic_s"] - killed_s, still["peak_force_N"])


def main(argv: list[str] | None = None) -> int:
    """Kill each victim in turn; write and print a summary. Return 1 if a trial failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=20, help="kills of each victim")
    parser.add_argument("--seed", type=int, default=0, help="seed of the moments, and of the first mission")
    parser.add_argument("--window", type=float, default=60.0, help="latest moment after the devices are ready, s")
    parser.add_argument("--mission", default="retrieve")
    parser.add_argument("--set", dest="settings", action="append", default=["target=apple"], metavar="NAME=VALUE")
    parser.add_argument("--objects", type=Path, help="folder of STL files in metres: fewer make a shorter mission")
    parser.add_argument("--out", type=Path, required=True)
    o = parser.parse_args(argv)
    rng = np.random.default_rng(o.seed)
    drills: list[Drill] = []
    for k in range(2 * o.trials):
        moment = float(rng.uniform(0.5, o.window))
        folder = o.out / f"kill{k:02d}"
        drill = run_drill(VICTIMS[k % 2], moment, o.mission, o.seed + k, folder, o.settings, o.objects)
        drills.append(drill)
        sys.stdout.write(json.dumps(asdict(drill) | {"passed": drill.passed}) + "\n")
        sys.stdout.flush()
    summary = {victim: _summary([d for d in drills if d.victim == victim], victim) for victim in VICTIMS}
    (o.out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
    sys.stdout.write(json.dumps(summary, indent=2) + "\n")
    return 0 if all(d.passed for d in drills) else 1


def _summary(drills: list[Drill], victim: str) -> dict[str, Any]:
    times = [d.standstill_s for d in drills if d.standstill_s is not None]
    forces = [d.peak_force_N for d in drills if d.peak_force_N is not None]
    return {
        "n": len(drills),
        "passed": sum(d.passed for d in drills),
        "moving": sum(d.speed_m_s > 1e-3 for d in drills),
        "allowed_s": ALLOWED_S[victim],
        "standstill_s": {"median": float(np.median(times)), "max": max(times)} if times else None,
        "peak_force_N": {"median": float(np.median(forces)), "max": max(forces)} if forces else None,
    }


if __name__ == "__main__":
    sys.exit(main())
