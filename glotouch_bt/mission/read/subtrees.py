"""Find and read a subtree in another file or in the mission itself, and give its parameters their values."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import replace
from os.path import isfile
from pathlib import Path

from glotouch_bt.escaped_text import fault_of_name
from glotouch_bt.mission.read.library import shipped_root, shown
from glotouch_bt.mission.read.parameters import Parameter, check_used, read_parameters
from glotouch_bt.mission.read.scope import Scope
from glotouch_bt.mission.read.yaml_source import read_named_yaml
from glotouch_bt.mission.spec import Map, Node, Place, Scalar
from glotouch_bt.robot import BadInput

MAX_SUBTREE_DEPTH = 8
"""Largest number of subtrees inside one another."""
SUBTREE_KEYS = ("subtree", "description", "parameters", "tree")


def handed_on(given: Map) -> tuple[dict[Scalar, Scalar], Map]:
    """Return the values of a subtree's parameters with their units and ranges, by key, and the plain settings."""
    section = given.get("parameters")
    if not isinstance(section, Map):
        return {}, given
    values = {k: v for k, v in section.entries if isinstance(v, Scalar)}
    bare = ((k, replace(v, unit="", span=None) if isinstance(v, Scalar) else v) for k, v in section.entries)
    sound = replace(section, entries=tuple((k, v) for k, v in bare if not (isinstance(v, Scalar) and v.poisoned)))
    return values, replace(given, entries=tuple((k, sound if v is section else v) for k, v in given.entries))


def find_subtree(given: str, at: Place, scope: Scope) -> tuple[Path, str, Node] | None:
    """Find a subtree: in the mission itself, else a file beside the present one, else a shipped file.

    A file must be in the mission's folder, in the shipped one, or in a folder that the user allows.

    Returns: Its path, its identity, and its content; None if that gave a finding.
    """
    if fault := fault_of_name(given):
        scope.findings.add(at, "wrong_name", f"the name of the subtree {fault}")
        return None
    if given in scope.reading.carried:
        path, identity = scope.file.parent / given, f"carried {given}"
    else:
        beside, shipped = scope.file.parent / given, shipped_root() / given
        path = shipped if isfile(shipped) and not isfile(beside) else beside
        try:
            resolved = path.resolve()
        except (OSError, RuntimeError) as e:  # links in a circle
            scope.findings.add(at, "unusable_subtree", f"subtree {given!r} cannot be found ({e})")
            return None
        if not any(resolved.is_relative_to(root) for root in (*scope.roots, shipped_root())):
            option = f"--allow-path {shlex.quote(str(resolved.parent))}"
            what = f"subtree {given!r} is outside of the mission's folder; {option} allows it"
            scope.findings.add(at, "subtree_outside", what)
            return None
        identity = str(resolved)
    if identity in (*scope.trail, str(scope.file.resolve())) or len(scope.trail) >= MAX_SUBTREE_DEPTH:
        scope.findings.add(at, "subtree_loop", f"subtree {given!r} contains itself or is nested too deep")
        return None
    if given in scope.reading.carried:
        return path, identity, scope.reading.carried[given]
    files = scope.reading.files
    try:
        if path not in files:
            files[path] = read_named_yaml(path, shown(path), "tree")
        return path, identity, files[path]
    except BadInput as e:
        near = scope.findings.nearest(given, _subtrees_near(scope))
        scope.findings.add(at, "unusable_subtree", f"subtree cannot be read: {e}", hint=near)
        return None


def entries_of(node: Node | None) -> tuple[tuple[Scalar, Node], ...]:
    """Return the entries of a mapping; none of anything else."""
    return node.entries if isinstance(node, Map) else ()


def open_subtree(
    source: Node, values: Mapping[Scalar, Scalar], scope: Scope, at: Place
) -> tuple[dict[str, Parameter], Node | None]:
    """Return the parameters and the tree of a subtree's file; None if it has no tree."""
    if not isinstance(source, Map):
        scope.findings.add(at, "unusable_subtree", "a subtree file must be a mapping", valid=", ".join(SUBTREE_KEYS))
        return {}, None
    for key, _ in source.entries:
        if key.value not in SUBTREE_KEYS:
            scope.findings.unknown(key.place, "unknown_key", "key of a subtree file:", str(key.value), SUBTREE_KEYS)
    given = {str(key.value): value for key, value in values.items()}
    parameters = read_parameters(source.get("parameters"), given, scope.findings, scope.objects, at)
    for key in values:
        if key.value not in parameters:
            scope.findings.unknown(
                key.place, "unknown_parameter", "parameter of the subtree:", str(key.value), parameters
            )
    tree = source.get("tree")
    if tree is None:
        scope.findings.add(source.place, "missing_key", "a subtree file needs 'tree'")
    else:
        check_used(source.get("parameters"), tree, scope.findings)
    return parameters, tree


def _subtrees_near(scope: Scope) -> list[str]:
    """Return the names that were possible: the mission's own subtrees, files beside the present one, shipped files."""
    here, shipped = scope.file.parent, shipped_root()
    files = [p.relative_to(here) for folder in (here, here / "subtrees") for p in folder.glob("*.yaml")]
    files += [p.relative_to(shipped) for p in (shipped / "subtrees").glob("*.yaml")]
    return [*scope.reading.carried, *(f.as_posix() for f in files)]
