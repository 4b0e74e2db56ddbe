"""Why each kind of finding matters, and which kinds are only warnings."""

from __future__ import annotations

from collections.abc import Mapping

WHY: Mapping[str, str] = {
    "port_unset": "a required input that nobody wrote stops the mission with an error when the skill starts; "
    "a condition on it can only fail",
    "port_maybe_unset": "on the path shown the skill starts without its input, and the mission stops with an error",
    "port_type": "the value is refused when the skill starts, in the middle of the mission",
    "port_unit": "both are numbers, so that nothing would stop it: the skill would act on a wrong value",
    "wrong_state": "the skill would move with something else in the hand than it counts on",
    "wrong_end": "the mission would report success without having done what it says",
    "unreachable": "what stands there will never run",
    "arm_shared": "each would overwrite the other's commands, period by period",
    "written_twice": "which of the values is read later depends on which of them ends last",
    "until_constant": "the loop either ends after its first pass or runs until its limit",
    "subtree_loop": "the tree would have no end",
    "wrong_unit": "the number would be taken for another quantity",
    "wrong_range": "the skill refuses such a value",
    "not_put_back": "the next mission begins with an empty hand",
    "never_succeeds": "running it can only waste time",
    "never_fails": "whoever reads its result cannot tell whether anything was done",
    "no_effect": "it does nothing here: probably something else was meant",
    "cannot_help": "it does nothing and never succeeds, so that the alternatives before it might as well fail",
    "constant_condition": "it always says the same, so that one way on is never taken",
    "all_or_nothing": "one failing item ends the loop, and with it the mission; what the others gave is lost",
    "timeout_never": "the outer limit ends the mission first",
    "float_equality": "measured numbers are hardly ever equal: use at_least and at_most",
    "unused_parameter": "setting it changes nothing",
    "unused_subtree": "it does nothing, and may be full of mistakes",
    "unused_key": "nobody reads what was renamed on purpose: perhaps a name is misspelt",
    "range_too_wide": "a value that the mission allows is refused when it is given",
    "practically_endless": "in the worst case it ends only with the mission's time",
}

WARNINGS = frozenset(
    {
        "not_put_back",
        "never_succeeds",
        "never_fails",
        "no_effect",
        "cannot_help",
        "constant_condition",
        "all_or_nothing",
        "timeout_never",
        "float_equality",
        "unused_parameter",
        "unused_key",
        "unused_subtree",
        "range_too_wide",
        "practically_endless",
    }
)
