"""The robot wrapper that applies a fault plan. It wraps the device directly, so every other layer sees the faults."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from glotouch_bt.faults.effects import EffectContext, samples_altered
from glotouch_bt.faults.plan import FaultPlan, FaultSpec
from glotouch_bt.faults.proof import Proof, Sighting
from glotouch_bt.faults.scheduled import ScheduledFault
from glotouch_bt.faults.trigger import TriggerState
from glotouch_bt.robot import BadInput, Command, GuardTripped, Observation, Request, Robot, Snapshot, Tare, Ticket
from glotouch_bt.robot.scene import stream
from glotouch_bt.robot.simulation import Disturber


class FaultInjector(Robot):
    """A Robot that applies a fault plan to another Robot. Without an active or pending fault it costs one comparison.

    A fault starts and ends at the start of a control period (or of a slow request). Each fault has its own random
    stream, so that it changes no draws of another fault or of the device.

    Args:
        robot: The device.
        plan: The fault plan.
        seed: Seed of the run; used if the plan has none.
        disturber: Access to the simulated world, if the backend offers it.
        may_kill: A fault may kill this process.

    Raises:
        BadInput: The plan has a fault that is impossible here.
    """

    def __init__(
        self, robot: Robot, plan: FaultPlan, seed: int, *, disturber: Disturber | None = None, may_kill: bool = False
    ) -> None:
        self.description, self.limits, self.period_s = robot.description, robot.limits, robot.period_s
        self.plan = plan
        self._robot = robot
        first = robot.observe()
        self._moment = TriggerState(first.now_s, first)
        self._handed_out: Observation | None = None
        self._taring: Ticket | None = None
        self.sightings: list[Sighting] = []
        self._started_after: list[tuple[float, str]] = []
        self.pending_events: list[tuple[float, dict[str, object]]] = []
        self.outcome = ""
        self.held = False
        self._make_context = partial(
            EffectContext,
            period_s=robot.period_s,
            description=robot.description,
            disturber=disturber,
            sensed=first,
            may_kill=may_kill,
        )
        self._draws = seed if plan.seed is None else plan.seed
        self._faults: list[ScheduledFault] = []
        self._waiting: list[ScheduledFault] = []
        self._active: list[ScheduledFault] = []
        for spec in plan.faults:
            self.add_fault(spec)

    def add_fault(self, spec: FaultSpec) -> None:
        """Add a fault, waiting for its trigger from now on.

        Raises:
            BadInput: It is impossible here.
        """
        context = self._make_context(stream(self._draws, f"fault {spec.name}"))
        try:
            effect = spec.kind.effect(spec.params, context)
            effect.prepare()
        except BadInput as e:
            raise BadInput(f"{spec.place}: {spec.name}: {e}") from e
        fault = ScheduledFault(spec, effect)
        self._faults.append(fault)
        self._waiting.append(fault)

    # -- the seam ----------------------------------------------------------------------------------------------------

    def observe(self) -> Observation:
        """Return the newest block as the faults altered it."""
        if self._waiting or self._active:
            self._update_faults()
        self._moment.calls += 1
        self._refuse()
        return self._handed_out if self._handed_out is not None else self._robot.observe()

    def cycle(self, command: Command) -> Observation:
        """Do one control period of the device through the active faults."""
        moment = self._moment
        self.held = False
        if self._waiting or self._active:
            self._update_faults()
        moment.calls += 1
        try:
            observation = self._faulted(command) if self._active else self._robot.cycle(command)
        except Exception as e:
            self._add_error(e)
            raise
        if not self._active:
            moment.sensed = observation
        moment.cycles += 1
        self._handed_out = observation
        return observation

    def start(self, request: Request) -> Ticket:
        """Start a slow request, unless a fault answers it."""
        if self._waiting or self._active:
            self._update_faults()
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
        """The device's; see `Robot`."""
        return self._robot.paced

    def snapshot(self) -> Snapshot | None:
        """Return the device's snapshot; the state of the faults is not saved."""
        return self._robot.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Restore the device; the faults continue unchanged."""
        self._robot.restore(snapshot)
        self._moment.sensed = self._robot.observe()
        self._handed_out = None

    def hold(self) -> None:
        """Hold the device."""
        self.held = True
        self._robot.hold()

    def close(self) -> None:
        """Close the device."""
        self._robot.close()

    # -- events of the run -------------------------------------------------------------------------------------------

    @property
    def now_s(self) -> float:
        """The device's clock, not altered by faults."""
        return self._moment.now_s

    def on_node_started(self, path: str, now_s: float) -> None:
        """Note that a node of the tree has started."""
        if self.sightings:
            self._started_after.append((now_s, path))
        self._moment.running[path] = now_s
        self._moment.visits[path] = self._moment.visits.get(path, 0) + 1

    def on_node_ended(self, path: str) -> None:
        """Note that a node of the tree has ended."""
        self._moment.running.pop(path, None)

    def add_sighting(self, stamp_s: float, by: str, code: str, text: str) -> None:
        """Note a reaction: a skill failed, a guard tripped."""
        self.sightings.append(Sighting(stamp_s, by, code, text))

    # -- proof -------------------------------------------------------------------------------------------------------

    def proofs(self) -> list[Proof]:
        """Return the proof of effect of each fault."""
        return [f.proof for f in self._faults]

    def conclude(self, outcome: str, code: str, text: str, now_s: float) -> None:
        """Note how the run ended; an end without success counts as a sighting by the runner."""
        self.outcome = outcome
        if outcome != "success":
            self.add_sighting(now_s, "runner", code, text)

    def report(self) -> list[dict[str, Any]]:
        """Return what each fault did, as in result.json."""
        return [f.proof.report(self.sightings, self._started_after, self.outcome) for f in self._faults]

    # -- inside ------------------------------------------------------------------------------------------------------

    def _update_faults(self) -> None:
        """End the faults that are over and start those that are due."""
        moment = self._moment
        ended = [f for f in self._active if f.try_end(moment)]
        for fault in ended:
            self._announce(fault, "ends")
        if ended:
            self._active = [f for f in self._active if f.active]
            self._waiting.extend(f for f in ended if not f.spent)
        begun = [f for f in self._waiting if f.try_begin(moment)]
        for fault in begun:
            self._announce(fault, "begins")
        if begun:
            if self._taring is not None and self._taring.done:
                self._taring = None
            self._waiting = [f for f in self._waiting if not f.active]
            order = {id(f): i for i, f in enumerate(self._faults)}
            self._active = sorted([*self._active, *begun], key=lambda f: order[id(f)])

    def _announce(self, fault: ScheduledFault, what: str) -> None:
        data: dict[str, object] = {
            "fault": fault.spec.kind.name,
            "name": fault.spec.name,
            "what": what,
            "notes": fault.proof.actions.notes,
        }
        self.pending_events.append((self._moment.now_s, data))

    def _faulted(self, command: Command) -> Observation:
        moment = self._moment
        now_s = moment.now_s
        cycle: Callable[[Command], Observation] = self._to_device
        for fault in self._active:
            effect, proof = fault.effect, fault.proof
            effect.context.sensed = moment.sensed
            acts = effect.actions.count
            try:
                altered = effect.command(command)
            except Exception:
                proof.refused += 1
                proof.changed(now_s)
                raise
            if altered is not command:
                proof.commands += 1
            if altered is not command or effect.actions.count > acts:
                proof.changed(now_s)
            command = altered
            if effect.drives:
                cycle = partial(self._driven, fault, cycle)
        observation = cycle(command)
        if self._taring is not None and self._taring.done:
            self._taring = None
            for fault in self._active:
                fault.effect.context.sensed = observation
                fault.effect.tared()
        for fault in self._active:
            reported = fault.effect.sense(observation)
            count = samples_altered(observation, reported)
            if count:
                fault.proof.samples += count
                fault.proof.changed(moment.now_s)
            observation = reported
        return observation

    def _refuse(self) -> None:
        """Let the active faults refuse a call other than `cycle`."""
        for fault in self._active:
            acts = fault.effect.actions.count
            try:
                fault.effect.refuse()
            except Exception as e:
                self._add_error(e)
                raise
            finally:
                if fault.effect.actions.count > acts:
                    fault.proof.changed(self._moment.now_s)

    def _to_device(self, command: Command) -> Observation:
        self._moment.sensed = observation = self._robot.cycle(command)
        return observation

    def _driven(self, fault: ScheduledFault, cycle: Callable[[Command], Observation], command: Command) -> Observation:
        acts, now_s = fault.effect.actions.count, self._moment.now_s
        try:
            return fault.effect.drive(cycle, command)
        finally:
            if fault.effect.actions.count > acts:
                fault.proof.changed(now_s)

    def _add_error(self, error: Exception) -> None:
        by = "supervision" if isinstance(error, GuardTripped) else "device"
        self.add_sighting(self._moment.now_s, by, type(error).__name__, str(error))
