"""Nodes that py_trees lacks, or has on the wall clock: timeout on the robot's clock, repeat-until, for-each, condition.

All read and write only the keys they are wired to, through `Keys`. A failure of their own has a reason.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Access, Status
from py_trees.decorators import Decorator

from glotouch_bt.mission.spec import ConditionSettings
from glotouch_bt.skill import Reason


class Keys:
    """A node's own door to the blackboard: a few named keys of one run's namespace.

    Args:
        name: The node's name, for introspection.
        namespace: The run's namespace.
        keys: The keys the node is wired to.
    """

    def __init__(self, name: str, namespace: str, keys: tuple[str, ...]) -> None:
        self._client = py_trees.blackboard.Client(name=name, namespace=namespace)
        for key in dict.fromkeys(keys):
            self._client.register_key(key=key, access=Access.WRITE)

    def get(self, key: str) -> Any:
        """The value, or None if nobody has written it."""
        return self._client.get(key) if self._client.exists(key) else None

    def set(self, key: str, value: object) -> None:
        """Write the value."""
        self._client.set(key, value)

    def unset(self, key: str) -> None:
        """Forget the value."""
        self._client.unset(key)


def holds(settings: ConditionSettings, value: Any) -> bool:
    """The comparison of a condition; an unset key (None) fails all but `is_set: false`."""
    if settings.is_set is not None:
        return (value is not None) == settings.is_set
    if value is None:
        return False
    if settings.equals is not None:
        return isinstance(value, bool) == isinstance(settings.equals, bool) and bool(value == settings.equals)
    if settings.at_least is not None:
        return bool(value >= settings.at_least)
    return settings.at_most is not None and bool(value <= settings.at_most)


def in_words(settings: ConditionSettings) -> str:
    """The comparison for people: `found at_least 1`."""
    for word in ("equals", "at_least", "at_most", "is_set"):
        wanted = getattr(settings, word)
        if wanted is not None:
            return (
                f"{settings.port} {word} {wanted:g}"
                if isinstance(wanted, float)
                else f"{settings.port} {word} {wanted}"
            )
    return settings.port


class PortCondition(Behaviour):
    """SUCCESS if a comparison holds, else FAILURE; never RUNNING."""

    def __init__(self, name: str, keys: Keys, key: str, settings: ConditionSettings) -> None:
        super().__init__(name)
        self.reason: Reason | None = None
        self._keys, self._key, self._settings = keys, key, settings

    def update(self) -> Status:
        """Compare."""
        value = self._keys.get(self._key)
        if holds(self._settings, value):
            self.feedback_message, self.reason = "", None
            return Status.SUCCESS
        plain = isinstance(value, (int, float, str))
        found = "not set" if value is None else repr(value) if plain else "something else"
        self.feedback_message = f"{in_words(self._settings)} does not hold: it is {found}"
        evidence = {"wanted": in_words(self._settings), "found": value if plain else found}
        self.reason = Reason("condition_false", self.feedback_message, evidence, node=self.name)
        return Status.FAILURE


class ClockTimeout(Decorator):
    """FAILURE when the child runs longer than `seconds` on the robot's clock; the child is then preempted."""

    def __init__(self, name: str, child: Behaviour, seconds: float, clock: Callable[[], float]) -> None:
        super().__init__(name, child)
        self._seconds, self._clock = seconds, clock
        self._start_s = 0.0
        self.reason: Reason | None = None

    @property
    def progress(self) -> dict[str, Any]:
        """How far it has come, for a checkpoint; here on the robot's clock."""
        return {"clock_s": self._clock(), "start_s": self._start_s}

    @progress.setter
    def progress(self, kept: dict[str, Any]) -> None:
        """As much time has passed; the clock may be another one now."""
        self._start_s = kept["start_s"] + (self._clock() - kept["clock_s"])

    @property
    def deadline_s(self) -> float:
        """When the child's time is up, on the robot's clock; of use while it runs."""
        return self._start_s + self._seconds

    def initialise(self) -> None:
        """Start the clock."""
        self.feedback_message, self.reason = "", None
        self._start_s = self._clock()

    def update(self) -> Status:
        """The child's status, unless time is up."""
        if self.decorated.status is Status.RUNNING and self._clock() - self._start_s >= self._seconds:
            self.feedback_message = f"{self.decorated.name!r} took longer than {self._seconds:g} s"
            evidence = {"limit_s": self._seconds, "took_s": round(self._clock() - self._start_s, 3)}
            advice = "allow more time, or see in the record what it waited for"
            self.reason = Reason("timed_out", self.feedback_message, evidence, advice, self.name)
            return Status.FAILURE
        return self.decorated.status


