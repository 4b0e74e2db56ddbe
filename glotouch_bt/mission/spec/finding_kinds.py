"""Every kind of finding, declared once: what it means, why it matters, what to do, if it is an error or a warning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Literal


@dataclass(frozen=True)
class FindingKind:
    """One kind of finding.

    Attributes:
        code: Short stable word, for programs.
        meaning: One line for people.
        why: Why it matters; empty: the meaning says it.
        advice: What to do; empty: the message says it.
        severity: An error stops the mission from being run. A warning may be intended.
        brief: True to print it on one line, without the mission's text and the reasons.
    """

    code: str
    meaning: str
    why: str = ""
    advice: str = ""
    severity: Literal["error", "warning"] = "error"
    brief: bool = False


_Error, _Warning = FindingKind, partial(FindingKind, severity="warning")

_CONVERT = "`glotouch objects DIR --out CLEAN` shows what is wrong and repairs what can be repaired"

_KINDS = (
    # the file and its keys
    _Error("unreadable", "the file cannot be read as YAML"),
    _Error("unknown_key", "no such key exists here"),
    _Error("missing_key", "a required key is missing"),
    _Error("wrong_name", "the name has characters that are not allowed"),
    _Error("wrong_type", "the value has the wrong type"),
    _Error("wrong_value", "the value is not allowed"),
    _Error("wrong_range", "the number is out of range", "the skill refuses such a value"),
    _Error(
        "wrong_unit", "the unit is unknown or of another quantity", "the number would be taken for another quantity"
    ),
    _Error("unknown_parameter", "no such parameter exists"),
    _Error("missing_parameter", "a required parameter has no value"),
    _Error("unknown_world", "the world file does not exist"),
    _Error("unusable_world", "the world file cannot be read"),
    _Error("no_objects", "the folder of objects has no STL file", advice=_CONVERT),
    _Error(
        "no_such_stl",
        "no object of this name exists",
        advice="choose one of the valid names, for example with --set target=NAME",
    ),
    _Error(
        "not_remembered",
        "a target `touched:NAME` was never remembered, or its file is damaged",
        "the mission would fail as soon as it needs the target",
        "run the mission `remember` with the object alone in the box",
    ),
    _Error("unusable_stl", "the STL file is not a solid of a plausible size", advice=_CONVERT),
    _Error(
        "no_layout",
        "the objects do not fit into the container",
        "a simulated run places them at random and cannot start",
        "use fewer or smaller objects, or a larger container",
    ),
    _Error(
        "box_out_of_reach",
        "the arm cannot reach a part of the container, or the probe in its stand",
        "a motion there would be refused, and the mission would fail",
        "move the container or the stand in the world file, or use an arm that reaches farther",
    ),
    _Error(
        "missing_part",
        "a skill is told to use a part that the robot's gripper does not have",
        "the run is refused before anything moves",
        "set the parameter to false, or use a robot that has the part",
    ),
    _Error(
        "target_out_of_reach",
        "the target is too low to be felt, or too wide for the jaws",
        "the mission can only fail",
        "choose another target; `glotouch objects DIR` shows which of them can be grasped",
    ),
    _Error("unknown_fault", "no such fault exists"),
    _Error("unknown_node", "the mission has no node of this name"),
    # the tree
    _Error("not_a_node", "a node is expected here"),
    _Error("no_children", "the node needs a child"),
    _Error("too_large", "the tree has too many nodes or levels"),
    _Error("unknown_skill", "no skill or node has this name"),
    _Error("unusable_skill", "the skill's module cannot be imported, or the skill declares something impossible"),
    _Error("unusable_subtree", "the subtree cannot be read"),
    _Error(
        "subtree_outside",
        "the subtree's file is outside of the mission's folder",
        "a mission from somebody else could show what your files hold",
        "move the file beside the mission, or allow its folder",
    ),
    _Error("subtree_loop", "a subtree contains itself", "the tree would have no end"),
    # ports and keys
    _Error("unknown_port", "no such port exists"),
    _Error("unknown_field", "the value has no such field"),
    _Error("wrong_key", "the name of a port key is not allowed"),
    _Error(
        "port_unset",
        "no node writes this input before it is read",
        "a skill without a required input stops the mission with an error; a condition on it can only fail",
        "run the node that writes it first, wire the port to another key, or give a value: `in: {PORT: VALUE}`",
    ),
    _Error(
        "port_maybe_unset",
        "on some paths no node writes this input before it is read",
        "on the path shown the skill starts without its input, and the mission stops with an error",
        "write it on every path, or test it with a condition first",
    ),
    _Error(
        "port_type",
        "the key holds a value of another type than the port takes",
        "the skill refuses the value when it starts, in the middle of the mission",
    ),
    _Error(
        "port_unit",
        "the key holds a value in another unit than the port takes",
        "both are numbers, so nothing would stop the skill from acting on a wrong value",
    ),
    _Error(
        "written_twice",
        "two nodes write the same key at the same time",
        "the value that is read later depends on which of them ends last",
    ),
    # resources
    _Error(
        "wrong_state",
        "the skill may start while a resource is in the wrong state",
        "the skill relies on this state: it would act on wrong readings, or with something else in the hand",
    ),
    _Error(
        "wrong_end",
        "the mission may succeed with a resource in another state than it declares",
        "the mission would report success without having done what it says",
    ),
    _Error("unknown_state", "the resource has no such state"),
    _Error("unknown_resource", "no skill of the mission uses such a resource"),
    _Error(
        "arm_shared", "two skills use the same resource at the same time", "each would overwrite the other's commands"
    ),
    # control flow
    _Error("unreachable", "no run reaches this node", "it will never run"),
    _Error(
        "until_constant",
        "nothing inside the loop changes what it waits for",
        "the loop either ends after its first pass or runs until its limit",
    ),
    # warnings
    _Warning(
        "input_never_written",
        "no node ever writes this optional input",
        "the skill always works without it",
        "add the node that writes it, or wire the key through the subtree's ports",
        brief=True,
    ),
    _Warning(
        "not_put_back", "the mission may end with something in the hand", "the next mission begins with an empty hand"
    ),
    _Warning("never_succeeds", "no run ends in success", "running it can only waste time"),
    _Warning("never_fails", "no run ends in failure", "the result cannot tell if anything was done"),
    _Warning("no_effect", "the node changes nothing", "probably something else was intended"),
    _Warning(
        "cannot_help",
        "the alternative never succeeds",
        "it does nothing and never succeeds, so the alternatives before it might as well fail",
    ),
    _Warning(
        "constant_condition", "the condition always has the same result", "one of its two branches is never taken"
    ),
    _Warning(
        "all_or_nothing",
        "one failing item ends the loop and the mission",
        "one failing item ends the loop, and with it the mission; the results of the other items are lost",
        "write on_failure: continue, or on_failure: stop if it is intended",
    ),
    _Warning(
        "timeout_never", "the time limit is longer than the one around it", "the outer limit ends the mission first"
    ),
    _Warning(
        "float_equality",
        "a float is compared for equality",
        "measured numbers are hardly ever exactly equal",
        "use at_least and at_most",
    ),
    _Warning(
        "identical_objects",
        "another object has exactly the shape of the target",
        "touch cannot tell them apart: no candidate will be accepted, or either of them",
        "take one of them out of the folder, or choose another target",
    ),
    _Warning("unused_parameter", "no node uses the parameter", "setting it changes nothing"),
    _Warning("unused_subtree", "no node uses the subtree", "it does nothing and is not checked"),
    _Warning("unused_key", "no node reads the key that was renamed", "perhaps a name is misspelt"),
    _Warning(
        "range_too_wide",
        "a parameter allows values that the node refuses",
        "a value that the mission allows is refused when it is given",
    ),
    _Warning(
        "practically_endless",
        "the loops allow more runs than any mission has time for",
        "in the worst case only the mission's time limit ends it",
    ),
)

FINDING_KINDS: Mapping[str, FindingKind] = {kind.code: kind for kind in _KINDS}
"""Every kind of finding by its code, errors first."""


def describe_findings() -> list[dict[str, object]]:
    """Return every kind of finding as plain data, for the reference pages."""
    return [asdict(kind) for kind in _KINDS]
