"""A node in BehaviorTree.CPP 4: its form in XML, and the names and values that the library's parser accepts."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from pydantic.fields import FieldInfo

_PREFIX = re.compile("@([0-9]+)/")
_INNER_UNDERSCORE = re.compile("_(?=_)")


@dataclass(frozen=True)
class BtcppForm:
    """A node in BehaviorTree.CPP's XML.

    Attributes:
        tag: Name of the element.
        attributes: Its attributes.
        settings: For a node that BehaviorTree.CPP lacks: the fields that it declares as ports, besides those of its
            skill. None: it is one of the library's own.
    """

    tag: str
    attributes: dict[str, str] = field(default_factory=dict)
    settings: Mapping[str, FieldInfo] | None = None


def btcpp_name(key: str) -> str:
    """Return a key as an identifier of BehaviorTree.CPP's scripts: letters, digits and underscores.

    A private key `part@2/key` becomes `part_2__key`. So that no other key gets the same name, a `Z` of its own is
    doubled, and its own `__` becomes `_Z_`.
    """
    own = _INNER_UNDERSCORE.sub("_Z", key.replace("Z", "ZZ"))
    name = _PREFIX.sub(r"_\1__", own).replace("@", "_Z")
    return f"Z{name}" if name[0].isdigit() else name


def btcpp_key(key: str) -> str:
    """Return a key as the value of a port in BehaviorTree.CPP."""
    return f"{{{btcpp_name(key)}}}"


def btcpp_value(value: object) -> str:
    """Return a constant as the value of a port in BehaviorTree.CPP: lists as `1;2;3`, mappings as `json:{...}`."""
    if isinstance(value, str):
        return value
    if isinstance(value, list | tuple) and all(isinstance(v, str | int | float) for v in value):
        return ";".join(map(btcpp_value, value))
    text = json.dumps(value, default=str)
    return f"json:{text}" if isinstance(value, Mapping | list | tuple) else text
