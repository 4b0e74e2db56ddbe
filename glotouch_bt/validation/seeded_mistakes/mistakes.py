# ruff: noqa: E501 (a table of one mistake a line reads better than wrapped ones)
"""Seeded mistakes in a mission of shipped skills, and unusual missions that are correct.

Each mistake replaces one piece of the mission; `at` is a piece of the line (of the mutated mission) it must be found on.
"""

from __future__ import annotations

from dataclasses import dataclass

MISSION = """\
mission: m
world: worlds/container_five.yaml
timeout_s: 1800
leaves: {hand: object}
parameters:
  target: {type: stl, default: wukong}
  expected_objects: {type: int, default: 5, range: [1, 20]}
  speed: {type: float, unit: mm/s, default: 30, range: [10, 60]}
tree:
  sequence:
    - tool_pickup
    - retry: {attempts: 2, do: tool_calibrate}
    - selector:
        name: explore
        do:
          - repeat:
              name: all found
              until: complete
              limit: 60
              do:
                - guarded_sweep: {expected_objects: $expected_objects, speed_m_s: $speed}
                - succeed: orbit_probe
          - sequence:
              - condition: {port: exhausted, equals: true}
              - condition: {port: found, at_least: 1}
    - for_each:
        name: measure
        items: candidates
        order_by: quality
        item: candidate
        collect: {measured: candidates}
        do:
          - succeed: refine_outline
          - succeed: touch_top
    - timeout: {seconds: 60 s, do: tool_return}
    - for_each:
        name: squeeze all
        items: candidates
        item: candidate
        collect: {touchset: touchsets}
        on_failure: continue
        do: squeeze
    - match: {target: $target}
    - grasp
    - lift
"""


@dataclass(frozen=True)
class Mistake:
    """One seeded mistake.

    Attributes:
        name: Description of the mistake.
        old, new: Text of `MISSION` to replace once, and its replacement.
        code: Expected finding.
        at: Part of the line of the finding.
        word: Part of its message.
    """

    name: str
    old: str
    new: str
    code: str
    at: str
    word: str = ""

    @property
    def text(self) -> str:
        """The mutated mission."""
        assert MISSION.count(self.old) == 1, (self.name, MISSION.count(self.old))
        return MISSION.replace(self.old, self.new)

    @property
    def line(self) -> int:
        """Return the line of the finding."""
        lines = [i for i, text in enumerate(self.text.splitlines(), 1) if self.at in text]
        assert len(lines) == 1, (self.name, lines)
        return lines[0]


