"""A record read back against what went in; damaged and missing files."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from glotouch_bt.report import read_run
from glotouch_bt.robot import BadInput


def test_everything_comes_back(whole: SimpleNamespace, writer: SimpleNamespace) -> None:
    record = read_run(whole.folder)
    assert record.complete
    assert len(record.cycles["stamp_s"]) == whole.cycles
    assert len(record.samples["stamp_s"]) == 10 * whole.cycles
    np.testing.assert_allclose(np.diff(record.samples["stamp_s"]), 1e-3, atol=2.1e-7)
    contacts = record.of_kind("contact")
    assert len(contacts) == len(whole.contacts)
    for event, made in zip(contacts, whole.contacts, strict=True):
        got = event.data["contact"]
        np.testing.assert_allclose(got["point_K_m"], made.point_K_m, atol=1e-9)
        assert got["stamp_s"] == made.stamp_s
    layer = record.of_kind("touchset")[2].data["touchset"]["sequences"][1]["layers"][0]
    made_layer = whole.touchsets[2].sequences[1].layers[0]
    np.testing.assert_allclose(np.array(layer["left_m"], float), made_layer.left_m, atol=0.51e-6)
    assert record.interior_m == writer.INTERIOR_M
    assert record.pose_B_K is not None
    np.testing.assert_allclose(record.pose_B_K.quat, writer.POSE_B_K.quat, atol=1e-9)
    assert record.result["peak_force_N"] == 12.34
    assert record.ticks[-1].node == "retrieve"
    assert record.ticks[-1].new == "SUCCESS"


@pytest.mark.parametrize("keep", [0.3, 0.7, 0.98])
def test_a_cut_file_gives_what_came_before_the_cut(whole: SimpleNamespace, tmp_path: Path, keep: float) -> None:
    data = (whole.folder / "run.mcap").read_bytes()
    (tmp_path / "run.mcap").write_bytes(data[: int(keep * len(data))])
    part, full = read_run(tmp_path), read_run(whole.folder)
    assert not part.complete
    n = len(part.samples["stamp_s"])
    assert 0 < n < len(full.samples["stamp_s"]) or keep > 0.9
    np.testing.assert_array_equal(part.samples["force_S_N"], full.samples["force_S_N"][:n])
    assert part.run == full.run
    assert [e.stamp_s for e in part.events] == [e.stamp_s for e in full.events][: len(part.events)]


def test_no_record_and_no_mcap_are_bad_input(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"run\.mcap is missing"):
        read_run(tmp_path)
    (tmp_path / "run.mcap").write_bytes(b"not an mcap file at all, is it")
    with pytest.raises(BadInput, match="not an MCAP"):
        read_run(tmp_path)
