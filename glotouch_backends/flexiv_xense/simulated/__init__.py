"""Simulated devices: firmware and control box over the MuJoCo world, behind the vendors' interfaces."""

from glotouch_backends.flexiv_xense.simulated.remote import RemoteVendor, open_remote_vendor
from glotouch_backends.flexiv_xense.simulated.vendor import (
    GRIPPER_ADDRESS,
    PAD_SNS,
    ROBOT_SN,
    UNUSABLE,
    SimulatedVendor,
    open_vendor,
)
