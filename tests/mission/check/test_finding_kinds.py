"""Every kind of finding is declared once and raised by some test; no other kind is raised."""

from __future__ import annotations

import ast
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import trimesh
from typer.testing import CliRunner

from glotouch_backends import robots
from glotouch_bt import check, run
from glotouch_bt.cli import app
from glotouch_bt.faults import read_plan
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import SkillRegistry, shipped, shipped_root
from glotouch_bt.mission.spec import FINDING_KINDS, Finding, MissionFaults, Place, describe_findings
from glotouch_bt.robot import BadInput
from glotouch_bt.skill import Skill
from glotouch_bt.validation.seeded_mistakes.mistakes import MISTAKES

HEAD = "mission: m\nworld: worlds/container_five.yaml\nleaves: {hand: [probe, empty]}\n"
ROOT = Path(__file__).parents[3]
SEEK = ROOT / "tests" / "support" / "seek.yaml"
WORLD = """mission: m
world:
  world: w
  container: {pose_B_K: {position_m: [0.5, 0, 0]}, interior_m: [0.3, 0.4, 0.1]}
  holder: {pose_B_grasp: {position_m: [0.5, 0.4, 0.2]}}
  objects: {folder: nowhere}
tree: [bare_hand]
"""
EXAMPLES = {
    "unknown_key": HEAD + "tre: 1\ntree: [tool_pickup]\n",
    "missing_key": "mission: m\ntree: [bare_hand]\n",
    "wrong_name": HEAD.replace("mission: m", "mission: a b") + "tree: [tool_pickup]\n",
    "wrong_key": HEAD + "tree:\n  - tool_pickup: {out: {tool: No Key}}\n",
    "unknown_world": "mission: m\nworld: nowhere\ntree: [bare_hand]\n",
    "unusable_world": "mission: m\nworld: broken.yaml\ntree: [bare_hand]\n",
    "no_objects": WORLD,
    "unusable_stl": HEAD + "parameters:\n  t: {type: stl, default: flat.stl}\ntree:\n  - match: {target: $t}\n",
    "not_remembered": HEAD
    + "parameters:\n  t: {type: stl, default: 'touched:nothing'}\ntree:\n  - match: {target: $t}\n",
    "too_large": HEAD + "tree: [" + "bare_hand, " * 3001 + "]\n",
    "subtree_outside": HEAD + "tree: {subtree: {file: /etc/shadow}}\n",
    "subtree_loop": HEAD + "tree: {subtree: {file: round}}\nsubtrees:\n  round: {tree: {subtree: {file: round}}}\n",
    "written_twice": HEAD + "tree:\n  - parallel: [tool_pickup, {tool_calibrate: {out: {tool: tool}}}]\n",
    "unknown_state": HEAD.replace("[probe, empty]", "[probe, empti]") + "tree: [tool_pickup]\n",
    "unknown_resource": HEAD.replace("hand", "foot") + "tree: [tool_pickup]\n",
    "input_never_written": HEAD + "tree: [bare_hand, guarded_sweep, orbit_probe, {match: {target: apple}}]\n",
    "not_put_back": "mission: m\nworld: worlds/container_five.yaml\ntree: [tool_pickup]\n",
    "identical_objects": WORLD.replace("nowhere", "twins").replace("[bare_hand]", "{match: {target: $t}}")
    + "parameters: {t: {type: stl, default: one}}\n",
    "never_succeeds": HEAD + "tree: {fail: bare_hand}\n",
    "never_fails": HEAD + "tree: {succeed: bare_hand}\n",
    "unused_subtree": HEAD + "tree: [bare_hand]\nsubtrees:\n  other: {tree: bare_hand}\n",
    "practically_endless": HEAD + "tree: {retry: {attempts: 10000, do: {retry: {attempts: 10000, do: bare_hand}}}}\n",
}
ELSEWHERE = {
    "unreadable", "unusable_skill", "unknown_fault", "unknown_node", "no_layout", "target_out_of_reach",
    "box_out_of_reach", "missing_part",
}  # fmt: skip
"""Kinds that no mission text alone can raise; the tests at the end of this file raise them."""


@pytest.mark.parametrize("code", EXAMPLES)
def test_each_example_raises_its_finding(code: str, tmp_path: Path, found_in: Callable[..., list[Finding]]) -> None:
    (tmp_path / "broken.yaml").write_text("a: [")
    (tmp_path / "flat.stl").write_bytes(b"solid\nendsolid\n")
    (tmp_path / "twins").mkdir()
    for name in ("one", "two"):
        trimesh.creation.box((0.05, 0.04, 0.06)).export(tmp_path / "twins" / f"{name}.stl")
    text = EXAMPLES[code].replace("flat.stl", str(tmp_path / "flat.stl"))
    assert code in {f.code for f in found_in(text, every=True)}


def test_every_declared_finding_is_raised_by_some_test() -> None:
    assert set(FINDING_KINDS) == {m.code for m in MISTAKES} | set(EXAMPLES) | set(ELSEWHERE)


def raised_codes() -> Iterator[str]:
    """Yield every code that stands as the second argument of a call that adds a finding."""
    folders = [ROOT / "glotouch_bt" / "mission" / name for name in ("spec", "read", "nodes", "check")]
    files = [p for folder in folders for p in folder.rglob("*.py")]
    files += [ROOT / "glotouch_bt" / "mission" / f"{name}.py" for name in ("load", "feasible")]
    files += [ROOT / "glotouch_bt" / "faults" / "plan.py"]
    for node in (n for path in files for n in ast.walk(ast.parse(path.read_text()))):
        if not isinstance(node, ast.Call) or len(node.args) < 3:
            continue
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        if (
            name in ("add", "unknown", "_add", "Finding")
            and isinstance(code := node.args[1], ast.Constant)
            and code.value
        ):
            yield str(code.value)


