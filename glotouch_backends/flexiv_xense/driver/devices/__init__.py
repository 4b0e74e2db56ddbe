"""TODO door of glotouch_backends/flexiv_xense/driver/devices."""

from .connect import Connected, connect

__all__ = ["Connected", "connect"]
