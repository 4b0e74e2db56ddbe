"""A finished trial of a campaign is reused for the same request only; an interrupted one is none."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from glotouch_bt.campaign import Campaign, Trial, run_trials
from glotouch_bt.campaign import trial as trials
from glotouch_bt.faults import read_plan
from glotouch_bt.mission.read import shipped_root
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import stl_files
from glotouch_bt.runs import RunRequest

MISSION = "mission: m\nworld: container_five\ntimeout_s: 60\ntree: [tool_pickup, tool_return]\n"


@pytest.fixture
def request_(tmp_path: Path) -> RunRequest:
    objects = tmp_path / "objects"
    objects.mkdir()
    for name, file in list(stl_files(shipped_root() / "objects").items())[:2]:
        shutil.copyfile(file, objects / f"{name}.stl")
    (tmp_path / "m.yaml").write_text(MISSION)
    (tmp_path / "c.yaml").write_text("name: c\nforce_noise_sd_N: 0.1\n")
    conditions = str(tmp_path / "c.yaml")
    return RunRequest(str(tmp_path / "m.yaml"), "fake", 3, {}, objects, conditions, tmp_path / "out" / "trial")


def trial(request: RunRequest, run: Callable[[], dict[str, Any]] = lambda: {"n": 1}) -> Trial:
    return Trial.of(request, run, lambda error: {"failed": str(error)})


def rows(trial: Trial, resume: bool = True) -> list[dict[str, Any]]:
    campaign = Campaign(mission="m", seeds=(), out=trial.folder.parent, resume=resume)
    with ThreadPoolExecutor(1) as pool:
        return run_trials(pool, [trial], campaign)


def forget_contents() -> None:
    from glotouch_bt.campaign import identity

    identity._content.cache_clear()


def test_a_finished_trial_is_kept(request_: RunRequest) -> None:
    assert rows(trial(request_)) == [{"n": 1}]
    assert rows(trial(request_, lambda: {"n": 2})) == [{"n": 1}]
    with pytest.raises(BadInput, match=r"already holds trials \(1\); add --resume"):
        rows(trial(request_, lambda: {"n": 2}), resume=False)


def change_objects(request: RunRequest) -> RunRequest:
    assert request.objects is not None
    first = next(iter(request.objects.iterdir()))
    first.write_bytes(b"another header" + first.read_bytes()[14:])
    return request


def change_mission(request: RunRequest) -> RunRequest:
    Path(request.mission).write_text(MISSION.replace("60", "61"))
    return request


def change_conditions(request: RunRequest) -> RunRequest:
    Path(request.conditions).write_text("name: c\nforce_noise_sd_N: 0.2\n")
    return request


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda r: replace(r, conditions="harsh"), "conditions "),
        (lambda r: replace(r, world="lying_five"), "content of world "),
        (lambda r: replace(r, backend="mujoco"), 'backend "fake", now "mujoco"'),
        (lambda r: replace(r, seed=4), "seed 3, now 4"),
        (lambda r: replace(r, settings={"devices": "x"}), 'settings: devices none, now "x"'),
        (lambda r: replace(r, faults=read_plan("weak_grip")), "faults none, now "),
        (change_objects, "content of object "),
        (change_mission, "content of mission "),
        (change_conditions, "content of conditions "),
    ],
)
def test_another_request_is_refused_with_the_difference(
    change: Callable[[RunRequest], RunRequest], said: str, request_: RunRequest
) -> None:
    rows(trial(request_))
    changed = change(request_)
    forget_contents()
    with pytest.raises(BadInput, match="holds a trial that was made otherwise") as refused:
        rows(trial(changed))
    assert said in str(refused.value)


def test_an_interrupted_trial_is_none(request_: RunRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that Ctrl-C ended has a result, which does not count; it is run again."""
    ended = SimpleNamespace(outcome=SimpleNamespace(error=KeyboardInterrupt()), result={"status": "aborted"})
    monkeypatch.setattr(trials, "launch", lambda request: ended)
    with pytest.raises(KeyboardInterrupt):
        rows(trial(request_, lambda: trials.launch_trial(request_).result))
    assert rows(trial(request_, lambda: {"n": 3})) == [{"n": 3}]


def test_an_error_is_a_row_that_counts_again(request_: RunRequest) -> None:
    def bug() -> dict[str, Any]:
        raise KeyError("a bug")

    assert rows(trial(request_, bug)) == [{"failed": "'a bug'"}]
    assert rows(trial(request_)) == [{"failed": "'a bug'"}]


def test_a_wrong_request_ends_the_campaign_and_a_record_that_cannot_be_scored_fails_its_trial(
    request_: RunRequest,
) -> None:
    """The same error before and after the run."""

    def score(n: int) -> dict[str, Any]:
        raise BadInput("two contacts")

    def run() -> dict[str, Any]:
        return score(len(trials.launch_trial(request_).result))

    with pytest.raises(BadInput, match="two contacts"):
        rows(trial(request_, lambda: score(0)))
    assert rows(trial(request_, run)) == [{"failed": "two contacts"}]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"request": {}}', '{"request": 1, "row": {}}'])
def test_a_broken_file_is_no_trial(text: str, request_: RunRequest) -> None:
    rows(trial(request_))
    assert request_.out is not None
    (request_.out / "trial.json").write_text(text)
    with pytest.raises(BadInput, match=r"trial\.json: is "):
        rows(trial(request_))