def test_only_declared_findings_are_raised() -> None:
    codes = set(raised_codes())
    assert len(codes) > 40
    assert codes <= set(FINDING_KINDS)
    with pytest.raises(ValueError, match="not declared"):
        Finding(Place("m.yaml"), "some_fault", "what")


def test_the_description_of_findings_is_complete() -> None:
    described = describe_findings()
    assert [d["code"] for d in described] == list(FINDING_KINDS)
    assert all(d["meaning"] for d in described)
    assert all(d["why"] for d in described if d["severity"] == "warning")


def test_unreadable(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("a: [")
    done = CliRunner().invoke(app, ["check", str(tmp_path / "m.yaml"), "--json"])
    assert done.exit_code == 2
    assert [f["code"] for f in json.loads(done.stdout)["missions"][0]["findings"]] == ["unreadable"]


def test_unusable_skill(tmp_path: Path) -> None:
    class Broken(SkillRegistry):
        def __getitem__(self, name: str) -> type[Skill]:
            raise BadInput(f"skill {name!r} cannot be used here")

    (tmp_path / "m.yaml").write_text(HEAD + "tree: [tool_pickup]\n")
    with pytest.raises(MissionFaults) as caught:
        load_mission(tmp_path / "m.yaml", skills=Broken())
    assert "unusable_skill" in {f.code for f in caught.value.findings}


@pytest.mark.parametrize(
    ("code", "fault"), [("unknown_fault", "nothing_like_it"), ("unknown_node", "wrench_off, when: {node: nowhere}")]
)
def test_findings_of_fault_plans(code: str, fault: str, tmp_path: Path) -> None:
    (tmp_path / "plan.yaml").write_text(f"faults: p\nplan:\n  - {{fault: {fault}}}\n")
    mission = load_mission("pick_at")
    with pytest.raises(MissionFaults) as caught:
        read_plan(tmp_path / "plan.yaml", mission.spec, mission.name)
    assert code in {f.code for f in caught.value.findings}


@pytest.mark.parametrize(
    ("code", "size_m", "count", "said"),
    [
        ("no_layout", (0.08, 0.08, 0.05), 12, "12 objects do not fit into the container: no place found for"),
        ("target_out_of_reach", (0.05, 0.05, 0.009), 1, "it is 9.0 mm high and must be high enough to be traced"),
        ("target_out_of_reach", (0.12, 0.11, 0.05), 1, "is 110 mm across at its narrowest and the jaws open 85 mm"),
    ],
)
def test_faults_of_objects(code: str, size_m: tuple[float, ...], count: int, said: str, tmp_path: Path) -> None:
    for i in range(count):
        trimesh.creation.box(size_m).export(tmp_path / f"o{i}.stl")
    found = check(SEEK, {"target": "o0"}, objects=tmp_path)
    assert [f.what for f in found if f.code == code and said in f.what], found


@pytest.mark.parametrize("robot", ["rizon4", "iiwa14"])
def test_box_out_of_reach(robot: str, tmp_path: Path) -> None:
    shipped_world = shipped("worlds")["container_five"].read_text()
    world = tmp_path / "far.yaml"
    world.write_text(shipped_world.replace("[0.60, 0.0, -0.20]", "[0.80, 0.0, -0.20]"))
    found = check(SEEK, {"robot": robot}, world=world, objects=shipped_root() / "objects")
    said = [f.what for f in found if f.code == "box_out_of_reach"]
    assert said
    assert "container" in said[0]
    assert "cannot be reached" in said[0]
    assert not [f for f in check(SEEK, {"robot": robot}) if f.code == "box_out_of_reach"]


def test_missing_part(tmp_path: Path) -> None:
    """Images asked of a gripper without cameras are found by `check` and refused by `run`, before anything moves."""
    files = Path(robots.__file__).parent
    written = (files / "rizon4.yaml").read_text().replace("urdf: ", f"urdf: {files}/")
    (tmp_path / "blind.yaml").write_text("\n".join(l for l in written.splitlines() if "camera:" not in l))
    mission = tmp_path / "m.yaml"
    text = (shipped_root() / "remember.yaml").read_text()
    mission.write_text(text.replace("{max_closures: $max_closures}", "{max_closures: 4, gel_images: true}"))
    settings = {"robot": str(tmp_path / "blind.yaml")}
    with pytest.raises(BadInput, match="has no camera"):
        run(mission, out=tmp_path / "run", robot=settings["robot"])
    found = [f for f in check(str(mission), settings) if f.code == "missing_part"]
    (what,) = (f.what for f in found)
    assert what.startswith("gel_images: the gripper of Flexiv Rizon 4")
    assert what.endswith("has no camera")
    assert not [f for f in check(str(mission)) if f.code == "missing_part"]


@pytest.mark.parametrize("count", [1, 8])
def test_objects_are_counted(count: int, tmp_path: Path) -> None:
    for i in range(count):
        trimesh.creation.box((0.03, 0.03, 0.04 + 0.002 * i)).export(tmp_path / f"o{i}.stl")
    assert load_mission(SEEK, {"target": "o0"}, objects=tmp_path).parameters["expected_objects"] == count
    told = load_mission(SEEK, {"target": "o0", "expected_objects": "2"}, objects=tmp_path)
    assert told.parameters["expected_objects"] == 2
    open_ = load_mission(SEEK, {"target": "o0", "expected_objects": "unknown"}, objects=tmp_path)
    assert open_.parameters["expected_objects"] == "unknown"
    assert not [f for f in check(SEEK, {"target": "o0"}, objects=tmp_path) if f.severity == "error"]
