"""Stand-in for the vendor's module `flexivrdk` 1.9: the names that the driver uses. See `flexivrdk_robot`."""

from glotouch_backends.flexiv_xense.simulated.vendor_api.flexiv_tool import Tool
from glotouch_backends.flexiv_xense.simulated.vendor_api.flexiv_types import (
    Mode,
    OperationalStatus,
    RobotEvent,
    RobotEvent_Level,
    RobotInfo,
    RobotStates,
    ToolParams,
)
from glotouch_backends.flexiv_xense.simulated.vendor_api.flexivrdk_robot import Robot

__all__ = [
    "Mode",
    "OperationalStatus",
    "Robot",
    "RobotEvent",
    "RobotEvent_Level",
    "RobotInfo",
    "RobotStates",
    "Tool",
    "ToolParams",
    "__version__",
]

__version__ = "1.9.4.1"
