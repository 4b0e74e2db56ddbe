"""The report's section of injected faults, from what an injector really says."""

from __future__ import annotations

from pathlib import Path

from glotouch_bt.faults import FaultInjector
from glotouch_bt.faults.plan import check_plan
from glotouch_bt.mission.read.yaml_source import parse_yaml
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.sections.faults import faults_section
from glotouch_bt.robot import HOLD
from glotouch_bt.robot.fake import FakeRobot

PLAN = """\
faults: two
plan:
  - {fault: wrench_bias, name: <bias>, when: {node: squeeze}}
  - {fault: wrench_scale, with: {factor: 1}}
"""


def test_each_fault_is_a_line_and_one_without_effect_is_marked() -> None:
    injector = FaultInjector(FakeRobot(), check_plan(parse_yaml(PLAN, "p.yaml")), 0)
    injector.on_node_started("m/squeeze", 0.0)
    injector.cycle(HOLD)
    injector.add_sighting(0.02, "squeeze", "off_zero", "the wrist reads 3 N")
    page = faults_section(RunRecord(Path("run.mcap"), result={"faults": injector.report()}))
    assert "&lt;bias&gt;" in page
    assert "10 samples" in page
    assert "squeeze: off_zero" in page
    assert '<span class="chip warn">nothing</span>' in page
    assert faults_section(RunRecord(Path("run.mcap"))) == ""
