"""`bench all`: the table of figures, its commands, running and continuing them, and their publication."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import typer
import yaml
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.campaign import commit_of_source
from glotouch_bt.claims import chosen, collect, read_claims, run, run_claims, scaled
from glotouch_bt.commands.bench import bench
from glotouch_bt.robot import BadInput, UnknownName

ROOT = Path(__file__).parents[2]
ENTRY = {
    "section": "S", "order": 1, "title": "T", "claim": "C", "conditions": "none",
    "rows": [{"label": "n", "at": "n"}],
}  # fmt: skip


def a_table(folder: Path, **commands: object) -> Path:
    """A table whose entries have these commands (or further keys)."""
    entries = {n: ENTRY | (c if isinstance(c, dict) else {"commands": c}) for n, c in commands.items()}
    path = folder / "table.yaml"
    path.write_text(yaml.safe_dump(entries, sort_keys=False))
    return path


def says(text: str) -> str:
    """A command that prints JSON; braces are doubled, because commands have placeholders."""
    return f"python -c {shlex.quote(text)}".replace("{", "{{").replace("}", "}}")


GOOD = says("print('{\"n\": 3}')")


def test_every_command_of_the_table_is_understood() -> None:
    """Options exist, numbers scale, scripts exist, and the whole and the small version differ in their seeds."""
    group = typer.main.get_command(bench)
    for name, claim in read_claims().items():
        for line in (*claim.lines(), *claim.lines(0.01)):
            words = [w for w in shlex.split(line) if not w.startswith("OMP_")]
            if words[:2] == ["glotouch", "bench"]:
                command = vars(group)["commands"][words[2]]
                part = claim.parts.get(next(iter(claim.parts), ""), "")
                text = [w.replace("{part}", part) for w in words[3:]]
                flat = [x for w in text for x in shlex.split(w)] if claim.parts else text
                command.make_context(words[2], [w.format(objects="o", out="o") for w in flat])
            elif words[0] == "python" and words[1].endswith(".py"):
                assert (ROOT / words[1]).is_file(), name
        assert claim.uses or claim.minutes > 0, name


def test_figures_on_the_page_are_in_the_table_or_older() -> None:
    known = read_claims()
    for meta in ROOT.glob("docs/results/*/meta.yaml"):
        found = yaml.safe_load(meta.read_text())
        assert meta.parent.name in known or found.get("older"), meta


def test_scale() -> None:
    line = "glotouch bench x --trials 100 --seed 7 --planar 0 --per-seed 2 {out}/y"
    assert scaled(line, 1.0) == line
    assert scaled(line, 0.011) == "glotouch bench x --trials 2 --seed 1000007 --planar 0 --per-seed 2 {out}/y"
    for wrong in (0.0, -1.0, 1.5, float("nan")):
        with pytest.raises(BadInput, match="--scale"):
            scaled(line, wrong)


def test_a_used_campaign_is_chosen() -> None:
    claims = read_claims()
    assert list(chosen(claims, ["match_paper"])) == ["match_five_nominal"]
    with pytest.raises(UnknownName, match="retrieve_nominal"):
        chosen(claims, ["retrieve_nominl"])


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"commands": "x", "uses": "b"}, "either commands or uses"),
        ({"uses": "gone"}, "no entry with commands"),
        ({"commands": "x", "orde": 2}, "orde"),
    ],
)
def test_wrong_tables_are_refused(entry: dict[str, object], message: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=message):
        read_claims(a_table(tmp_path, a=entry))


def test_parts_failures_and_continuation(tmp_path: Path) -> None:
    """One claim fails and the others go on; the same call repeats only the failed one."""
    flag = tmp_path / "flag"
    flaky = says(f"import os, sys; print('{{\"n\": 4}}'); sys.exit(0 if os.path.exists({str(flag)!r}) else 3)")
    parts = {
        "commands": 'python -c \'print("{{}}" if 0 else "[{part}]".replace("[", "{{\\"n\\": ").replace("]", "}}"))\''
    }
    parts["parts"] = {"one": "1", "two": "2"}
    claims = read_claims(a_table(tmp_path, bad=flaky, good=GOOD, several=parts))
    lines: list[str] = []

    def go() -> list[tuple[str, bool, bool]]:
        ends = run_claims(claims, tmp_path / "o", on_start=lambda name, line: lines.append(name))
        return [(e.name, bool(e.failed), e.before) for e in ends]

    assert go() == [("bad", True, False), ("good", False, False), ("several", False, False)]
    flag.touch()
    assert go() == [("bad", False, False), ("good", False, True), ("several", False, True)]
    assert lines == ["bad", "good", "several", "several", "bad"]
    summaries = {n: json.loads((tmp_path / "o" / n / "summary.json").read_text()) for n in claims}
    assert summaries == {"bad": {"n": 4}, "good": {"n": 3}, "several": {"one": {"n": 1}, "two": {"n": 2}}}


def test_other_code_or_another_scale_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    claims = read_claims(a_table(tmp_path, a=GOOD))
    run_claims(claims, tmp_path / "o")
    with pytest.raises(BadInput, match=r"scale 1\.0, now 0\.5"):
        run_claims(claims, tmp_path / "o", scale=0.5)
    with pytest.raises(BadInput, match="other commands"):
        run_claims(read_claims(a_table(tmp_path, a=GOOD + " x")), tmp_path / "o")
    monkeypatch.setattr(run, "described_code", lambda: {"code": "other"})
    with pytest.raises(BadInput, match="another campaign"):
        run_claims(claims, tmp_path / "o")


def test_ctrl_c_ends_the_command_and_keeps_what_is_done(tmp_path: Path) -> None:
    slow = says(
        "import time\ntry:\n    time.sleep(60)\nexcept KeyboardInterrupt:\n"
        "    open('ended', 'w')\n    raise SystemExit(130)"
    )
    table = a_table(tmp_path, first=GOOD, second=slow)
    words = [
        sys.executable,
        "-m",
        "glotouch_bt.cli",
        "bench",
        "all",
        "--table",
        str(table),
        "--out",
        str(tmp_path / "o"),
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(words, cwd=tmp_path, env=environment, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    for line in process.stderr:
        if "second:" in line:
            break
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) == 130
    process.stderr.close()
    assert (tmp_path / "ended").exists()
    assert (tmp_path / "o" / "first" / "done.json").exists()
    assert not (tmp_path / "o" / "second" / "done.json").exists()


@pytest.mark.study
def test_a_real_bench_is_made_small_and_listed(tmp_path: Path) -> None:
    runner = CliRunner()
    words = ["bench", "all", "--out", str(tmp_path / "o"), "--only", "check", "--scale", "0.01"]
    done = runner.invoke(cli.app, words)
    assert done.exit_code == 0, done.output
    assert "[1/1] check: glotouch bench check --out" in done.stderr
    rows = json.loads(runner.invoke(cli.app, [*words, "--list", "--json"]).stdout)
    assert [(r["name"], r["done"], r["commands"]) for r in rows] == [("check", True, ["glotouch bench check"])]
    refused = runner.invoke(cli.app, ["bench", "all", "--out", str(tmp_path / "o"), "--collect", str(tmp_path)])
    assert refused.exit_code == 2
    assert "measure without --scale" in refused.stderr


def test_collect_fills_in_how_a_figure_was_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = tmp_path / "results"
    (results / "old").mkdir(parents=True)
    (results / "old" / "meta.yaml").write_text("command: x\ncommit: abc\nconditions: c\nseeds: 1-2\nnotes: [n]\n")
    line = says("import json; print(json.dumps(dict(n=3, seeds=[5, 6, 7])))") + " --seed 5"
    claims = read_claims(a_table(tmp_path, a=line, b=GOOD + " --seed 4 --trials 3", c={"uses": "a"}, d=GOOD))
    monkeypatch.setattr(run, "commit_of_source", lambda: "def1234")
    run_claims({n: claims[n] for n in ("a", "b")}, tmp_path / "o")
    assert collect(claims, tmp_path / "o", results) == (["a", "b"], ["d"])
    metas = {p.parent.name: yaml.safe_load(p.read_text()) for p in results.glob("*/meta.yaml")}
    assert {n: (m["commit"], m["seeds"], m.get("older")) for n, m in metas.items()} == {
        "a": ("def1234", "5-7", None),
        "b": ("def1234", "4-6", None),
        "c": ("def1234", "5-7", None),
        "old": ("abc", "1-2", True),
    }
    assert json.loads((results / "a" / "summary.json").read_text())["n"] == 3
    assert not (results / "c" / "summary.json").exists()


def test_collect_wants_a_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    claims = read_claims(a_table(tmp_path, a=GOOD))
    monkeypatch.setattr(run, "commit_of_source", lambda: "def1234 (changed)")
    run_claims(claims, tmp_path / "o")
    with pytest.raises(BadInput, match="commit"):
        collect(claims, tmp_path / "o", tmp_path)
    with pytest.raises(BadInput, match="docs/results"):
        collect(claims, tmp_path / "o", tmp_path / "gone")


def test_the_commit_of_the_source_is_named() -> None:
    assert commit_of_source()
