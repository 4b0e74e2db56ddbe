"""Check a mission, run it, and print its result: `python examples/run_mission.py [FOLDER]`."""

import sys

import py_trees

import glotouch_bt as gt


def main(folder: str | None = None) -> gt.RunResult:
    """Run the shipped mission `calibrate` in simulation; its record and report go to the folder."""
    mission = gt.load_mission("calibrate")
    print(py_trees.display.unicode_tree(mission.tree))
    for finding in gt.check("calibrate"):
        print(finding.severity, finding.what)

    try:
        result = gt.run("calibrate", seed=3, out=folder)
    except gt.BadInput as error:  # a wrong argument, or a mission with mistakes: nothing has moved
        sys.exit(f"not started: {error}")
    print(result.status, *result.reasons, sep="\n  because ")
    print("outputs of the skills:", result.outputs)
    print("report:", result.report)

    record = gt.read_run(result.folder)
    force_N = record.samples["force_S_N"]
    print(f"{len(force_N)} samples at 1 kHz, largest force component {abs(force_N).max():.1f} N")
    return result


if __name__ == "__main__":
    main(*sys.argv[1:2])
