"""Load a mission file: return the checked mission, or report everything that is wrong with it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os.path import isfile
from pathlib import Path
from typing import Any

import yaml
from py_trees.behaviour import Behaviour

from glotouch_bt.mission.check import check_flow
from glotouch_bt.mission.read import (
    Parameter,
    Reading,
    Scope,
    SkillRegistry,
    Unreadable,
    Value,
    check_used,
    entries_of,
    find_shipped,
    from_command_line,
    parse_tree,
    read_named_yaml,
    read_parameters,
    read_world,
    read_yaml,
    resolved,
    shipped_root,
    shown,
    substitute,
)
from glotouch_bt.mission.spec import (
    Finding,
    Findings,
    Map,
    MissionFaults,
    Node,
    NodeSpec,
    Place,
    Scalar,
    Seq,
    number_names,
    plain,
)
from glotouch_bt.perception import touched_name
from glotouch_bt.robot import BadInput, ObjectSet, World
from glotouch_bt.robot.scene import twins_of
from glotouch_bt.skill import Context, Skill

MISSION_KEYS = ("mission", "description", "world", "parameters", "tree", "timeout_s", "leaves", "subtrees")
MAX_DURATION_S = 3600.0


@dataclass(frozen=True)
class Mission:
    """A mission that passed every check.

    Attributes:
        name: Its name.
        description: One line for people.
        world: The nominal world it runs in.
        parameters: Values in use, in their declared units.
        stl_parameters: Names of the parameters that name an object.
        spec: The checked tree, as plain node specifications.
        timeout_s: Longest duration on the robot's clock.
        file: The file it was read from.
        document: The mission as plain data with the values in use and its subtrees, for the run's folder.
        warnings: Findings that may be intended.
    """

    name: str
    description: str
    world: World
    parameters: Mapping[str, Value]
    stl_parameters: tuple[str, ...]
    spec: NodeSpec
    timeout_s: float
    file: Path
    document: Mapping[str, Any]
    warnings: tuple[Finding, ...] = ()

    @property
    def tree(self) -> Behaviour:
        """A new py_trees tree of the mission for `py_trees.display`. It has no robot and cannot be ticked."""
        from glotouch_bt.mission.tree import build_tree

        nothing: Any = None
        built = build_tree(self.spec, Context(self.world, nothing, nothing, nothing, nothing), self.name)
        built.forget()
        return built.root

    def resolved_yaml(self) -> str:
        """Return the document as YAML text."""
        return str(yaml.safe_dump(dict(self.document), sort_keys=False, allow_unicode=True, width=110))


def load_mission(
    given: str | Path,
    settings: Mapping[str, str | Value] | None = None,
    *,
    skills: Mapping[str, type[Skill]] | None = None,
    objects: Path | None = None,
    world: str | None = None,
    allow_paths: Sequence[Path] = (),
) -> Mission:
    """Load and check a mission.

    Args:
        given: Path of a mission file, or the name of a shipped mission.
        settings: `--set` values; names the mission does not declare are left to the caller (`split_settings`).
        skills: Known skills (default: all that are installed).
        objects: A folder of STL files to use instead of the world's.
        world: Path or name of a world to use instead of the mission's.
        allow_paths: Folders in which subtrees may be, besides the mission's own.

    Raises:
        MissionFaults: It has errors; each has its place. (A `BadInput`.)
        BadInput: The file cannot be read.
    """
    path = find_shipped("", str(given), "mission")
    findings = Findings()
    roots = tuple(folder.resolve() for folder in (path.parent, *allow_paths))
    skills = SkillRegistry() if skills is None else skills
    mission = _read(path, dict(settings or {}), skills, objects, world, roots, findings, flow=True)
    if mission is None or len(findings):
        raise MissionFaults(findings.errors, findings.warnings)
    return mission


def node_paths(file: Path) -> list[str]:
    """Return the paths of all nodes of a mission file, parents first; what can happen in a run is not checked.

    A file with errors has none.

    Raises:
        BadInput: The file cannot be read.
    """
    mission = _read(file, {}, SkillRegistry(), None, None, (file.parent.resolve(),), Findings(), flow=False)
    return [] if mission is None else list(mission.spec.paths(mission.name))


def split_settings(mission: Mission, settings: Mapping[str, object]) -> dict[str, object]:
    """Return the `--set` values that the mission does not declare; they are backend options.

    Text that begins like a JSON object or list is read as one: `--set 'layout={"apple": [0, 0.05, 0]}'`.

    Raises:
        BadInput: It begins like JSON but is not.
    """
    return {k: _option(k, v) for k, v in settings.items() if k not in mission.parameters}


def _option(name: str, value: object) -> object:
    if not isinstance(value, str) or not value.lstrip().startswith(("{", "[")):
        return value
    try:
        return json.loads(value)
    except (ValueError, RecursionError) as e:
        raise BadInput(f"--set {name}: begins like JSON but is not: {e}") from e


def _read(
    path: Path,
    settings: Mapping[str, str | Value],
    skills: Mapping[str, type[Skill]],
    objects: Path | None,
    other_world: str | None,
    roots: tuple[Path, ...],
    findings: Findings,
    *,
    flow: bool,
) -> Mission | None:
    try:
        source = read_yaml(path, shown(path))
    except Unreadable as e:
        findings.add(e.place, "unreadable", e.what)
        return None
    if not isinstance(source, Map):
        findings.add(source.place, "wrong_type", "a mission must be a mapping", valid=", ".join(MISSION_KEYS))
        return None
    is_plan = "faults" in source and "tree" not in source
    if is_plan or not any(key in source for key in MISSION_KEYS):
        if is_plan:
            what = "is no mission but a fault plan: `glotouch run MISSION --faults PLAN` checks it and runs with it"
            findings.add(source.place, "wrong_type", what)
        else:
            what = "is no mission: it has none of the keys of one"
            findings.add(Place(shown(path)), "wrong_type", what, valid=", ".join(MISSION_KEYS))
        return None
    for key, _ in source.entries:
        if key.value not in MISSION_KEYS:
            findings.unknown(key.place, "unknown_key", "key of a mission:", str(key.value), MISSION_KEYS)
    name = _text(source, "mission", findings, required=True)
    description = _text(source, "description", findings, required=False)
    node = source.get("world") if other_world is None else Scalar(other_world, Place("--world"))
    world, world_document = _world(source, node, path, objects, findings)
    chosen = world.objects if world else None
    section = source.get("parameters")
    given = {n: from_command_line(n, v, section) for n, v in settings.items()}
    parameters = read_parameters(section, given, findings, chosen)
    timeout_s = _timeout(source, findings)
    tree_node = source.get("tree")
    if tree_node is None:
        findings.add(source.place, "missing_key", "a mission needs 'tree'")
        return None
    reading = Reading(carried=_carried(source, findings))
    scope = Scope(skills, findings, path, roots, chosen, reading=reading)
    tree = parse_tree(substitute(tree_node, parameters, findings), scope)
    number_names(tree)
    check_used(source.get("parameters"), tree_node, findings)
    for key, _ in entries_of(source.get("subtrees")):
        if f"carried {key.value}" not in reading.sources.values():
            findings.add(key.place, "unused_subtree", f"no node uses the subtree {key.value!r}, so it is not checked")
    leaves = _leaves(source, findings)
    if flow:
        check_flow(tree, skills, findings, leaves, timeout_s)
    if world is not None and not len(findings):
        _check_twins(parameters, given, section, world.objects, findings)
    if world is None or len(findings):
        return None
    values = {n: p.value for n, p in parameters.items() if p.value is not None}
    document = _document(source, name, world_document, parameters, reading)
    stl = tuple(n for n, p in parameters.items() if p.declared.type == "stl")
    return Mission(name, description, world, values, stl, tree, timeout_s, path, document, tuple(findings.warnings))


def _check_twins(
    parameters: Mapping[str, Parameter],
    given: Mapping[str, Scalar],
    section: Node | None,
    objects: ObjectSet,
    findings: Findings,
) -> None:
    """Report the objects that cannot be told from a target."""
    for name, parameter in parameters.items():
        if parameter.declared.type != "stl" or not parameter.value or touched_name(str(parameter.value)):
            continue
        twins = twins_of(str(parameter.value), objects)
        if twins:
            place = given[name].place if name in given else _place_of(section, name)
            what = f"{name} = {parameter.value!r}: {', '.join(twins)} {'has' if len(twins) == 1 else 'have'} its shape"
            findings.add(place, "identical_objects", what)


def _place_of(section: Node | None, key: str) -> Place:
    return section.key_place(key) if isinstance(section, Map) else Place(key)


def _text(source: Map, key: str, findings: Findings, *, required: bool) -> str:
    node = source.get(key)
    if node is None:
        if required:
            findings.add(source.place, "missing_key", f"a mission needs {key!r}")
        return ""
    if not isinstance(node, Scalar) or not isinstance(node.value, str) or not node.value.strip():
        findings.add(node.place, "wrong_type", f"{key}: must be text")
        return ""
    if key == "mission" and not all(c.isalnum() or c in "_-" for c in node.value):
        findings.add(
            node.place,
            "wrong_name",
            f"mission name {node.value!r} has characters that are not allowed",
            valid="letters, digits, _ and -",
        )
    return node.value


def _timeout(source: Map, findings: Findings) -> float:
    node = source.get("timeout_s")
    if node is None:
        return MAX_DURATION_S
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value <= 86_400:
        findings.add(node.place, "wrong_value", "timeout_s: must be a number of seconds in (0, 86400]")
        return MAX_DURATION_S
    return float(value)


def _world(
    source: Map, node: Node | None, path: Path, objects: Path | None, findings: Findings
) -> tuple[World | None, object]:
    if node is None:
        findings.add(source.place, "missing_key", "a mission needs 'world'", valid="worlds/NAME.yaml or a path")
        return None, None
    if isinstance(node, Map):
        return read_world(node, path, findings, objects), plain(node)
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        findings.add(node.place, "wrong_type", "world: must be the path of a world file")
        return None, None
    near = path.parent if node is source.get("world") else Path()  # of the command line: beside the working folder
    found = _find_world(node.value, (near, shipped_root()))
    if found is None:
        names = [p.stem for p in sorted((shipped_root() / "worlds").glob("*.yaml"))]
        findings.unknown(node.place, "unknown_world", "world", node.value, names)
        return None, None
    try:
        content = read_named_yaml(found, shown(found), "world")
    except BadInput as e:
        findings.add(node.place, "unusable_world", f"the world cannot be read: {e}")
        return None, None
    inside = shown(found).removeprefix("glotouch_missions/")
    document = inside if inside != shown(found) else str(found.resolve())
    return read_world(content, found, findings, objects), document


def _find_world(given: str, roots: Sequence[Path]) -> Path | None:
    """Return the path of a world, relative to one of these folders; None: there is none."""
    names = [given] if given.endswith((".yaml", ".yml")) else [given, f"worlds/{given}.yaml"]
    for root in roots:
        for name in names:
            if isfile(root / name):
                return root / name
    return None


def _carried(source: Map, findings: Findings) -> dict[str, Node]:
    """Return the subtrees that stand in the mission itself, by name."""
    node = source.get("subtrees")
    if node is None:
        return {}
    if not isinstance(node, Map):
        findings.add(node.place, "wrong_type", "subtrees: must be a mapping of name: {parameters, tree}")
        return {}
    return {str(k.value): v for k, v in node.entries}


def _leaves(source: Map, findings: Findings) -> dict[str, tuple[frozenset[str], Place]]:
    """Return the states in which the mission declares to leave each resource on success, and the place of each."""
    node = source.get("leaves")
    found: dict[str, tuple[frozenset[str], Place]] = {}
    if node is None:
        return found
    entries = node.entries if isinstance(node, Map) else ()
    for key, value in entries:
        names = [value] if isinstance(value, Scalar) else list(value.items) if isinstance(value, Seq) else []
        states = {n.value for n in names if isinstance(n, Scalar) and isinstance(n.value, str)}
        if len(states) == len(names) > 0:
            found[str(key.value)] = (frozenset(states), key.place)
            continue
        findings.add(value.place, "wrong_type", f"leaves.{key.value}: must be a state, or a list of them")
    if not entries:
        findings.add(node.place, "wrong_type", "leaves: must be a mapping of resource: state", valid="{hand: empty}")
    return found


def _document(
    source: Map, name: str, world: object, parameters: Mapping[str, Parameter], reading: Reading
) -> dict[str, Any]:
    """Return the mission with the values in use and every subtree it uses. It needs no other file but the world's."""
    document: dict[str, Any] = {"mission": name, "world": world}
    for key in ("description", "timeout_s", "leaves"):
        node: Node | None = source.get(key)
        if node is not None:
            document[key] = plain(node)
    section = resolved(source.get("parameters"), parameters)
    if section:
        document["parameters"] = section
    tree = source.get("tree")
    document["tree"] = plain(tree, reading.renamed) if tree is not None else None
    if reading.used:
        document["subtrees"] = {n: plain(t, reading.renamed) for n, t in sorted(reading.used.items())}
    return document
