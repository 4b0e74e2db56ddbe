"""Validate a mapping with source positions by a pydantic model. Each fault becomes a finding with its position."""

from __future__ import annotations

import json
import operator
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from glotouch_bt.mission.spec import (
    SMALLER_UNITS,
    Findings,
    Map,
    Node,
    Place,
    Scalar,
    Seq,
    convert,
    split_quantity,
    units_for,
    walk,
)

M = TypeVar("M", bound=BaseModel)

_WORDS = {
    "several": "{rules}",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "float_type": "must be a number",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "literal_error": "must be {expected}",
    "enum": "must be {expected}",
    "greater_than": "must be > {gt}",
    "greater_than_equal": "must be >= {ge}",
    "less_than": "must be < {lt}",
    "less_than_equal": "must be <= {le}",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "dict_type": "must be a mapping",
    "model_type": "must be a mapping",
    "too_short": "must have at least {min_length} items",
    "too_long": "must have at most {max_length} items",
}
"""Messages by pydantic's error type; {} are its context values."""


_SCALARS = {"string_type", "int_type", "float_type", "bool_type"}
_RULES = (("gt", ">", operator.gt), ("ge", ">=", operator.ge), ("lt", "<", operator.lt), ("le", "<=", operator.le))


NOTHING: Mapping[str, str] = MappingProxyType({})


class Poison:
    """A value that already has a finding, so that no second one is reported for it."""


POISON = Poison()


def unit_of(field: FieldInfo) -> str:
    """Return the unit that a parameter declares, or empty."""
    return _extra(field, "unit")


def named_by(field: FieldInfo) -> str:
    """Return the kind of thing that a text parameter names (`stl`), or empty."""
    return _extra(field, "names")


def needed_by(field: FieldInfo) -> str:
    """Return the optional part of the gripper that a parameter needs, or empty."""
    return _extra(field, "needs")


def limits_of(field: FieldInfo) -> list[tuple[str, float, Callable[[float, float], bool]]]:
    """Return (symbol, limit, comparison) of each limit of a number, or of each number of a list."""
    rules = [*field.metadata, *(rule for item in _items(field) for rule in item.metadata)]
    found = ((symbol, getattr(m, word, None), holds) for m in rules for word, symbol, holds in _RULES)
    numbers = [(symbol, limit, holds) for symbol, limit, holds in found if isinstance(limit, (int, float))]
    return list(dict.fromkeys(numbers))


def _items(field: FieldInfo) -> list[FieldInfo]:
    """Return the rules that a list's items have."""
    annotated = (a for a in get_args(field.annotation) if get_origin(a) is Annotated)
    return [rule for a in annotated for rule in a.__metadata__ if isinstance(rule, FieldInfo)]


def _extra(field: FieldInfo, word: str) -> str:
    extra = field.json_schema_extra
    return str(extra.get(word, "")) if isinstance(extra, dict) else ""


def validate(
    model: type[M],
    given: Map,
    what: str,
    findings: Findings,
    *,
    where: Place | None = None,
    beside: Mapping[str, str] = NOTHING,
) -> M | None:
    """Return a model made from a mapping; None if that gave findings.

    Args:
        model: The pydantic model; its fields may declare a unit.
        given: The mapping as written.
        what: Name of the thing that the mapping describes, for messages (``skill 'squeeze'``).
        findings: Where faults go.
        where: Place of missing keys (default: the mapping).
        beside: Other names that are valid here, each with the key under which it is written; empty: here.
    """
    values: dict[str, Any] = {}
    poisoned: set[str] = set()
    known = True
    for key, node in given.entries:
        name = str(key.value)
        field = model.model_fields.get(name)
        if field is None:
            if beside.get(name):
                said = f"{name!r} is not a parameter of {what}: write it under {beside[name]}:"
                findings.add(key.place, "unknown_parameter", said)
            else:
                names = [*model.model_fields, *(n for n, under in beside.items() if not under)]
                findings.unknown(key.place, "unknown_parameter", f"parameter of {what}:", name, names)
            known = False
            continue
        value = _value(node, unit_of(field), name, findings)
        if _holds_poison(value):
            poisoned.add(name)
        else:
            values[name] = value
    try:
        made = model.model_validate_json(json.dumps(values), strict=True)
    except ValidationError as e:
        before = len(findings)
        for error in _one_a_scalar(_of_the_right_branch(e.errors(), given), given):
            _report(error, model, given, what, findings, poisoned, where or given.place)
        if len(findings) == before and not poisoned and known:
            findings.add(where or given.place, "wrong_value", f"{what}: {e.errors()[0]['msg']}")
        return None
    for key, node in given.entries if not poisoned else ():
        if isinstance(node, Scalar) and node.span is not None and str(key.value) in model.model_fields:
            _check_span(node, str(key.value), model.model_fields[str(key.value)], findings)
    return made if known and not poisoned else None


