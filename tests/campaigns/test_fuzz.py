"""`bench fuzz`: the same documents each time, every class of damage noticed by the watch, few trials for real."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.campaign import WorkerLost
from glotouch_bt.validation.fuzz import campaign as campaign_module
from glotouch_bt.validation.fuzz import missions as missions_module
from glotouch_bt.validation.fuzz import trial as trial_module
from glotouch_bt.validation.fuzz.campaign import KINDS, FuzzCampaign, run_campaign
from glotouch_bt.validation.fuzz.corrupt import ODD_VALUES
from glotouch_bt.validation.fuzz.kind import BAD, FuzzKind
from glotouch_bt.validation.fuzz.missions import document_of
from glotouch_bt.validation.fuzz.trial import Result, run_inputs, stream_of

SEED = 7
MISSIONS = KINDS["missions"]


def drawn(seed: int, n: int) -> tuple[str, bytes]:
    return document_of(stream_of(seed, n))


@pytest.fixture(scope="module", autouse=True)
def limits() -> Iterator[None]:
    """Give back the memory and the bytecode that a trial's watch denies its process."""
    memory, bytecode = resource.getrlimit(resource.RLIMIT_AS), sys.dont_write_bytecode
    yield
    resource.setrlimit(resource.RLIMIT_AS, memory)
    sys.dont_write_bytecode = bytecode


def test_a_trial_is_the_same_whenever_it_is_made() -> None:
    for n in range(60):
        assert drawn(SEED, n) == drawn(SEED, n)


@pytest.mark.study
def test_a_document_does_not_depend_on_those_before_it() -> None:
    before = deepcopy(ODD_VALUES)
    first = [drawn(1, n)[1] for n in range(1500)]
    assert repr(before) == repr(ODD_VALUES)
    assert first == [drawn(1, n)[1] for n in range(1500)]


def test_documents_are_of_both_kinds_and_in_all_states() -> None:
    """Each within the first few thousand; which ones have it changes with every skill and fault that is added."""
    missing = {"tags", "anchors", "deep nesting", "a mission", "a fault plan"}
    pickups = 0
    for n in range(5000):
        kind, text = drawn(SEED, n)
        found = {
            "tags": b"!!python" in text,
            "anchors": b"&a" in text,
            "deep nesting": b"[" * 20 in text or b"- " * 20 in text,
            "a mission": kind == "mission",
            "a fault plan": kind == "fault plan",
        }
        missing -= {name for name, there in found.items() if there}
        pickups += b"tool_pickup" in text
        if not missing and pickups > 20:
            return
    pytest.fail(f"never drawn: {missing}; {pickups} documents with a skill of this project")


@pytest.mark.study
@pytest.mark.parametrize(
    ("kind", "trials", "some"),
    [
        ("missions", 60, {"refused unread", "refused with places"}),
        ("meshes", 60, {"accepted", "refused with places"}),
        ("runs", 16, {"accepted", "refused unread"}),
    ],
)
def test_nothing_bad_comes_of_some_of_them(kind: str, trials: int, some: set[str]) -> None:
    results = run_inputs(KINDS[kind], SEED, range(trials))
    assert [(r.number, r.came, r.detail) for r in results if r.came in BAD] == []
    assert some <= {r.came for r in results}


@pytest.fixture
def broken_check(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Lets a test say what reading a mission does."""
    run_inputs(MISSIONS, SEED, [])  # the missions made in advance are sound
    monkeypatch.setattr(trial_module, "MAX_DURATION_S", 0.3)
    return monkeypatch


def missions(n: int) -> list[int]:
    return [i for i in range(60) if drawn(SEED, i)[0] == "mission"][:n]


def bug(path: object, settings: object) -> None:
    raise KeyError("a bug")


def endless(path: object, settings: object) -> None:
    while True:
        pass


def starts_a_process(path: object, settings: object) -> None:
    subprocess.run([sys.executable, "-c", ""], check=True)


def writes_a_file(path: Path, settings: object) -> None:
    (path.parent / "left").write_text("x")


def runs_text(path: Path, settings: object) -> None:
    compile("'glotouch_fuzz_canary'", "a document", "eval")


@pytest.mark.parametrize(
    ("what", "came"),
    [(bug, "traceback"), (endless, "hang"), (starts_a_process, "code run"), (writes_a_file, "code run"),
     (runs_text, "code run")],
)  # fmt: skip
def test_what_must_not_happen_is_noticed(broken_check: pytest.MonkeyPatch, what: object, came: str) -> None:
    broken_check.setattr(missions_module, "load_mission", what)
    (result,) = run_inputs(MISSIONS, SEED, missions(1))
    assert result.came == came


def test_a_kind_that_writes_does_so_below_its_folder_only(tmp_path: Path) -> None:
    class Writes(FuzzKind):
        name, description, writes = "writes", "", True

        def make(self, rng: object, folder: Path) -> str:
            return "file"

        def attempt(self, sort: str, folder: Path, rng: object) -> tuple[Any, str]:
            (folder / "inside").write_text("x")
            (folder / "inside").rename(folder / "renamed")
            (tmp_path / "outside").write_text("x")
            return "accepted", ""

    (result,) = run_inputs(Writes(), SEED, [0])
    assert result.came == "code run"
    assert result.detail.splitlines() == [f"open {str(tmp_path / 'outside')!r} w"]


def test_a_campaign_counts_and_keeps_what_broke(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that dies costs no result: its trials are run one by one."""

    def made(kind: FuzzKind, seed: int, numbers: tuple[int, ...]) -> list[Result]:
        if 70 in numbers:
            raise WorkerLost(-9)
        return [Result(n, "mission", "traceback" if n == 3 else "ran to success", "why") for n in numbers]

    monkeypatch.setattr(campaign_module, "run_inputs", made)
    with ThreadPoolExecutor(1) as pool:
        summary = run_campaign(FuzzCampaign(120, SEED, tmp_path / "out"), pool)
    assert summary["counts"] == {"mission": {"ran to success": 118, "traceback": 1}, "unknown": {"process died": 1}}
    found = json.loads((tmp_path / "out/summary.json").read_text())["failures"]
    assert [(f["trial"], f["detail"]) for f in found] == [(3, "why"), (70, "its process was killed (SIGKILL)")]
    assert (tmp_path / "out/failures/traceback-3/m.yaml").read_bytes() == drawn(SEED, 3)[1]
    assert (tmp_path / "out/failures/process_died-70/m.yaml").read_bytes() == drawn(SEED, 70)[1]
