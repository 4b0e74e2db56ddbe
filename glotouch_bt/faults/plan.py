"""Read and check a fault plan, a YAML file that says which faults happen when.

faults: biased wrist
seed: 7                     # of the faults' random draws; default: the run's
plan:
  - fault: wrench_bias
    with: {force_N: [0, 0, 3]}
    when: {node: guarded_sweep, after_s: 0.5}
    for: 2 s                # or: ever, node, {cycles: 20}
    repeat: {times: 3, every_s: 10}
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import yaml
from pydantic import BaseModel

from glotouch_bt.escaped_text import fault_of_name
from glotouch_bt.faults.effects import CATALOGUE, FaultKind, FaultParams
from glotouch_bt.faults.trigger import Duration, Repeat, When, matches
from glotouch_bt.mission.read import find_shipped, read_yaml, shown, validate
from glotouch_bt.mission.spec import Findings, Map, MissionFaults, Node, NodeSpec, Place, Scalar, Seq, split_quantity

PLAN_KEYS = ("faults", "description", "seed", "plan")
FAULT_KEYS = ("fault", "name", "with", "when", "for", "repeat")
MAX_FAULTS = 1000

M = TypeVar("M", bound=BaseModel)


@dataclass(frozen=True)
class FaultSpec:
    """One fault of a plan.

    Attributes:
        name: For reports; by default the kind's name, numbered if it occurs twice.
        kind: Its entry of the catalogue.
        params: Its parameters.
        when, duration, repeat: When it starts, how long it lasts, how often it comes.
        place: Its place in the file.
        node_place: Place of its node's name, if it has one.
    """

    name: str
    kind: FaultKind
    params: FaultParams
    when: When
    duration: Duration
    repeat: Repeat
    place: Place
    node_place: Place | None = None

    def requested(self) -> dict[str, object]:
        """Return the requested fault as JSON data."""
        return {
            "with": self.params.model_dump(mode="json"),
            "when": self.when.model_dump(mode="json", exclude_defaults=True),
            "for": self.duration.model_dump(mode="json", exclude_defaults=True),
            "repeat": self.repeat.model_dump(mode="json", exclude_defaults=True),
        }


@dataclass(frozen=True)
class FaultPlan:
    """A plan that passed every check.

    Attributes:
        name: Its name.
        faults: In the order of the file. If two change the same samples, the later one is applied last.
        seed: Seed of the faults' draws; None: the run's.
        description: Text for people.
    """

    name: str
    faults: tuple[FaultSpec, ...]
    seed: int | None = None
    description: str = ""

    @classmethod
    def from_yaml(cls, given: str | Path) -> FaultPlan:
        """Read and check a plan by path or shipped name; errors as in `read_plan`."""
        return read_plan(given)

    def as_yaml(self) -> str:
        """Return the plan as YAML from which the same plan is read."""
        seed = {} if self.seed is None else {"seed": self.seed}
        text = {"description": self.description} if self.description else {}
        faults = [{"fault": f.kind.name, "name": f.name, **f.requested()} for f in self.faults]
        data = {"faults": self.name, **text, **seed, "plan": faults}
        return str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=110))


def read_plan(given: str | Path, tree: NodeSpec | None = None, root: str = "") -> FaultPlan:
    """Read and check a plan.

    Args:
        given: A path, or the name of a shipped plan.
        tree: The mission's tree; every `when: {node: ...}` must then match one of its nodes.
        root: The mission's name, first part of every path.

    Raises:
        MissionFaults: The plan is wrong; lists every finding with its place. (A `BadInput`.)
        BadInput: The file cannot be read.
    """
    path = find_shipped("faults", str(given), "fault plan")
    return check_plan(read_yaml(path, shown(path)), tree, root)


def check_plan(source: Node, tree: NodeSpec | None = None, root: str = "") -> FaultPlan:
    """Check a plan that has been read; raises as `read_plan`."""
    findings = Findings()
    plan = _plan(source, findings)
    if plan is not None and tree is not None:
        _check_nodes(plan, tree, root, findings)
    if plan is None or len(findings):
        raise MissionFaults(findings.sorted())
    return plan


def _plan(source: Node, findings: Findings) -> FaultPlan | None:
    if not isinstance(source, Map):
        findings.add(source.place, "wrong_type", "a fault plan must be a mapping", valid=", ".join(PLAN_KEYS))
        return None
    for key, _ in source.entries:
        if key.value not in PLAN_KEYS:
            findings.unknown(key.place, "unknown_key", "key of a fault plan:", str(key.value), PLAN_KEYS)
    name = _text(source, "faults", findings, is_name=True)
    if name is None and "faults" not in source:
        findings.add(source.place, "missing_key", "a fault plan needs 'faults', its name")
    seed = source.get("seed")
    number = seed.value if isinstance(seed, Scalar) else None
    if seed is not None and not (isinstance(number, int) and not isinstance(number, bool) and 0 <= number < 2**32):
        findings.add(seed.place, "wrong_value", "seed: must be a whole number in 0 .. 4294967295")
    items = source.get("plan")
    if not isinstance(items, Seq) or not items.items:
        at = source.place if items is None else items.place
        findings.add(
            at, "missing_key" if items is None else "wrong_type", "a fault plan needs 'plan', a list of faults"
        )
        return None
    if len(items.items) > MAX_FAULTS:
        findings.add(items.place, "wrong_value", f"{len(items.items)} faults: at most {MAX_FAULTS} in a plan")
        return None
    taken: set[str] = set()
    faults = [f for item in items.items if (f := _fault(item, taken, findings)) is not None]
    text = _text(source, "description", findings) or ""
    return FaultPlan(name or "", tuple(faults), number if isinstance(number, int) else None, text)


def _text(source: Map, key: str, findings: Findings, *, is_name: bool = False) -> str | None:
    node = source.get(key)
    if node is None:
        return None
    if isinstance(node, Scalar) and isinstance(node.value, str) and node.value.strip():
        if is_name and (fault := fault_of_name(node.value)):
            findings.add(node.place, "wrong_name", f"{key}: {fault}")
            return None
        return node.value
    findings.add(node.place, "wrong_type", f"{key}: must be text")
    return None


def _fault(source: Node, taken: set[str], findings: Findings) -> FaultSpec | None:
    if not isinstance(source, Map):
        findings.add(source.place, "wrong_type", "a fault must be a mapping", valid=", ".join(FAULT_KEYS))
        return None
    for key, _ in source.entries:
        if key.value not in FAULT_KEYS:
            findings.unknown(key.place, "unknown_key", "key of a fault:", str(key.value), FAULT_KEYS)
    word = _text(source, "fault", findings)
    if word is None:
        if "fault" not in source:
            findings.add(source.place, "missing_key", "a fault needs 'fault', one of the catalogue (glotouch faults)")
        return None
    kind = CATALOGUE.get(word)
    if kind is None:
        node = source.get("fault")
        findings.unknown(node.place if node else source.place, "unknown_fault", "fault", word, CATALOGUE)
    params = None if kind is None else _model(kind.effect.Params, source, "with", f"fault {word!r}", findings)
    when = _model(When, source, "when", "'when'", findings)
    duration = _lasting(source, when, findings)
    repeat = _model(Repeat, source, "repeat", "'repeat'", findings)
    if when is not None:
        _check_when(source, when, findings)
    if duration is not None and repeat is not None and duration.until == "ever" and repeat.times > 1:
        what = "repeat: a fault that lasts for ever cannot repeat"
        findings.add(source.key_place("repeat"), "wrong_value", what, valid="for: 2 s, {cycles: 20} or node")
    if kind is None or params is None or when is None or duration is None or repeat is None:
        return None
    base = _text(source, "name", findings, is_name=True) or word
    name, n = base, 2
    while name in taken:
        name, n = f"{base} {n}", n + 1
    taken.add(name)
    moment = source.get("when")
    node = moment.get("node") if isinstance(moment, Map) else None
    return FaultSpec(name, kind, params, when, duration, repeat, source.place, node.place if node else None)


def _check_when(source: Map, when: When, findings: Findings) -> None:
    """Report conditions that can never hold and keys without effect."""
    given = source.get("when")
    at = given if isinstance(given, Map) else source
    for sensed, unit in (("force", "N"), ("aperture", "m")):
        above, below = (getattr(when, f"{sensed}_{side}_{unit}") for side in ("above", "below"))
        if above is not None and below is not None and above >= below:
            what = f"when: no {sensed} is above {above:g} {unit} and below {below:g} {unit}"
            findings.add(at.key_place(f"{sensed}_below_{unit}"), "wrong_value", what)
    for key in ("visit", "after_s"):
        if when.node is None and key in when.model_fields_set:
            what = f"when: {key} needs a node, and 'when' names none"
            findings.add(at.key_place(key), "wrong_value", what, valid="add node: NAME; time_s is the mission's time")


def _model(model: type[M], source: Map, key: str, what: str, findings: Findings) -> M | None:
    node = source.get(key)
    if node is None or (isinstance(node, Scalar) and node.value is None):
        node = Map((), source.key_place(key))
    if not isinstance(node, Map):
        findings.add(node.place, "wrong_type", f"{key}: must be a mapping", valid=", ".join(model.model_fields))
        return None
    return validate(model, node, what, findings)


def _lasting(source: Map, when: When | None, findings: Findings) -> Duration | None:
    """Read `for`: a time, `ever`, `node` or a mapping; by default until the node ends, or for ever."""
    node = source.get("for")
    has_node = when is not None and when.node is not None
    if node is None:
        return Duration(until="node" if has_node else "ever")
    words = "ever, node, a time such as 2 s, {duration_s: ...} or {cycles: ...}"
    if isinstance(node, Map):
        made = validate(Duration, node, "'for'", findings)
        if made is not None and len(node.entries) != 1:
            findings.add(node.place, "wrong_value", "for: give exactly one key", valid=words)
            return None
    elif isinstance(node, Scalar) and node.value in ("ever", "node"):
        made = Duration(until="node" if node.value == "node" else "ever")
    elif isinstance(node, Scalar) and (_is_number(node.value) or split_quantity(str(node.value))):
        key = Scalar("duration_s", node.place)
        made = validate(Duration, Map(((key, node),), node.place), "'for'", findings)
    else:
        findings.add(node.place, "wrong_type", "for: cannot be read", valid=words)
        return None
    if made is not None and made.until == "node" and when is not None and not has_node:
        findings.add(node.place, "wrong_value", "for: node, but 'when' names no node", valid="add when: {node: ...}")
        return None
    return made


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _check_nodes(plan: FaultPlan, tree: NodeSpec, root: str, findings: Findings) -> None:
    paths = tree.paths(root)
    for fault in plan.faults:
        pattern = fault.when.node
        if pattern is None or any(matches(p, pattern) for p in paths):
            continue
        names = sorted({p.rsplit("/", 1)[-1] for p in paths})
        at = fault.node_place or fault.place
        findings.unknown(at, "unknown_node", f"node of fault {fault.name!r}:", pattern, names)
