"""What a skill is: a py_trees leaf with typed ports whose body is a generator of commands.

    class Approach(Skill):
        "Advance until touch. SUCCESS: touched. FAILURE no_touch: the travel ran out."

        class Params(SkillParams):
            travel_m: float = param("Longest free travel", unit="m", default=0.05, ge=0.0, le=0.3)

        start = In(Contact, "where to start")
        contact = Out(Contact, "first touch, in K")

        def run(self) -> SkillRun:
            observation = yield HOLD                    # one yield = one control period
            result = yield from self.context.arm.guarded_line(...)
            if result.stop is None:
                raise SkillFailed("no_touch", f"no touch in {self.params.travel_m} m", advice="sweep lower")
            self.contact = ...

`run` returns: SUCCESS. `SkillFailed` or `MotionRefused`: FAILURE with its reason. Anything else reaches the runner,
which holds the arm. A preempted skill's generator is closed (its `finally` blocks run) and the arm is held; since it
brakes past its last setpoint, the next skill first waits for it to stand and takes up the setpoint from there.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, Protocol, TypeVar, cast, overload

import py_trees
from py_trees.common import Status
from py_trees.ports import PortInformation, PortsMixin
from pydantic import BaseModel, ConfigDict, Field

from glotouch_bt.robot import HOLD, Command, GlotouchError, MotionRefused, Observation, Request, Ticket, World

if TYPE_CHECKING:
    from glotouch_bt.motion import Arm

T = TypeVar("T")
SkillRun = Generator[Command, Observation, None]

NOTHING: Mapping[str, Any] = MappingProxyType({})
UNCHANGED = "unchanged"
"""In `AFTER_FAILURE`: the resource may be in the state in which the skill found it."""
GENERAL_FAILURES: Mapping[str, str] = MappingProxyType(
    {
        "not_at_rest": "the arm still moves after the skill before was broken off",
        "skill_timeout": "it took longer than its class allows",
    }
)
"""Failures that the base class gives, so that any skill can."""

REST_RAD_S, REST_PERIODS, LONGEST_BRAKING_PERIODS = 0.01, 5, 300
"""The arm stands once every joint was this slow for so many periods; it must within the last number of them."""


class SkillParams(BaseModel):
    """Base of every skill's parameters; YAML keys are the field names. Unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def param(description: str, *, unit: str = "", names: str = "", default: Any = ..., **rules: Any) -> Any:
    """One parameter: a description, its unit, a default (none: required) and pydantic rules (ge, le, gt, ...).

    `names="stl"`: its text is the path of an STL file or the name of one in the world's folder, which must be there.
    """
    return Field(default, description=description, json_schema_extra={"unit": unit, "names": names}, **rules)


class _Port(Generic[T]):
    def __init__(
        self, data_type: type[T], description: str, *, key: str | None = None, element: type | None = None
    ) -> None:
        """`element`: type of the items, when the data type is a tuple (checked through for_each)."""
        self.data_type, self.description, self._key, self.element = data_type, description, key, element
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @property
    def key(self) -> str:
        """Blackboard key this port is wired to unless the mission says otherwise."""
        return self._key or self.name


class In(_Port[T]):
    """An input port: read as an attribute. `required=False` gives None when nobody wrote it."""

    def __init__(
        self,
        data_type: type[T],
        description: str,
        *,
        key: str | None = None,
        element: type | None = None,
        required: bool = True,
    ) -> None:
        super().__init__(data_type, description, key=key, element=element)
        self.required = required

    @overload
    def __get__(self, obj: None, owner: type) -> In[T]: ...
    @overload
    def __get__(self, obj: Skill, owner: type) -> T: ...
    def __get__(self, obj: Skill | None, owner: type) -> In[T] | T:
        if obj is None:
            return self
        if not self.required and not obj.blackboard_client.exists(self.name):
            return cast(T, None)
        return cast(T, obj.get_input(self.name))


