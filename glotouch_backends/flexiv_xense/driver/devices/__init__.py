"""Adapters of the vendors' interfaces: the only files of the driver that call an SDK."""

from .arm import ArmState
from .connect import Connected, connect_devices
from .vendor import Served, Vendor
