"""Read a tree into checked `NodeSpec`s. Faults are gathered, not raised; a faulty node stays in the tree."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from glotouch_bt.escaped_text import fault_of_name
from glotouch_bt.mission.nodes import NODES, NodeKind, SubtreeSettings
from glotouch_bt.mission.read.fields import named_by, validate
from glotouch_bt.mission.read.literals import is_literal, read_literal
from glotouch_bt.mission.read.parameters import stl_usable, substitute
from glotouch_bt.mission.read.scope import Scope
from glotouch_bt.mission.read.subtrees import entries_of, find_subtree, handed_on, open_subtree
from glotouch_bt.mission.spec import Map, Node, NodeSpec, Place, Scalar, Seq, Wire
from glotouch_bt.robot import BadInput
from glotouch_bt.skill import Skill

MAX_NODES = 3000
"""Largest number of nodes of a mission, subtrees included."""
MAX_DEPTH = 100
"""Largest depth of a tree, subtrees included."""
TITLE, CHILD = {"name": ""}, {"name": "", "do": ""}


def parse_tree(node: Node, scope: Scope) -> NodeSpec:
    """Read one node and everything below it."""
    reading = scope.reading
    reading.nodes += 1
    if reading.nodes > MAX_NODES or reading.depth >= MAX_DEPTH:
        if reading.nodes <= MAX_NODES + 1:
            what = f"more than {MAX_NODES} nodes, or nested deeper than {MAX_DEPTH}"
            scope.findings.add(node.place, "too_large", f"the tree has {what} (subtrees included)")
            reading.nodes = MAX_NODES + 1
        return _lost(node)
    reading.depth += 1
    try:
        return _node(node, scope)
    finally:
        reading.depth -= 1


def _node(node: Node, scope: Scope) -> NodeSpec:
    if isinstance(node, Scalar) and isinstance(node.value, str) and not node.poisoned:
        return _named(node.value, node.place, Scalar(None, node.place), scope)
    if isinstance(node, Map) and len(node.entries) == 1:
        key, body = node.entries[0]
        return _named(str(key.value), key.place, body, scope)
    if isinstance(node, Seq):
        return _node_of_kind(NODES["sequence"], node.place, node, scope)
    if isinstance(node, Map) and node.entries:
        names = ", ".join(node.keys())
        what = f"a node has one name, here are {len(node.entries)}: {names}"
        what += " (is the indentation right, and does each node begin with '- '?)"
        scope.findings.add(node.entries[1][0].place, "not_a_node", what)
        key, body = node.entries[0]
        return _named(str(key.value), key.place, body, scope) if key.value in {*NODES, *scope.skills} else _lost(node)
    if not (isinstance(node, Scalar) and node.poisoned):
        scope.findings.add(
            node.place, "not_a_node", "a node is expected here", valid="a skill or node name, then its settings"
        )
    return _lost(node)


def _lost(node: Node) -> NodeSpec:
    return NodeSpec("unknown", "unknown", node.place)


def _named(name: str, place: Place, body: Node, scope: Scope) -> NodeSpec:
    if name in NODES:
        return _node_named(name, place, body, scope)
    if " - " in name:
        what = f"{name!r}: a '-' below is indented deeper than the entry above it; begin each '-' in the same column"
        scope.findings.add(place, "not_a_node", what)
        return NodeSpec("unknown", name, place, _children_of_unknown(body, scope))
    known = name
    if name not in scope.skills:
        also = {kind.btcpp: name for name, kind in NODES.items() if kind.btcpp}
        known = scope.findings.unknown(place, "unknown_skill", "skill or node", name, [*NODES, *scope.skills], also)
        if known in NODES and _holds_children(body) == (NODES[known].children != "none"):
            return _node_named(known, place, body, scope)
        if known not in scope.skills or _holds_children(body):
            return NodeSpec("unknown", name, place, _children_of_unknown(body, scope))
    try:
        skill = scope.skills[known]
    except BadInput as e:
        scope.findings.add(place, "unusable_skill", str(e))
        return NodeSpec("unknown", name, place)
    return _skill(known, skill, place, body, scope)


def _holds_children(body: Node) -> bool:
    """Return True if nodes stand below a name: a list, or a mapping with `do`."""
    return isinstance(body, Seq) or (isinstance(body, Map) and "do" in body)


def _children_of_unknown(body: Node, scope: Scope) -> tuple[NodeSpec, ...]:
    """Read the nodes below an unknown name, so that it hides none of their mistakes."""
    below = body.get("do") if isinstance(body, Map) else body
    if isinstance(below, Seq):
        return tuple(parse_tree(i, scope) for i in below.items)
    return (parse_tree(below, scope),) if isinstance(below, Map) else ()


def _settings_map(name: str, place: Place, body: Node, scope: Scope) -> Map:
    """Return the mapping after a node's name; an empty one if it is missing or wrong (then reported)."""
    if isinstance(body, Map):
        return body
    if not (isinstance(body, Scalar) and (body.value is None or body.poisoned)):
        scope.findings.add(body.place, "wrong_type", f"{name}: its settings must be a mapping, {name}: {{key: value}}")
    return Map((), place)


