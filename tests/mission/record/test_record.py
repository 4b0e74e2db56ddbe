"""The record against what was put in: every channel, a cut file, equal bytes, odd values."""

import base64
import json
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from py_trees.common import Status

from glotouch_bt.mission.record.mcap_json import dumps, to_json
from glotouch_bt.mission.record.mcap_packing import Column, pack, unpack
from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.perception.touch.values import Contact
from glotouch_bt.report import read_run
from glotouch_bt.robot import (
    HOLD,
    BadInput,
    Command,
    GelImages,
    GlotouchError,
    GripperState,
    GripperTarget,
    JointSetpoint,
    Observation,
    Pose,
    TactileFrame,
)

N_SAMPLES = 10
RUN = {
    "mission": "retrieve",
    "seed": 3,
    "pose_B_K": Pose(np.array([0.6, 0.0, -0.2])),
    "container": {"interior_m": (0.4, 0.3, 0.08)},
}


def observation(i: int, rng: np.random.Generator, tactile: bool = False) -> Observation:
    """Cycle `i` of smooth motion with noisy force."""
    t = (N_SAMPLES * i + np.arange(N_SAMPLES) + 1001) * 1e-3
    phase = np.outer(t, np.arange(1, 8) * 0.3)
    half = 0.5 * t
    quat = np.stack([np.cos(half), np.sin(half), 0 * t, 0 * t], axis=1)
    position = np.stack([0.6 + 0.1 * np.sin(t), 0.1 * np.cos(t), 0.2 + 0 * t], axis=1)
    frame = None
    if tactile:
        left = rng.normal(0.0, 2e-4, (6, 4))
        left[0, 0] = np.nan
        frame = TactileFrame(float(t[-1]) - 0.03, left, rng.normal(0.0, 2e-4, (6, 4)))
    jaws = GripperState(float(t[-1]) - 0.01, 0.04 + 1e-4 * i, 0.5 * i, i % 2 == 0)
    return Observation(t, np.sin(phase), np.cos(phase), position, quat, rng.normal(0, 2, (N_SAMPLES, 6)), jaws, frame)


def cycles(n: int, seed: int = 0) -> list[tuple[Observation, Command]]:
    rng = np.random.default_rng(seed)
    out = []
    for i in range(n):
        o = observation(i, rng, tactile=i % 3 == 0)
        c = HOLD
        if i % 4:
            jaws = GripperTarget(0.01 * (i % 5), 0.1, 10.0) if i % 5 == 0 else None
            c = Command(JointSetpoint(o.q[-1] + 1e-3, o.dq[-1], o.dq[-1], Pose(np.zeros(3))), jaws, i % 3 == 0)
        out.append((o, c))
    return out


CONTACT = Contact(
    stamp_s=0.1,
    tip_K_m=np.array([0.01, 0.02, 0.03]),
    approach_K=np.array([1.0, 0.0, 0.0]),
    reaction_K=np.array([-1.0, 0.0, 0.0]),
    point_K_m=np.array([0.016, 0.02]),
    force_N=2.5,
)


def write(path: Path, n: int = 25, batch_cycles: int = 10) -> list[tuple[Observation, Command]]:
    made = cycles(n)
    with Recorder(path, RUN, batch_cycles=batch_cycles) as record:
        for i, (o, c) in enumerate(made):
            record.block(o, c)
            if i == 7:
                record.tick(o.now_s, [("root/sweep", Status.RUNNING, Status.SUCCESS), ("root", "INVALID", "RUNNING")])
                record.event("contact", o.now_s, {"contact": CONTACT, "seq": 4})
                record.port(o.now_s, "candidates", [CONTACT, np.zeros((35, 20))])
        record.close({"status": "success", "wall_time_s": 12.0})
    return made


def messages(path: Path) -> dict[str, list[tuple[int, bytes]]]:
    out: dict[str, list[tuple[int, bytes]]] = {}
    with path.open("rb") as f:
        for _, channel, message in make_reader(f).iter_messages():
            assert message.publish_time == message.log_time
            out.setdefault(channel.topic, []).append((message.log_time, message.data))
    return out


