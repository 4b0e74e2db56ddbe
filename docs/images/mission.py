"""Write docs/images/mission.png: six moments of one retrieval. Needs OpenGL (MUJOCO_GL=egl works in software).

MUJOCO_GL=egl python docs/images/mission.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from glotouch_backends.mujoco.render import render
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.execution import run_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.robot import Command, Observation, load_backend

SIZE = (520, 390)
# (node that must be running, seconds after it began, camera, caption)
SHOTS = (
    ("tool_pickup", 7.0, "holder", "1  pick up the probe"),
    ("orbit_probe", 18.0, "container", "2  sweep, touch, trace each object"),
    ("tool_return", 12.0, "overview", "3  put the probe back"),
    ("squeeze", 15.8, "hand", "4  squeeze each candidate at several heights"),
    ("grasp", 8.5, "container", "5  match the STL, grasp the best"),
    ("lift", 2.5, "overview", "6  lift the target"),
)


class Photographer:
    """A record that only notes which node runs and since when."""

    def __init__(self) -> None:
        self.node, self.since = "", 0.0

    def tick(self, stamp_s: float, changes: list[tuple[str, Any, Any]]) -> None:
        """Note which of the nodes in SHOTS began."""
        for path, _, new in changes:
            name = path.rsplit("/", 1)[-1]
            if str(getattr(new, "value", new)) == "RUNNING" and any(name == shot[0] for shot in SHOTS):
                self.node, self.since = name, stamp_s

    def __getattr__(self, name: str) -> Any:
        return lambda *args, **kwargs: None


def main() -> None:
    """Run the mission and write the picture."""
    mission = load_mission("retrieve", {"target": "wukong"})
    robot: Any = load_backend("mujoco").open(mission.world, load_conditions("nominal"), 0, {})
    watch, waiting, pictures = Photographer(), list(SHOTS), []
    cycle = robot.cycle

    def watched(command: Command) -> Observation:
        observation = cycle(command)
        if waiting and watch.node == waiting[0][0] and observation.now_s - watch.since >= waiting[0][1]:
            _, _, camera, caption = waiting.pop(0)
            picture = Image.fromarray(render(robot, *(2 * s for s in SIZE), camera)).resize(SIZE, Image.LANCZOS)
            ImageDraw.Draw(picture).text(
                (12, 10), caption, fill=(20, 24, 32), font_size=18, stroke_width=2, stroke_fill="white"
            )
            pictures.append(np.asarray(picture))
        return observation

    robot.cycle = watched
    with robot:
        print(run_mission(mission, robot, watch).status)
    rows = [np.concatenate(pictures[i : i + 3], axis=1) for i in (0, 3)]
    Image.fromarray(np.concatenate(rows)).quantize(192).save(Path(__file__).with_suffix(".png"), optimize=True)


if __name__ == "__main__":
    main()
