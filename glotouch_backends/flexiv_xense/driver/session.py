"""A session with the devices: commands, samples, hard limits and slow requests, independent of socket and pace."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Sequence

import numpy as np

from . import messages
from .checks import SetpointCheck, rest_pose
from .clock_offset import StampConverter
from .devices import ArmState, Connected
from .faults import CommandRefused, DeviceFault, vendor_call
from .frames import payload_on_tool, twist_between, wrench_map
from .hard_limit import HardLimit, pressing_power_W

MAX_BUFFERED_SAMPLES = 60_000
"""Samples buffered while the client requests none (60 s)."""
SPEED_SAMPLES = 20
"""Samples over which the speed of P is measured."""
MAX_STANDSTILL_M_S = 1e-3
"""P stands still below this speed. Source: ours."""
TWIST_SAMPLES = 5
"""Samples over which the twist of a pressing hand is measured; it must be known within milliseconds."""
NO_TWIST = (0.0,) * 6
NO_JAWS = messages.JawState(0.0, math.nan, 0.0, False)


class DriverSession:
    """See the module's text.

    Args:
        devices: Connected and ready.
        request: The client's request.

    Attributes:
        failed: Error that ended the session; every later command raises it again.
        stop: (quantity, value, limit, stamp) once the hard limit has tripped.
        peak_force_N: Largest sensed force so far.
        recent_peak_N: The same since it was last set to zero.
    """

    def __init__(self, devices: Connected, request: messages.Open) -> None:
        self.devices, self.clock = devices, devices.clock
        self._arm, self._tool, self._limits = devices.arm, request.tool, request.arm
        self._check = SetpointCheck(request.arm, request.period_s)
        self._to_S = wrench_map(request.tool.pose_E_P)
        self._zero_s = self.clock.now_s()
        self._stamps: deque[float] = deque(maxlen=MAX_BUFFERED_SAMPLES)
        self._rows: deque[list[float]] = deque(maxlen=MAX_BUFFERED_SAMPLES)
        self._device_stamp: object = None
        self._to_our_clock = StampConverter()
        self._fresh_s = self._zero_s
        self._hard_limit = HardLimit(request.arm.force_N, request.arm.torque_Nm)
        self._newest: list[float] | None = None
        self._last: messages.Setpoint | None = None  # the last one sent, while the arm follows setpoints
        self._rest: tuple[float, ...] | None = None  # pose of rest, once told to hold
        self._queue: deque[messages.TareRequest | messages.PayloadRequest] = deque()
        self._done: list[messages.Done] = []
        self._busy = False
        self._jaws = NO_JAWS
        self._moves = request.move
        self._sent_s = self._read_s = time.monotonic()
        self.failed: DeviceFault | None = None
        self.stop: tuple[str, float, float, float] | None = None
        self.peak_force_N = self.recent_peak_N = 0.0
        self._track: deque[tuple[float, list[float]]] = deque(maxlen=SPEED_SAMPLES)
        self.sample()
        self._reset_to_measured()
        self.poll()

    @property
    def ready(self) -> bool:
        """True if there is a sample for the next block."""
        return bool(self._rows)

    @property
    def speed_m_s(self) -> float:
        """Speed of P over the last `SPEED_SAMPLES`."""
        (begin, first), (end, last) = self._track[0], self._track[-1]
        return math.dist(first[:3], last[:3]) / (end - begin) if end > begin else 0.0

    # -- commands ----------------------------------------------------------------------------------------------------

    def command(self, cycle: messages.Cycle) -> None:
        """Send one period's command; send nothing once the hard limit has tripped.

        Raises:
            CommandRefused: The command is invalid; nothing was sent, and the arm holds.
            DeviceFault: The device refuses it, or had failed before.
        """
        if self.failed is not None:
            raise self.failed
        if (cycle.tactile or cycle.images) and self.devices.pads is not None:
            self.devices.pads.request()
            if cycle.images:
                self.devices.pads.request_images()
        if self.stop is not None:
            return
        try:
            self._check_command(cycle)
        except CommandRefused:
            self.hold()
            raise
        if cycle.jaws is not None and self.devices.gripper is not None:
            self.devices.gripper.send(cycle.jaws)
        if cycle.setpoint is not None:
            self._last, self._rest = cycle.setpoint, None
            self._arm.send(cycle.setpoint)
        else:
            self.hold()
        self._sent_s = time.monotonic()

    def _check_command(self, cycle: messages.Cycle) -> None:
        if not self._moves and (cycle.setpoint is not None or cycle.jaws is not None):
            raise CommandRefused("command", "a motion", "none in a read-only session")
        if cycle.jaws is not None:
            if self.devices.gripper is None:
                raise CommandRefused("command.gripper", cycle.jaws, "none: no gripper is connected")
            self.devices.gripper.check(cycle.jaws)
        if cycle.setpoint is not None:
            if self._busy:
                raise CommandRefused("command.motion", "a setpoint", "none while a tare or payload is pending")
            if self._rest is not None and self._newest is not None and self.speed_m_s < MAX_STANDSTILL_M_S:
                self._check.reset_to(self._newest[:7], self._newest[14:21])  # it has braked past its last setpoint
            self._check.check(cycle.setpoint)

    def hold(self) -> None:
        """Brake to rest along the path of the last setpoint and stay; later calls repeat the pose of rest.

        Raises:
            DeviceFault: The arm refuses it.
        """
        if self._last is None or self._busy:
            return  # the arm stands, or the pending request is stopping it
        if self._rest is None:
            self._rest = rest_pose(self._last, self._limits.stop_acceleration_m_s2)
        self._arm.hold_at(self._rest)

    def start(self, request: messages.TareRequest | messages.PayloadRequest) -> None:
        """Queue a slow request; it starts at once if none is pending. A read-only session refuses it."""
        if not self._moves:
            self._done.append(messages.Done(request.ticket, "not in a read-only session: it would switch the arm"))
            return
        self._queue.append(request)
        if not self._busy:
            self._busy = True
            self.clock.spawn(self._work)

    def _work(self) -> None:
        """Run all queued requests one after another, concurrently with the loop."""
        while self._queue:
            request = self._queue.popleft()
            try:
                if isinstance(request, messages.TareRequest):
                    self._arm.zero(request.duration_s)
                else:
                    self._arm.idle()
                    com_P, t = request.com_P_m, self._tool
                    self._arm.load(*payload_on_tool(t.mass_kg, t.com_E_m, request.mass_kg, com_P, t.pose_E_P))
                self._arm.enter_motion()
            except DeviceFault as e:
                self.failed = self.failed or e
                self._done.append(messages.Done(request.ticket, e.message))
            else:
                self._done.append(messages.Done(request.ticket))
        self._reset_to_measured()
        self._busy = False

    def _reset_to_measured(self) -> None:
        """Continue from the measured pose: the arm's own controller has moved it, not a setpoint sent from here."""
        self._last = self._rest = None
        if self._newest is not None:
            self._check.reset_to(self._newest[:7], self._newest[14:21])

    # -- sensing -----------------------------------------------------------------------------------------------------

    def sample(self) -> None:
        """Read the arm once and check the hard limit.

        Raises:
            DeviceFault: The arm cannot be read, or repeats an old reading.
        """
        with vendor_call("reading the arm", "link"):
            state = self._arm.state()
        now, self._read_s = self.clock.now_s(), time.monotonic()
        if state.stamp == self._device_stamp:
            age = now - self._fresh_s
            if age > self._limits.max_age_s:
                limit = self._limits.max_age_s
                raise DeviceFault("stale", "the arm repeats an old state", age_s=age, limit_s=limit)
            return
        self._device_stamp = state.stamp
        wrench: list[float] = (self._to_S @ state.wrench).tolist()
        row = [*state.q, *state.dq, *state.pose, *wrench]
        if not math.isfinite(math.fsum(row)):
            raise DeviceFault("vendor", "the arm reports numbers that are not finite")
        self._track.append((now, row[14:21]))
        self._fresh_s, self._newest = now, row
        self._stamps.append(self._to_our_clock(state.stamp, now - self._zero_s))
        self._rows.append(row)
        self._enforce_hard_limit(wrench, state, now)

    def _enforce_hard_limit(self, wrench: list[float], state: ArmState, now: float) -> None:
        """Stop the arm where it is when the hard limit trips, and keep it stopped."""
        force = math.hypot(*wrench[:3])
        self.peak_force_N = max(self.peak_force_N, force)
        self.recent_peak_N = max(self.recent_peak_N, force)
        tripped = self._hard_limit.check(wrench, lambda: pressing_power_W(state.wrench, state.pose, self._twists()))
        if tripped is None or self.stop is not None or self._busy:
            return
        self.stop = (*tripped, now - self._zero_s)
        self._rest = tuple(state.pose)  # later holds use this pose, not the last setpoint's
        if self._moves:
            self._arm.hold_at(self._rest)

    def _twists(self) -> list[Sequence[float]]:
        """Return the twists (6,) of P in B: the measured one, and the setpoint's while the arm follows it."""
        (then, before), (now, after) = self._track[-min(len(self._track), TWIST_SAMPLES)], self._track[-1]
        measured = twist_between(before, after, now - then).tolist() if now > then else NO_TWIST
        followed = self._last.twist if self._last is not None and self._rest is None else NO_TWIST
        return [measured, followed]

    def poll(self) -> None:
        """Check the arm's flags and read the gripper; call once a period.

        Raises:
            DeviceFault: A device failed.
        """
        if not self._busy and self._moves:
            self._arm.check()
        if self.devices.gripper is not None:
            state = self.devices.gripper.poll()
            self._jaws = messages.JawState(state.stamp_s - self._zero_s, state.aperture_m, state.force_N, state.moving)

    def block(self, number: int, *, tactile: bool, late: int = 0) -> messages.Block:
        """Return everything sensed since the last block.

        Raises:
            DeviceFault: The pads failed.
        """
        maps: messages.Maps | None = None
        if tactile and self.devices.pads is not None:
            m = self.devices.pads.take()
            if m is not None:
                maps = messages.Maps(m.stamp_s - self._zero_s, m.rows, m.columns, m.left, m.right)
        images = None if self.devices.pads is None else self.devices.pads.take_images()
        if images is not None:
            images = messages.Images(
                images.stamp_s - self._zero_s, images.rows, images.columns, images.left, images.right
            )
        n = len(self._rows)
        stamps = np.array([self._stamps.popleft() for _ in range(n)])
        rows = np.array([self._rows.popleft() for _ in range(n)]).reshape(n, messages.COLUMNS)
        done, self._done = tuple(self._done), []
        return messages.Block(
            number=number,
            stamps=stamps.astype("<f8").tobytes(),
            samples=rows.astype("<f8").tobytes(),
            jaws=self._jaws,
            maps=maps,
            images=images,
            done=done,
            late=late,
            stop=self.stop,
            sent_s=self._sent_s,
            read_s=self._read_s,
        )