def columns_of(found: dict[str, list[tuple[int, bytes]]], topic: str) -> dict[str, np.ndarray]:
    parts = [unpack(data) for _, data in found[topic]]
    assert all(start == log for (start, _), (log, _) in zip(parts, found[topic], strict=True))
    return {
        name: np.concatenate([p[name] + (s * 1e-9 if name.endswith("stamp_s") else 0.0) for s, p in parts])
        for name in parts[0][1]
    }


def test_full_rate_samples_come_back_within_half_a_step(tmp_path: Path) -> None:
    made = write(tmp_path / "run.mcap")
    got = columns_of(messages(tmp_path / "run.mcap"), "/packed/samples")
    for name, step in (("stamp_s", 1e-7), ("q", 1e-7), ("dq", 1e-6), ("position_B_P", 1e-7), ("quat_B_P", 1e-8)):
        want = np.concatenate([getattr(o, name) for o, _ in made])
        np.testing.assert_allclose(got[name], want, rtol=0, atol=0.501 * step, err_msg=name)
    wrench = np.concatenate([o.wrench_S for o, _ in made])
    np.testing.assert_allclose(got["force_S_N"], wrench[:, :3], rtol=0, atol=0.501e-4)
    np.testing.assert_allclose(got["torque_S_Nm"], wrench[:, 3:], rtol=0, atol=0.501e-5)


def test_commands_and_jaws_come_back(tmp_path: Path) -> None:
    made = write(tmp_path / "run.mcap")
    got = columns_of(messages(tmp_path / "run.mcap"), "/packed/cycles")
    assert got["samples"].tolist() == [N_SAMPLES] * len(made)
    np.testing.assert_allclose(got["gripper_aperture_m"], [o.gripper.aperture_m for o, _ in made], atol=1e-7)
    np.testing.assert_allclose(got["gripper_force_N"], [o.gripper.force_N for o, _ in made], atol=1e-4)
    np.testing.assert_allclose(got["gripper_stamp_s"], [o.gripper.stamp_s for o, _ in made], atol=1e-7)
    assert got["gripper_moving"].tolist() == [float(o.gripper.moving) for o, _ in made]
    assert got["command_tactile"].tolist() == [float(c.tactile) for _, c in made]
    for i, (_, c) in enumerate(made):
        if c.motion is None:
            assert np.isnan(got["command_q"][i]).all()
        else:
            np.testing.assert_allclose(got["command_q"][i], c.motion.q, atol=1e-7)
            np.testing.assert_allclose(got["command_dq"][i], c.motion.dq, atol=1e-6)
        assert np.isnan(got["command_aperture_m"][i]) == (c.gripper is None)
        if c.gripper is not None:
            assert got["command_aperture_m"][i] == pytest.approx(c.gripper.aperture_m, abs=1e-7)
            assert got["command_speed_m_s"][i] == pytest.approx(c.gripper.speed_m_s, abs=1e-6)


def test_depth_maps_come_back_packed_and_as_images(tmp_path: Path) -> None:
    made = write(tmp_path / "run.mcap")
    found = messages(tmp_path / "run.mcap")
    frames = [o.tactile for o, _ in made if o.tactile is not None]
    got = columns_of(found, "/packed/tactile")
    np.testing.assert_allclose(got["left_m"], [f.left_m for f in frames], atol=0.51e-6)
    np.testing.assert_allclose(got["right_m"], [f.right_m for f in frames], atol=0.51e-6)
    np.testing.assert_allclose(got["stamp_s"], [f.stamp_s for f in frames], atol=1e-7)
    image = json.loads(found["/tactile/left"][0][1])
    assert (image["height"], image["width"], image["encoding"]) == (6, 4, "32FC1")
    pixels = np.frombuffer(base64.b64decode(image["data"]), "<f4").reshape(6, 4)
    np.testing.assert_allclose(pixels, frames[0].left_m, atol=0.51e-6)
    assert 1 <= len(found["/tactile/left"]) < len(frames)


