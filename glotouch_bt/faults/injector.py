"""The wrapper that makes a plan happen on any Robot. Next to the device: everything above sees what it lets through."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from glotouch_bt.faults.effects import Scene, samples_altered
from glotouch_bt.faults.plan import FaultPlan, FaultSpec
from glotouch_bt.faults.proof import Proof, Sighting
from glotouch_bt.faults.scheduled import Scheduled
from glotouch_bt.faults.trigger import Moment
from glotouch_bt.robot import BadInput, Command, GuardTripped, Observation, Request, Robot, Snapshot, Tare, Ticket
from glotouch_bt.robot.scene import stream
from glotouch_bt.robot.simulation import Disturber


class FaultInjector(Robot):
    """A Robot that does to another what a plan says; without a fault under way or to come it costs one comparison.

    A fault begins and ends at the start of a control period (or of a slow request). Each draws from a random stream of
    its own, so that one fault of a plan does not change another's draws, nor the device's.

    Args:
        robot: The device.
        plan: What shall go wrong.
        seed: Of the run; used where the plan has none.
        disturber: Hands inside the simulated world, if the backend offers them.
        may_kill: The process may be killed.

    Raises:
        BadInput: The plan asks for what cannot be done here.
    """

    def __init__(
        self, robot: Robot, plan: FaultPlan, seed: int, *, disturber: Disturber | None = None, may_kill: bool = False
    ) -> None:
        self.description, self.limits, self.period_s = robot.description, robot.limits, robot.period_s
        self.plan = plan
        self._robot = robot
        first = robot.observe()
        self._moment = Moment(first.now_s, first)
        self._handed_out: Observation | None = None
        self._taring: Ticket | None = None
        self.sightings: list[Sighting] = []
        self._began_after: list[tuple[float, str]] = []
        self.news: list[tuple[float, dict[str, object]]] = []
        self.outcome = ""
        self.held = False
        draws = seed if plan.seed is None else plan.seed
        self._scene = partial(
            Scene,
            period_s=robot.period_s,
            description=robot.description,
            disturber=disturber,
            sensed=first,
            may_kill=may_kill,
        )
        self._draws = draws
        self._faults: list[Scheduled] = []
        self._waiting: list[Scheduled] = []
        self._active: list[Scheduled] = []
        for spec in plan.faults:
            self.arm(spec)

    def arm(self, spec: FaultSpec) -> None:
        """One more fault, from now on.

        Raises:
            BadInput: It cannot be done here.
        """
        scene = self._scene(stream(self._draws, f"fault {spec.name}"))
        try:
            effect = spec.kind.effect(spec.params, scene)
            effect.prepare()
        except BadInput as e:
            raise BadInput(f"{spec.place}: {spec.name}: {e}") from e
        fault = Scheduled(spec, effect)
        self._faults.append(fault)
        self._waiting.append(fault)

    # -- the seam ----------------------------------------------------------------------------------------------------

    def observe(self) -> Observation:
        """The newest block, as it was handed out."""
        if self._waiting or self._active:
            self._turn()
        self._moment.calls += 1
        self._refuse()
        return self._handed_out if self._handed_out is not None else self._robot.observe()

    def cycle(self, command: Command) -> Observation:
        """One control period of the device, through the faults that are under way."""
        moment = self._moment
        self.held = False
        if self._waiting or self._active:
            self._turn()
        moment.calls += 1
        try:
            observation = self._faulted(command) if self._active else self._robot.cycle(command)
        except Exception as e:
            self._see_error(e)
            raise
        if not self._active:
            moment.sensed = observation
        moment.cycles += 1
        self._handed_out = observation
        return observation

    def start(self, request: Request) -> Ticket:
        """A slow request, unless a fault answers it."""
        if self._waiting or self._active:
            self._turn()
        self._moment.calls += 1
        self._refuse()
        for fault in self._active:
            ticket = fault.effect.request(request)
            if ticket is not None:
                fault.proof.changed(self._moment.now_s)
                return ticket
        ticket = self._robot.start(request)
        if isinstance(request, Tare):
            self._taring = ticket
        return ticket

    @property
    def paced(self) -> bool:  # type: ignore[override]
        """See `Robot`."""
        return self._robot.paced

    @property
    def inner(self) -> Robot:
        """The device."""
        return self._robot

    def snapshot(self) -> Snapshot | None:
        """The device's; where the faults stand is not kept."""
        return self._robot.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """The device goes back; faults begin and end as if nothing had happened."""
        self._robot.restore(snapshot)
        self._moment.sensed = self._robot.observe()
        self._handed_out = None

    def hold(self) -> None:
        """Passed on."""
        self.held = True
        self._robot.hold()

    def close(self) -> None:
        """Passed on."""
        self._robot.close()

    # -- what the run tells it ---------------------------------------------------------------------------------------

    @property
    def now_s(self) -> float:
        """The device's clock, whatever it is said to be."""
        return self._moment.now_s

    def node_began(self, path: str, now_s: float) -> None:
        """A node of the tree runs from now on."""
        if self.sightings:
            self._began_after.append((now_s, path))
        self._moment.running[path] = now_s
        self._moment.visits[path] = self._moment.visits.get(path, 0) + 1

    def node_ended(self, path: str) -> None:
        """A node of the tree runs no more."""
        self._moment.running.pop(path, None)

    def saw(self, stamp_s: float, by: str, code: str, text: str) -> None:
        """Something reacted: a skill failed, a guard tripped."""
        self.sightings.append(Sighting(stamp_s, by, code, text))

    # -- proof -------------------------------------------------------------------------------------------------------

    def proofs(self) -> list[Proof]:
        """One for each fault of the plan."""
        return [f.proof for f in self._faults]

    def conclude(self, outcome: str, code: str, text: str, now_s: float) -> None:
        """How the run ended; where nobody saw anything before, its end is when it was seen."""
        self.outcome = outcome
        if outcome != "success":
            self.saw(now_s, "runner", code, text)

    def report(self) -> list[dict[str, Any]]:
        """What became of each fault, as result.json has it."""
        return [f.proof.report(self.sightings, self._began_after, self.outcome) for f in self._faults]

    # -- inside ------------------------------------------------------------------------------------------------------

    def _turn(self) -> None:
        """End what is over, begin what is due."""
        moment = self._moment
        ended = [f for f in self._active if f.try_end(moment)]
        for fault in ended:
            self._tell(fault, "ends")
        if ended:
            self._active = [f for f in self._active if f.active]
            self._waiting.extend(f for f in ended if not f.spent)
        begun = [f for f in self._waiting if f.try_begin(moment)]
        for fault in begun:
            self._tell(fault, "begins")
        if begun:
            if self._taring is not None and self._taring.done:
                self._taring = None
            self._waiting = [f for f in self._waiting if not f.active]
            order = {id(f): i for i, f in enumerate(self._faults)}
            self._active = sorted([*self._active, *begun], key=lambda f: order[id(f)])

    def _tell(self, fault: Scheduled, what: str) -> None:
        data: dict[str, object] = {
            "fault": fault.spec.kind.name,
            "name": fault.spec.name,
            "what": what,
            "notes": fault.proof.acts.notes,
        }
        self.news.append((self._moment.now_s, data))

    def _faulted(self, command: Command) -> Observation:
        moment = self._moment
        now_s = moment.now_s
        cycle: Callable[[Command], Observation] = self._to_device
        for fault in self._active:
            effect, proof = fault.effect, fault.proof
            effect.scene.sensed = moment.sensed
            acts = effect.acts.times
            try:
                told = effect.command(command)
            except Exception:
                proof.refused += 1
                proof.changed(now_s)
                raise
            if told is not command:
                proof.commands += 1
            if told is not command or effect.acts.times > acts:
                proof.changed(now_s)
            command = told
            if effect.drives:
                cycle = partial(self._driven, fault, cycle)
        observation = cycle(command)
        if self._taring is not None and self._taring.done:
            self._taring = None
            for fault in self._active:
                fault.effect.scene.sensed = observation
                fault.effect.tared()
        for fault in self._active:
            reported = fault.effect.sense(observation)
            altered = samples_altered(observation, reported)
            if altered:
                fault.proof.samples += altered
                fault.proof.changed(moment.now_s)
            observation = reported
        return observation

    def _refuse(self) -> None:
        """Let the faults under way refuse a call that is no cycle."""
        for fault in self._active:
            acts = fault.effect.acts.times
            try:
                fault.effect.refuse()
            except Exception as e:
                self._see_error(e)
                raise
            finally:
                if fault.effect.acts.times > acts:
                    fault.proof.changed(self._moment.now_s)

    def _to_device(self, command: Command) -> Observation:
        self._moment.sensed = observation = self._robot.cycle(command)
        return observation

    def _driven(self, fault: Scheduled, cycle: Callable[[Command], Observation], command: Command) -> Observation:
        acts, now_s = fault.effect.acts.times, self._moment.now_s
        try:
            return fault.effect.drive(cycle, command)
        finally:
            if fault.effect.acts.times > acts:
                fault.proof.changed(now_s)

    def _see_error(self, error: Exception) -> None:
        by = "supervision" if isinstance(error, GuardTripped) else "device"
        self.saw(self._moment.now_s, by, type(error).__name__, str(error))
