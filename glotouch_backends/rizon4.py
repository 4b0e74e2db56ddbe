"""The Flexiv Rizon 4 with a Xense-like parallel gripper; shared by the simulator and the hardware backend."""

from __future__ import annotations

from glotouch_backends.robots import load_robot

RIZON4_XENSE = load_robot("rizon4")
XENSE_GRIPPER = RIZON4_XENSE.gripper