def test_gel_images_come_back_and_cost_nothing_without_a_request(tmp_path: Path) -> None:
    """The record of a run without images does not mention them; with them, every pixel comes back."""
    made = write(tmp_path / "plain.mcap", n=12)
    assert not {t for t in messages(tmp_path / "plain.mcap") if "image" in t}
    rng = np.random.default_rng(0)
    left, right = rng.integers(0, 256, (2, 21, 10, 3)).astype(np.uint8)
    images = GelImages(made[5][0].now_s - 0.0123, left, right)
    with Recorder(tmp_path / "run.mcap", {}) as recorder:
        for i, (o, c) in enumerate(made):
            seen = replace(o, images=images if i == 5 else None)
            recorder.block(seen, replace(c, images=i in (2, 9)))
    record = read_run(tmp_path / "run.mcap")
    np.testing.assert_array_equal(record.images["left"], [left])
    np.testing.assert_array_equal(record.images["right"], [right])
    assert record.images["stamp_s"] == pytest.approx([images.stamp_s], abs=1e-7)
    assert record.images["arrived_s"] == pytest.approx([made[5][0].now_s], abs=1e-7)
    assert record.image_requests["stamp_s"] == pytest.approx([made[i][0].now_s for i in (2, 9)], abs=1e-7)


def test_plots_hold_the_newest_sample_of_every_fourth_cycle(tmp_path: Path) -> None:
    made = write(tmp_path / "run.mcap", n=25, batch_cycles=7)
    found = messages(tmp_path / "run.mcap")
    picked = [o for o, _ in made][::4]
    assert [t for t, _ in found["/wrench"]] == [round(o.now_s * 1e9) for o in picked]
    for (_, data), o in zip(found["/wrench"], picked, strict=True):
        m = json.loads(data)
        assert m["timestamp"]["sec"] + 1e-9 * m["timestamp"]["nsec"] == pytest.approx(o.now_s, abs=1e-9)
        got = [*m["force"].values(), *m["torque"].values()]
        np.testing.assert_allclose(got, o.wrench_S[-1], atol=0.51e-4)
    for (_, data), o in zip(found["/pose"], picked, strict=True):
        m = json.loads(data)["pose"]
        np.testing.assert_allclose([m["position"][k] for k in "xyz"], o.position_B_P[-1], atol=0.51e-6)
        np.testing.assert_allclose([m["orientation"][k] for k in "wxyz"], o.quat_B_P[-1], atol=0.51e-7)
    assert [json.loads(d)["aperture_m"] for _, d in found["/gripper"]] == [
        pytest.approx(o.gripper.aperture_m, abs=1e-6) for o in picked
    ]
    joints = json.loads(found["/joints"][0][1])["joints"]
    assert [j["name"] for j in joints] == [f"joint{k}" for k in range(1, 8)]
    for _, data in found["/tf"]:  # a viewer that jumps gets one message only
        assert {t["child_frame_id"] for t in json.loads(data)["transforms"]} == {"P", "K"}


def test_ticks_events_ports_attachments(tmp_path: Path) -> None:
    write(tmp_path / "run.mcap")
    found = messages(tmp_path / "run.mcap")
    ticks = [json.loads(d) for _, d in found["/tree/ticks"]]
    assert [(t["node"], t["old"], t["new"]) for t in ticks] == [
        ("root/sweep", "RUNNING", "SUCCESS"),
        ("root", "INVALID", "RUNNING"),
    ]
    event = json.loads(found["/events/contact"][0][1])
    assert event["kind"] == "contact"
    assert event["data"]["seq"] == 4
    assert event["data"]["contact"]["point_K_m"] == [0.016, 0.02]
    port = json.loads(found["/tree/ports"][0][1])
    assert port["key"] == "candidates"
    assert port["value"][1] == {"shape": [35, 20], "min": 0.0, "max": 0.0}
    drawn = found["/scene"] + found["/scene/world"]
    names = {e["id"] for _, d in drawn for e in json.loads(d)["entities"]}
    assert "container" in names
    assert any(n.startswith("contact") for n in names)
    with (tmp_path / "run.mcap").open("rb") as f:
        attachments = {a.name: json.loads(a.data) for a in make_reader(f).iter_attachments()}
    with (tmp_path / "run.mcap").open("rb") as f:
        metadata = {m.name: m.metadata for m in make_reader(f).iter_metadata()}
    assert attachments["run.json"]["container"]["interior_m"] == [0.4, 0.3, 0.08]
    assert attachments["result.json"] == {"status": "success"}  # no wall time
    assert metadata["run"]["mission"] == "retrieve"


