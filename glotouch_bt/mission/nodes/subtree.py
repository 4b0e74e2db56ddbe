"""`subtree`: a tree from another file, with parameters and ports of its own."""

from __future__ import annotations

from pydantic import Field

from glotouch_bt.mission.nodes.base import BtcppForm, NodeKind
from glotouch_bt.mission.spec import NodeSpec, Settings


class SubtreeSettings(Settings):
    """Another file's tree with parameters and ports of its own."""

    file: str = Field(description="path of the subtree's file, relative to this one")
    parameters: dict[str, bool | int | float | str] = Field(
        default_factory=dict, description="values of its parameters"
    )
    ports: dict[str, str] = Field(default_factory=dict, description="its key: our key; all its other keys are private")


class SubtreeKind(NodeKind):
    """Return the result of the other tree, which is read as its only child."""

    name = "subtree"
    description = "a tree from another file"
    Settings = SubtreeSettings
    children = "none"
    btcpp, sign, fill = "SubTree", "▤", "#eeeeee"

    def btcpp_form(self, node: NodeSpec) -> BtcppForm | None:
        """Let its tree stand in its place."""
        return None
