"""Bad input: exit 2, one message that names the file and the place, nothing moved, nothing written, no traceback."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import trimesh
from typer.testing import CliRunner

from glotouch_bt import cli

WORLD = """world: w
container:
  pose_B_K: {position_m: [0.6, 0.0, -0.2]}
  interior_m: INTERIOR
holder:
  pose_B_grasp: {position_m: [0.45, -0.32, -0.06]}
objects: {folder: good}
"""
SEEK = Path(__file__).parents[1] / "support" / "seek.yaml"
TREE = "mission: m\nworld: container_five\ntree:\n"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders of unusable STL files, and faulty missions, worlds and conditions."""
    root = tmp_path_factory.mktemp("bad")

    def save(mesh: trimesh.Trimesh, *names: str) -> None:
        for name in names:
            (root / name).parent.mkdir(exist_ok=True)
            mesh.export(root / name)

    block = trimesh.creation.box((0.05, 0.04, 0.06))
    save(block, "good/a.stl", *(f"many/o{i}.stl" for i in range(12)))
    save(block.copy().apply_scale(1000.0), "mm/a.stl")
    save(trimesh.Trimesh(block.vertices, block.faces[:-1], process=False), "open/a.stl")
    apart = block.copy().apply_translation([0.2, 0, 0])
    save(trimesh.util.concatenate([block, apart]), "two/a.stl")
    save(trimesh.creation.box((0.05, 0.04, 0.001)), "thin/a.stl")
    for folder in ("text", "none", "empty"):
        (root / folder).mkdir()
    (root / "text/a.stl").write_text("this is not an STL")
    (root / "empty/a.stl").write_bytes(b"")
    (root / "file").write_text("x")
    for name, interior in (("tiny", "[0.06, 0.06, 0.08]"), ("negative", "[0.3, -0.4, 0.08]"), ("flat", "[0.3, 0.4]")):
        (root / f"{name}_world.yaml").write_text(WORLD.replace("INTERIOR", interior))
        (root / f"{name}.yaml").write_text(f"mission: m\nworld: {name}_world.yaml\ntree: tool_pickup\n")
    bomb = "mission: m\na: &a [x, x, x, x, x, x, x, x, x]\n"
    for above, name in zip("abcdefgh", "bcdefghi", strict=True):
        bomb += f"{name}: &{name} [{', '.join([f'*{above}'] * 9)}]\n"
    for name, text in {
        "seek": SEEK.read_text(),
        "anchor": TREE + "  - &again tool_pickup\n  - *again\n",
        "bomb": bomb + "world: container_five\ntree: lift\n",
        "merge": TREE + "  - grasp: {<<: {force_N: 3}}\n",
        "code": TREE + "  - !!python/object/apply:os.mkdir ['pwned']\n",
        "tag": "mission: !secret m\nworld: container_five\ntree: lift\n",
        "twice": "mission: m\nmission: n\nworld: container_five\ntree: lift\n",
        "deep": "mission: m\nworld: container_five\ntree: " + "[" * 3000 + "]" * 3000 + "\n",
        "types": TREE + "  - tool_pickup: {grip_N: strong, floor_touch: 3}\n",
        "units": TREE + "  - tool_pickup: {grip_N: 30 mm}\n",
        "ranges": TREE + "  - tool_pickup: {grip_N: 61}\n",
        "parameter": TREE + "  - tool_pickup: {grip_n: 30}\n",
        "skill": TREE + "  - tool_pikup\n",
        "syntax": TREE + "  - {tool_pickup: [\n",
        "blank": "",
        "list": "- tool_pickup\n",
        "documents": "mission: m\n---\nmission: n\n",
        "world": "mission: m\nworld: container_fve\ntree: tool_pickup\n",
        "loud": "name: c\nforce_noise_sd_N: loud\n",
        "turned": "name: c\nobject_mass_kg: [0.4, 0.1]\n",
        "noise": "name: c\nforce_noise: 1\n",
    }.items():
        (root / f"{name}.yaml").write_text(text)
    (root / "binary.yaml").write_bytes(b"\xff\xfe\x00\x01mission")
    return root


