"""Stand-ins for the vendors' modules, with the vendors' names, signatures and errors; only what the driver uses."""

from glotouch_backends.flexiv_xense.simulated.vendor_api.flexiv_types import (
    EPOCH_S,
    Mode,
    OperationalStatus,
    RobotEvent,
    RobotEvent_Level,
    ToolParams,
)
from glotouch_backends.flexiv_xense.simulated.vendor_api.xensegripper import GripperLink
from glotouch_backends.flexiv_xense.simulated.vendor_api.xensesdk import PadLink
