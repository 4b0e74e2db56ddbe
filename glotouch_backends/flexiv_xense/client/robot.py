"""The robot behind the driver: one cycle is one request and its block."""

from __future__ import annotations

import math
import time
from contextlib import suppress

import numpy as np

from glotouch_backends.flexiv_xense.client.chain import Chain
from glotouch_backends.flexiv_xense.client.link import DriverLink
from glotouch_backends.flexiv_xense.client.process import DriverProcess
from glotouch_backends.flexiv_xense.driver import messages
from glotouch_bt.robot import (
    BackendError,
    Command,
    GelImages,
    GlotouchError,
    GripperState,
    JointSetpoint,
    Limits,
    Observation,
    ParamError,
    PendingTicket,
    Request,
    Robot,
    RobotDescription,
    SafetyStop,
    TactileFrame,
    Tare,
    Ticket,
)

MAX_POSE_ERROR_M = 1e-3
"""Largest distance between a setpoint's pose and the pose of its joints; a larger one means a plan for another arm."""
MAX_POSE_ERROR_RAD = 0.01
"""The same for the angle."""
QUIT_S = 10.0
"""Longest wait for the answer to a hold."""


class FlexivXenseRobot(Robot):
    """See `Robot`. Created by `FlexivXenseBackend.open`.

    Attributes:
        link, process: Connection to the driver, and its process if we started it.
        info: Facts about the devices, for display.
        late_periods: Control periods so far without a command from this client.
        latency_s: Of the last cycle: from the call until the arm has the setpoint, plus from reading the newest sample
            to the observation, without the wait for the period's end. Valid on one machine only.
    """

    def __init__(
        self,
        description: RobotDescription,
        limits: Limits,
        period_s: float,
        link: DriverLink,
        process: DriverProcess | None,
        info: dict[str, str],
        first: messages.Block,
    ) -> None:
        self.description, self.limits, self.period_s = description, limits, period_s
        self.link, self.process, self.info = link, process, info
        self.late_periods = 0
        self.latency_s = 0.0
        self._chain = Chain(description)
        self._tickets: dict[int, PendingTicket] = {}
        self._failed: BackendError | None = None
        self._closed = False
        self._observation = self._take(first)

    def observe(self) -> Observation:
        """See `Robot`."""
        return self._observation

    def cycle(self, command: Command) -> Observation:
        """See `Robot`."""
        if self._closed:
            raise BackendError("the robot is closed")
        if self._failed is not None:
            raise self._failed
        setpoint = None if command.motion is None else self._setpoint(command.motion)
        g = command.gripper
        jaws = None if g is None else messages.JawTarget(float(g.aperture_m), float(g.speed_m_s), float(g.force_N))
        number, began = self.link.number(), time.monotonic()
        try:
            cycle = messages.Cycle(
                number=number, setpoint=setpoint, jaws=jaws, tactile=command.tactile, images=command.images
            )
            block = self.link.ask(cycle, messages.Block)
        except BackendError as e:
            self._failed = e
            for ticket in self._tickets.values():
                ticket.error, ticket.done = str(e), True
            self._tickets.clear()
            raise
        self.latency_s = (block.sent_s - began) + (time.monotonic() - block.read_s)
        self._observation = self._take(block)
        if block.stop is not None:
            raise SafetyStop(*block.stop)
        return self._observation

    def start(self, request: Request) -> Ticket:
        """See `Robot`."""
        number, ticket = self.link.number(), PendingTicket()
        message: messages.TareRequest | messages.PayloadRequest
        if isinstance(request, Tare):
            message = messages.TareRequest(number=number, ticket=number, duration_s=request.duration_s)
        else:
            com = tuple(request.com_P_m.tolist())
            message = messages.PayloadRequest(number=number, ticket=number, mass_kg=float(request.mass_kg), com_P_m=com)
        self._tickets[number] = ticket
        self.link.slow_request = True
        self.link.ask(message, messages.Accepted)
        return ticket

    def hold(self) -> None:
        """See `Robot`."""
        if self._closed:
            return
        try:
            self.link.ask(messages.HoldRequest(number=self.link.number()), messages.Accepted, limit_s=QUIT_S)
        except GlotouchError as e:
            self._failed = e if isinstance(e, BackendError) else self._failed

    def close(self) -> None:
        """See `Robot`: the driver stops the arm, releases the devices and ends."""
        if self._closed:
            return
        self._closed = True
        with suppress(GlotouchError):  # the driver may have ended already
            self.link.post(messages.Quit(number=self.link.number()))
        if self.process is not None:
            self.process.end()
        self.link.close()

    def _setpoint(self, motion: JointSetpoint) -> messages.Setpoint:
        """Return the message of a setpoint: its pose, and the twist of its joint velocities.

        Raises:
            ParamError: Not finite, wrong shape, or the pose does not belong to the joints.
        """
        dof = self.description.dof
        try:
            q, dq = np.asarray(motion.q, dtype=np.float64), np.asarray(motion.dq, dtype=np.float64)
        except (TypeError, ValueError) as e:
            raise ParamError("setpoint", motion, f"arrays of shape ({dof},)") from e
        for name, value in (("q", q), ("dq", dq)):
            if value.shape != (dof,) or np.count_nonzero(np.isfinite(value)) < dof:
                raise ParamError(f"setpoint.{name}", value.tolist(), f"{dof} finite numbers")
        pose, twist = self._chain.pose_and_twist(q, dq)
        asked = motion.pose_B_P
        away = float(np.abs(pose.position_m - asked.position_m).max())
        same = abs(float(pose.quat @ asked.quat))
        if away > MAX_POSE_ERROR_M or 2.0 * math.acos(min(1.0, same)) > MAX_POSE_ERROR_RAD:
            raise ParamError(
                "setpoint.pose_B_P", f"{away * 1e3:.2f} mm from where its joints put P", "the pose its joints realise"
            )
        return messages.Setpoint(
            tuple(q.tolist()),
            tuple(dq.tolist()),
            (*asked.position_m.tolist(), *asked.quat.tolist()),
            tuple(twist.tolist()),
        )

    def _take(self, block: messages.Block) -> Observation:
        for done in block.done:
            ticket = self._tickets.pop(done.ticket, None)
            if ticket is not None:
                ticket.error, ticket.done = done.error or None, True
        self.link.slow_request = bool(self._tickets)
        self.late_periods += block.late
        rows = np.frombuffer(block.samples, dtype="<f8").reshape(-1, messages.COLUMNS)
        j = block.jaws
        return Observation(
            stamp_s=np.frombuffer(block.stamps, dtype="<f8"),
            q=rows[:, 0:7],
            dq=rows[:, 7:14],
            position_B_P=rows[:, 14:17],
            quat_B_P=rows[:, 17:21],
            wrench_S=rows[:, 21:27],
            gripper=GripperState(j.stamp_s, j.aperture_m, j.force_N, j.moving),
            tactile=None if block.maps is None else _frame(block.maps),
            images=None if block.images is None else _images(block.images),
        )


def _frame(maps: messages.Maps) -> TactileFrame:
    shape = (maps.rows, maps.columns)
    left, right = (np.frombuffer(body, dtype="<f8").reshape(shape) for body in (maps.left, maps.right))
    return TactileFrame(maps.stamp_s, left, right)


def _images(images: messages.Images) -> GelImages:
    shape = (images.rows, images.columns, 3)
    left, right = (np.frombuffer(body, dtype=np.uint8).reshape(shape) for body in (images.left, images.right))
    return GelImages(images.stamp_s, left, right)