CASES = [
    # object files
    ("run seek.yaml --set target=gone.stl", "--set target: gone.stl: no such STL file"),
    ("run seek.yaml --set target=open/a.stl", "open/a.stl: is not watertight"),
    ("run seek.yaml --set target=mm/a.stl", "mm/a.stl: is 60 m large; STL files must be in METRES"),
    ("run seek.yaml --set target=text/a.stl", "text/a.stl: "),
    ("run seek.yaml --set target=empty/a.stl", "empty/a.stl: "),
    ("run seek.yaml --set target=thin/a.stl", "thin/a.stl: "),
    ("run seek.yaml --set target=", "--set target: unknown object"),
    ("run seek.yaml --objects open --set target=a", "open/a.stl: is not watertight"),
    ("run seek.yaml --objects mm --set target=a", "(in millimetres? then scale it by 0.001 to 0.06 m)"),
    ("run seek.yaml --objects good --set target=b", "unknown object (in good) 'b' (valid: a)"),
    ("run survey --objects open", "open/a.stl: is not watertight"),
    ("run survey --objects mm", "mm/a.stl: is 60 m large"),
    ("run survey --objects none", "--objects none: is not a folder with .stl files in it"),
    ("run survey --objects file", "--objects file: is not a folder with .stl files in it"),
    # worlds that cannot be
    ("run survey --objects many", "12 objects do not fit into the container"),
    ("run tiny.yaml", "do not fit into the container: no place found for 'a'"),
    ("run negative.yaml", "negative_world.yaml:4:15: container.interior_m = -0.4: must be finite and positive"),
    ("run flat.yaml", "flat_world.yaml:4:15: "),
    ("run world.yaml", "world.yaml:2:8: unknown world 'container_fve'; did you mean 'container_five'?"),
    # YAML
    ("run anchor.yaml", "anchor.yaml:4:5: anchors (&again) are not allowed"),
    ("run bomb.yaml", "bomb.yaml:2:4: anchors (&a) are not allowed"),
    ("run merge.yaml", "merge.yaml:4:13: merge keys (<<) are not allowed"),
    ("run code.yaml", "code.yaml:4:5: tags (tag:yaml.org,2002:python/object/apply:os.mkdir) are not allowed"),
    ("run tag.yaml", "tag.yaml:1:10: tags (!secret) are not allowed"),
    ("run twice.yaml", "twice.yaml:2:1: duplicate key 'mission' (first at line 1)"),
    ("run deep.yaml", "nested deeper than"),
    ("run syntax.yaml", "syntax.yaml:5:1: not valid YAML"),
    ("run blank.yaml", "blank.yaml: holds no YAML document"),
    ("run list.yaml", "list.yaml:1:1: a mission must be a mapping"),
    ("run documents.yaml", "documents.yaml:2:1: a second document"),
    ("run binary.yaml", "binary.yaml:1:1: not UTF-8 text"),
    # missions
    ("run skill.yaml", "skill.yaml:4:5: unknown skill or node 'tool_pikup'; did you mean 'tool_pickup'?"),
    ("run parameter.yaml", "parameter.yaml:4:19: unknown parameter of skill 'tool_pickup': 'grip_n'; did you mean"),
    ("run types.yaml", "types.yaml:4:27: grip_N = 'strong': must be a number (valid: float N, > 0.0, <= 60.0)"),
    ("run types.yaml", "types.yaml:4:48: floor_touch = 3: must be true or false"),
    ("run units.yaml", "units.yaml:4:27: grip_N is in N, not 'mm' (valid: N, mN, kN)"),
    ("run ranges.yaml", "ranges.yaml:4:27: grip_N = 61: must be <= 60.0 N"),
    # settings
    (
        "run survey --set expected_objects=2.5",
        "expected_objects = '2.5': must be a whole number or unknown (valid: int, 1 to 20, or unknown)",
    ),
    ("run pick_at --set x=2kg", "--set x: x is in mm, not 'kg' (valid: m, cm, mm, um)"),
    ("run pick_at --set width=0.05", "--set width: width = 0.05: must be in [3, 80] mm"),
    (
        "run survey --set nonsense=1",
        "--set nonsense: mission 'survey' has no such parameter (valid: expected_objects, left_below, policy, "
        "retraces); unknown",
    ),
    ("run survey --set layout=here", "option layout = 'here': must be a mapping of object names"),
    ("run survey --set layout={apple", "--set layout: begins like JSON but is not"),
    ('run survey --set layout={"apple":[0,0,0]}', "option layout: no place for nailong, train, truck, wukong"),
    ("run survey --seed 4294967296", "--seed 4294967296: must be in 0 .. 4294967295"),
    ("run survey --seed x", "'--seed'"),
    (
        "run survey --conditions gone.yaml",
        "no such conditions file (shipped: harsh, ideal, nominal, realistic, strong)",
    ),
    ("run survey --conditions loud.yaml", "loud.yaml:2:19: force_noise_sd_N = 'loud': must be a number or a list"),
    ("run survey --conditions turned.yaml", "turned.yaml:2:17: conditions.object_mass_kg = (0.4, 0.1): must be"),
    ("run survey --conditions noise.yaml", "unknown parameter of conditions: 'force_noise'; did you mean"),
]