M = Mistake
MISTAKES = (
    # names, values, units
    M("a skill's name misspelt", "    - grasp\n", "    - graps\n", "unknown_skill", "- graps", "'grasp'"),
    M("a node's name misspelt", "    - selector:\n", "    - slector:\n", "unknown_skill", "- slector", "'selector'"),
    M("a parameter misspelt", "{expected_objects: $", "{expected_object: $", "unknown_parameter", "expected_object: $", "'expected_objects'"),
    M("a mission parameter misspelt", "match: {target: $target}", "match: {target: $tagret}", "unknown_parameter", "$tagret", "'target'"),
    M("a parameter left out", "match: {target: $target}", "match", "missing_parameter", "- match", "'target'"),
    M("text for a number", "speed_m_s: $speed", "speed_m_s: fast", "wrong_type", "speed_m_s: fast", "number"),
    M("half an attempt", "attempts: 2", "attempts: 1.5", "wrong_type", "attempts: 1.5", "whole number"),
    M("too fast", "speed_m_s: $speed", "speed_m_s: 0.4", "wrong_range", "speed_m_s: 0.4", "<= 0.08"),
    M("metres for millimetres", "speed_m_s: $speed", "speed_m_s: 40", "wrong_range", "speed_m_s: 40", "<= 0.08"),
    M("a force for a speed", "speed_m_s: $speed", "speed_m_s: 40 N", "wrong_unit", "40 N", "not 'N'"),
    M("a parameter in another unit", "unit: mm/s, default", "unit: mm, default", "wrong_unit", "speed_m_s: $speed", "not 'mm'"),
    M("a default out of its range", "default: 5, range", "default: 50, range", "wrong_value", "default: 50", "[1, 20]"),
    M("an object nobody knows", "default: wukong", "default: wukon", "no_such_stl", "wukon", "'wukong'"),
    M("a time that is a length", "seconds: 60 s", "seconds: 60 mm", "wrong_unit", "60 mm", "not 'mm'"),
    # keys: unwritten, sometimes unwritten, of the wrong kind
    M("the tool is never taken", "    - tool_pickup\n", "", "port_unset", "do: tool_calibrate", "'tool'"),
    M("the tool may not have been taken", "    - tool_pickup\n", "    - succeed: tool_pickup\n", "port_maybe_unset", "do: tool_calibrate", "'tool_pickup'"),
    M("a port wired to a misspelt key", "    - lift\n", "    - lift: {in: {grip_m: grib_m}}\n", "port_unset", "grib_m", "'grip_m'"),
    M("the plan is not sure", "    - match: {target: $target}\n", "    - succeed: {match: {target: $target}}\n", "port_maybe_unset", "- grasp", "'plan'"),
    M("grasped before matched", "    - match: {target: $target}\n    - grasp\n", "    - grasp\n    - match: {target: $target}\n", "port_unset", "- grasp", "later"),
    M("gathers what nobody writes", "{touchset: touchsets}", "{touch_set: touchsets}", "port_unset", "touch_set:", "touch_set"),
    M("loops over what is no list", "        items: candidates\n        order_by: quality\n", "        items: tool\n", "port_type", "items: tool", "as tuple"),
    M("sorts by a field that is not there", "    - for_each:\n        name: measure\n        items: candidates\n        order_by: quality\n", "    - for_each:  # by size\n        name: measure\n        items: candidates\n        order_by: qality\n", "unknown_field", "# by size", "'quality'"),
    M("a candidate where a plan is wanted", "    - grasp\n", "    - grasp: {in: {plan: ranking}}\n", "port_type", "plan: ranking", "GraspPlan"),
    M("a weight where a width is wanted", "    - lift\n", "    - lift\n    - lift: {in: {grip_m: weight}}\n", "port_unit", "grip_m: weight", "in N"),
    M("waits for a number", "until: complete", "until: found", "port_type", "until: found", "as bool"),
    M("compares a number with text", "{port: found, at_least: 1}", "{port: found, equals: some}", "port_type", "equals: some", "as str"),
    M("compares a flag with a number", "{port: exhausted, equals: true}", "{port: exhausted, at_least: 1}", "port_type", "exhausted, at_least", "bool"),
    M("a condition on a misspelt key", "{port: found, at_least: 1}", "{port: fuond, at_least: 1}", "port_unset", "fuond", "'found'"),
    M("a constant for what has none", "    - grasp\n", "    - grasp: {in: {plan: 7}}\n", "wrong_type", "plan: 7", "GraspPlan"),
    M("wired under the wrong side", "    - grasp\n", "    - grasp: {in: {grip_m: grip}}\n", "unknown_port", "grip_m: grip", "belongs under out"),
    # the hand
    M("squeezes with the probe in the hand", "    - timeout: {seconds: 60 s, do: tool_return}\n", "", "wrong_state", "do: squeeze", "'probe'"),
    M("the probe may still be in the hand", "do: tool_return}", "do: {succeed: tool_return}}", "wrong_state", "do: squeeze", "probe"),
    M("the probe goes back twice", "do: tool_return}\n", "do: tool_return}\n    - tool_return\n", "wrong_state", "    - tool_return", "'empty'"),
    M("probes with the bare hand", "do: tool_return}\n", "do: tool_return}\n    - guarded_sweep: {name: again}\n", "wrong_state", "name: again", "'empty'"),
    M("lifts without grasping", "    - grasp\n    - lift\n", "    - lift: {in: {grip_m: 0.04}}\n", "wrong_state", "- lift", "'empty'"),
    M("lifts after a failed grasp", "    - grasp\n    - lift\n", "    - succeed: grasp\n    - lift: {in: {grip_m: 0.04}}\n", "wrong_state", "- lift", "'empty'"),
    M("grasps again with the object in the hand", "    - grasp\n    - lift\n", "    - retry: {attempts: 2, do: [grasp, lift]}\n", "wrong_state", "[grasp, lift]", "'object'"),
    M("takes the probe with the object in the hand", "    - lift\n", "    - lift\n    - tool_pickup: {name: again}\n", "wrong_state", "name: again", "'object'"),
    M("reports success without the object", "    - grasp\n    - lift\n", "    - succeed: [grasp, lift]\n", "wrong_end", "leaves:", "'empty'"),
    # ways that are not ways
    M("an alternative behind one that cannot fail", "          - sequence:\n", "          - succeed: touch_top\n          - sequence:\n", "unreachable", "          - sequence:", "always succeeds"),
    M("a step behind one that cannot succeed", "    - grasp\n", "    - fail: {do: tool_check}\n    - grasp\n", "unreachable", "- grasp", "always fails"),
    M("a key that the loop does not write", "until: complete", "until: exhausted_all", "port_unset", "exhausted_all", ""),
    M("waits for what its loop cannot change", "        do: squeeze\n", "        do: {repeat: {until: complete, do: squeeze}}\n", "until_constant", "until: complete, do", "'complete'"),
    M("a loop without an end", "until: complete\n              limit: 60\n", "\n", "wrong_value", "          - repeat:", "times or until"),
    M("two skills on one arm", "    - retry: {attempts: 2, do: tool_calibrate}\n", "    - parallel: [tool_calibrate, wrist_check]\n", "arm_shared", "- parallel", "arm"),
    M("a condition that tests two things", "at_least: 1}", "at_least: 1, at_most: 5}", "wrong_value", "at_most: 5", "exactly one"),
    M("two nodes in one entry", "    - grasp\n    - lift\n", "    - grasp:\n      lift:\n", "not_a_node", "      lift:", "indentation"),
    M("an empty list of steps", "    - lift\n", "    - lift\n    - sequence: []\n", "no_children", "sequence: []", "no children"),
    M("a subtree that is not there", "    - lift\n", "    - subtree: {file: subtrees/lfit.yaml}\n", "unusable_subtree", "lfit", ""),
    # warnings
    M("one failing item ends it", "    - for_each:\n        name: squeeze all\n        items: candidates\n        item: candidate\n        collect: {touchset: touchsets}\n        on_failure: continue\n", "    - for_each:  # squeeze\n        items: candidates\n        item: candidate\n        collect: {touchset: touchsets}\n", "all_or_nothing", "# squeeze", "on_failure: continue"),
    M("a timeout beyond the mission's", "seconds: 60 s", "seconds: 40 min", "timeout_never", "40 min", "1800"),
    M("a parameter nobody uses", "speed_m_s: $speed", "speed_m_s: 0.04", "unused_parameter", "  speed: {", "'speed'"),
    M("a parameter may be set too high", "default: 30, range: [10, 60]", "default: 30, range: [10, 600]", "range_too_wide", "speed_m_s: $speed", "<= 0.08"),
    M("renames what nobody reads", "    - lift\n", "    - lift: {out: {weight_N: wieght}}\n", "unused_key", "wieght", "'weight_N'"),
    M("tries again once", "attempts: 2", "attempts: 1", "no_effect", "attempts: 1", "one attempt"),
    M("catches what cannot fail", "          - succeed: touch_top\n", "          - succeed: {succeed: touch_top}\n", "no_effect", "succeed: {succeed", "never fails"),
    M("a float compared exactly", "    - lift\n", "    - lift\n    - condition: {port: grip_m, equals: 0.04}\n", "float_equality", "equals: 0.04", "exactly"),
    M("a condition that always holds", "    - match:", "    - condition: {port: tool, is_set: true}\n    - match:", "constant_condition", "port: tool", "always holds"),
    M("an alternative that never helps", "          - sequence:\n              - condition: {port: exhausted, equals: true}\n              - condition: {port: found, at_least: 1}\n", "          - fail: {condition: {port: exhausted, equals: true}}\n", "cannot_help", "fail: {condition", "never succeeds"),
)  # fmt: skip

