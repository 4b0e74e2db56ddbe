"""A mission from a stranger: it shows no file of the user, and no name of it reaches a terminal unseen."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.faults import read_plan
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.spec import Finding
from glotouch_bt.robot import BadInput

HEAD = "mission: m\nworld: worlds/container_five.yaml\n"
SECRET = "root: hunter2\nlogin: hunter2\n"
SECRETS = (SECRET, "hunter2", "- hunter2\n", "a: &hunter2 1\n", "a: !hunter2 1\n", "hunter2: 1\nhunter2: 1\n",
           "a: *hunter2\n", "a: 1e999\nb: hunter2\n", "tree: hunter2: x\n")  # fmt: skip


def checked(folder: Path, *more: str) -> str:
    done = CliRunner().invoke(cli.app, ["check", str(folder / "m" / "m.yaml"), *more])
    assert done.exit_code == 2, done.output
    assert "Traceback" not in done.output
    return done.output


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "m").mkdir()
    (tmp_path / "x.yaml").write_text(SECRET)
    (tmp_path / "m" / "link.yaml").symlink_to("../x.yaml")
    (tmp_path / "m" / "round.yaml").symlink_to("round.yaml")
    return tmp_path


@pytest.mark.parametrize(
    "name", ["/etc/shadow", "../x.yaml", "../../x", "link.yaml", "~/x.yaml/../../../x", "/dev/zero"]
)
def test_a_subtree_stays_in_the_missions_folder(name: str, folder: Path) -> None:
    (folder / "m" / "m.yaml").write_text(f"{HEAD}tree:\n  subtree: {{file: '{name}'}}\n")
    said = checked(folder)
    assert "[subtree_outside]" in said
    assert "hunter2" not in said


def test_links_in_a_circle_are_a_finding(folder: Path) -> None:
    (folder / "m" / "m.yaml").write_text(f"{HEAD}tree:\n  subtree: {{file: round.yaml}}\n")
    assert "[unusable_subtree]" in checked(folder)


def test_the_user_may_allow_a_folder(folder: Path) -> None:
    (folder / "common").mkdir()
    (folder / "common" / "hold.yaml").write_text("subtree: hold\ntree: bare_hand\n")
    (folder / "m" / "m.yaml").write_text(f"{HEAD}tree:\n  subtree: {{file: ../common/hold.yaml}}\n")
    checked(folder)
    with pytest.raises(BadInput, match="outside of the mission's folder"):
        load_mission(folder / "m" / "m.yaml")
    mission = load_mission(folder / "m" / "m.yaml", allow_paths=[folder / "common"])
    assert [n.name for n in mission.spec.walk()] == ["hold", "bare_hand"]
    words = ["check", str(folder / "m" / "m.yaml"), "--allow-path", str(folder / "common")]
    assert CliRunner().invoke(cli.app, words).exit_code == 0


@pytest.mark.parametrize("secret", SECRETS)
@pytest.mark.parametrize("use", ["world: pw.yaml\ntree: bare_hand\n", HEAD[11:] + "tree: {subtree: {file: pw.yaml}}\n"])
def test_no_message_quotes_a_file_that_is_no_mission(secret: str, use: str, folder: Path) -> None:
    (folder / "m" / "pw.yaml").write_text(secret)
    (folder / "m" / "m.yaml").write_text("mission: m\n" + use)
    for more in ((), ("--json",)):
        said = checked(folder, *more)
        assert "hunter2" not in said
        assert "pw.yaml" in said


def test_a_file_that_is_no_mission_is_not_quoted_either(folder: Path) -> None:
    (folder / "m" / "m.yaml").write_text(SECRET)
    assert "hunter2" not in checked(folder)


ODD_NAMES = ['"a\\e[31mb"', '"\\e]8;;http://x\\a"', '"a\\u202eb"', '"a\\u0085b"', '"a\\nb"']


@pytest.mark.parametrize("name", ODD_NAMES)
@pytest.mark.parametrize(
    "text",
    [
        HEAD + "tree:\n  - bare_hand: {name: NAME}\n",
        HEAD + "tree:\n  - sequence: {name: NAME, do: [bare_hand]}\n",
        HEAD + "tree:\n  - subtree: {file: NAME}\n",
        HEAD + "tree: {subtree: {file: NAME}}\nsubtrees:\n  NAME: {tree: bare_hand}\n",
        HEAD + "tree: bare_hand\nparameters:\n  NAME: {type: int, default: 1}\n",
        HEAD + "tree: bare_hand\nleaves: {NAME: empty}\n",
        HEAD.replace("mission: m", "mission: NAME") + "tree: bare_hand\n",
        "mission: m\nworld: NAME\ntree: bare_hand\n",
    ],
)
def test_a_name_with_control_characters_is_refused(name: str, text: str, folder: Path) -> None:
    (folder / "m" / "m.yaml").write_text(text.replace("NAME", name))
    said = checked(folder)
    assert not any(c in said for c in ("\x1b", "\x07", "\u202e", "\x85"))


@pytest.mark.parametrize("name", ODD_NAMES)
@pytest.mark.parametrize(
    "plan", ["faults: NAME\nplan: [{fault: wrench_off}]\n", "faults: f\nplan: [{fault: wrench_off, name: NAME}]\n"]
)
def test_a_fault_plan_is_no_better(name: str, plan: str, tmp_path: Path) -> None:
    (tmp_path / "f.yaml").write_text(plan.replace("NAME", name))
    with pytest.raises(BadInput, match=r"f\.yaml:\d+:\d+: .* has a (control character|line break)"):
        read_plan(tmp_path / "f.yaml")


def test_text_of_several_lines_is_no_name(found_in: Callable[..., list[Finding]]) -> None:
    assert found_in(HEAD + "description: |\n  one\n  two\ntree: bare_hand\n") == []