@pytest.fixture
def there(files: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(files)
    yield files
    cli._debug = False


@pytest.mark.parametrize(("words", "message"), CASES, ids=[f"{w} {i}" for i, (w, _) in enumerate(CASES)])
def test_bad_input(words: str, message: str, there: Path) -> None:
    out = len(words) % 2  # with a folder of its own, or the default one
    before = sorted(there.rglob("*"))
    done = CliRunner().invoke(cli.app, [*words.split(" "), *(["--out", "new/run"] if out else [])])
    assert done.exit_code == 2, done.output
    assert message in done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert "internal error" not in done.stderr
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    assert len(lines) <= 4, "one message, a line a fault"
    assert sorted(there.rglob("*")) == before, "nothing is written"


@pytest.mark.parametrize("words", ["run survey --objects mm", "run types.yaml", "run survey --set nonsense=1"])
def test_an_earlier_run_in_the_folder_is_left_untouched(words: str, there: Path, tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text("{}")
    (tmp_path / "run.mcap").write_bytes(b"earlier")
    assert CliRunner().invoke(cli.app, [*words.split(" "), "--out", str(tmp_path)]).exit_code == 2
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == {"result.json": b"{}", "run.mcap": b"earlier"}


@pytest.mark.parametrize("out", ["file", "file/deeper/run"])
def test_a_file_in_the_way_of_out(out: str, there: Path) -> None:
    done = CliRunner().invoke(cli.app, ["run", "survey", "--out", out])
    assert done.exit_code == 2
    assert f"{out}: a run's folder cannot be written here" in done.stderr
    assert (there / "file").read_text() == "x"


def test_every_fault_of_a_mission_is_in_one_report(there: Path) -> None:
    text = TREE + "  - tool_pickup: {grip_N: strong, speed_m_s: 5 kg}\n  - lift: {hieght_m: 1}\n  - lfit\n"
    (there / "faulty.yaml").write_text(text)
    done = CliRunner().invoke(cli.app, ["check", "faulty.yaml"])
    (there / "faulty.yaml").unlink()
    assert done.exit_code == 2
    for place in ("faulty.yaml:4:27", "faulty.yaml:4:46", "faulty.yaml:5:5", "faulty.yaml:5:12", "faulty.yaml:6:5"):
        assert place in done.stderr


def test_more_objects_expected_than_the_world_says_it_has(there: Path) -> None:
    (there / "short_world.yaml").write_text(
        WORLD.replace("INTERIOR", "[0.3, 0.4, 0.08]").replace("good}", "good, expected: 5}")
    )
    (there / "short.yaml").write_text("mission: m\nworld: short_world.yaml\ntree: tool_pickup\n")
    done = CliRunner().invoke(cli.app, ["run", "short.yaml"])
    assert done.exit_code == 2
    assert "short_world.yaml:7:35: objects.expected = 5, but 1 are chosen" in done.stderr