def test_same_inputs_same_bytes(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap")
    write(tmp_path / "b.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_messages_are_in_the_order_of_time(tmp_path: Path) -> None:
    write(tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as f:
        times = [m.log_time for m in StreamReader(f, validate_crcs=True).records if type(m).__name__ == "Message"]
    assert times[0] == 0  # the scene
    batches = np.array(times)
    assert (np.diff(batches) < 0).sum() <= 3  # only a late tactile stamp may step back at a batch's start


def test_a_file_whose_writer_died_is_readable_up_to_the_last_batch(tmp_path: Path) -> None:
    record = Recorder(tmp_path / "run.mcap", RUN, batch_cycles=10)
    for o, c in cycles(25):
        record.block(o, c)
    dead = (tmp_path / "run.mcap").read_bytes()  # never closed: what a killed process leaves
    record.close()
    samples = 0

    def read() -> None:
        nonlocal samples
        for m in StreamReader(BytesIO(dead)).records:
            if type(m).__name__ == "Message" and m.data.find(b"torque_S_Nm:3") >= 0:
                samples += len(unpack(m.data)[1]["stamp_s"])

    with pytest.raises(EndOfFile):
        read()
    assert samples == 20 * N_SAMPLES


def test_closing_twice_is_one_close_and_writing_after_it_is_refused(tmp_path: Path) -> None:
    record = Recorder(tmp_path / "run.mcap", {})
    record.close()
    size = (tmp_path / "run.mcap").stat().st_size
    record.close({"status": "success"})
    assert (tmp_path / "run.mcap").stat().st_size == size
    with pytest.raises(GlotouchError, match="closed"):
        record.event("note", 0.0, {"text": "late"})


def test_an_unwritable_place_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"nowhere.*cannot be written"):
        Recorder(tmp_path / "nowhere" / "run.mcap", {})


def test_a_reading_that_is_not_finite_neither_stops_the_record_nor_breaks_its_json(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    o = observation(0, rng)
    wrench = o.wrench_S.copy()
    wrench[-1, 0], wrench[-1, 4] = np.nan, -np.inf
    bad = Observation(o.stamp_s, o.q, o.dq, o.position_B_P, o.quat_B_P, wrench, o.gripper)
    with Recorder(tmp_path / "run.mcap", {}) as record:
        record.block(bad, HOLD)
    found = messages(tmp_path / "run.mcap")
    plotted = json.loads(found["/wrench"][0][1])
    assert plotted["force"]["x"] is None
    assert plotted["torque"]["y"] is None
    assert np.isnan(columns_of(found, "/packed/samples")["force_S_N"][-1, 0])


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("shape", [(), (3,), (4, 5)])
def test_packing_inverts_at_the_edges_of_its_range(order: int, shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(order)
    values = rng.uniform(-200.0, 200.0, (50, *shape))
    values[3:5] = np.nan
    start, got = unpack(pack(-5, [Column("a_m", shape, 1e-7, order)], [values]))
    assert start == -5
    np.testing.assert_allclose(got["a_m"], values, rtol=0, atol=0.51e-7)


def test_garbage_is_refused_by_unpack() -> None:
    for bad in (b"\xff\xff", b"\x1a\x05abc", b"\x10\x05"):
        with pytest.raises(GlotouchError):
            unpack(bad + b"\x1a\x03a:b")


@dataclass(frozen=True)
class Nested:
    pose: Pose
    inner: tuple[Contact, ...]


def test_any_value_becomes_plain_json() -> None:
    plain = to_json(
        {
            "nested": Nested(Pose(np.array([1.0, 2.0, 3.0])), (CONTACT,)),
            "bad": [np.nan, float("inf"), np.array([np.nan, 1.0])],
            "numpy": [np.float64(1.5), np.int64(2), np.bool_(True)],
            "path": Path("a/b"),
            "set": {"b", "a"},
            "status": Status.FAILURE,
            "thing": object(),
            3: None,
        }
    )
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert isinstance(plain, dict)
    assert plain["bad"] == [None, None, [None, 1.0]]
    assert plain["numpy"] == [1.5, 2, True]
    assert plain["path"] == "a/b"
    assert plain["set"] == ["a", "b"]
    assert plain["status"] == "FAILURE"
    assert plain["thing"] == "<object>"
    assert plain["nested"]["pose"] == {"position_m": [1.0, 2.0, 3.0], "quat": [1.0, 0.0, 0.0, 0.0]}  # type: ignore[index, call-overload]
    ring: dict[str, object] = {}
    ring["self"] = ring
    assert b"<dict>" in dumps(ring)
