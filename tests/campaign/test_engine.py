"""The engine: claims, retries, limits, refused mixing, shards, Ctrl-C, and several commands on one folder."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.campaign import Claimed, Shard, ShardDone, Trial, WorkerPool, engine, identity, perform, trial_folder
from glotouch_bt.campaign.trial_folder import TrialFolder, claimed
from glotouch_bt.robot import BadInput
from tests.support.short_trials import run_short, short_campaign, short_trials


def journal(out: Path) -> list[str]:
    return [line.split()[0] for line in (out / "journal").read_text().splitlines()]


def rows_of(out: Path, kinds: dict[int, str], count: int = 4, limit_s: float = 60.0, **given: Any) -> list[Any]:
    campaign = short_campaign(out, **given)
    with WorkerPool(1, limit_s) as pool:
        return run_short(campaign, pool, short_trials(campaign, count, 10, kinds))


def test_trials_that_die_or_find_a_full_disk_are_tried_three_times(tmp_path: Path) -> None:
    kinds = {0: "kill", 1: "full", 2: "kill once", 3: "full once", 4: "raise"}
    rows = rows_of(tmp_path, kinds, count=6)
    assert [r["cause"] for r in rows] == [
        "lost: its process was killed (SIGKILL)",
        "lost: its files could not be written (No space left on device)",
        "",
        "",
        "traceback KeyError: 'a bug'",
        "",
    ]
    assert journal(tmp_path).count("begin") == 3 + 3 + 2 + 2 + 1 + 1
    assert len(TrialFolder(tmp_path / "t0000").lost()) == 3
    assert repr(rows_of(tmp_path, {}, count=6, resume=True)) == repr(rows), "nothing is run again"
    assert journal(tmp_path).count("begin") == 12


def test_a_trial_that_hangs_is_a_failure_with_its_cause(tmp_path: Path) -> None:
    rows = rows_of(tmp_path, {0: "hang"}, count=2, limit_s=1.0)
    assert [r["cause"] for r in rows] == ["lost: it hung: no result after 1 s", ""]


def test_a_claim_is_of_one_process_and_ends_with_it(tmp_path: Path) -> None:
    script = "import sys,threading\nfrom pathlib import Path\nfrom glotouch_bt.campaign.trial_folder import claimed\n"
    script += f"with claimed(Path({str(tmp_path)!r})):\n    print('mine', flush=True)\n    threading.Event().wait()"
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) as owner:
        assert owner.stdout is not None
        owner.stdout.readline()
        with pytest.raises(Claimed, match=f"another process runs this trial .* process {owner.pid}"), claimed(tmp_path):
            pass
        owner.kill()
    with claimed(tmp_path) as before:
        assert before


def test_many_threads_on_one_trial_run_it_once(tmp_path: Path) -> None:
    campaign = short_campaign(tmp_path)
    campaign.open()
    (trial,) = short_trials(campaign, 1, 1000)

    def attempt(_: int) -> str:
        try:
            return str(perform(trial)["digest"])
        except Claimed:
            return "claimed"

    with ThreadPoolExecutor(8) as pool:
        found = set(pool.map(attempt, range(40)))
    assert len(found - {"claimed"}) == 1
    assert journal(tmp_path) == ["begin", "end"]


def test_two_commands_share_the_trials_of_one_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "POLL_S", 0.02)
    campaign = short_campaign(tmp_path, resume=True)
    trials = short_trials(campaign, 30, 2000)

    def command(_: int) -> list[Any]:
        with ThreadPoolExecutor(2) as pool:
            return run_short(campaign, pool, trials)

    with ThreadPoolExecutor(2) as commands:
        one, two = commands.map(command, range(2))
    assert [r["digest"] for r in one] == [r["digest"] for r in two]
    assert journal(tmp_path).count("begin") == journal(tmp_path).count("end") == 30


@pytest.mark.study
def test_the_shards_are_the_whole(tmp_path: Path) -> None:
    whole = rows_of(tmp_path / "whole", {}, count=7)
    for index in (1, 2, 3):
        done = pytest.raises(ShardDone, match=r"trials of this shard are done; \d of 7")
        with done if index < 3 else nullcontext():
            rows_of(tmp_path / "parts", {}, count=7, shard=Shard(index, 3))
    assert repr(rows_of(tmp_path / "parts", {}, count=7, resume=True)) == repr(whole)
    tables = [(tmp_path / name / "trials.csv").read_bytes() for name in ("whole", "parts")]
    assert tables[0] == tables[1]
    assert journal(tmp_path / "parts").count("begin") == 7


@pytest.mark.parametrize("text", ["0/3", "4/3", "1", "a/b", "1/0", "-1/2"])
def test_a_shard_is_i_of_n(text: str) -> None:
    assert Shard.parse("2/8") == Shard(2, 8)
    with pytest.raises(BadInput, match="must be I/N"):
        Shard.parse(text)


def test_another_campaign_is_refused_with_the_difference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows_of(tmp_path, {}, count=1)
    for changes, told in (
        ({"conditions": "harsh"}, 'conditions "nominal", now "harsh"'),
        ({"settings": {"a": "1"}}, 'settings: a none, now "1"'),
        ({"backend": "mujoco"}, 'backend "fake", now "mujoco"'),
    ):
        with pytest.raises(BadInput, match="holds another campaign") as refused:
            replace(short_campaign(tmp_path, resume=True), **changes).open()
        assert told in str(refused.value)
    now = identity.code_versions() | {"glotouch_bt": "other"}
    monkeypatch.setattr(identity, "code_versions", lambda: now)
    with pytest.raises(BadInput, match=r'code: glotouch_bt "[0-9a-f]{16}", now "other"'):
        short_campaign(tmp_path, resume=True).open()
    with pytest.raises(BadInput, match=r"already holds trials \(1\); add --resume"):
        short_campaign(tmp_path).open()


def test_a_worker_with_other_code_is_refused(tmp_path: Path) -> None:
    trial = Trial(tmp_path / "t", {"code": {"glotouch_bt": "0" * 16}}, dict, lambda error: {})
    with pytest.raises(BadInput, match=r"this worker has other code than the command: .*glotouch_bt"):
        perform(trial)


def test_a_disk_that_takes_no_result_loses_no_trial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The row counts in this command although no file has it; a later command runs the trial again."""
    campaign = short_campaign(tmp_path)
    trials = short_trials(campaign, 2, 10)

    def full(folder: Any, name: str, text: str) -> None:
        if name == "trial.json" and folder.path.name == "t0001":
            try:
                raise OSError(errno.ENOSPC, "No space left on device")
            except OSError as e:
                raise trial_folder.GlotouchError(f"{name}: cannot be written ({e.strerror})") from e
        write(folder, name, text)

    write = trial_folder.RunFolder.write_text
    monkeypatch.setattr(trial_folder.RunFolder, "write_text", full)
    with ThreadPoolExecutor(1) as pool:
        rows = run_short(campaign, pool, trials)
    assert [r["cause"] for r in rows] == ["", "lost: its files could not be written (No space left on device)"]
    monkeypatch.undo()
    (tmp_path / "t0001" / ".lost.json").unlink()
    assert [r["cause"] for r in rows_of(tmp_path, {}, count=2, resume=True)] == ["", ""]
    assert journal(tmp_path).count("end") == 5


