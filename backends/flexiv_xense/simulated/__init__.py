"""Devices that are not there: the vendors' modules, names and quirks over the MuJoCo world. See `open_vendor`."""

from backends.flexiv_xense.simulated.vendor import ROBOT_SN, SimulatedVendor, open_vendor

__all__ = ["ROBOT_SN", "SimulatedVendor", "open_vendor"]
