"""The simulated devices and the driver's calls, compared with the real vendors' packages.

The real packages are installed into temporary environments of Python 3.10; without one these tests are skipped. The
comparison itself is tested without them at the end.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import pytest

from glotouch_backends.flexiv_xense.simulated.vendor_api import flexivrdk, xensegripper, xensesdk
from tests.backends.flexiv_xense.driver_usage import Use, uses
from tests.backends.flexiv_xense.introspect_vendor import described, refusals
from tests.backends.flexiv_xense.vendor_wheels import real_api

Api = dict[str, Any]
OURS = {"flexivrdk": flexivrdk, "xensesdk": xensesdk, "xensegripper.xense_gripper": xensegripper}
CLASSES = {
    "flexivrdk": tuple(n for n in flexivrdk.__all__ if n[0] != "_"),
    "xensesdk": ("Sensor",),
    "xensegripper.xense_gripper": ("XenseGripper", "XenseTCPGripper", "XenseSerialGripper"),
}
OUR_OWN_ERROR = {"SerialException": "OSError"}  # which it is a kind of


@pytest.fixture(scope="module")
def real_19(tmp_path_factory: pytest.TempPathFactory) -> Api:
    return real_api("1.9", tmp_path_factory.mktemp("vendor") / "api.json")


@pytest.fixture(scope="module")
def real_20(tmp_path_factory: pytest.TempPathFactory) -> Api:
    return real_api("2.0", tmp_path_factory.mktemp("vendor") / "api.json")


def differences(name: str, ours: Api, real: Api) -> Iterator[str]:
    """Yield every part of a class of ours that the real one does not have or has differently."""
    if ours["kind"] != real["kind"]:
        yield f"{name}: is no {ours['kind']}"
        return
    if ours["kind"] == "enum":
        if ours["members"] != real["members"]:
            yield f"{name}: members {sorted(set(ours['members'].items()) ^ set(real['members'].items()))}"
        return
    for method, overloads in ours["methods"].items():
        theirs = real["methods"].get(method)
        if theirs is None:
            yield f"{name}.{method}: there is none"
        elif (theirs and method != "__init__") or name in CONSTRUCTED:
            yield from _arguments(f"{name}.{method}", overloads[0], theirs)
    yield from (f"{name}.{f}: there is no such field" for f in sorted({*ours["fields"]} - {*real["fields"]}))
    for field, value in ours["values"].items():
        if field in real["values"] and real["values"][field] != value:
            yield f"{name}.{field}: first value is {value}, really {real['values'][field]}"
    for nested, inner in ours["nested"].items():
        if nested not in real["nested"]:
            yield f"{name}.{nested}: there is none"
        else:
            yield from differences(f"{name}.{nested}", inner, real["nested"][nested])


CONSTRUCTED = ("Robot", "Tool", "XenseTCPGripper", "XenseSerialGripper")


def _arguments(name: str, ours: list[Api], theirs: list[list[Api]]) -> Iterator[str]:
    longest = max(theirs, key=len)
    if [a["name"] for a in ours] != [a["name"] for a in longest]:
        yield f"{name}: arguments {[a['name'] for a in ours]}, really {[a['name'] for a in longest]}"
        return
    for i, (mine, real) in enumerate(zip(ours, longest, strict=True)):
        optional = real["has_default"] or any(len(o) <= i for o in theirs)
        if mine["has_default"] != optional:
            yield f"{name}({mine['name']}): is {'optional' if optional else 'needed'}"
        elif real["has_default"] and mine["default"] != real["default"]:
            yield f"{name}({mine['name']}): default {mine['default']}, really {real['default']}"


def faults_of(use: Use, module: Api) -> Iterator[str]:
    """Yield the errors of a use, given a module's classes."""
    classes = module["classes"]
    first, *rest = use.path
    if first.startswith("__"):
        return
    if first not in classes:
        yield f"{use.where}: the module has no {use.name}"
        return
    found = classes[first]
    for name in rest:
        if found["kind"] == "enum":
            if name not in (*found["members"], "name", "value"):
                yield f"{use.where}: {use.name}: no such member"
            return
        if name in found["nested"]:
            found = found["nested"][name]
        elif name in found["methods"]:
            if use.called:
                yield from _call(use, found["methods"][name])
            return
        elif name in found["fields"]:
            if use.called:
                yield f"{use.where}: {use.name} is no function"
            return
        else:
            yield f"{use.where}: there is no {use.name}"
            return
    if use.called and found["kind"] == "class":
        yield from _call(use, found["methods"].get("__init__", []))


def _call(use: Use, overloads: list[list[Api]]) -> Iterator[str]:
    """Yield an error if no overload accepts the call."""
    if not overloads or use.positional is None:
        return
    for arguments in overloads:
        names = [a["name"] for a in arguments]
        anything = any(n.startswith("**") for n in names)
        given = {*names[: use.positional], *(k for k in use.keywords if k in names or not anything)}
        needed = {a["name"] for a in arguments if not a["has_default"]}
        if use.positional <= len(names) and needed <= given <= {*names}:
            return
    yield f"{use.where}: {use.name} does not take {use.positional} arguments and {list(use.keywords)}"


