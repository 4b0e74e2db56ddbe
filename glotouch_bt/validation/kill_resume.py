"""`bench resume`: kill missions with SIGKILL at random moments, resume them, and compare with uninterrupted twins.

A moment is a share of the twin's CPU time, so other processes on the core do not shift it. Killed and resumed missions
are processes of their own, started with the normal command line.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from glotouch_bt.bench import Rate, bootstrap_mean, wilson
from glotouch_bt.campaign import Campaign, OnRow, Row, Trial, perform, silent, write_summary, write_table
from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile
from glotouch_bt.report import RunRecord, read_run
from glotouch_bt.robot import BackendError, BadInput, GlotouchError
from glotouch_bt.robot.scene import stream

POLL_S = 0.002
ONLY_HERE = ("wall_time_s", "wall_open_s", "resumed", "versions")
"""Keys of result.json that may differ after a resume."""
COLUMNS = (
    "seed", "moment", "killed_cpu_s", "twin_cpu_s", "outcome", "status", "twin_status", "retrieved", "twin_retrieved",
    "same_end", "same_result", "readable_after_kill", "readable_at_end", "same_record", "checkpoint", "checkpoints",
    "skill_lost", "lost_s", "exit_code", "message",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class KillStudy(Campaign):
    """Settings of the study, with one twin a seed. Missions run on the default backend.

    Attributes:
        kills: Number of kills a seed.
        words: First words of the command line.
    """

    kills: int
    words: tuple[str, ...] = (sys.executable, "-m", "glotouch_bt.cli")

    def run_words(self, seed: int, folder: Path) -> list[str]:
        """Return the command that runs one mission."""
        sets = [w for k, v in self.settings.items() for w in ("--set", f"{k}={v}")]
        head = [*self.words, "run", self.mission, "--seed", str(seed), "--conditions", self.conditions]
        return [*head, *sets, *self.box, "--out", str(folder), "--overwrite", "--json"]

    @property
    def box(self) -> list[str]:
        """The option that names the objects; a resumed run needs it again."""
        return [] if self.objects is None else ["--objects", str(self.objects)]


@dataclass(frozen=True)
class Twin:
    """An uninterrupted run.

    Attributes:
        folder: Its folder.
        result: Its result.json.
        began_s, ended_s: CPU time of its process when the record began and when the result was written.
    """

    folder: Path
    result: Mapping[str, Any]
    began_s: float
    ended_s: float


def run_study(study: KillStudy, on_row: OnRow = silent) -> dict[str, Any]:
    """Run every twin and every kill, write trials.csv and summary.json after each, and return the summary.

    Raises:
        BadInput: The mission or an option is wrong.
        BackendError: This system has no /proc to read CPU times from.
    """
    if not Path("/proc/self/stat").is_file():
        raise BackendError("bench resume needs /proc, which this system has not")
    study.open()
    rows: list[dict[str, Any]] = []
    total = len(study.seeds) * study.kills
    for seed in study.seeds:
        twin = _twin(study, seed)
        for number, share in enumerate(stream(seed, "kill").random(study.kills)):
            run = partial(_trial, study, seed, number, float(share), twin)
            rows.append(perform(Trial.of(study.request(seed, f"killed-s{seed}-{number}"), run, _unexpected)))
            _write(study, rows)
            on_row(rows[-1], len(rows), total)
    return _write(study, rows)


def _write(study: KillStudy, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    write_table(study.out, "trials.csv", COLUMNS, rows)
    summary = summarise(rows) | study.described() | {"settings": dict(study.settings), "kills": study.kills}
    return write_summary(study.out, summary)


def summarise(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return rates over all kills; `outside` counts kills before the first checkpoint or after the end."""
    everything, rows = len(rows), [r for r in rows if r["outcome"] == "killed"]
    n = len(rows)

    def rate(key: str) -> Rate:
        return wilson(sum(bool(r.get(key)) for r in rows), n)

    readable = sum(bool(r["readable_after_kill"]) and bool(r["readable_at_end"]) for r in rows)
    return {
        "outside": everything - n,
        "same_end": rate("same_end"),
        "same_result": rate("same_result"),
        "same_record": rate("same_record"),
        "readable": wilson(readable, n),
        "at_most_the_running_skill_lost": wilson(sum(r.get("skill_lost") == 0 for r in rows), n),
        "lost_s": bootstrap_mean([r["lost_s"] for r in rows if r.get("lost_s") is not None]),
    }


def _twin(study: KillStudy, seed: int) -> Twin:
    folder = study.out / f"twin-s{seed}"
    request = study.request(seed, f"twin-s{seed}")
    times = perform(Trial.of(request, partial(_twin_times, study, seed, folder), _unexpected))
    return Twin(folder, json.loads((folder / "result.json").read_text()), times["began_s"], times["ended_s"])


def _unexpected(error: Exception) -> Row:
    raise error


