"""`bench compare`: pairs, what differs, unpaired trials, and bad input."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.bench.compare import compare_folders
from glotouch_bt.campaign import MANIFEST, TrialFolder
from glotouch_bt.robot import BadInput

MADE = {
    "campaign": "RetrieveCampaign",
    "code": {"glotouch_bt": "aaa"},
    "settings": {},
    "content": {"object apple": "1"},
}


def a_campaign(folder: Path, rows: dict[str, dict[str, Any]], **changes: Any) -> Path:
    folder.mkdir()
    (folder / MANIFEST).write_text(json.dumps({**MADE, **changes}))
    for name, row in rows.items():
        (folder / name).mkdir(parents=True)
        TrialFolder(folder / name).write({}, row)
    return folder


def a_row(seed: int, *, good: bool = True, sim_s: float | None = 200.0, **more: Any) -> dict[str, Any]:
    end = {"status": "success" if good else "failure", "correct": good, "retrieved": "apple" if good else None}
    return {"target": "apple", "seed": seed, "exit_code": 0 if good else 1, "sim_time_s": sim_s, **end, **more}


def test_pairs_differences_and_unpaired_trials(tmp_path: Path) -> None:
    a = a_campaign(tmp_path / "a", {f"apple-s{i}": a_row(i, sim_s=200.0 + i) for i in range(4)})
    rows = {f"apple-s{i}": a_row(i, good=i != 2, sim_s=210.0 + i) for i in (1, 2, 3, 9)}
    rows["apple-s3"]["sim_time_s"] = None
    b = a_campaign(tmp_path / "b", rows, code={"glotouch_bt": "bbb"}, settings={"press": "0"})
    found = compare_folders(a, b)
    assert found["differs"] == [
        {"what": "code: glotouch_bt", "a": "aaa", "b": "bbb"},
        {"what": "settings: press", "a": None, "b": "0"},
    ]
    assert found["pairs"] == 3
    (group,) = found["groups"].values()
    assert group["numbers"]["sim_time_s"]["difference"] == pytest.approx(10.0)
    assert group["numbers"]["sim_time_s"]["n"] == 2
    assert found["missing"] == {"sim_time_s": 1}
    success = group["rates"]["success"]
    assert (success["only_a"], success["only_b"], success["worlds"]) == (1, 0, 3)
    assert found["turned"] == {"only_a": ["apple-s2"], "only_b": []}
    assert found["unpaired"] == {"a": ["apple-s0"], "b": ["apple-s9"]}


def test_policies_and_methods_are_compared_apart(tmp_path: Path) -> None:
    def rows(found_m: float) -> dict[str, dict[str, Any]]:
        return {f"{p}-s1": {"policy": p, "simulator": "planar", "seed": 1, "discovered_m": [found_m]} for p in "xy"}

    found = compare_folders(a_campaign(tmp_path / "a", rows(2.0)), a_campaign(tmp_path / "b", rows(0.5)))
    assert list(found["groups"]) == ["planar x", "planar y"]
    numbers = found["groups"]["planar x"]["numbers"]
    assert [numbers[f"found_at_{d}_m"]["difference"] for d in (1, 3)] == [1.0, 0.0]


def test_decisions_within_a_trial_are_paired(tmp_path: Path) -> None:
    def row(right: bool) -> dict[str, Any]:
        decision = {"method": "likelihood", "kind": "present", "target": "apple", "right": right, "p_best": 0.5}
        return {"layout": {"seed": 4, "touched": 5}, "trials": [decision], "pairs": [], "closures": []}

    a, b = (a_campaign(tmp_path / n, {"layouts/s0004": row(n == "a")}) for n in "ab")
    group = compare_folders(a, b)["groups"]["likelihood present"]
    assert group["rates"]["right"]["only_a"] == 1
    assert group["numbers"]["p_best"]["difference"] == 0.0


def test_bad_input(tmp_path: Path) -> None:
    a = a_campaign(tmp_path / "a", {"x-s1": a_row(1)})
    other = a_campaign(tmp_path / "other", {"x-s1": a_row(1)}, campaign="SearchCampaign")
    apart = a_campaign(tmp_path / "apart", {"y-s1": a_row(1)})
    empty = a_campaign(tmp_path / "empty", {})
    for b, message in (
        (a, "compared with itself"),
        (other, "same bench"),
        (apart, "has a partner"),
        (empty, "no finished trial"),
        (tmp_path, "not the folder of a campaign"),
    ):
        with pytest.raises(BadInput, match=message):
            compare_folders(a, b)


@pytest.mark.parametrize("as_json", [False, True])
def test_the_command(as_json: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    a = a_campaign(tmp_path / "a", {f"apple-s{i}": a_row(i) for i in range(3)})
    b = a_campaign(tmp_path / "b", {f"apple-s{i}": a_row(i, good=i > 0) for i in range(4)}, backend="other")
    done = CliRunner().invoke(cli.app, ["bench", "compare", str(a), str(b), *(["--json"] if as_json else [])])
    assert done.exit_code == 0, done.output
    if as_json:
        assert json.loads(done.stdout)["pairs"] == 3
        return
    for text in (
        "what differs",
        "backend",
        "success",
        "McNemar p",
        "only in B: 1 (apple-s3)",
        "only in A: 1 (apple-s0)",
    ):
        assert text in done.stdout, text
    assert done.stdout.index("what differs") < done.stdout.index("McNemar p")