def _take(given: Map, *names: str) -> tuple[dict[str, tuple[Place, Node]], Map]:
    """Split off some keys; return ({name: (place of the key, value)}, the rest)."""
    taken = {str(k.value): (k.place, v) for k, v in given.entries if k.value in names}
    return taken, replace(given, entries=tuple((k, v) for k, v in given.entries if k.value not in names))


def _title(taken: Mapping[str, tuple[Place, Node]], default: str, scope: Scope) -> str:
    if "name" not in taken:
        return default
    node = taken["name"][1]
    if not isinstance(node, Scalar) or not isinstance(node.value, str) or not node.value.strip():
        scope.findings.add(node.place, "wrong_type", "name: must be text")
        return default
    if fault := fault_of_name(node.value.strip()):
        scope.findings.add(node.place, "wrong_name", f"name: {fault}")
        return default
    return node.value.strip()[:80]


def _node_named(name: str, place: Place, body: Node, scope: Scope) -> NodeSpec:
    return _subtree(place, body, scope) if name == "subtree" else _node_of_kind(NODES[name], place, body, scope)


def _node_of_kind(kind: NodeKind, place: Place, body: Node, scope: Scope) -> NodeSpec:
    if kind.children == "many" and _without_dashes(body, scope):
        body = _listed(kind, body, scope)
    bare = kind.children == "one" and not kind.Settings.model_fields  # `succeed: {orbit_probe: ...}` needs no `do`
    if (kind.children == "many" and isinstance(body, Seq)) or (
        bare and not (isinstance(body, Map) and ("do" in body or not body.entries))
    ):
        taken: dict[str, tuple[Place, Node]] = {"do": (place, body)}
        rest = Map((), place)
    else:
        own = ("name",) if kind.children == "none" else ("name", "do")
        taken, rest = _take(_settings_map(kind.name, place, body, scope), *own)
    rest, unit = kind.convert_units(rest, scope.findings)
    beside = TITLE if kind.children == "none" else CHILD
    settings = validate(kind.Settings, rest, f"node {kind.name!r}", scope.findings, where=place, beside=beside)
    children = (
        () if kind.children == "none" else _children(kind, taken["do"][1] if "do" in taken else None, place, scope)
    )
    if kind.children != "none" and not children:
        children = (_lost(body),)
    spec = NodeSpec(kind.name, "", place, children, settings)
    spec.name = _title(taken, kind.default_name(spec), scope)
    kind.wire(spec, rest, unit, scope)
    return spec


def _children(kind: NodeKind, below: Node | None, place: Place, scope: Scope) -> tuple[NodeSpec, ...]:
    """Read the nodes under `do`; return none, with a finding, if there is none."""
    children: tuple[NodeSpec, ...] = ()
    if kind.children == "one":
        if below is None or (isinstance(below, Scalar) and below.value is None):
            scope.findings.add(place, "no_children", f"{kind.name} has no child", valid="do: a node")
            return ()
        return (parse_tree(below, scope),)
    if below is not None and ((isinstance(below, Map) and len(below.entries) > 1) or _is_text(below)):
        below = _listed(kind, below, scope)
    if isinstance(below, Seq):
        children = tuple(parse_tree(i, scope) for i in below.items)
    elif isinstance(below, Map):
        children = (parse_tree(below, scope),)
    if not children:
        what = f"{kind.name} has no children"
        scope.findings.add(place, "no_children", what, valid=f"{kind.name}: [node, node, ...]")
    return children


def _without_dashes(body: Node, scope: Scope) -> bool:
    """Return True if children stand below a name without dashes: text, or a mapping of nodes."""
    if isinstance(body, Map):
        return "do" not in body and any(key.value in NODES or key.value in scope.skills for key, _ in body.entries)
    return _is_text(body)


def _is_text(node: Node) -> bool:
    return isinstance(node, Scalar) and isinstance(node.value, str) and not node.poisoned


def _listed(kind: NodeKind, undashed: Node, scope: Scope) -> Seq:
    """Report children without dashes, and return them as a list."""
    what = f"the children of {kind.name} are a list: begin each of them with '- '"
    scope.findings.add(undashed.place, "not_a_node", what, valid=f"{kind.name}: [node, node, ...]")
    if isinstance(undashed, Map):
        return Seq(tuple(Map((entry,), entry[0].place) for entry in undashed.entries), undashed.place)
    return Seq((Scalar(None, undashed.place, poisoned=True),), undashed.place)


