"""Squeeze a candidate between the tactile jaws at several heights, in three sequences."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.perception.touch import Candidate, Layer, TouchSequence, TouchSet
from glotouch_bt.perception.touch.calibration import JawZero
from glotouch_bt.robot import Array, MotionRefused
from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Failure, In, Out, Skill, SkillRun, param
from glotouch_skills.common.hand import (
    keeping_clear_of,
    neighbours,
)
from glotouch_skills.common.planning import (
    MIN_GAP_M,
    ClosureParams,
    Squeezing,
    Stance,
    all_sides,
    disturbance,
    layer_heights,
    plan_stances,
    side_gaps_m,
)


class SqueezeParams(ClosureParams):
    """Parameters of `squeeze`."""

    max_closures: int = param(
        "Closures at most, spread over all sides and heights; 0: three sequences", default=0, ge=0, le=100
    )


class Squeeze(Skill):
    """Squeeze one candidate with limited force at several heights.

    A round candidate is squeezed at three yaws, 60 degrees apart; a box-like one on three parallel tracks across its
    short side. Heights ascend: the first closure centres the object where it cannot topple. With `max_closures`, the
    sequences come from all sides instead: for an object to be remembered.

    SUCCESS: there is at least one stable layer; `touchset` has all layers.
    """

    Params = SqueezeParams
    params: SqueezeParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty", "fingers"}), "wrist": frozenset({"tared"})}
    POSTCONDITIONS: ClassVar = {"hand": "empty"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED, "empty"})}
    USES: ClassVar = frozenset({"arm"})

    NOTHING_FELT = Failure(
        "nothing_felt",
        "no closure reached a plateau on anything",
        advice="the object may have moved away; trace it again",
    )
    NO_SQUEEZE = Failure(
        "no_squeeze",
        "the object does not fit between the open jaws, or the fingers would collide with its neighbours",
        advice="neighbours or walls are too near; remove the neighbour, or trace the object again",
    )
    FAILURES: ClassVar = (MOTION_REFUSED.with_meaning("the hand cannot be brought over the object"),)

    candidate = In(Candidate, "object to squeeze")
    known = In(tuple, "all candidates, to keep clear of", key="candidates", element=Candidate, required=False)
    jaw_zero = In(JawZero, "offset of the reported aperture", required=False, expected=False)
    touchset = Out(TouchSet, "the touches")

    def run(self) -> SkillRun:
        """See the class."""
        candidate = self.candidate
        arm = self.context.arm
        others = neighbours(self.known or (), candidate.index)
        sequences: list[TouchSequence] = []
        refusals: list[str]
        with keeping_clear_of(arm, others):
            heights = layer_heights(candidate, arm.description.gripper, self.params)
            container = self.context.world.container
            gaps_m = side_gaps_m(self.params.side_gap_m)
            max_closures = self.params.max_closures
            sides = max(max_closures // len(heights), 1)
            choices = [all_sides(candidate, arm.description.gripper, sides)] if max_closures else ()
            stances, refusals = yield from plan_stances(candidate, arm, container, float(heights[0]), gaps_m, choices)
            for at in stances:
                left = max_closures - sum(len(s.layers) for s in sequences) if max_closures else 2 * len(heights)
                if left <= 0:
                    break
                try:
                    sequences.append((yield from self._sequence(candidate, at, heights, left)))
                except MotionRefused as refusal:
                    refusals.append(str(refusal))
        touchset = TouchSet(candidate, tuple(sequences))
        stable = sum(layer.stable for layer in touchset.layers)
        self.event("touchset", touchset=touchset, refusals=refusals)
        if not sequences:
            raise self.NO_SQUEEZE(
                f"no squeeze of candidate {candidate.index} is possible: {'; '.join(refusals[:3])}",
                refusals=len(refusals),
            )
        if stable == 0:
            raise self.NOTHING_FELT(
                f"no closure on candidate {candidate.index} reached a plateau", closures=len(touchset.layers)
            )
        self.touchset = touchset

    def _sequence(self, candidate: Candidate, at: Stance, heights: Array, max_closures: int) -> Motion[TouchSequence]:
        """Open over the candidate, close at each height from below at most `max_closures` times, rise.

        Retry a height without a stable layer once, at a height nearby. If the hand cannot close there either, end the
        sequence: higher up the object slopes or stands free, too.
        """
        hand = Squeezing(self.context, candidate, at, self.params, self.jaw_zero)
        layers: list[Layer] = []
        yield from hand.go_down(float(heights[0]))
        for height, elsewhere in zip(heights.tolist(), _elsewhere(heights), strict=True):
            if len(layers) >= max_closures:
                break
            tried = [(yield from self._layer(hand, height))]
            if (tried[0] is None or not tried[0].stable) and len(layers) + len(tried) < max_closures:
                tried.append((yield from self._layer(hand, elsewhere)))
            layers += [layer for layer in tried if layer is not None]
            if tried[-1] is None:
                break
        yield from hand.rise()
        layers.sort(key=lambda layer: layer.height_m)
        return TouchSequence(np.asarray(at.position_K_m), hand.yaw_K_rad, tuple(layers))

    def _layer(self, hand: Squeezing, height_m: float) -> Motion[Layer | None]:
        """Make one closure; return its layer, or None if it could not be made."""
        if not (yield from hand.move_to(height_m)):
            return None  # caught under a protruding part
        try:
            layer, object_motion = yield from hand.close()
        except MotionRefused as refusal:
            self.event("note", text=f"a closure {height_m * 1e3:.0f} mm above the floor was given up: {refusal}")
            return None
        if (moved := disturbance(hand.candidate, layer, object_motion)) is not None:
            self.event("object_moved", **moved)
        return layer


def _elsewhere(heights: Array) -> list[float]:
    """Return for each height another one to try: half way to the next or, for the highest, to the one before."""
    if len(heights) == 1:
        return [float(heights[0]) + MIN_GAP_M]
    gaps = np.diff(heights)
    return [*(heights[:-1] + 0.5 * gaps).tolist(), float(heights[-1] - 0.5 * gaps[-1])]
