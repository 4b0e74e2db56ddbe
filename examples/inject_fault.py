"""Inject a fault into a run and plot the wrist force: `python examples/inject_fault.py [FOLDER]`."""

import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import glotouch_bt as gt

PLAN = """
faults: push
description: something presses on the wrist with 3 N
plan:
  - {fault: wrench_bias, with: {force_N: [0, 0, 3]}, when: {time_s: 0.5}}
"""


def main(folder: str = "runs/inject_fault") -> None:
    """Run `calibrate` on the robot without physics while 3 N are added to the sensed force."""
    with gt.open_robot("fake", world="container_five") as robot:
        observation = robot.cycle(gt.HOLD)
        print(f"{robot.description.name}: {len(observation.stamp_s)} samples in each {robot.period_s:g} s")

    with tempfile.TemporaryDirectory() as temporary:
        file = Path(temporary) / "plan.yaml"
        file.write_text(PLAN)
        plan = gt.FaultPlan.from_yaml(file)

    result = gt.run("calibrate", backend="fake", faults=plan, out=folder, overwrite=True)
    print(result.status, *result.reasons, sep="\n  because ")
    for fault in result.result["faults"]:
        print(f"{fault['name']}: effective {fault['effective']}, seen by {fault['seen']}")

    record = gt.read_run(result.folder)
    plt.plot(record.samples["stamp_s"], record.samples["force_S_N"], label=["x", "y", "z"])
    plt.xlabel("robot time, s")
    plt.ylabel("wrist force, N")
    plt.legend()
    plt.savefig(result.folder / "force.png")
    print("plot:", result.folder / "force.png")


if __name__ == "__main__":
    main(*sys.argv[1:2])