def _check_span(node: Scalar, name: str, field: FieldInfo, findings: Findings) -> None:
    """Report a parameter whose range includes values that the field refuses; its present value is valid."""
    unit = unit_of(field)
    for end in node.span or ():
        value = convert(end, node.unit, unit) if node.unit else end
        for symbol, limit, holds in limits_of(field):
            if not holds(value, limit):
                shown = f"{end:g} {node.unit}".strip()
                what = f"{node.origin} may be set to {shown}, but {name} must be {symbol} {limit:g} {unit}".rstrip()
                findings.add(node.place, "range_too_wide", what)


def _of_the_right_branch(errors: Sequence[Any], given: Map) -> list[Any]:
    """Drop the errors that pydantic reports for the plain types of a union when a mapping was written."""
    deep = {e["loc"][0] for e in errors if len(e["loc"]) > 2}
    kept = [e for e in errors if not (len(e["loc"]) == 2 and e["loc"][0] in deep and e["type"] in _SCALARS)]
    return kept if kept and all(isinstance(given.get(str(n)), (Map, Seq)) for n in deep) else list(errors)


def _one_a_scalar(errors: Sequence[Any], given: Map) -> list[Any]:
    """Merge the errors that pydantic reports for each type of a union when a scalar fits none of them."""
    kept: dict[object, Any] = {}
    for i, error in enumerate(errors):
        name = error["loc"][0] if error["loc"] else ""
        scalar = isinstance(name, str) and isinstance(given.get(name), Scalar) and error["type"] in _WORDS
        known = kept.setdefault(name if scalar else i, error)
        if known is not error:
            rules = [_WORDS[e["type"]].format(**e.get("ctx", {})) for e in (known, error)]
            both = rules[0] + " or " + rules[1].removeprefix("must be ")
            kept[name] = {**known, "type": "several", "loc": (name,), "ctx": {"rules": both}}
    return list(kept.values())


def _value(node: Node, unit: str, name: str, findings: Findings) -> Any:
    """Return the plain value with quantities converted to the field's unit."""
    if isinstance(node, Seq):
        return [_value(i, unit, name, findings) for i in node.items]
    if isinstance(node, Map):
        return {str(k.value): _value(v, unit, name, findings) for k, v in node.entries}
    number, given_unit = node.value, node.unit
    if node.poisoned:
        return POISON
    if isinstance(number, str) and (found := split_quantity(number)) and unit:
        number, given_unit = found
    if given_unit and isinstance(number, (int, float)):
        try:
            return convert(number, given_unit, unit)
        except ValueError:
            source = f" (from {node.origin})" if node.origin else ""
            what = f"{name} {f'is in {unit}, not' if unit else 'has no unit; given in'} {given_unit!r}{source}"
            findings.add(node.place, "wrong_unit", what, valid=", ".join(units_for(unit)) if unit else "")
            return POISON
    return number


def _holds_poison(value: Any) -> bool:
    if isinstance(value, Mapping):
        return any(_holds_poison(v) for v in value.values())
    if isinstance(value, list):
        return any(_holds_poison(v) for v in value)
    return isinstance(value, Poison)


def locate(node: Node, loc: tuple[int | str, ...]) -> tuple[Node, Place, tuple[int | str, ...]]:
    """Follow a pydantic location through the source; return (node, place of its key or value, remaining location)."""
    place = node.place
    for i, step in enumerate(loc):
        if isinstance(node, Map) and isinstance(step, str) and (child := node.get(step)) is not None:
            place = node.key_place(step) if isinstance(child, Scalar) and child.value is None else child.place
            node = child
        elif isinstance(node, Seq) and isinstance(step, int) and step < len(node.items):
            node = node.items[step]
            place = node.place
        else:
            return node, place, loc[i:]
    return node, place, ()


