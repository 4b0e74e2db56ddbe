"""Stand-in for the vendor's `Tool` class: the tools of the simulated arm."""

from __future__ import annotations

from glotouch_backends.flexiv_xense.simulated.control_box import REQUEST_S, SWITCH_S, load_of
from glotouch_backends.flexiv_xense.simulated.vendor_api.flexiv_types import Mode, ToolParams
from glotouch_backends.flexiv_xense.simulated.vendor_api.flexivrdk_robot import Robot


class Tool:
    """The tools. Changes need IDLE and block."""

    def __init__(self, robot: Robot) -> None:
        if not isinstance(robot, Robot):
            raise TypeError(f"incompatible constructor arguments: {robot!r}")
        self._box = robot._box

    def exist(self, name: str) -> bool:
        """Return True if there is a tool of this name."""
        self._box.wait(REQUEST_S)
        return name in self._box.tools

    def params(self, name: str | None = None) -> ToolParams:
        """Return a tool's parameters; by default those of the current one."""
        self._box.wait(REQUEST_S)
        return self._box.tools[self._known(self._box.tool if name is None else name)]._copy()

    def Add(self, name: str, params: ToolParams) -> None:
        """Add a tool."""
        self._check(params)
        if name in self._box.tools:
            raise ValueError(f"[flexiv::rdk] tool {name} exists already")
        self._box.need_mode(Mode.IDLE)
        self._box.wait(REQUEST_S)
        self._box.tools[name] = params._copy()

    def Update(self, name: str, params: ToolParams) -> None:
        """Change a tool's parameters at once."""
        self._check(params)
        self._known(name)
        self._box.need_mode(Mode.IDLE)
        self._box.wait(REQUEST_S)
        self._box.tools[name] = params._copy()
        if name == self._box.tool:
            self._box.use_tool(name)

    def Switch(self, name: str) -> None:
        """Make a tool the current one."""
        self._known(name)
        self._box.need_mode(Mode.IDLE)
        self._box.wait(SWITCH_S)
        self._box.use_tool(name)

    def _known(self, name: str) -> str:
        if name not in self._box.tools:
            raise ValueError(f"[flexiv::rdk] tool {name!r} does not exist")
        return name

    @staticmethod
    def _check(params: ToolParams) -> None:
        if not isinstance(params, ToolParams):
            raise TypeError(f"incompatible function arguments: params = {params!r}")
        try:
            load_of(params)
        except Exception as e:
            raise ValueError(f"[flexiv::rdk] invalid tool parameters: {e}") from e
