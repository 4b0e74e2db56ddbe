"""Write docs/images/robots.webp: every shipped robot in the same world. Needs OpenGL (MUJOCO_GL=egl works in software).

MUJOCO_GL=egl python docs/images/robots.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import glotouch_bt as gt
from glotouch_backends.mujoco.render import render
from glotouch_backends.robots import shipped_robots

SIZE = (1120, 960)
SEED = 3


def main() -> None:
    """Draw the robots side by side, in the order of their names."""
    pictures = []
    for name in shipped_robots():
        robot: Any = gt.open_robot("mujoco", robot=name, seed=SEED)
        with robot:
            large = Image.fromarray(render(robot, *SIZE, camera="whole"))
        pictures.append(np.asarray(large.resize((SIZE[0] // 2, SIZE[1] // 2), Image.Resampling.LANCZOS)))
    out = Path(__file__).with_name("robots.webp")
    Image.fromarray(np.hstack(pictures)).save(out, quality=80, method=6)
    print(out.name, out.stat().st_size, "bytes:", ", ".join(shipped_robots()))


if __name__ == "__main__":
    main()