def _skill(name: str, skill: type[Skill], place: Place, body: Node, scope: Scope) -> NodeSpec:
    taken, rest = _take(_settings_map(name, place, body, scope), "name", "in", "out")
    ports = {p: "out" for p in skill.OUTPUT_PORTS} | {p: "in" for p in skill.INPUT_PORTS} | {"in": "", "out": ""}
    params = validate(skill.Params, rest, f"skill {name!r}", scope.findings, where=place, beside=TITLE | ports)
    for key, value in rest.entries if scope.objects is not None else ():
        field = skill.Params.model_fields.get(str(key.value))
        if field is not None and named_by(field) == "stl" and isinstance(value, Scalar) and not value.poisoned:
            if value.value == "" and field.default == "":
                continue  # no object
            stl_usable(str(value.value), scope.objects, value.place, scope.findings)
    keys = skill.default_keys()
    reads = {p: Wire(p, scope.key(keys[p]), place) for p in skill.INPUT_PORTS}
    writes = {p: Wire(p, scope.key(keys[p]), place) for p in skill.OUTPUT_PORTS}
    constants: dict[str, object] = {}
    if "in" in taken:
        given, constants = _literals(skill, taken["in"][1], reads, scope)
        _rewire(name, "in", given, reads, skill, scope)
    if "out" in taken:
        _rewire(name, "out", taken["out"][1], writes, skill, scope)
    title = _title(taken, name, scope)
    return NodeSpec("skill", title, place, (), None, name, skill, params, reads, writes, constants)


def _literals(skill: type[Skill], given: Node, wires: dict[str, Wire], scope: Scope) -> tuple[Node, dict[str, object]]:
    """Read constants of input ports; return (entries left to wire, values). Missions cannot name their keys."""
    constants: dict[str, object] = {}
    if not isinstance(given, Map):
        return given, constants
    left: list[tuple[Scalar, Node]] = []
    for key, value in given.entries:
        port = str(key.value)
        if port not in wires or not is_literal(value):
            left.append((key, value))
            continue
        scope.reading.constants += 1
        wires[port] = Wire(port, f"{scope.prefix}{port}@{scope.reading.constants}", value.place)
        constants[port] = read_literal(value, skill.INPUT_PORTS[port].data_type, port, scope.findings)
    return replace(given, entries=tuple(left)), constants


def _rewire(name: str, direction: str, given: Node, wires: dict[str, Wire], skill: type[Skill], scope: Scope) -> None:
    if not isinstance(given, Map):
        scope.findings.add(given.place, "wrong_type", f"{direction}: must be a mapping of port: key")
        return
    word = "input" if direction == "in" else "output"
    for key, value in given.entries:
        port = str(key.value)
        if port not in wires:
            if port in skill.Params.model_fields:
                what = f"{port!r} of skill {name!r} is a parameter, not a port: write it outside of {direction}:"
                scope.findings.add(key.place, "unknown_port", what, valid=", ".join(wires) or "none")
            elif port in {**skill.INPUT_PORTS, **skill.OUTPUT_PORTS}:
                where = "out" if direction == "in" else "in"
                what = f"port {port!r} of skill {name!r} is not an {word} port: it belongs under {where}:"
                scope.findings.add(key.place, "unknown_port", what, valid=", ".join(wires) or "none")
            else:
                scope.findings.unknown(key.place, "unknown_port", f"{word} port of skill {name!r}:", port, wires)
        elif not isinstance(value, Scalar) or not isinstance(value.value, str):
            scope.findings.add(value.place, "wrong_key", f"{direction}.{port}: must be the name of a key")
        elif not value.poisoned and (wire := scope.wire(port, value.value, value.place)):
            wires[port] = wire


def _subtree(place: Place, body: Node, scope: Scope) -> NodeSpec:
    given = _settings_map("subtree", place, body, scope)
    taken, rest = _take(given, "name")
    values, rest = handed_on(rest)
    settings = validate(SubtreeSettings, rest, "node 'subtree'", scope.findings, where=place, beside=TITLE)
    if settings is None:
        return NodeSpec("unknown", _title(taken, "subtree", scope), place)
    file_node = rest.get("file")
    at = file_node.place if file_node else place
    found = find_subtree(settings.file, at, scope)
    if found is None:
        return NodeSpec("unknown", _title(taken, "subtree", scope), place)
    path, identity, source = found
    name = scope.reading.carry(path.stem, identity, source, at)
    title = _title(taken, name, scope)
    inner, tree = open_subtree(source, values, scope, at)
    if tree is None:
        return NodeSpec("unknown", title, place)
    ports: dict[str, str] = {}
    for key, value in entries_of(rest.get("ports")):
        if isinstance(value, Scalar) and (wire := scope.wire(str(key.value), str(value.value), value.place)):
            ports[str(key.value)] = wire.key
    # py_trees splits keys at dots, so that none may stand in a key.
    scope.reading.subtrees += 1
    prefix = f"{scope.prefix}{re.sub('[^A-Za-z0-9]', '_', name)}@{scope.reading.subtrees}/"
    child_scope = replace(scope, file=path, prefix=prefix, ports=ports, trail=(*scope.trail, identity))
    child = parse_tree(substitute(tree, inner, scope.findings), child_scope)
    used = {w.key for n in child.walk() for w in (*n.reads.values(), *n.writes.values())}
    for key, _ in entries_of(rest.get("ports")):
        if str(key.value) in ports and ports[str(key.value)] not in used:
            own = (k.removeprefix(prefix) for k in used if k.startswith(prefix))
            names = [k for k in own if "/" not in k and "@" not in k]
            scope.findings.unknown(key.place, "unknown_port", f"port of subtree {name!r}:", str(key.value), names)
    return NodeSpec("subtree", title, place, (child,), settings)
