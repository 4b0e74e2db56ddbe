"""Functions shared by campaigns: gathering results, trial requests, and output files."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.escaped_text import finite, json_text
from glotouch_bt.robot import BadInput
from glotouch_bt.runs import Campaign, Task, WorkerLost, gather, write_summary, write_table

NAN, INF = float("nan"), float("inf")


def task(run: Callable[[], Any]) -> Task[Any]:
    return Task(run, lambda error: f"failed: {error}")


def raises(error: BaseException) -> Callable[[], Any]:
    def run() -> Any:
        raise error

    return run


def test_results_are_gathered_and_counted() -> None:
    told: list[tuple[int, int]] = []
    tasks = [task(partial(pow, 3, 2)), task(raises(KeyError("a bug"))), task(raises(ValueError("another")))]
    with ThreadPoolExecutor(1) as pool:
        found = gather(pool, tasks, lambda _, done, total: told.append((done, total)))
    assert sorted(found, key=str) == [9, "failed: 'a bug'", "failed: another"]
    assert told == [(1, 3), (2, 3), (3, 3)]


class Lost(Executor):
    """Gives futures that the test ends."""

    def __init__(self, *made: Future[Any]) -> None:
        self.made = list(made)

    def submit(self, *_: Any) -> Future[Any]:
        return self.made.pop(0)


@pytest.mark.parametrize("who", ["trial", "caller"])
def test_bad_input_or_an_interrupt_cancels_what_has_not_begun(who: str) -> None:
    first: Future[int] = Future()
    waiting: Future[int] = Future()
    if who == "trial":
        first.set_exception(BadInput("no such mission"))
    else:
        first.set_result(1)

    def refuse(*_: Any) -> None:
        raise KeyboardInterrupt

    with pytest.raises(BadInput if who == "trial" else KeyboardInterrupt):
        gather(Lost(first, waiting), [task(int)] * 2, refuse)
    assert waiting.cancelled()


def test_a_lost_process_is_the_failure_of_its_task() -> None:
    lost: Future[int] = Future()
    lost.set_exception(WorkerLost(-9))
    assert gather(Lost(lost), [task(int)]) == ["failed: its process was killed (SIGKILL)"]


def test_a_trial_takes_the_settings_of_its_campaign(tmp_path: Path) -> None:
    campaign = Campaign(mission="m", seeds=(1, 2), out=tmp_path, settings={"a": "1"}, backend="fake")
    request = campaign.request(2, "x-s2", report=False)
    assert (request.mission, request.seed, request.backend) == ("m", 2, "fake")
    assert (request.out, request.settings, request.report) == (tmp_path / "x-s2", {"a": "1"}, False)
    assert campaign.request(1, "y", settings={"b": "2"}).settings == {"b": "2"}
    assert campaign.described() == {"mission": "m", "conditions": "nominal", "seeds": [1, 2]}


def test_files_hold_null_for_what_is_no_number(tmp_path: Path) -> None:
    write_table(tmp_path / "new", "trials.csv", ("a", "b"), [{"a": 1, "c": 2}, {"b": "x, y"}])
    assert (tmp_path / "new" / "trials.csv").read_bytes() == b'a,b\r\n1,\r\n,"x, y"\r\n'
    write_summary(tmp_path, {"mean": NAN, "all": [1.5, INF, {"low": -INF}], "n": 3})
    written = json.loads((tmp_path / "summary.json").read_text())
    assert written == {"mean": None, "all": [1.5, None, {"low": None}], "n": 3}
    assert sorted(p.name for p in tmp_path.iterdir()) == ["new", "summary.json"]


def test_json_text_keeps_what_json_has() -> None:
    assert json.loads(json_text({"a": (1, 2.5, None, True), "b": "nan"})) == {"a": [1, 2.5, None, True], "b": "nan"}
    assert finite({"a": (NAN,)}) == {"a": [None]}
    with pytest.raises(TypeError):
        json_text({"a": Path("x")})
    assert json.loads(json_text({"a": Path("x")}, default=str)) == {"a": "x"}
