"""Write a skill and a mission, check the mission and test it without physics: `python examples/own_skill.py`.

A package makes its skills known to `glotouch run` through an entry point; see docs/tutorial.md.
"""

import tempfile
from pathlib import Path

import numpy as np

import glotouch_bt as gt
from glotouch_bt.mission_testing import fails, ok, real, run_scripted

MISSION = """
mission: still
description: wait until the arm stands still
world: container_five
tree:
  retry: {attempts: 2, do: {measure_noise: {seconds: 500 ms}}}
"""


class NoiseParams(gt.SkillParams):
    """Parameters of `measure_noise`; the field names are the keys in mission files."""

    seconds: float = gt.param("Duration of the measurement", unit="s", default=1.0, gt=0.0, le=60.0)
    max_noise_N: float = gt.param("Largest standard deviation of a force component", unit="N", default=0.5, gt=0.0)


class MeasureNoise(gt.Skill):
    """Hold the arm and measure the noise of the wrist force."""

    Params = NoiseParams
    params: NoiseParams

    TOO_NOISY = gt.Failure("too_noisy", "the wrist force is not steady", advice="wait until nothing touches the arm")

    noise_N = gt.Out(float, "largest standard deviation of a force component, N")

    def run(self) -> gt.SkillRun:
        """Yield one command for each control period; each yield returns the observation of that period."""
        start_s = self.context.observation.now_s
        forces_N: list[np.ndarray] = []
        while self.context.observation.now_s - start_s < self.params.seconds:
            observation: gt.Observation = yield gt.HOLD
            forces_N.append(observation.wrench_S[:, :3])
        noise_N = float(np.concatenate(forces_N).std(axis=0).max())
        if noise_N > self.params.max_noise_N:
            raise self.TOO_NOISY(f"the force varies by {noise_N:.2f} N", noise_N=noise_N)
        self.noise_N = noise_N


def main() -> None:
    """Check the mission, then run it with real and with scripted skills on a robot without physics."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "still.yaml"
        file.write_text(MISSION)
        mission = gt.load_mission(file, skills={"measure_noise": MeasureNoise})  # raises gt.MissionFaults on mistakes

    run = run_scripted(mission, {"measure_noise": real()})
    print("real skill:", run.status, run.keys)
    assert run.succeeded

    run = run_scripted(mission, {"measure_noise": [fails("too_noisy"), ok(noise_N=0.1)]})
    print("one failure, then a success:", run.status, run.endings("measure_noise"))
    assert run.succeeded

    run = run_scripted(mission, {"measure_noise": fails("too_noisy")})
    print("a failure each time:", run.status, run.code)
    assert run.failed_with("too_noisy")


if __name__ == "__main__":
    main()