class Out(_Port[T]):
    """An output port: written as an attribute. `always=True` promises that it is written even when the skill fails.

    `on_success`, `on_failure`: the value it then has, where the outcome says it all; `glotouch check` counts on it.
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
    ) -> None:
        super().__init__(data_type, description, key=key, element=element)
        self.always, self.on_success, self.on_failure = always, on_success, on_failure

    @overload
    def __get__(self, obj: None, owner: type) -> Out[T]: ...
    @overload
    def __get__(self, obj: Skill, owner: type) -> T: ...
    def __get__(self, obj: Skill | None, owner: type) -> Out[T] | T:
        if obj is None:
            return self
        return cast(T, obj.get_last_output(self.name))

    def __set__(self, obj: Skill, value: T) -> None:
        obj.write_port(self.name, value)


@dataclass(frozen=True)
class Reason:
    """Why a node failed.

    Attributes:
        code: Short stable word, e.g. ``search_exhausted``.
        message: One sentence for a person, with numbers.
        evidence: Numbers against their limits.
        advice: What to try.
        node: Name of the tree node.
    """

    code: str
    message: str
    evidence: Mapping[str, float | int | str] = field(default_factory=dict)
    advice: str = ""
    node: str = ""


class SkillFailed(GlotouchError):
    """Raised inside `run` to end the skill with FAILURE."""

    def __init__(self, code: str, message: str, *, advice: str = "", **evidence: float | int | str) -> None:
        super().__init__(message)
        self.reason = Reason(code, message, evidence, advice)


class Journal(Protocol):
    """Where skills write what they found; the runner's record implements it."""

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Record one event: `kind` (contact, candidate, touchset, ranking, ...) with JSON-able data or arrays."""
        ...


class RobotRequests(Protocol):
    """The part of a Robot a skill may call directly; everything else goes through yielded commands."""

    def start(self, request: Request) -> Ticket:
        """Begin a slow request; keep yielding and poll the ticket."""
        ...


@dataclass
class Context:
    """What the runner lends to every skill.

    Attributes:
        world: The nominal world.
        arm: Motion generators and the clearance scene.
        requests: Tare and payload.
        journal: The run's record.
        observation: The newest observation; set by the runner before each tick.
        command: What the active skill wants next; reset to hold by the runner before each tick.
        preempted: A skill was broken off, and no other has made sure since that the arm stands.
        paused_s: Robot time so far in which the mission was paused.
    """

    world: World
    arm: Arm
    requests: RobotRequests
    journal: Journal
    observation: Observation
    command: Command = HOLD
    preempted: bool = False
    paused_s: float = 0.0

    @property
    def mission_s(self) -> float:
        """The clock of timeouts: the robot's, which stands still while the mission is paused."""
        return self.observation.now_s - self.paused_s


def come_to_rest(context: Context) -> SkillRun:
    """Hold until the braking arm stands, then plan from where it stands.

    Raises:
        SkillFailed: `not_at_rest` if it still moves after 300 control periods.
    """
    still = 0
    for _ in range(LONGEST_BRAKING_PERIODS):
        observation = yield HOLD
        still = still + 1 if bool((abs(observation.dq) < REST_RAD_S).all()) else 0
        if still >= REST_PERIODS:
            context.arm.sync(observation)
            context.preempted = False
            return
    raise SkillFailed(
        "not_at_rest",
        "the arm still moves after the skill before was broken off",
        advice="something pushes it, or the servo does not settle",
        joint_rad_s=float(abs(context.observation.dq).max()),
    )


class UndeclaredFailure(UserWarning):
    """A skill failed with a code that its `FAILURES` do not name."""