def _twin_times(study: KillStudy, seed: int, folder: Path) -> Row:
    """Run a twin; return the CPU times of its process when the record began and when the result was written, s."""
    began_s = ended_s = 0.0
    with _start(study.run_words(seed, folder)) as process:
        while process.poll() is None:
            cpu_s = _cpu_s(process.pid)
            if cpu_s is not None:
                if not began_s and (folder / CHECKPOINT_FILE).is_file():
                    began_s = cpu_s
                if not (folder / "result.json").is_file():
                    ended_s = cpu_s
            _wait(process)
        said = b"" if process.stderr is None else process.stderr.read()
    if process.returncode not in (0, 1, 3):
        raise BadInput(said.decode().strip().removeprefix("glotouch: ") or "the twin did not run")
    return {"began_s": began_s, "ended_s": ended_s}


def _trial(study: KillStudy, seed: int, number: int, share: float, twin: Twin) -> dict[str, Any]:
    folder = study.out / f"killed-s{seed}-{number}"
    moment_s = twin.began_s + share * (twin.ended_s - twin.began_s)
    cpu_s = 0.0
    with _start(study.run_words(seed, folder)) as process:
        while process.poll() is None:
            cpu_s = _cpu_s(process.pid) or cpu_s
            if cpu_s >= moment_s:
                process.send_signal(signal.SIGKILL)
                break
            _wait(process)
    row: dict[str, Any] = {
        "seed": seed,
        "moment": round(share, 4),
        "killed_cpu_s": round(cpu_s, 2),
        "twin_cpu_s": round(twin.ended_s - twin.began_s, 2),
        "twin_status": twin.result["status"],
        "twin_retrieved": twin.result["retrieved"],
        "outcome": "killed" if process.returncode == -signal.SIGKILL else "ended before",
    }
    if row["outcome"] == "killed" and (folder / "result.json").exists():
        row["outcome"] = "ended before"  # it was closing already
    if not (folder / CHECKPOINT_FILE).exists():
        return row | {"outcome": "not begun"}
    row |= _after_kill(folder, twin)
    words = [*study.words, "resume", str(folder), *study.box, "--json"]
    done = subprocess.run(words, capture_output=True, env=_environment())
    row |= {"exit_code": done.returncode, "message": done.stderr.decode().strip()[-300:]}
    if row.get("checkpoint") is not None and row["checkpoint"] == row.get("checkpoints"):
        row["outcome"] = "ended before"
    return row | _at_end(folder, twin)


def _after_kill(folder: Path, twin: Twin) -> dict[str, Any]:
    """Describe what a killed process left behind."""
    row: dict[str, Any] = {"readable_after_kill": False, "skill_lost": None}
    record = _read(folder)
    row["readable_after_kill"] = record is not None
    try:
        file, whole = CheckpointFile(folder / CHECKPOINT_FILE), CheckpointFile(twin.folder / CHECKPOINT_FILE)
        rows, expected = file.rows(), whole.rows()
        file.close()
        whole.close()
    except GlotouchError:
        return row
    row |= {"checkpoint": rows[-1].number if rows else -1, "checkpoints": len(expected) - 1}
    if record is not None and rows and len(record.samples.get("stamp_s", ())):
        end_s = max(record.span_s[1], rows[-1].stamp_s)
        row["lost_s"] = round(end_s - rows[-1].stamp_s, 3)
        # a skill that ended in the record but has no checkpoint would be lost
        row["skill_lost"] = sum(r.number > rows[-1].number and r.stamp_s < end_s - 1e-6 for r in expected)
    return row


def _at_end(folder: Path, twin: Twin) -> dict[str, Any]:
    """Compare the end of the resumed run with its twin."""
    row: dict[str, Any] = {"same_end": False, "same_result": False, "readable_at_end": False, "same_record": False}
    record = _read(folder)
    row["readable_at_end"] = record is not None and record.complete
    try:
        result = json.loads((folder / "result.json").read_text())
    except (OSError, ValueError):
        return row
    row |= {"status": result["status"], "retrieved": result["retrieved"]}
    row["same_end"] = (result["status"], result["retrieved"]) == (twin.result["status"], twin.result["retrieved"])
    row["same_result"] = _told(result) == _told(twin.result)
    if record is not None:
        row["same_record"] = _same_record(record, read_run(twin.folder))
    return row


def _told(result: Mapping[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in result.items() if k not in ONLY_HERE}


def _same_record(a: RunRecord, b: RunRecord) -> bool:
    """Return True for equal samples (to the bit), ticks, ports and events."""
    arrays = all(
        mine.keys() == theirs.keys() and all(mine[k].tobytes() == theirs[k].tobytes() for k in mine)
        for mine, theirs in (
            (getattr(a, name), getattr(b, name))
            for name in ("samples", "cycles", "tactile", "images", "image_requests")
        )
    )
    told = [(json.dumps([vars(e) for e in x.events]), x.ticks, x.ports) for x in (a, b)]
    return arrays and told[0] == told[1]


def _read(folder: Path) -> RunRecord | None:
    try:
        return read_run(folder)
    except GlotouchError:
        return None


def _start(words: Sequence[str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=_environment())


def _wait(process: subprocess.Popen[bytes]) -> None:
    """Wait a moment, or until the process ends."""
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(POLL_S)


def _environment() -> dict[str, str]:
    return {**os.environ, "OMP_NUM_THREADS": "1"}


def _cpu_s(pid: int) -> float | None:
    """Return the user and system time of a process so far."""
    try:
        after_name = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return (int(after_name[11]) + int(after_name[12])) / os.sysconf("SC_CLK_TCK") if len(after_name) > 12 else None
