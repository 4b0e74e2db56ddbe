"""Report what is probably not meant: two skills at once on one arm, loops that nothing ends, nodes without effect."""

from __future__ import annotations

from glotouch_bt.mission.check.data_flow import DataFlow
from glotouch_bt.mission.check.requirements import verdicts
from glotouch_bt.mission.nodes import UNSET, kind_of
from glotouch_bt.mission.spec import Findings, NodeSpec, Place

MAX_RUNS = 1_000_000
"""Report a mission whose loops allow more skill runs than this."""


def check_lint(flow: DataFlow, findings: Findings, timeout_s: float) -> None:
    """Report what is probably not meant.

    Args:
        flow: The analysis; the lenient one if there are mistakes, so that their consequences are not reported.
        findings: Where findings go.
        timeout_s: Longest duration of the mission.
    """
    _Lint(flow, findings).look(flow.tree, (), timeout_s)
    runs = kind_of(flow.tree).max_runs(flow.tree)
    if runs.fixed > MAX_RUNS:
        what = f"loops within loops: up to {runs} runs of skills"
        findings.add(flow.tree.place, "practically_endless", what)


class _Lint:
    def __init__(self, flow: DataFlow, findings: Findings) -> None:
        self._flow, self._findings = flow, findings
        self._read = {w.key for n in flow.tree.walk() for w in n.reads.values()}
        self._written = {w.key for n in flow.tree.walk() for w in n.writes.values()}

    def look(self, node: NodeSpec, above: tuple[NodeSpec, ...], timeout_s: float) -> None:
        kind = kind_of(node)
        if kind.concurrent:
            self._at_once(node)
        if kind.revisits:
            self._until(node, above)
        if kind.loses_gathered(node):
            self._all_or_nothing(node, above)
        self._gathered(node)
        if not node.children:
            self._condition(node)
        if not kind.continue_on:
            self._alternatives(node)
        if node.skill_type is not None:
            self._renamed(node)
        self._no_effect(node)
        limit_s = kind.time_limit_s(node)
        if limit_s is not None:
            if limit_s >= timeout_s:
                outer = next((n for n in reversed(above) if kind_of(n).time_limit_s(n) is not None), None)
                whose = f"{outer.name!r} (line {outer.place.line})" if outer is not None else "the mission"
                what = f"{node.name!r} allows {limit_s:g} s, {whose} only {timeout_s:g} s"
                self._findings.add(node.place, "timeout_never", what, node=node.name)
            timeout_s = min(timeout_s, limit_s)
        for child in node.children:
            self.look(child, (*above, node), timeout_s)

    def _add(self, node: NodeSpec, code: str, what: str, place: Place | None = None) -> None:
        self._findings.add(place or node.place, code, what, node=node.name)

    def _at_once(self, node: NodeSpec) -> None:
        for i, child in enumerate(node.children):
            for other in node.children[:i]:
                mine, theirs = _users(child), _users(other)
                for thing in sorted(set(mine) & set(theirs)):
                    one, two = theirs[thing], mine[thing]
                    what = f"{two.name!r} and {one.name!r} (line {one.place.line}) both use the {thing} at once"
                    self._add(two, "arm_shared", what)
                written = {w.key: (n, w.place) for n in other.walk() for w in n.writes.values()}
                for below in child.walk():
                    for wire in below.writes.values():
                        if wire.key in written:
                            name = wire.key.rpartition("/")[2]
                            writer, place = written[wire.key]
                            what = f"{below.name!r} and {writer.name!r} (line {place.line}) write {name!r} at once"
                            self._add(below, "written_twice", what, wire.place)

    def _until(self, node: NodeSpec, above: tuple[NodeSpec, ...]) -> None:
        compared = kind_of(node).comparison(node)
        if compared is None:
            return
        wire = node.reads[compared[0]]
        outer = next((n for n in reversed(above) if kind_of(n).concurrent), node)
        if any(w.key == wire.key for n in outer.walk() for w in n.writes.values()):
            return
        if any(n.is_unread for n in node.walk()):
            return
        name = wire.key.rpartition("/")[2]
        self._add(
            node, "until_constant", f"nothing inside {node.name!r} writes {name!r}, which it waits for", wire.place
        )

    def _all_or_nothing(self, node: NodeSpec, above: tuple[NodeSpec, ...]) -> None:
        if not node.children or not self._fails(node.children[0]):
            return
        if any(kind_of(n).catches_failure(n) for n in above):
            return
        what = f"if one item of {node.name!r} fails, the mission fails with what it gathered"
        what += "; say on_failure: continue, or on_failure: stop if it is meant"
        self._add(node, "all_or_nothing", what)

    def _condition(self, node: NodeSpec) -> None:
        compared = kind_of(node).comparison(node)
        if compared is None:
            return
        settings, variables = compared[1], self._flow.variables
        for requirement in self._flow.requirements[id(node)]:
            found = self._flow.found(requirement) & (requirement.good | {UNSET})
            yes, no = verdicts(variables, requirement, settings)
            if found - {UNSET} and not (found & yes and found & no):
                said = "always holds" if found & yes else "never holds"
                self._add(node, "constant_condition", f"{node.name!r} {said}")
            kinds = [variables.kind(requirement.key, v) for v in found - {UNSET}]
            measured = kinds and all(k.data_type is float for k in kinds)
            if settings.equals is not None and not isinstance(settings.equals, (bool, str)) and measured:
                what = f"{node.name!r} compares the float {settings.port!r} for being exactly {settings.equals}"
                self._add(node, "float_equality", what)

    def _alternatives(self, node: NodeSpec) -> None:
        for child in node.children:
            idle = not any(n.skill_type is not None or n.is_unread for n in child.walk())
            if idle and self._entered(child) and not self._succeeds(child):
                self._add(child, "cannot_help", f"{child.name!r} is an alternative that never succeeds")

    def _renamed(self, node: NodeSpec) -> None:
        for port, wire in node.writes.items():
            if wire.place != node.place and wire.key not in self._read:
                name = wire.key.rpartition("/")[2]
                what = f"no node reads {name!r}, to which {node.name!r} writes its {port!r}"
                near = self._findings.nearest(name, (k.rpartition("/")[2] for k in self._read))
                self._findings.add(wire.place, "unused_key", what, hint=near, node=node.name)

    def _gathered(self, node: NodeSpec) -> None:
        """Report a gathered key that no node reads, if a similar name is read and never written."""
        for port, (_, target) in kind_of(node).gathers(node).items():
            if target not in self._read:
                name = target.rpartition("/")[2]
                missed = {k.rpartition("/")[2] for k in self._read - self._written}
                if near := self._findings.nearest(name, missed):
                    what = f"no node reads {name!r}, in which {node.name!r} gathers, and no node writes {near!r}"
                    self._findings.add(node.writes[port].place, "unused_key", what, hint=near, node=node.name)

    def _no_effect(self, node: NodeSpec) -> None:
        child = node.children[0] if node.children else None
        if child is None or not self._entered(child):
            return
        why = kind_of(node).no_effect(node, fails=self._fails(child), succeeds=self._succeeds(child))
        if why:
            self._add(node, "no_effect", f"{node.name!r} changes nothing: {why}")

    def _entered(self, node: NodeSpec) -> bool:
        return id(node) in self._flow.entered

    def _fails(self, node: NodeSpec) -> bool:
        return (id(node), False) in self._flow.ends

    def _succeeds(self, node: NodeSpec) -> bool:
        return (id(node), True) in self._flow.ends


def _users(node: NodeSpec) -> dict[str, NodeSpec]:
    """Return what the skills of a subtree use, each with the first skill that uses it."""
    found: dict[str, NodeSpec] = {}
    for below in node.walk():
        for thing in below.skill_type.USES if below.skill_type is not None else ():
            found.setdefault(thing, below)
    return found
