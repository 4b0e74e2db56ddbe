"""Tests of the jaws and their pads."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_bt.conformance.base import Conformance
from glotouch_bt.conformance.rig import Rig
from glotouch_bt.robot import Command, GripperTarget, Observation

FRAMES_S = 1.0
"""Duration for which depth maps are requested."""


class HandTests(Conformance):
    """Jaws and pads."""

    def _drive(self, rig: Rig, aperture_m: float, speed_m_s: float, force_N: float) -> list[Observation]:
        """Send a target; wait for the motion's duration and 0.5 s more."""
        way = abs(rig.last.gripper.aperture_m - aperture_m)
        first = rig.cycle(Command(gripper=GripperTarget(aperture_m, speed_m_s, force_N)))
        return [first, *rig.hold(way / speed_m_s + 0.5)]

    def test_jaw_targets_are_reached(self) -> None:
        """Apertures are in metres, 0 closed; `moving` is set in motion; a reading is neither early nor stale."""
        rig = self.rig()
        stroke = rig.robot.description.gripper.stroke_m
        for aperture in (0.8 * stroke, 0.3 * stroke, 0.6 * stroke):
            before = rig.last.gripper.aperture_m
            seen = self._drive(rig, aperture, 0.05, 10.0)
            states = [o.gripper for o in seen]
            assert abs(states[-1].aperture_m - aperture) < self.aperture_m
            assert not states[-1].moving
            assert any(g.moving for g in states), "it never said that it moved"
            lowest, highest = sorted((before, aperture))
            inside = [lowest - self.aperture_m < g.aperture_m < highest + self.aperture_m for g in states]
            assert all(inside), "it went the other way"
            assert all(g.force_N >= 0.0 for g in states)
            for o in seen:
                age = o.now_s - o.gripper.stamp_s
                assert -1e-6 <= age < rig.robot.limits.max_age_s, f"a reading that is {age:.3f} s old"

    def test_jaw_speed_is_limited(self) -> None:
        """Opening by half the stroke at 40 mm/s takes as long as it must."""
        rig = self.rig()
        stroke = rig.robot.description.gripper.stroke_m
        self._drive(rig, 0.2 * stroke, 0.1, 10.0)
        seen = self._drive(rig, 0.7 * stroke, 0.04, 10.0)
        begin = seen[0].gripper.aperture_m
        way = np.array([abs(o.gripper.aperture_m - begin) for o in seen])
        between = (way > 0.2 * way[-1]) & (way < 0.8 * way[-1])
        stamps = np.array([o.gripper.stamp_s for o in seen])
        speed = np.polyfit(stamps[between], way[between], 1)[0]
        assert 0.8 * 0.04 < speed < 1.1 * 0.04

    def test_jaws_do_not_move_the_arm(self) -> None:
        """The hand stays in place while the jaws move."""
        rig = self.rig()
        at = rig.last.position_B_P[-1].copy()
        self._drive(rig, 0.5 * rig.robot.description.gripper.stroke_m, 0.1, 10.0)
        assert np.linalg.norm(rig.last.position_B_P[-1] - at) < 1e-3

    def test_depth_maps_arrive_on_request(self) -> None:
        """Depth maps arrive only on request: in pairs, in order, fresh, in metres, about 0 where nothing touches."""
        if not self.pads:
            pytest.skip("this robot has no pads")
        rig = self.rig()
        assert all(o.tactile is None for o in rig.hold(0.3)), "depth maps arrived without a request"
        frames = [(o.now_s, o.tactile) for o in rig.hold(FRAMES_S, tactile=True) if o.tactile is not None]
        assert len(frames) >= 5, f"{len(frames)} pairs in {FRAMES_S} s"
        shape = rig.robot.description.gripper.pad_shape
        stamps = [f.stamp_s for _, f in frames]
        assert stamps == sorted(set(stamps)), "a pair came twice, or in the wrong order"
        for now, frame in frames:
            assert 0.0 <= now - frame.stamp_s + 1e-6 < 0.3, f"a frame {now - frame.stamp_s:.3f} s old"
            for depth in (frame.left_m, frame.right_m):
                assert depth.shape == shape
                assert np.isnan(depth).mean() < 0.1
                assert np.nanmax(np.abs(depth)) < 5e-4, "metres; nothing touches the pads"

    def test_gel_images_arrive_once_a_request(self) -> None:
        """A request brings one pair of images, of the declared shape and fresh; without a request, none comes."""
        rig = self.rig()
        camera = rig.robot.description.gripper.camera
        if not self.pads or camera is None:
            pytest.skip("this robot's pads take no images")
        assert all(o.images is None for o in rig.hold(0.3, tactile=True)), "images arrived without a request"
        asked = rig.cycle(Command(tactile=True, images=True))
        pairs = [(o.now_s, o.images) for o in (asked, *rig.hold(FRAMES_S, tactile=True)) if o.images is not None]
        assert len(pairs) == 1, f"{len(pairs)} pairs after one request"
        for now, images in pairs:
            assert 0.0 <= now - images.stamp_s + 1e-6 < 0.3, f"images {now - images.stamp_s:.3f} s old"
            for image in (images.left, images.right):
                assert image.shape == (*camera.shape, 3)
                assert image.dtype == np.dtype(np.uint8)