def _report(
    error: Any, model: type[BaseModel], given: Map, what: str, findings: Findings, poisoned: set[str], where: Place
) -> None:
    loc: tuple[int | str, ...] = error["loc"]
    name = str(loc[0]) if loc else ""
    if name in poisoned:
        return
    field = model.model_fields.get(name)
    unit = f" {unit_of(field)}" if field and unit_of(field) else ""
    if error["type"] == "missing" and len(loc) == 1:
        description = f" ({field.description})" if field and field.description else ""
        findings.add(where, "missing_parameter", f"{what} needs {name!r}{description}")
        return
    node, place, rest = locate(given, loc)
    if error["type"] == "extra_forbidden":
        parent = locate(given, loc[:-1])[0]
        at = parent.key_place(str(loc[-1])) if isinstance(parent, Map) else place
        names = _keys(model, loc[:-1])
        findings.unknown(at, "unknown_parameter", f"key of {name} in {what}:", str(loc[-1]), names)
        return
    written = {str(k.value) for n in walk(given) if isinstance(n, Map) for k, _ in n.entries}
    dotted = ".".join(str(s) for s in loc if not isinstance(s, str) or s in written or rest == ())
    shown = f" = {node.value!r}" if isinstance(node, Scalar) else ""
    source = f" (from {node.origin})" if isinstance(node, Scalar) and node.origin else ""
    words = _WORDS.get(error["type"])
    rule = words.format(**error.get("ctx", {})) if words else error["msg"][:1].lower() + error["msg"][1:]
    if error["type"] == "missing":
        rule = f"needs {loc[-1]!r}" if isinstance(loc[-1], str) else "has too few items"
        dotted, shown = ".".join(str(s) for s in loc[:-1]), ""
    subject = f"{dotted}{shown}{source}" if dotted else what
    code = "wrong_range" if error["type"].startswith(("greater", "less")) else "wrong_type"
    said = f"{subject}: {rule}{unit if code == 'wrong_range' else ''}"
    known = [a for a in get_args(field.annotation) if isinstance(a, str)] if field else []
    hint = findings.nearest(node.value, known) if isinstance(node, Scalar) and isinstance(node.value, str) else ""
    if field and code == "wrong_range":
        hint = _in_smaller_unit(node, field)
    findings.add(place, code, said, valid=_valid(field, unit), hint=hint)


def _in_smaller_unit(node: Node, field: FieldInfo) -> str:
    """Return a number that was written without a unit in the next smaller one, if the field allows that; else empty."""
    smaller = SMALLER_UNITS.get(unit_of(field))
    if smaller is None or not isinstance(node, Scalar) or node.unit or not isinstance(node.value, int | float):
        return ""
    value = convert(node.value, smaller, unit_of(field))
    return f"{node.value:g} {smaller}" if all(holds(value, limit) for _, limit, holds in limits_of(field)) else ""


def _keys(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    """Return the valid keys at a location inside nested models; none if it is not a plain nesting."""
    for step in loc:
        if step == model.__name__:  # in a union pydantic names the branch
            continue
        field = model.model_fields.get(str(step))
        kinds = get_args(field.annotation) or (field.annotation,) if field else ()
        models = [k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)]
        if not models:
            return []
        model = models[0]
    return list(model.model_fields)


def _valid(field: FieldInfo | None, unit: str) -> str:
    """Return the field's type, range and unit in words."""
    kind = _kind_in_words(field.annotation) if field is not None else ""
    if field is None or not kind:
        return ""
    rules = [f"{symbol} {limit}" for symbol, limit, _ in limits_of(field)]
    return f"{kind}{unit}" + (f", {', '.join(rules)}" if rules else "")


def _kind_in_words(annotation: Any) -> str:
    """Return a field's type in words; empty where the message names it already."""
    origin, inside = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _kind_in_words(inside[0])
    if origin is tuple:
        return "a list" if Ellipsis in inside else f"[{', '.join(map(_kind_in_words, inside))}]"
    if origin is dict:
        return "a mapping"
    if origin in (Union, UnionType):
        return " or ".join(words for words in map(_kind_in_words, inside) if words)
    if annotation is type(None) or not isinstance(annotation, type) or issubclass(annotation, BaseModel):
        return ""
    return annotation.__name__
