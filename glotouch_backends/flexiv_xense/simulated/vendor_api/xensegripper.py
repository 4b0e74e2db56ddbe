"""Stand-in for the vendor's `xensegripper`: mm, mm/s and N; 85 mm is open.

Like the real grippers: only the serial class checks a range, that of its position; a target is accepted silently even
without a link; the status is a cached dict without a stamp, None at first and repeated for ever once the link is lost;
an unreachable TCP gripper raises a bare Exception.
"""

from __future__ import annotations

from typing import Any, ClassVar

from glotouch_backends.flexiv_xense.driver import Clock
from glotouch_backends.flexiv_xense.simulated.hand import SimulatedHand

MM = 1e-3
UNREACHABLE_S = 7.5
"""Time until an unreachable gripper is reported. ASSUMED."""
CONNECT_S = 0.3
"""Duration of connecting. ASSUMED."""
FIRST_S = 0.02
"""Time from connecting to the first status. ASSUMED."""
TEMPERATURE_C = 31.0
"""Reported temperature. ASSUMED."""


class GripperLink:
    """One gripper on the simulated network.

    Args:
        hand: The hand.
        clock: What blocking calls wait on.
    """

    def __init__(self, hand: SimulatedHand, clock: Clock) -> None:
        self.hand, self.clock, self.linked = hand, clock, True


class XenseGripper:
    """Common part of both grippers."""

    _links: ClassVar[dict[str, GripperLink]] = {}
    _tcp: ClassVar[type[Any]]
    _serial: ClassVar[type[Any]]

    @classmethod
    def create(cls, mac_addr: str | None = None, **kwargs: Any) -> XenseGripper:
        """Create a TCP gripper with an address, a serial one with a `port`."""
        gripper = cls._tcp(mac_addr) if mac_addr is not None else cls._serial(**kwargs)
        assert isinstance(gripper, XenseGripper)
        return gripper

    def _connect(self, link: GripperLink) -> None:
        link.clock.sleep_until(link.clock.now_s() + CONNECT_S)
        self._link = link
        self._since_s = link.clock.now_s()
        self._status: dict[str, float] | None = None

    def get_gripper_status(self) -> dict[str, float] | None:
        """Return the cached status."""
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
        """Disconnect; the last target stays."""


class XenseTCPGripper(XenseGripper):
    """Gripper on the network."""

    def __init__(self, mac_addr: str) -> None:
        link = self._links.get(mac_addr)
        if link is None or not link.linked:
            for any_link in self._links.values():
                any_link.clock.sleep_until(any_link.clock.now_s() + UNREACHABLE_S)
                break
            raise Exception(f"no gripper answers at {mac_addr}")
        self._connect(link)

    def set_position(self, position: float, vmax: float = 80.0, fmax: float = 27.0) -> None:
        """Set a target without a check; return at once."""
        self._go(position, vmax, fmax)


class XenseSerialGripper(XenseTCPGripper):
    """Gripper on a serial line."""

    def __init__(self, port: str, device_id: int = 1) -> None:
        link = self._links.get(port)
        if link is None:
            raise OSError(f"could not open port {port}")
        self._connect(link)

    def set_position(self, position: float, vmax: float = 80.0, fmax: float = 27.0) -> None:
        """Set a target; only the position is checked."""
        if not 0.0 <= position <= 85.0:
            raise ValueError(f"position {position} is outside 0 .. 85")
        self._go(position, vmax, fmax)
