"""The Xense gripper: range checks of our own, and detection of readings that repeat because the link is lost."""

from __future__ import annotations

import math
from typing import Any

from ..clock import Clock
from ..faults import CommandRefused, DeviceFault, vendor_call
from ..frames import MM
from ..messages import HandLimits, JawState, JawTarget

MOVING_M_S = 0.002
"""Report the jaws as moving above this speed. Source: ours."""
MAX_RESPONSE_S = 1.0
"""After a command the status must change within this time. Source: ours."""
MAX_REPEAT_S = 0.2
"""Jaws that move cannot report the same for longer. Source: the supervisor's limit for old reports."""
MIN_MOVE_M = 1e-3
"""A nearer target need not change the status. Source: ours."""
GRIPPED_FORCE_SHARE = 0.5
"""Above this share of the force limit, an object explains why the jaws do not close further. Source: ours."""
FIRST_STATUS_S = 5.0
"""Longest wait for the first status. Source: ours."""
POLL_S = 0.01
"""Interval between two reads while waiting."""
SERIAL = "serial:"
"""Prefix of the address of a gripper on a serial port."""


def open_gripper(sdk: Any, address: str) -> Any:
    """Connect to the gripper at a MAC or IP address, or at "serial:PORT".

    Raises:
        DeviceFault: It cannot be reached (the vendor raises a bare Exception after some seconds).
    """
    with vendor_call(f"connecting to the gripper at {address}", "connect"):
        if address.startswith(SERIAL):
            return sdk.XenseGripper.create(port=address[len(SERIAL) :])
        return sdk.XenseGripper.create(address)


class DriverGripper:
    """The gripper. Aperture 0 is closed, as everywhere in this project (the vendor's 85 mm is open).

    Args:
        device: From `open_gripper`.
        clock: Time.
        limits: Ranges of the hand.
        link_loss: Behaviour of this model when its link is lost, "holds" or "opens"; it is named in the errors.
    """

    def __init__(self, device: Any, clock: Clock, limits: HandLimits, link_loss: str = "holds") -> None:
        self._link_loss_effect = "keeps its grip" if link_loss == "holds" else "LETS GO of what it holds"
        self._device, self._clock, self._limits = device, clock, limits
        self._target: JawTarget | None = None
        self._commanded_s = -math.inf
        self._seen: tuple[float, float, float] | None = None
        self._changed_s = clock.now_s()
        self._answered = True
        self.state = JawState(clock.now_s(), math.nan, 0.0, False)

    def wait_for_status(self) -> None:
        """Wait for the first status: the vendor has none right after connecting.

        Raises:
            DeviceFault: No status came.
        """
        until = self._clock.now_s() + FIRST_STATUS_S
        while True:
            with vendor_call("reading the gripper", "link"):
                status = self._device.get_gripper_status()
            if status is not None:
                self._take(status)
                return
            now = self._clock.now_s()
            if now >= until:
                raise DeviceFault("connect", f"the gripper sent no status within {FIRST_STATUS_S:g} s")
            self._clock.sleep_until(now + POLL_S)

    def check(self, target: JawTarget) -> None:
        """Refuse a target outside the hand's ranges.

        Raises:
            CommandRefused: Not finite or out of range.
        """
        limits = self._limits
        for name, value, low, high in (
            ("aperture_m", target.aperture_m, 0.0, limits.stroke_m),
            ("speed_m_s", target.speed_m_s, 1e-4, limits.speed_m_s),
            ("force_N", target.force_N, 0.1, limits.force_N),
        ):
            if not (math.isfinite(value) and low - 1e-9 <= value <= high + 1e-9):
                raise CommandRefused(f"gripper.{name}", value, f"within {low:g} .. {high:g}")

    def send(self, target: JawTarget) -> None:
        """Send a (checked) target, clamped once more because the vendor's own range checks are unreliable."""
        limits = self._limits
        aperture = min(max(target.aperture_m, 0.0), limits.stroke_m)
        speed, force = min(target.speed_m_s, limits.speed_m_s), min(target.force_N, limits.force_N)
        with vendor_call("commanding the gripper", "link"):
            self._device.set_position(aperture / MM, speed / MM, force)
        if self._target is None or abs(aperture - self._target.aperture_m) > MIN_MOVE_M:
            self._answered, self._commanded_s = False, self._clock.now_s()
        self._target = JawTarget(aperture, speed, force)

    def poll(self) -> JawState:
        """Return the newest status.

        Raises:
            DeviceFault: stale: the jaws should have moved by now, or report that they move, but the status does not
                change. A link that is lost while the jaws rest shows only at the next command.
        """
        with vendor_call("reading the gripper", "link"):
            status = self._device.get_gripper_status()
        if status is None:
            raise DeviceFault(
                "link", f"the gripper has no status any more; without its link this model {self._link_loss_effect}"
            )
        self._take(status)
        now, target = self.state.stamp_s, self._target
        if self.state.moving and (age_s := now - self._changed_s) > MAX_REPEAT_S:
            raise DeviceFault(
                "stale",
                f"the gripper reports moving jaws at {self.state.aperture_m / MM:.1f} mm again and again; its link is "
                f"lost, and then this model {self._link_loss_effect}",
                age_s=age_s,
                limit_s=MAX_REPEAT_S,
            )
        if target is None or self._answered or now - self._commanded_s < MAX_RESPONSE_S:
            return self.state
        closing = target.aperture_m < self.state.aperture_m
        blocked = closing and self.state.force_N > GRIPPED_FORCE_SHARE * target.force_N
        if abs(target.aperture_m - self.state.aperture_m) < MIN_MOVE_M or blocked:
            self._answered = True
            return self.state
        raise DeviceFault(
            "stale",
            f"the gripper was told to go to {target.aperture_m / MM:.1f} mm and still reports "
            f"{self.state.aperture_m / MM:.1f} mm; it is blocked, or its link is lost, and then this model "
            f"{self._link_loss_effect}",
            age_s=now - self._changed_s,
            limit_s=MAX_RESPONSE_S,
        )

    def _take(self, status: Any) -> None:
        with vendor_call("reading the gripper's status"):
            seen = float(status["position"]), float(status["velocity"]), float(status["force"])
        if not all(map(math.isfinite, seen)):
            raise DeviceFault("vendor", f"the gripper reports {status!r}")
        now = self._clock.now_s()
        if seen != self._seen:
            self._answered = self._answered or self._seen is not None
            self._seen, self._changed_s = seen, now
        position, velocity, force = seen
        self.state = JawState(now, position * MM, abs(force), abs(velocity * MM) > MOVING_M_S)

    def release(self) -> None:
        """Disconnect from the device, which keeps its grip; never raises."""
        try:
            self._device.release()
        except Exception:  # the session ends; the arm has been stopped before
            return
