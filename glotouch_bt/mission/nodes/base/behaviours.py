"""Base classes of our py_trees nodes: access to the run's keys, a reason of failure, progress for checkpoints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Access, Status
from py_trees.decorators import Decorator

from glotouch_bt.skill import Context, Reason


class Keys:
    """A node's access to the blackboard: a few named keys of one run's namespace.

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
        """Return the value, or None if the key is not written."""
        return self._client.get(key) if self._client.exists(key) else None

    def set(self, key: str, value: object) -> None:
        """Write the value."""
        self._client.set(key, value)

    def unset(self, key: str) -> None:
        """Remove the value."""
        self._client.unset(key)


@dataclass(frozen=True)
class BuildContext:
    """Everything that a node kind needs to build its py_trees node.

    Attributes:
        context: What skills are lent; `context.mission_s` is the clock of timeouts.
        namespace: Where the run's keys live on py_trees' blackboard.
    """

    context: Context
    namespace: str

    def keys(self, name: str, *keys: str) -> Keys:
        """Return access to some keys for the node of a name."""
        return Keys(name, self.namespace, keys)


class MissionDecorator(Decorator):
    """A decorator that gives a reason when it fails and can be checkpointed.

    Attributes:
        kept: Names of the attributes that a checkpoint keeps, beside its status.
        reason: Why it failed last, or None.
    """

    kept: ClassVar[tuple[str, ...]] = ()

    def __init__(self, name: str, child: Behaviour) -> None:
        super().__init__(name, child)
        self.reason: Reason | None = None

    @property
    def progress(self) -> dict[str, Any]:
        """State that a checkpoint keeps, by name."""
        return {name.lstrip("_"): getattr(self, name) for name in self.kept}

    @progress.setter
    def progress(self, found: dict[str, Any]) -> None:
        """Go on from there."""
        for name in self.kept:
            setattr(self, name, found[name.lstrip("_")])

    def initialise(self) -> None:
        """Forget the last failure."""
        self.feedback_message, self.reason = "", None

    def enter(self) -> None:
        """Begin, or go on, with the child about to start: a mission that starts inside it calls this."""
        if self.status is not Status.RUNNING:
            self.initialise()

    def fail(self, code: str, message: str, advice: str = "", **evidence: Any) -> Status:
        """Note the reason and return FAILURE."""
        self.feedback_message = message
        self.reason = Reason(code, message, evidence, advice, self.name)
        return Status.FAILURE

    def update(self) -> Status:
        """Return the child's status."""
        return self.decorated.status


class OutcomeDecorator(MissionDecorator):
    """Replace the child's result by another one.

    Args:
        name: The node's name.
        child: Its child.
        outcome: Returns True for SUCCESS, given whether the child succeeded.
    """

    def __init__(self, name: str, child: Behaviour, outcome: Callable[[bool], bool]) -> None:
        super().__init__(name, child)
        self._outcome = outcome

    def update(self) -> Status:
        """Return RUNNING with the child, else the other result."""
        status = self.decorated.status
        if status not in (Status.SUCCESS, Status.FAILURE):
            return status
        if self._outcome(status is Status.SUCCESS):
            return Status.SUCCESS
        if status is Status.SUCCESS:
            return self.fail("failed", f"{self.decorated.name!r} succeeded, which counts as a failure here")
        return Status.FAILURE


class CountedLoop(MissionDecorator):
    """A loop that counts its finished passes; a subclass ends it at `limit`."""

    kept = ("_passes",)

    def __init__(self, name: str, child: Behaviour, limit: int) -> None:
        super().__init__(name, child)
        self._limit, self._passes = limit, 0

    def initialise(self) -> None:
        """Start counting passes."""
        super().initialise()
        self._passes = 0