class Skill(PortsMixin, py_trees.behaviour.Behaviour, register=False):  # type: ignore[call-arg]
    """Base class of every skill; see the module's text. Subclass names are not used: entry points name skills.

    What a skill promises about things that are no ports, for `glotouch check`; left out, it promises and asks nothing.
    A resource is a name, `hand` above all, whose states are names too: a mission begins with the hand `empty`. A state
    says what skills did on purpose. What was lost against their will is a fault: the next skill that needs it notices.

    Attributes:
        NEEDS: States of resources in which it may start.
        LEAVES: Their states after SUCCESS; of those not named, what they were.
        AFTER_FAILURE: What they may be after FAILURE (`UNCHANGED`: what they were); of those not named, what they were
            or what they are after SUCCESS.
        PUT_BACK_WITH: Of what it leaves, what should not outlast a mission unsaid, and the skill that puts it back.
        USES: What it has for itself while it runs: no two skills that use the same may run at once.
        FAILURES: Codes it may fail with, each in a few words (beside `GENERAL_FAILURES`).
        PAUSE: What a pause does to it: `hold` (a motion stops where it is along its path, and its guard goes on
            listening), `retreat` (the same, and a guarded motion also backs off a few millimetres the way it came),
            `finish` (the present motion is made to its end). What stands under `arm.feed.finishing()`, as all that
            moves the jaws, is finished in any case. A skill never notices: timeouts and durations do not run.
        LONGEST_S: Longest duration of one run on the mission's clock: a skill that yields for ever ends with FAILURE
            `skill_timeout`.
    """

    NEEDS: ClassVar[Mapping[str, frozenset[str]]] = NOTHING
    LEAVES: ClassVar[Mapping[str, str]] = NOTHING
    AFTER_FAILURE: ClassVar[Mapping[str, frozenset[str]]] = NOTHING
    PUT_BACK_WITH: ClassVar[Mapping[str, str]] = NOTHING
    USES: ClassVar[frozenset[str]] = frozenset()
    FAILURES: ClassVar[Mapping[str, str]] = NOTHING
    PAUSE: ClassVar[Literal["hold", "retreat", "finish"]] = "hold"
    LONGEST_S: ClassVar[float] = 900.0

    Params: ClassVar[type[SkillParams]] = SkillParams
    INPUT_PORTS: ClassVar[dict[str, PortInformation]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, PortInformation]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        ports = {n: p for c in reversed(cls.__mro__) for n, p in vars(c).items() if isinstance(p, _Port)}
        cls.INPUT_PORTS = {
            n: PortInformation(p.data_type, required=p.required, description=p.description)
            for n, p in ports.items()
            if isinstance(p, In)
        }
        cls.OUTPUT_PORTS = {
            n: PortInformation(p.data_type, description=p.description) for n, p in ports.items() if isinstance(p, Out)
        }
        kwargs.setdefault("register", False)
        super().__init_subclass__(**kwargs)

    def __init__(self, name: str, params: SkillParams, context: Context) -> None:
        super().__init__(name)
        self.params = params
        self.context = context
        self.reason: Reason | None = None
        self._run: SkillRun | None = None

    @classmethod
    def default_keys(cls) -> dict[str, str]:
        """Blackboard key of each port where a mission does not rewire it."""
        return {n: getattr(cls, n).key for n in (*cls.INPUT_PORTS, *cls.OUTPUT_PORTS)}

    def run(self) -> SkillRun:
        """The skill's body; see the module's text."""
        raise NotImplementedError(f"{type(self).__name__} has no run()")

    def write_port(self, name: str, value: object) -> None:
        """Write an output port (the public door to py_trees' protected setter)."""
        self._set_output(name, value)

    def event(self, kind: str, **data: object) -> None:
        """Record an event of this skill at the robot's present time."""
        self.context.journal.event(kind, self.context.observation.now_s, {"node": self.name, **data})

    def remember(self) -> object:
        """What this skill knows from one run to the next beyond its ports, for a checkpoint; None: nothing.

        Plain values, arrays and dataclasses (`mission.values`). Override together with `recall`.
        """
        return None

    def recall(self, remembered: Any) -> None:
        """Take up what `remember` gave, in a new process."""

    def initialise(self) -> None:
        """Start the body; its first command comes with the first update."""
        self.reason = None
        self._run = self._body()
        self._started = False
        self._begun_s = self.context.mission_s

    def _body(self) -> SkillRun:
        if self.context.preempted:
            yield from come_to_rest(self.context)
        body: Generator[Command, Observation, object] = self.run()
        returned = yield from body
        if returned is not None:  # a status, most likely: it would pass as success
            raise TypeError(f"run() returned {returned!r}; it returns nothing, and raises SkillFailed to fail")

    def update(self) -> Status:
        """Hand the newest observation to the body, take its next command."""
        assert self._run is not None
        if self.context.mission_s - self._begun_s > self.LONGEST_S:
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
            return self._fail(Reason("motion_refused", str(e), advice="move the target or clear the way"))
        if not isinstance(command, Command):
            raise TypeError(f"run() yielded {command!r}; it yields a Command, such as HOLD")
        self.context.command = command
        return Status.RUNNING

    def _too_long(self) -> Status:
        self.context.preempted = True  # it may be broken off in a motion
        message = f"it took longer than {self.LONGEST_S:g} s, the longest a {type(self).__name__} may take"
        evidence = {"limit_s": self.LONGEST_S, "since_s": self._begun_s}
        return self._fail(Reason("skill_timeout", message, evidence, "it hangs, or its task is larger than foreseen"))

    @classmethod
    def failure_codes(cls) -> dict[str, str]:
        """Every code it may fail with, each in a few words."""
        return {**cls.FAILURES, **GENERAL_FAILURES}

    def _fail(self, reason: Reason) -> Status:
        if self.FAILURES and reason.code not in self.failure_codes():
            warnings.warn(f"{type(self).__name__} does not declare {reason.code!r}", UndeclaredFailure, stacklevel=2)
        self.reason = dataclasses.replace(reason, node=self.name)
        self.feedback_message = reason.message
        return Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        """Close the body; a preempted skill leaves the arm holding."""
        preempted = self._run is not None and new_status is Status.INVALID
        try:
            if self._run is not None:
                self._run.close()
        finally:
            self._run = None
            if new_status is Status.INVALID:
                self.context.command = HOLD
                self.context.preempted |= preempted
