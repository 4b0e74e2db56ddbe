"""A small world, and a driver of the simulated arm with its own inverse kinematics (MuJoCo Jacobians)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_bt.robot import (
    Array,
    Command,
    Conditions,
    Container,
    GripperTarget,
    Holder,
    JointSetpoint,
    ObjectSet,
    Observation,
    Pose,
    Probe,
    Request,
    World,
)

K = Pose.planar((0.60, 0.0, -0.20), 0.0)
GRASP = Pose.pointing_down((0.45, -0.32, -0.06), np.pi)
BLOCK_M = (0.050, 0.036, 0.060)
LAYOUT = {"block": (0.03, 0.08, 0.0)}


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one box, which is its own convex hull."""
    path = tmp_path_factory.mktemp("objects")
    trimesh.creation.box(BLOCK_M).export(path / "block.stl")
    return path


@pytest.fixture(scope="session", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Use a private cache of hulls."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def world(folder: Path) -> World:
    return World(
        name="test",
        container=Container(pose_B_K=K, interior_m=(0.30, 0.40, 0.08)),
        probe=Probe(),
        holder=Holder(pose_B_grasp=GRASP),
        objects=ObjectSet(folder=folder),
    )


SOLVED: dict[tuple[bytes, ...], Array] = {}


class Driver:
    """Straight lines at a smooth speed, one control period at a time."""

    def __init__(self, robot: MujocoRobot) -> None:
        self.robot = robot
        self.observations: list[Observation] = [robot.observe()]
        self._scratch = mujoco.MjData(robot.model)
        self._scratch.qpos[:] = robot.data.qpos
        self.planned: list[Pose] = []
        m = robot.model
        self._arm = b"".join(
            a.tobytes() for a in (m.body_pos, m.body_quat, m.jnt_pos, m.jnt_axis, m.site_pos, m.site_quat)
        )
        self.q = np.array(robot.description.home_q)
        self.pose = self._forward(self.q)

    @property
    def last(self) -> Observation:
        return self.observations[-1]

    def _forward(self, q: Array) -> Pose:
        h, d = self.robot.handles, self._scratch
        d.qpos[h.arm_qpos] = q
        mujoco.mj_kinematics(self.robot.model, d)
        mujoco.mj_comPos(self.robot.model, d)
        return Pose.from_matrix(d.site_xpos[h.pads_site], d.site_xmat[h.pads_site].reshape(3, 3))

    def solve(self, pose: Pose) -> Array:
        """Joint angles that reach `pose`, from the present ones; kept for other tests."""
        key = (self._arm, self.q.tobytes(), pose.position_m.tobytes(), pose.quat.tobytes())
        if key not in SOLVED:
            SOLVED[key] = self._solve(pose)
        return SOLVED[key].copy()

    def _solve(self, pose: Pose) -> Array:
        """Damped Gauss-Newton."""
        h, m, q = self.robot.handles, self.robot.model, self.q.copy()
        jac = np.zeros((6, m.nv))
        for _ in range(50):
            now = self._forward(q)
            turn = pose.rotation @ now.rotation.T
            vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
            error = np.concatenate([pose.position_m - now.position_m, vector])
            if np.abs(error).max() < 1e-9:
                return q
            mujoco.mj_jacSite(m, self._scratch, jac[:3], jac[3:], h.pads_site)
            j = jac[:, h.arm_dof]
            q = q + j.T @ np.linalg.solve(j @ j.T + 1e-8 * np.eye(6), error)
        raise AssertionError(f"{pose} is out of reach: {error}")

    def line(
        self,
        position_m: tuple[float, float, float] | Array,
        speed_m_s: float = 0.10,
        yaw_rad: float = np.pi,
        until: Callable[[Observation], bool] | None = None,
        settle_s: float = 0.05,
    ) -> Observation:
        """Move P to `position_m` in B, pointing down; stop at once when `until` returns True."""
        start, end = self.pose, Pose.pointing_down(position_m, yaw_rad)
        turn = (end.yaw_rad - start.yaw_rad + np.pi) % (2 * np.pi) - np.pi
        distance = max(float(np.linalg.norm(end.position_m - start.position_m)), 0.1 * abs(turn))
        n = max(10, round(1.9 * distance / speed_m_s / self.robot.period_s))
        s = np.arange(1, n + 1) / n
        for t in 10 * s**3 - 15 * s**4 + 6 * s**5:
            p = start.position_m + t * (end.position_m - start.position_m)
            pose = Pose.pointing_down(p, start.yaw_rad + t * turn)
            q = self.solve(pose)
            # the line's end is at rest; a velocity from the last step would not be
            dq = (q - self.q) / self.robot.period_s if t < 1.0 else np.zeros(7)
            self.cycle(Command(motion=JointSetpoint(q, dq, np.zeros(7), pose)))
            self.q, self.pose = q, pose
            self.planned.append(pose)
            if until is not None and until(self.last):
                break
        return self.wait(settle_s)

    def cycle(self, command: Command) -> Observation:
        self.observations.append(self.robot.cycle(command))
        return self.last

    def wait(self, time_s: float, command: Command | None = None) -> Observation:
        for _ in range(round(time_s / self.robot.period_s)):
            self.cycle(command or Command())
        return self.last

    def jaws(
        self, aperture_m: float, force_N: float = 60.0, speed_m_s: float = 0.08, time_s: float = 1.0
    ) -> Observation:
        self.cycle(Command(gripper=GripperTarget(aperture_m, speed_m_s, force_N)))
        return self.wait(time_s)

    def request(self, request: Request) -> None:
        ticket = self.robot.start(request)
        for _ in range(200):
            if ticket.done:
                assert ticket.error is None
                return
            self.cycle(Command())
        raise AssertionError(f"{request} never finished")

    def tip(self) -> Array:
        """True centre of the ball, B."""
        return np.array(self.robot.data.site_xpos[self.robot.handles.tip_site])

    def pick(self) -> None:
        """Take the probe out of its stand."""
        x, y, z = GRASP.position_m
        self.line((x, y, z + 0.10))
        self.jaws(0.040, time_s=0.3)
        self.line((x, y, z))
        self.jaws(0.0)
        self.line((x, y, z + 0.18))


@pytest.fixture
def drive() -> Callable[[MujocoRobot], Driver]:
    """Return the driver class."""
    return Driver


@pytest.fixture
def open_robot(world: World) -> Iterator[Callable[..., MujocoRobot]]:
    """Open robots in the small world; all are closed at the end."""
    opened: list[MujocoRobot] = []

    def make(
        conditions: Conditions | None = None, seed: int = 0, layout: dict[str, tuple[float, float, float]] | None = None
    ) -> MujocoRobot:
        robot = MujocoBackend().open(world, conditions or Conditions(), seed, {"layout": layout or LAYOUT})
        assert isinstance(robot, MujocoRobot)
        opened.append(robot)
        return robot

    yield make
    for robot in opened:
        robot.close()
