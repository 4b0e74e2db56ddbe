"""Base class of skills: a py_trees leaf with typed ports whose body is a generator of commands.

    class Approach(Skill):
        "Advance until touch. SUCCESS: touched."

        class Params(SkillParams):
            travel_m: float = param("Longest free travel", unit="m", default=0.05, ge=0.0, le=0.3)

        NO_TOUCH = Failure("no_touch", "the travel ran out", advice="sweep lower")

        start = In(Contact, "where to start")
        contact = Out(Contact, "first touch, in K")

        def run(self) -> SkillRun:
            observation = yield HOLD                    # one yield = one control period
            result = yield from self.context.arm.line(pose, speed, guard=...)
            if result.stop is None:
                raise self.NO_TOUCH(f"no touch in {self.params.travel_m} m")
            self.contact = ...

If `run` returns, the skill succeeds. If it raises `SkillFailed` or `MotionRefused`, the skill fails with that reason.
Any other exception reaches the runner, which holds the arm. On preemption the generator is closed (its `finally` blocks
run) and the arm is held. The arm brakes past its last setpoint, so the next skill first waits until it is at rest.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Generator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, ClassVar, Literal

import py_trees
from py_trees.common import Status
from py_trees.ports import PortInformation, PortsMixin

from glotouch_bt.robot import HOLD, Command, MotionRefused, Observation
from glotouch_bt.skill.context import Context, SkillRun, come_to_rest
from glotouch_bt.skill.failures import (
    GENERAL_FAILURES,
    MOTION_REFUSED,
    SKILL_TIMEOUT,
    Failure,
    Reason,
    SkillFailed,
    UndeclaredFailure,
)
from glotouch_bt.skill.params import SkillParams
from glotouch_bt.skill.ports import In, Out, Port

NOTHING: Mapping[str, Any] = MappingProxyType({})
UNCHANGED = "unchanged"
"""In `FAILURE_STATES`: the resource may be in the state it had before."""


class Skill(PortsMixin, py_trees.behaviour.Behaviour, register=False):  # type: ignore[call-arg]
    """Base class of every skill; see the module's text. Entry points name the skills, not the class names.

    The class attributes declare to `glotouch check` what the ports cannot: the states of resources. A resource, above
    all the `hand`, has named states; a mission begins with the hand `empty`. A state is what skills brought about on
    purpose. An accidental loss is a fault, which the next skill that needs the resource detects.

    Attributes:
        PRECONDITIONS: States of resources in which the skill may start.
        POSTCONDITIONS: States after SUCCESS; resources not named keep theirs.
        FAILURE_STATES: Possible states after FAILURE (`UNCHANGED`: as before). Resources not named are as before or as
            after SUCCESS.
        RESTORED_BY: For a state that should not last to the mission's end: the skill that undoes it.
        USES: Resources used exclusively: two skills that use the same one must not run at once.
        FAILURES: Failures of the shared motions that it uses; its own are class attributes.
        PAUSE: Effect of a pause: `hold` (the motion stops on its path and its guard stays active), `retreat` (also, a
            guarded motion backs off a few millimetres along its path), or `finish` (the present motion is completed).
            Jaw motions, and anything under `arm.pause_signal.finishing()`, are always completed. Timeouts and durations
            do not run during a pause.
        MAX_DURATION_S: Longest run on the mission's clock; then the skill fails with `skill_timeout`.
    """

    PRECONDITIONS: ClassVar[Mapping[str, frozenset[str]]] = NOTHING
    POSTCONDITIONS: ClassVar[Mapping[str, str]] = NOTHING
    FAILURE_STATES: ClassVar[Mapping[str, frozenset[str]]] = NOTHING
    RESTORED_BY: ClassVar[Mapping[str, str]] = NOTHING
    USES: ClassVar[frozenset[str]] = frozenset()
    FAILURES: ClassVar[tuple[Failure, ...]] = ()
    PAUSE: ClassVar[Literal["hold", "retreat", "finish"]] = "hold"
    MAX_DURATION_S: ClassVar[float] = 900.0

    _failures: ClassVar[Mapping[str, Failure]] = NOTHING
    _results: ClassVar[tuple[Out[Any], ...]] = ()
    Params: ClassVar[type[SkillParams]] = SkillParams
    INPUT_PORTS: ClassVar[dict[str, PortInformation]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, PortInformation]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        own = {f.code: f for c in reversed(cls.__mro__) for f in vars(c).values() if isinstance(f, Failure)}
        cls._failures = {**own, **{f.code: f for f in cls.FAILURES if f.code not in own}}
        ports = {n: p for c in reversed(cls.__mro__) for n, p in vars(c).items() if isinstance(p, Port)}
        cls.INPUT_PORTS = {
            n: PortInformation(p.data_type, required=p.required, description=p.description)
            for n, p in ports.items()
            if isinstance(p, In)
        }
        cls.OUTPUT_PORTS = {
            n: PortInformation(p.data_type, description=p.description) for n, p in ports.items() if isinstance(p, Out)
        }
        cls._results = tuple(p for p in ports.values() if isinstance(p, Out) and p.result is not None)
        kwargs.setdefault("register", False)
        super().__init_subclass__(**kwargs)

    def __init__(self, name: str, params: SkillParams, context: Context) -> None:
        super().__init__(name)
        self.params = params
        self.context = context
        self.reason: Reason | None = None
        self._run: SkillRun | None = None
        self._ahead: Status | None = None

    @classmethod
    def default_keys(cls) -> dict[str, str]:
        """Return the blackboard key of each port that a mission does not rewire."""
        return {n: getattr(cls, n).key for n in (*cls.INPUT_PORTS, *cls.OUTPUT_PORTS)}

    def run(self) -> SkillRun:
        """Execute the skill; see the module's text."""
        raise NotImplementedError(f"{type(self).__name__} has no run()")

    def write_port(self, name: str, value: object) -> None:
        """Write an output port."""
        self._set_output(name, value)

    def event(self, kind: str, **data: object) -> None:
        """Record an event of this skill at the present robot time."""
        self.context.journal.event(kind, self.context.observation.now_s, {"node": self.name, **data})

    def report(self, title: str, text: str, head: Sequence[str] = (), rows: Sequence[Sequence[object]] = ()) -> None:
        """Add a section to the report of the run: a paragraph, and a table of `rows` under the titles `head`."""
        self.event("report", title=title, text=text, head=head, rows=rows)

    def remember(self) -> object:
        """Return the state that this skill keeps between runs beyond its ports, for a checkpoint, or None.

        It consists of plain values, arrays and dataclasses. Override together with `recall`.
        """
        return None

    def recall(self, remembered: Any) -> None:
        """Restore what `remember` returned, in a new process."""

    def initialise(self) -> None:
        """Start the body; its first command comes with the first update."""
        self.reason = None
        self._run = self._body()
        self._started = False
        self._begun_s = self.context.mission_s

    def _body(self) -> SkillRun:
        if self.context.preempted:
            yield from come_to_rest(self.context)
        self.context.arm.not_run.clear()
        body: Generator[Command, Observation, object] = self.run()
        if not isinstance(body, Generator):
            raise TypeError(f"run() is no generator but returned {body!r}: it has no `yield` and no `yield from`")
        try:
            returned = yield from body
        except SkillFailed:
            self._say_results(always=True)
            raise
        if returned is not None:  # most likely a status, which would be taken for success
            raise TypeError(f"run() returned {returned!r}; it returns nothing, and raises SkillFailed to fail")
        if self.context.arm.not_run:
            raise TypeError(f"the motion {self.context.arm.not_run[0]} was made and not run: write `yield from`")
        for name in self.OUTPUT_PORTS:
            if not self.blackboard_client.exists(name):
                raise TypeError(f"run() ended without writing the output {name!r}: write `self.{name} = ...`")
        self._say_results()

    def _say_results(self, *, always: bool = False) -> None:
        """Record the results that have words; with `always`, only those of ports also written after a failure."""
        for port in self._results:
            if (port.always or not always) and (text := port.in_words(self)):
                self.event("result", key=port.key, text=text)

    def update_ahead(self) -> Status:
        """Update before the tree is ticked, and return the result; the next `update` returns it again."""
        self._ahead = status = self.update()
        return status

    def forget_update(self) -> None:
        """Let the next `update` update again: the tree will not be ticked."""
        self._ahead = None

    def update(self) -> Status:
        """Send the newest observation to the body and take its next command."""
        if self._ahead is not None:
            status, self._ahead = self._ahead, None
            return status
        assert self._run is not None
        if self.context.mission_s - self._begun_s > self.MAX_DURATION_S:
            return self._too_long()
        try:
            if self._started:
                command = self._run.send(self.context.observation)
            else:
                self._started = True
                command = next(self._run)
        except StopIteration:
            return Status.SUCCESS
        except SkillFailed as e:
            return self._fail(e.reason)
        except MotionRefused as e:
            return self._fail(MOTION_REFUSED(str(e)).reason)
        if not isinstance(command, Command):
            raise TypeError(f"run() yielded {command!r}; it yields a Command, such as HOLD")
        self.context.command = command
        return Status.RUNNING

    def _too_long(self) -> Status:
        self.context.preempted = True  # it may be in a motion
        message = f"it took longer than {self.MAX_DURATION_S:g} s, the longest a {type(self).__name__} may take"
        return self._fail(SKILL_TIMEOUT(message, limit_s=self.MAX_DURATION_S, since_s=self._begun_s).reason)

    @classmethod
    def failures(cls, *, general: bool = False) -> dict[str, Failure]:
        """Return the declared failures by code, the skill's own first; with `general`, also those of any skill."""
        return {**cls._failures, **({f.code: f for f in GENERAL_FAILURES} if general else {})}

    def _fail(self, reason: Reason) -> Status:
        if self._failures and reason.code not in self.failures(general=True):
            warnings.warn(f"{type(self).__name__} does not declare {reason.code!r}", UndeclaredFailure, stacklevel=2)
        self.reason = dataclasses.replace(reason, node=self.name)
        self.feedback_message = reason.message
        return Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        """Close the body; after a preemption, hold the arm."""
        preempted = self._run is not None and new_status is Status.INVALID
        try:
            if self._run is not None:
                self._run.close()
        finally:
            self._run = None
            if new_status is Status.INVALID:
                self.context.command = HOLD
                self.context.preempted |= preempted