_HEAD = "mission: m\nworld: worlds/container_five.yaml\n"
_TOOL = "leaves: {hand: probe}\ntree:\n  - tool_pickup\n"
RIGHT: dict[str, str] = {
    "as it is": MISSION,
    "no probe, a known place": _HEAD + "tree:\n  - tare\n  - grasp: {in: {plan: {candidate: 0, position_K_m: [0, 0, 25 mm], yaw_rad: 30 deg, aperture_m: 50 mm, opening_m: 80 mm}}}\n  - lift\n",
    "the probe stays, and it is said": _HEAD + _TOOL,
    "either of two states in the end": _HEAD + "leaves: {hand: [probe, empty]}\ntree:\n  - tool_pickup\n  - succeed: {timeout: {seconds: 30, do: tool_calibrate}}\n",
    "pickup again after its failure": _HEAD + "leaves: {hand: probe}\ntree:\n  retry: {attempts: 3, do: [tool_pickup, tool_calibrate]}\n",
    "return again after its failure": MISSION.replace("seconds: 60 s, do: tool_return", "seconds: 60 s, do: {retry: {attempts: 2, do: tool_return}}"),
    "bare fingers instead of the probe": _HEAD + "tree:\n  - bare_hand\n  - guarded_sweep\n  - orbit_probe\n",
    "fingers, then a squeeze": _HEAD + "tree:\n  - bare_hand\n  - repeat: {until: complete, limit: 30, do: [guarded_sweep, {succeed: orbit_probe}]}\n  - for_each: {items: candidates, item: candidate, on_failure: continue, collect: {touchset: touchsets}, do: squeeze}\n",
    "a condition on one output makes the others sure": _HEAD + "tree:\n  - bare_hand\n  - guarded_sweep\n  - succeed: orbit_probe\n  - condition: {port: found, at_least: 1}\n  - for_each: {items: candidates, item: candidate, on_failure: continue, do: squeeze}\n",
    "set or not, both ways lead on": _HEAD + "tree:\n  - bare_hand\n  - succeed: guarded_sweep\n  - selector:\n    - [{condition: {port: contact, is_set: true}}, {condition: {port: map, is_set: true}}, orbit_probe]\n    - condition: {port: exhausted, equals: true}\n",
    "a safe end that does not count as success": _HEAD + "leaves: {hand: object}\ntree:\n  selector:\n    - [bare_hand, guarded_sweep, orbit_probe, {for_each: {items: candidates, item: candidate, on_failure: continue, collect: {touchset: touchsets}, do: squeeze}}, {match: {target: apple}}, grasp, lift]\n    - fail: stow\n",
    "a failure that is meant": _HEAD + "tree:\n  selector:\n    - invert: bare_hand\n    - guarded_sweep\n",
    "one failing item ends it, and it is said": MISSION.replace("on_failure: continue", "on_failure: stop"),
    "one failing item is tried again and then skipped": MISSION.replace("        do: squeeze\n", "        do: {retry: {attempts: 2, do: squeeze}}\n"),
    "keys renamed throughout": _HEAD + "leaves: {hand: probe}\ntree:\n  - tool_pickup: {out: {tool: stick}}\n  - tool_calibrate: {in: {before: stick}, out: {tool: exact}}\n  - guarded_sweep: {in: {tool: exact}}\n",
    "once again, from another start": _HEAD + "tree:\n  - bare_hand\n  - repeat: {times: 3, do: guarded_sweep}\n",
    "a timeout inside a longer one": _HEAD + _TOOL + "  - timeout: {seconds: 10 min, do: {retry: {attempts: 2, do: {timeout: {seconds: 1 min, do: tool_calibrate}}}}}\n",
    "an optional input that nobody writes": _HEAD + "tree:\n  - bare_hand\n  - guarded_sweep\n  - orbit_probe\n",
    "touched where it tells most": MISSION.replace("    - for_each:\n        name: squeeze all\n        items: candidates\n        item: candidate\n        collect: {touchset: touchsets}\n        on_failure: continue\n        do: squeeze\n", "    - repeat: {until: decided, limit: 100, do: {touch_next: {target: $target}}}\n"),
    "matched again after more touches": MISSION.replace("    - match: {target: $target}\n", "    - selector:\n      - match: {target: $target}\n      - [{repeat: {until: decided, limit: 20, do: {touch_next: {target: $target}}}}, {match: {target: $target}}]\n"),
    "nothing but a condition in the end": MISSION + "    - condition: {port: weight, at_least: 0.5}\n",
    "two candidates' worth of grasps": MISSION.replace("    - grasp\n    - lift\n", "    - retry: {attempts: 3, do: grasp}\n    - lift\n"),
    "measured as often as it takes": MISSION.replace("          - succeed: touch_top\n", "          - succeed: {retry: {attempts: 2, do: touch_top}}\n"),
    "values in other units": MISSION.replace("speed_m_s: $speed", "speed_m_s: $speed, height_m: 18 mm"),
    "a list within a list": MISSION.replace("    - grasp\n    - lift\n", "    - - grasp\n      - lift\n"),
}  # fmt: skip
