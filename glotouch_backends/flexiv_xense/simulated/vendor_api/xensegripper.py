"""A stand-in for the vendor's `xensegripper` over the simulated hand: mm, mm/s and N; 85 mm is open.

As with the real ones: nobody checks a range but the serial class its position; a target is taken in silence whether
anybody hears it or not; the status is a cached dict without a stamp, None at first and repeated for ever when the link
is gone; an unreachable TCP gripper raises a bare Exception.
"""

from __future__ import annotations

from enum import Enum
from typing import Any, ClassVar

from glotouch_backends.flexiv_xense.driver import Clock
from glotouch_backends.flexiv_xense.simulated.hand import SimulatedHand

MM = 1e-3
UNREACHABLE_S, CONNECT_S, FIRST_S = 7.5, 0.3, 0.02
TEMPERATURE_C = 31.0


class GripperLink:
    """One gripper on the simulated network.

    Args:
        hand: The hand.
        clock: What blocking calls wait on.
    """

    def __init__(self, hand: SimulatedHand, clock: Clock) -> None:
        self.hand, self.clock, self.linked = hand, clock, True


class XenseGripper:
    """What both grippers can do."""

    class ControlMode(Enum):
        """Modes of the TCP gripper."""

        POSITION = 0
        SAFE = 1
        SPEED = 2

    _links: ClassVar[dict[str, GripperLink]] = {}
    _tcp: ClassVar[type[Any]]
    _serial: ClassVar[type[Any]]

    @classmethod
    def create(cls, mac_addr: str | None = None, **kwargs: Any) -> XenseGripper:
        """TCP with an address, serial with a `port`."""
        gripper = cls._tcp(mac_addr) if mac_addr is not None else cls._serial(**kwargs)
        assert isinstance(gripper, XenseGripper)
        return gripper

    def _connect(self, link: GripperLink) -> None:
        link.clock.sleep_until(link.clock.now_s() + CONNECT_S)
        self._link = link
        self._since_s = link.clock.now_s()
        self._status: dict[str, float] | None = None

    def get_gripper_status(self) -> dict[str, float] | None:
        """The cached status."""
        link = self._link
        if link.linked and link.clock.now_s() - self._since_s >= FIRST_S:
            aperture_m, speed_m_s, force_N = link.hand.status
            self._status = {
                "position": round(aperture_m / MM, 2),
                "velocity": round(speed_m_s / MM, 1),
                "force": round(force_N, 2),
                "temperature": TEMPERATURE_C,
            }
        return None if self._status is None else dict(self._status)

    def _go(self, position: float, vmax: float, fmax: float) -> None:
        if self._link.linked:
            self._link.hand.go_to(float(position) * MM, float(vmax) * MM, float(fmax))

    def release(self) -> None:
        """Stop talking; the last target stays."""


class XenseTCPGripper(XenseGripper):
    """Over the network."""

    def __init__(self, mac_addr: str) -> None:
        link = self._links.get(mac_addr)
        if link is None or not link.linked:
            for any_link in self._links.values():
                any_link.clock.sleep_until(any_link.clock.now_s() + UNREACHABLE_S)
                break
            raise Exception(f"no gripper answers at {mac_addr}")
        self._connect(link)

    def set_position(self, position: float, vmax: float = 80.0, fmax: float = 27.0) -> None:
        """A target; returns at once and checks nothing."""
        self._go(position, vmax, fmax)

    def set_position_sync(
        self,
        position: float,
        vmax: float,
        fmax: float,
        tolerance: float = 0.01,
        timeout: float = 5,
        poll_interval: float = 0.05,
    ) -> bool:
        """A target; blocks until it is reached to `tolerance` mm: False when an object stops the jaws before."""
        clock = self._link.clock
        self._go(position, vmax, fmax)
        until = clock.now_s() + timeout
        while clock.now_s() < until:
            clock.sleep_until(clock.now_s() + poll_interval)
            status = self.get_gripper_status()
            if status is not None and abs(status["position"] - position) <= tolerance:
                return True
        return False


class XenseSerialGripper(XenseTCPGripper):
    """Over a serial line."""

    def __init__(self, port: str, device_id: int = 1) -> None:
        link = self._links.get(port)
        if link is None:
            raise OSError(f"could not open port {port}")
        self._connect(link)

    def set_position(self, position: float, vmax: float = 80.0, fmax: float = 27.0) -> None:
        """A target; only the position is checked."""
        if not 0.0 <= position <= 85.0:
            raise ValueError(f"position {position} is outside 0 .. 85")
        self._go(position, vmax, fmax)
