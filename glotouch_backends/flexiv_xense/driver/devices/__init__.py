"""TODO door of glotouch_backends/flexiv_xense/driver/devices."""

from .connect import Connected, connect_devices

__all__ = ["Connected", "connect_devices"]
