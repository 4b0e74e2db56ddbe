"""Write docs/images/mission.webp: one retrieval as an animation. Needs OpenGL (MUJOCO_GL=egl works in software).

MUJOCO_GL=egl python docs/images/mission.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw

from glotouch_bt.mission import load_mission
from glotouch_bt.mission.execution import run_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.mission.record import NullRecord, RunSummary
from glotouch_bt.robot import Command, Observation, load_backend

SIZE = (560, 420)
DRAWN = (840, 630)
EVERY_S, FRAME_MS, LAST_MS = 1.6, 80, 2500
"""Robot time between two pictures, and how long one is shown: about 20 times real time."""


def main() -> None:
    """Run the mission and write the animation."""
    mission = load_mission("retrieve", {"target": "apple"})
    backend = load_backend("mujoco")
    robot: Any = backend.open(mission.world, load_conditions("nominal"), 0, {})
    camera = backend.camera(robot)
    assert camera is not None
    frames: list[Image.Image] = []
    shown: dict[str, Any] = {"summary": RunSummary(NullRecord()), "next_s": 0.0}
    cycle = robot.cycle

    def draw(now_s: float) -> None:
        summary = shown["summary"]
        picture = Image.fromarray(camera(*DRAWN)).resize(SIZE, Image.Resampling.LANCZOS)
        text = f"{now_s:3.0f} s   {summary.node.rsplit('/', 1)[-1].rstrip(' 0123456789')}"
        facts = f"{summary.contacts} contacts   {len(summary.candidates)} of 5 objects"
        facts += f"   candidate {summary.best[0]}: {100 * summary.best[1]:.0f} %" if summary.best[0] >= 0 else ""
        pen = ImageDraw.Draw(picture)
        for y, line in ((12, text), (SIZE[1] - 30, facts)):
            pen.text((14, y), line, fill=(20, 24, 32), font_size=17, stroke_width=2, stroke_fill="white")
        frames.append(picture)

    def watched(command: Command) -> Observation:
        observation = cycle(command)
        if observation.now_s >= shown["next_s"]:
            shown["next_s"] = observation.now_s + EVERY_S
            draw(observation.now_s)
        return observation

    robot.cycle = watched
    with robot:
        done = run_mission(mission, robot, NullRecord(), on_progress=lambda _, summary: shown.update(summary=summary))
        draw(done.end_s)
    times = [FRAME_MS] * (len(frames) - 1) + [LAST_MS]
    out = Path(__file__).with_suffix(".webp")
    frames[0].save(out, save_all=True, append_images=frames[1:], duration=times, loop=0, quality=55, method=4)
    print(done.status, len(frames), "frames", out.stat().st_size, "bytes")


if __name__ == "__main__":
    main()
