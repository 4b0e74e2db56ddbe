"""The gymnasium environment: its checker, the command of an action, rewards, limits and ends."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402

from glotouch_bt.environment import ACTION_KEYS, OBSERVATION_KEYS, TouchEnv, Transition  # noqa: E402
from glotouch_bt.robot import FakeRobot, ParamError, load_backend  # noqa: E402


def checked(env: TouchEnv) -> None:
    """Run gymnasium's checker; a warning that is not about unbounded observations is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*(infinity|not normalized|symmetric).*")
        check_env(env, skip_render_check=True)


def action(env: TouchEnv, velocity: float = 0.0, aperture_m: float = 0.05, tactile: int = 0):
    joints = np.full(env.action_space["joint_velocity"].shape, velocity)
    return {"joint_velocity": joints, "gripper": np.array([aperture_m, 0.1, 10.0]), "tactile": tactile}


def test_the_checker_passes_on_the_fake_robot() -> None:
    checked(TouchEnv("fake", duration_s=1.0))


def test_the_checker_passes_in_mujoco() -> None:
    env = TouchEnv("mujoco", duration_s=1.0)
    checked(env)
    env.close()


def test_it_can_be_made_by_name() -> None:
    env = gymnasium.make("glotouch_bt.environment:glotouch/Touch-v0", backend="fake", disable_env_checker=True)
    observation, info = env.reset(seed=7)
    assert info == {"seed": 7}
    assert tuple(observation) == tuple(sorted(OBSERVATION_KEYS)) or set(observation) == set(OBSERVATION_KEYS)
    assert set(env.action_space.keys()) == set(ACTION_KEYS)


def test_velocity_is_integrated_within_the_acceleration() -> None:
    """Closed form: from rest at constant acceleration a, q(t) = q0 + a t^2 / 2, until the velocity is reached."""
    env = TouchEnv("fake", acceleration_rad_s2=2.0)
    first, _ = env.reset(seed=0)
    for _ in range(10):
        last, *_ = env.step(action(env, velocity=0.2))
    assert last["q"][-1] - first["q"][-1] == pytest.approx(np.full(7, 0.5 * 2.0 * 0.1**2), abs=1e-12)
    for _ in range(10):
        end, *_ = env.step(action(env, velocity=0.2))
    assert end["q"][-1] - last["q"][-1] == pytest.approx(np.full(7, 0.2 * 0.1), abs=1e-12)


def test_joint_limits_hold_for_any_action() -> None:
    env = TouchEnv("fake", acceleration_rad_s2=500.0)
    env.reset(seed=0)
    upper = np.array([j.upper_rad for j in env.robot.description.joints])
    for _ in range(300):
        observation, *_ = env.step(action(env, velocity=2.5))
    assert (observation["q"][-1] <= upper + 1e-12).all()
    assert observation["q"][-1] == pytest.approx(upper)


def test_reward_and_end_are_the_users() -> None:
    seen: list[Transition] = []

    def reward(transition: Transition) -> float:
        seen.append(transition)
        return float(transition.after.gripper.aperture_m)

    env = TouchEnv("fake", reward=reward, done=lambda t: t.after.gripper.aperture_m < 0.08, duration_s=0.1)
    env.reset(seed=0)
    results = [env.step(action(env, aperture_m=0.07)) for _ in range(10)]
    assert [r[1] for r in results[:2]] == pytest.approx([0.084, 0.083])  # 0.1 m/s for periods of 10 ms
    assert [r[2] for r in results] == [False] * 5 + [True] * 5
    assert [r[3] for r in results] == [False] * 9 + [True]  # 0.1 s
    assert seen[0].command.gripper is not None
    assert seen[0].referee is None


def test_a_safety_stop_terminates_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    heavy = FakeRobot(wrench=lambda stamp, *_: np.where(stamp[:, None] > 0.25, 50.0, 0.0) * np.ones((len(stamp), 6)))
    monkeypatch.setattr(type(load_backend("fake")), "open", lambda *_: heavy)
    env = TouchEnv("fake")
    env.reset(seed=0)
    for _ in range(10):
        _, _, terminated, _, info = env.step(action(env))
        if terminated:
            break
    assert terminated
    assert "force" in info["stop"]


def test_an_action_that_is_no_number_is_refused() -> None:
    env = TouchEnv("fake")
    env.reset(seed=0)
    with pytest.raises(ParamError, match="joint_velocity"):
        env.step(action(env, velocity=np.nan))