class RepeatUntil(Decorator):
    """Do the child again until a condition holds after a pass. FAILURE if the child fails or the passes run out."""

    def __init__(self, name: str, child: Behaviour, done: Callable[[], bool], limit: int, words: str) -> None:
        super().__init__(name, child)
        self._done, self._limit, self._words = done, limit, words
        self._passes = 0
        self.reason: Reason | None = None

    @property
    def progress(self) -> dict[str, Any]:
        """How far it has come, for a checkpoint."""
        return {"passes": self._passes}

    @progress.setter
    def progress(self, kept: dict[str, Any]) -> None:
        """Go on from there."""
        self._passes = kept["passes"]

    def initialise(self) -> None:
        """Start counting passes."""
        self.feedback_message, self.reason = "", None
        self._passes = 0

    def update(self) -> Status:
        """Judge a finished pass."""
        if self.decorated.status is not Status.SUCCESS:
            return self.decorated.status
        self._passes += 1
        if self._done():
            return Status.SUCCESS
        if self._passes >= self._limit:
            self.feedback_message = f"{self._words!r} does not hold after {self._passes} passes"
            evidence = {"passes": self._passes, "limit": self._limit}
            advice = "raise its limit, or end it by another condition"
            self.reason = Reason("passes_ran_out", self.feedback_message, evidence, advice, self.name)
            return Status.FAILURE
        return Status.RUNNING


class ForEach(Decorator):
    """Do the child for every item of a tuple, one pass a tick at most, and gather what it writes.

    SUCCESS: every item succeeded (`on_failure: stop`), or at least one did (`continue`), or there is no item.
    FAILURE: the items are not written; an item failed (`stop`); no item succeeded (`continue`).
    The gathered tuples hold one value per item that succeeded, in the items' order, and are written in each case.
    With `least_first` the items are taken in rising order of that field of theirs.
    """

    def __init__(
        self,
        name: str,
        child: Behaviour,
        keys: Keys,
        items: str,
        item: str,
        collect: Mapping[str, str],
        go_on: bool,
        least_first: str | None = None,
    ) -> None:
        super().__init__(name, child)
        self._keys, self._items_key, self._item_key = keys, items, item
        self._collect, self._go_on, self._least_first = dict(collect), go_on, least_first
        self._items: tuple[Any, ...] = ()
        self._order: list[int] = []
        self._next = 0
        self._succeeded = 0
        self._gathered: dict[str, dict[int, Any]] = {}
        self.reason: Reason | None = None

    @property
    def progress(self) -> dict[str, Any]:
        """How far it has come, for a checkpoint: its items, their order, and what was gathered of them."""
        return {
            "items": self._items,
            "order": list(self._order),
            "next": self._next,
            "succeeded": self._succeeded,
            "gathered": {source: dict(row) for source, row in self._gathered.items()},
        }

    @progress.setter
    def progress(self, kept: dict[str, Any]) -> None:
        """Go on from there."""
        self._items, self._order = kept["items"], kept["order"]
        self._next, self._succeeded, self._gathered = kept["next"], kept["succeeded"], kept["gathered"]

    def enter(self) -> None:
        """Begin, or go on with the present item, in the midst of the child: its item is put in place."""
        if self.status is not Status.RUNNING:
            self.initialise()
        if self._next < len(self._items):
            self._keys.set(self._item_key, self._items[self._order[self._next]])

    def initialise(self) -> None:
        """Take the items as they are now."""
        self.feedback_message, self.reason = "", None
        self._next = self._succeeded = 0
        self._gathered = {source: {} for source in self._collect}
        items = self._keys.get(self._items_key)
        self._items = tuple(items) if items is not None else ()
        self._order = list(range(len(self._items)))
        if self._least_first is not None:
            self._order.sort(key=lambda i: getattr(self._items[i], str(self._least_first)))
        if items is None:
            self._because("no_items", f"{self._items_key!r} has not been written")
        for target in self._collect.values():
            self._keys.set(target, ())

    def tick(self) -> Iterator[Behaviour]:
        """Tick the child with its item in place; without items the child is not ticked at all."""
        if self.status is not Status.RUNNING:
            self.initialise()
        if self._next < len(self._items):
            if self.decorated.status is not Status.RUNNING:
                for source in self._collect:
                    self._keys.unset(source)
                self._keys.set(self._item_key, self._items[self._order[self._next]])
            yield from self.decorated.tick()
        new_status = self.update()
        if new_status is not Status.RUNNING:
            self.stop(new_status)
        self.status: Status = new_status
        yield self

    def update(self) -> Status:
        """Judge a finished item."""
        if not self._items:
            return Status.FAILURE if self.feedback_message else Status.SUCCESS
        status = self.decorated.status
        if status is Status.RUNNING:
            return Status.RUNNING
        if status is Status.SUCCESS:
            self._succeeded += 1
            self._gather()
        elif not self._go_on:
            self._because("item_failed", f"item {self._next + 1} of {len(self._items)} failed", item=self._next + 1)
            return Status.FAILURE
        self._next += 1
        if self._next < len(self._items):
            return Status.RUNNING
        if self._succeeded == 0:
            self._because("all_items_failed", f"none of {len(self._items)} items succeeded", items=len(self._items))
            return Status.FAILURE
        return Status.SUCCESS

    def _because(self, code: str, text: str, **evidence: int) -> None:
        self.feedback_message = text
        self.reason = Reason(code, text, evidence, node=self.name)

    def _gather(self) -> None:
        """Only whole rows: an item whose child left a key unwritten is not gathered at all."""
        row = {source: self._keys.get(source) for source in self._collect}
        if any(v is None for v in row.values()):
            return
        for source, value in row.items():
            gathered = self._gathered[source]
            gathered[self._order[self._next]] = value
            self._keys.set(self._collect[source], tuple(gathered[i] for i in sorted(gathered)))


class Passage(Decorator):
    """The child's status, unchanged: the visible root of a subtree."""

    def update(self) -> Status:
        """The child's status."""
        return self.decorated.status
