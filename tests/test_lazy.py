"""Start-up time: a check loads no heavy module; a run loads all of them first, unless the robot waits."""

from __future__ import annotations

import subprocess
import sys

import pytest

# flake
HEAVY = (
    "pinocchio",
    "fcl",
    "trimesh",
    "scipy.ndimage",
    "scipy.spatial",
    "scipy.special",
    "mcap",
    "mujoco",
    "matplotlib",
    "numba",
)
LOADED = "[m for m in HEAVY if m in sys.modules and type(sys.modules[m]).__name__ != '_LazyModule']"


def loaded_after(code: str) -> list[str]:
    """Return the modules of HEAVY that are loaded after `code` has run in a process of its own."""
    script = f"import sys\n{code}\nHEAVY = {HEAVY!r}\nprint(*{LOADED})"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_check_loads_no_heavy_module() -> None:
    assert loaded_after("from glotouch_bt.mission import load_mission; load_mission('retrieve')") == []


def test_the_command_line_loads_no_mission_code() -> None:
    assert loaded_after("import glotouch_bt.cli; assert 'glotouch_bt.mission' not in sys.modules") == []


def test_load_all_loads_what_missions_need() -> None:
    code = "from glotouch_bt.mission import load_mission; load_mission('retrieve')\n"
    loaded = loaded_after(code + "from glotouch_bt.lazy import load_all; load_all()")
    assert set(loaded) >= set(HEAVY) - {"mcap", "mujoco", "matplotlib"}


def test_a_simulated_world_opens_without_what_only_recognition_needs() -> None:
    code = "import glotouch_backends.mujoco as m\nfrom glotouch_bt.mission.read import load_conditions, load_world\n"
    opening = "m.MujocoBackend().open(load_world('container_five'), load_conditions('nominal'), 1, {})"
    assert not {"trimesh", "scipy.ndimage", "matplotlib"} & set(loaded_after(code + opening))


def test_scipy_loads_no_part_of_numpy_that_it_does_not_use() -> None:
    code = "import glotouch_bt.robot, scipy; scipy.spatial.ConvexHull\n"
    spared = "assert not {'numpy.f2py.crackfortran', 'numpy.testing.overrides'} & set(sys.modules)\n"
    loaded_after(code + spared + "import numpy; numpy.testing.assert_allclose(1.0, 1.0); assert numpy.f2py.get_include")


def test_load_all_does_not_keep_what_an_earlier_run_left() -> None:
    code = (
        "import gc, weakref\nfrom glotouch_bt.lazy import load_all\nload_all(); gc.disable()\n"
        "class World: pass\nworld = World(); world.itself = world; left = weakref.ref(world); del world\n"
        "load_all(); assert left() is None\n"
    )
    loaded_after(code)


OPENINGS = {
    "open_robot": "import glotouch_bt.api as module; start = lambda: module.open_robot('fake')",
    "launch": "import sys, glotouch_bt.runs; module = sys.modules['glotouch_bt.runs.launch']; "
    "start = lambda: module.launch(module.RunRequest('calibrate', 'fake', out=module.Path('unused')))",
    "bench link": "from pathlib import Path; import glotouch_bt.commissioning.link as module; "
    "start = lambda: module.run_study(module.LinkStudy('fake', Path('unused')))",
}


@pytest.mark.parametrize("opening", OPENINGS)
def test_no_import_waits_until_a_robot_is_open(opening: str) -> None:
    code = (
        f"{OPENINGS[opening]}\n"
        "class Backend:\n"
        "    clock_waits = False\n"
        "    def open(self, *_): raise InterruptedError\n"
        "    describe = open\n"
        "module.load_backend = lambda name: Backend()\n"
        "try: start()\n"
        "except InterruptedError: pass\n"
    )
    assert "numba" in loaded_after(code)