def test_a_row_is_kept_to_the_bit(tmp_path: Path) -> None:
    row = {"a": [float("nan"), -float("inf"), 0.1], "b": {"c": (1, None, True, "é")}}
    kept = TrialFolder(tmp_path).write({"x": 1}, row)
    again = TrialFolder(tmp_path).read({"x": 1})
    assert repr(kept) == repr(again) == "{'a': [nan, -inf, 0.1], 'b': {'c': [1, None, True, 'é']}}"
    json.loads((tmp_path / "trial.json").read_text(), parse_constant=pytest.fail)


SCRIPT = """
import sys
from pathlib import Path
from glotouch_bt.campaign import WorkerPool
from tests.support.short_trials import run_short, short_campaign, short_trials

if __name__ == "__main__":
    campaign = short_campaign(Path(sys.argv[1]), resume=True)
    try:
        with WorkerPool(2) as pool:
            run_short(campaign, pool, short_trials(campaign, 40, int(sys.argv[2])), lambda *_: print("row", flush=True))
    except KeyboardInterrupt:
        sys.exit(130)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_an_ended_command_leaves_all_that_is_done(tmp_path: Path, number: int) -> None:
    script, out = tmp_path / "script.py", tmp_path / "out"
    script.write_text(SCRIPT)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), *sys.path])}
    words = [sys.executable, str(script), str(out)]
    with subprocess.Popen([*words, "50000"], stdout=subprocess.PIPE, env=environment) as command:
        assert command.stdout is not None
        command.stdout.readline()
        command.send_signal(number)
        command.communicate(timeout=30)
    assert command.returncode == (130 if number == signal.SIGINT else -number)
    done = len(list(out.glob("t*/trial.json")))
    assert 1 <= done < 40
    if number == signal.SIGINT:
        rows = len((out / "trials.csv").read_text().splitlines()) - 1
        assert max(1, done - 2) <= rows <= done  # each of two workers may end a trial after the table was written
    threading.Event().wait(0.2)
    again = subprocess.run([*words, "50000"], stdout=subprocess.PIPE, env=environment, check=True)
    assert again.stdout.count(b"row") == 40 - done
    assert len((out / "trials.csv").read_text().splitlines()) == 41
