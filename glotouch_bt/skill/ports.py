"""Typed input and output ports of a skill, as descriptors over py_trees' ports."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, Self, TypeVar, cast, overload

if TYPE_CHECKING:
    from glotouch_bt.skill.skill import Skill

T = TypeVar("T")


class Port(Generic[T]):
    """Base of input and output ports: a typed, described attribute of a skill that lives on the blackboard."""

    def __init__(
        self, data_type: type[T], description: str, *, key: str | None = None, element: type | None = None
    ) -> None:
        """`element`: type of the items of a tuple, which the checker follows through for_each."""
        self.data_type, self.description, self._key, self.element = data_type, description, key, element
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, obj: None, owner: type) -> Self: ...
    @overload
    def __get__(self, obj: Skill, owner: type) -> T: ...
    def __get__(self, obj: Skill | None, owner: type) -> Self | T:
        return self if obj is None else cast(T, self._value(obj))

    def _value(self, skill: Skill) -> object:
        return skill.get_last_output(self.name)

    @property
    def key(self) -> str:
        """Blackboard key of the port unless the mission rewires it."""
        return self._key or self.name


class In(Port[T]):
    """An input port: read as an attribute. With `required=False` it is None until it is written.

    `expected=False`: a mission in which nothing writes it is usual, so `glotouch check` does not warn.
    """

    def __init__(
        self,
        data_type: type[T],
        description: str,
        *,
        key: str | None = None,
        element: type | None = None,
        required: bool = True,
        expected: bool = True,
    ) -> None:
        super().__init__(data_type, description, key=key, element=element)
        self.required, self.expected = required, expected

    def _value(self, skill: Skill) -> object:
        missing = not self.required and not skill.blackboard_client.exists(self.name)
        return None if missing else skill.get_input(self.name)


class Out(Port[T]):
    """An output port: written as an attribute. `always=True` promises that it is written even if the skill fails.

    `on_success`, `on_failure`: its value after that outcome, if it is always the same; `glotouch check` relies on it.
    `result`: the value in words; makes it a result of the mission, in result.json, in the terminal and in the report.
    No words: no result. After a failure, only a port that is `always` written gives one.
    """

    def __init__(
        self,
        data_type: type[T],
        description: str,
        *,
        key: str | None = None,
        element: type | None = None,
        always: bool = False,
        on_success: T | None = None,
        on_failure: T | None = None,
        result: Callable[[T], str] | None = None,
    ) -> None:
        super().__init__(data_type, description, key=key, element=element)
        self.always, self.on_success, self.on_failure, self.result = always, on_success, on_failure, result

    def __set__(self, obj: Skill, value: T) -> None:
        obj.write_port(self.name, value)

    def in_words(self, skill: Skill) -> str:
        """Return the value that a skill has written in the words of `result`; nothing without one."""
        return "" if self.result is None else self.result(cast(T, self._value(skill)))