@pytest.mark.parametrize("module", OURS)
def test_the_simulated_modules_offer_what_the_real_ones_do(real_19: Api, module: str) -> None:
    found = []
    for name in CLASSES[module]:
        assert name in real_19[module]["classes"], name
        found += [*differences(name, described(getattr(OURS[module], name)), real_19[module]["classes"][name])]
    assert found == []


@pytest.mark.parametrize("module", OURS)
def test_the_simulated_modules_refuse_as_the_real_ones_do(real_19: Api, module: str) -> None:
    real = {k: OUR_OWN_ERROR.get(v, v) for k, v in real_19[module]["refusals"].items()}
    ours = refusals(module, OURS[module])
    assert {k: "OSError" if v == "FileNotFoundError" else v for k, v in ours.items()} == real


def test_the_versions_are_those_we_name(real_19: Api, real_20: Api) -> None:
    assert real_19["flexivrdk"]["version"] == flexivrdk.__version__
    assert real_20["flexivrdk"]["version"].startswith("2.0")


@pytest.mark.parametrize(
    ("module", "files"),
    [
        ("flexivrdk", ("arm.py", "arm_19.py", "connect.py")),
        ("xensesdk", ("pads.py",)),
        ("xensegripper.xense_gripper", ("gripper.py",)),
    ],
)
def test_the_driver_uses_what_there_is(real_19: Api, module: str, files: tuple[str, ...]) -> None:
    assert [fault for use in uses(*files) for fault in faults_of(use, real_19[module])] == []


def test_the_driver_uses_what_there_is_in_2_0(real_20: Api) -> None:
    assert [f for use in uses("arm.py", "arm_20.py", "connect.py") for f in faults_of(use, real_20["flexivrdk"])] == []


def test_the_serial_gripper_takes_the_same_calls(real_19: Api) -> None:
    classes = real_19["xensegripper.xense_gripper"]["classes"]
    both = {"classes": {**classes, "XenseTCPGripper": classes["XenseSerialGripper"]}}
    assert [fault for use in uses("gripper.py") for fault in faults_of(use, both)] == []


# --- the comparison itself -------------------------------------------------------------------------------------------


def test_the_driver_is_read_completely() -> None:
    """The reader above knows the driver's variables by name; it must follow their renaming."""
    seen = {use.name for use in uses("arm.py", "arm_19.py", "arm_20.py", "connect.py", "pads.py", "gripper.py")}
    assert {
        "Robot.SendCartesianMotionForce",
        "Robot.SwitchMode",
        "Robot.ExecutePrimitive",
        "Robot.SetMaxContactWrench",
        "Robot.states",
        "RobotStates.timestamp",
        "RobotStates.ext_wrench_in_tcp_raw",
        "RobotStates.raw_tcp_wrench_local",
        "RobotEvent.description",
        "RobotInfo.K_x_nom",
        "Tool.Switch",
        "ToolParams.tcp_location",
        "Mode.NRT_CARTESIAN_MOTION_FORCE",
        "JointGroup.ARMS",
        "NrtCartesianCmd.twist_d",
        "PrimitiveArgs",
        "Sensor.create",
        "Sensor.calibrateSensor",
        "Sensor.selectSensorInfo",
        "Sensor.OutputType.Depth",
        "Sensor.release",
        "XenseGripper.create",
        "XenseTCPGripper.set_position",
        "XenseTCPGripper.get_gripper_status",
        "XenseTCPGripper.release",
    } <= seen


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (("Robot", "methods", "SwitchMode", 0, 0, "name"), "arguments"),
        (("Robot", "methods", "SendCartesianMotionForce", 0, 3, "default"), "default"),
        (("Robot", "methods", "ClearFault", 0, 0, "has_default"), "needed"),
        (("Mode", "members", "IDLE"), "members"),
    ],
)
def test_a_difference_is_found(path: tuple[str | int, ...], words: str) -> None:
    ours = {name: described(getattr(flexivrdk, name)) for name in CLASSES["flexivrdk"]}
    real: Any = copy.deepcopy(ours)
    *way, last = path
    place = real
    for step in way:
        place = place[step]
    place[last] = {"name": "other", "default": 0.7, "has_default": False, "IDLE": 2}[str(last)]
    name = str(path[0])
    assert words in " ".join(differences(name, ours[name], real[name]))


@pytest.mark.parametrize(
    "use",
    [
        Use("x", ("Robot", "Switch_Mode"), True, 1),
        Use("x", ("Robot", "SwitchMode"), True, 2),
        Use("x", ("Robot", "SwitchMode"), True, 0, ("group",)),
        Use("x", ("Mode", "CARTESIAN")),
        Use("x", ("RobotStates", "tcp_twist")),
        Use("x", ("RobotStates", "q"), True, 0),
        Use("x", ("Gripper",)),
    ],
)
def test_a_wrong_use_is_found(use: Use) -> None:
    module = {"classes": {name: described(getattr(flexivrdk, name)) for name in CLASSES["flexivrdk"]}}
    assert [*faults_of(use, module)] != []
    assert [*faults_of(Use("x", ("Robot", "SwitchMode"), True, 1), module)] == []
