"""A matcher and a search policy of another package run on the same layouts and TouchSets as ours."""

from __future__ import annotations

import json
import math
import shutil
import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from glotouch_bt import cli, plugins
from glotouch_bt.bench.match.methods import judge, methods
from glotouch_bt.campaign import code_versions
from glotouch_bt.perception.search import policy_names, search_policy
from glotouch_bt.robot import BadInput, UnknownName

SHIPPED = Path(__file__).parents[2] / "glotouch_missions" / "objects"
OUTSIDE = Path(__file__).parents[1] / "support" / "outside"
TOUCHED = [SimpleNamespace(candidate=SimpleNamespace(index=i)) for i in (4, 2, 7)]


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The other package as if it were installed; worker processes inherit the path."""
    monkeypatch.syspath_prepend(str(OUTSIDE))
    caches = (code_versions, search_policy, plugins.load_plugin)
    for cached in caches:
        cached.cache_clear()
    yield
    sys.modules.pop("outside_methods", None)
    for cached in caches:
        cached.cache_clear()


@pytest.mark.study
def test_an_outside_matcher_and_ours_on_the_same_touches(installed: None, tmp_path: Path) -> None:
    (tmp_path / "objects").mkdir()
    for name in ("apple", "train", "truck"):
        shutil.copy(SHIPPED / f"{name}.stl", tmp_path / "objects")
    words = ["--sampled", "--phases", "1", "--seed", "11", "--workers", "1", "--objects", str(tmp_path / "objects")]
    words += ["--method", "by_size", "--method", "likelihood"]
    done = CliRunner().invoke(cli.app, ["bench", "match", *words, "--out", str(tmp_path / "o"), "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)["methods"]
    assert {name: f["row_top1"]["n"] for name, f in found.items()} == {"by_size": 3, "likelihood": 3}
    assert found["by_size"]["row_top1"]["rate"] >= 0.6  # by chance: 0.33
    assert "outside_methods" in json.loads((tmp_path / "o" / "campaign.json").read_text())["code"]


@pytest.mark.study
def test_an_outside_policy_and_ours_on_the_same_layouts(installed: None, tmp_path: Path) -> None:
    words = ["--trials", "0", "--planar", "2", "--seed", "11", "--policies", "lawnmower,expected_find"]
    done = CliRunner().invoke(cli.app, ["bench", "search", *words, "--out", str(tmp_path / "o"), "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)["planar"]
    assert {name: f["mean_discovered"]["5"]["n"] for name, f in found.items()} == {"lawnmower": 2, "expected_find": 2}
    assert found["lawnmower"]["mean_discovered"]["5"]["mean"] >= 4


def test_names(installed: None) -> None:
    assert policy_names()[-1] == "lawnmower"
    assert "by_size" in methods()
    assert type(search_policy("lawnmower", 3)).__name__ == "Lawnmower"
    with pytest.raises(UnknownName, match="lawnmower"):
        search_policy("lawnmowr")


def point(name: str) -> EntryPoint:
    return EntryPoint(name, f"tests.bench.test_outside_methods:{name}", plugins.MATCHERS)


def half(mesh: object, touchsets: object) -> list[float]:
    return [0.25, 0.5, 0.0]


def sure(mesh: object, touchsets: object) -> list[float]:
    return [0.0, 0.05, 0.95]


def too_much(mesh: object, touchsets: object) -> list[float]:
    return [0.5, 0.5, 0.5]


def too_few(mesh: object, touchsets: object) -> list[float]:
    return [1.0]


NUMBER = 3


def test_probabilities_become_a_ranking() -> None:
    target = SimpleNamespace(mesh=None)
    ranking = judge(point("half"), target, TOUCHED)
    assert [m.index for m in ranking.matches] == [2, 4, 7]
    assert (ranking.accepted, ranking.p_absent) == (False, 0.25)
    assert ranking.best.loss == pytest.approx(math.log(2.0))
    assert judge(point("sure"), target, TOUCHED).accepted


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("too_much", "sum of at most 1"),
        ("too_few", "3 probabilities"),
        ("NUMBER", "is not callable"),
        ("gone", "cannot be imported: AttributeError"),
    ],
)
def test_what_is_no_matcher_is_refused(name: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        judge(point(name), SimpleNamespace(mesh=None), TOUCHED)
