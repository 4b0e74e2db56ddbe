"""Run by Python 3.10 among the vendors' packages: writes, as JSON, what their modules offer and how they refuse.

    python introspect_vendor.py OUT flexivrdk xensesdk xensegripper.xense_gripper

Compiled pybind11 functions have no signature to inspect, but the first lines of their docstrings are one.
"""

import ast
import enum
import importlib
import inspect
import json
import re
import sys
import warnings

NUMBERED = re.compile(r"^(?:\d+\. )?(\w+)\((.*)\) -> (.*)$")


def split(arguments):
    """`a: X[b, c] = [1, 2], d` -> ["a: X[b, c] = [1, 2]", "d"]."""
    parts, depth, last, quoted = [], 0, 0, False
    for i, c in enumerate(arguments):
        if c == '"':
            quoted = not quoted
        elif not quoted and c in "[({<":
            depth += 1
        elif not quoted and c in "])}>":
            depth -= 1
        elif c == "," and depth == 0 and not quoted:
            parts.append(arguments[last:i])
            last = i + 1
    return [p.strip() for p in [*parts, arguments[last:]] if p.strip()]


def plain(value):
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    return value if isinstance(value, (int, float, str, bool, type(None))) else repr(value)


def documented(name, text):
    """Overloads of a pybind11 function."""
    found = []
    for line in (text or "").splitlines():
        match = NUMBERED.match(line.strip())
        if match is None or match[1] != name or match[2] == "*args, **kwargs":
            continue
        arguments = []
        for part in split(match[2]):
            declared, has_default, default = part.partition(" = ")
            argument = {"name": declared.split(":")[0].strip(), "has_default": bool(has_default)}
            if has_default:
                try:
                    argument["default"] = plain(ast.literal_eval(default))
                except (ValueError, SyntaxError):
                    argument["default"] = default
            arguments.append(argument)
        found.append([a for a in arguments if a["name"] != "self"])
    return found


def inspected(function):
    arguments = []
    for p in inspect.signature(function).parameters.values():
        if p.name in ("self", "cls") or p.kind == p.VAR_POSITIONAL:
            continue
        argument = {"name": p.name, "has_default": p.default is not p.empty}
        if p.kind == p.VAR_KEYWORD:
            argument = {"name": "**" + p.name, "has_default": True, "default": None}
        elif argument["has_default"]:
            argument["default"] = plain(p.default)
        arguments.append(argument)
    return [arguments]


def members_of(cls):
    if issubclass(cls, enum.Enum):
        return {m.name: int(m.value) for m in cls}
    found = getattr(cls, "__members__", None)  # pybind11 enumeration
    return {n: int(m.value) for n, m in found.items()} if isinstance(found, dict) else None


def shape(value):
    """The type of a field's first value, and its length if it has one."""
    return [type(value).__name__, len(value) if isinstance(value, (list, tuple)) else None]


def described(cls):
    members = members_of(cls)
    if members is not None:
        return {"kind": "enum", "members": members}
    methods, fields, nested = {}, [], {}
    for name in dir(cls):
        if name.startswith("_") and name != "__init__":
            continue
        static, value = inspect.getattr_static(cls, name), getattr(cls, name)
        if isinstance(value, type):
            nested[name] = described(value)
        elif isinstance(static, property) or inspect.ismemberdescriptor(static):
            fields.append(name)
        elif callable(value):
            overloads = documented(name, value.__doc__)
            if not overloads:
                try:
                    overloads = inspected(value)
                except (TypeError, ValueError):
                    overloads = []
            methods[name] = overloads
    values = {}
    if fields:
        try:
            made = cls()
            values = {f: shape(getattr(made, f)) for f in fields}
        except Exception:  # it needs a device
            values = {}
    return {"kind": "class", "methods": methods, "fields": fields, "values": values, "nested": nested}


def refusal(call):
    try:
        call()
    except Exception as e:
        return type(e).__name__
    return "accepted"


def refusals(name, module):
    """What can be tried without a device."""
    if name == "flexivrdk":
        tool = module.ToolParams()
        mine = tool.CoM
        mine[0] = 5.0
        return {
            "a serial number of the wrong form": refusal(lambda: module.Robot("Rizon4")),
            "a serial number that is a number": refusal(lambda: module.Robot(5)),
            "a tool's CoM of two numbers": refusal(lambda: setattr(tool, "CoM", [0.0, 0.0])),
            "a tool's mass in words": refusal(lambda: setattr(tool, "mass", "heavy")),
            "a field that is not there": refusal(lambda: setattr(tool, "colour", 1)),
            "a tool of nothing": refusal(lambda: module.Tool(None)),
            "a list that was handed out is a copy": str(list(tool.CoM) == [0.0, 0.0, 0.0]),
            "an enumeration equals its number": str(module.Mode.IDLE == 1),
            "an enumeration converts to its number": str(int(module.Mode.IDLE)),
        }
    if name == "xensesdk":
        return {
            "a sensor number nobody has": refusal(lambda: module.Sensor.create(77)),
            "a serial number nobody has": refusal(lambda: module.Sensor.create("OG999999")),
        }
    return {"a serial port nobody has": refusal(lambda: module.XenseSerialGripper("/dev/no-such-port"))}


def public(module):
    for name in dir(module):
        value = getattr(module, name)
        if isinstance(value, type) and not name.startswith("_"):
            yield name, value


def main():
    warnings.simplefilter("ignore")
    out = {}
    for name in sys.argv[2:]:
        module = importlib.import_module(name)
        extra = [("Sensor", module.Sensor)] if name == "xensesdk" else []  # it is handed out lazily
        classes = [*public(module), *extra]
        if name != "flexivrdk":  # their modules also show what they import
            classes = [(n, c) for n, c in classes if n.startswith(("Xense", "Sensor", "ControlMode"))]
        out[name] = {
            "version": getattr(module, "__version__", None),
            "classes": {n: described(c) for n, c in classes},
            "refusals": refusals(name, module),
        }
    with open(sys.argv[1], "w") as file:  # the vendors' libraries print to stdout
        json.dump(out, file)


if __name__ == "__main__":
    main()
