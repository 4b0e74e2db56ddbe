"""Squeeze a candidate between the tactile jaws at several heights, in three sequences."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.robot import Array, MotionRefused
from glotouch_bt.touch import Candidate, Layer, TouchSequence, TouchSet
from skills.allowance import keeping_clear_of
from skills.base import In, Out, Skill, SkillFailed, SkillRun
from skills.squeeze_motion import ClosureParams, Squeezing, layer_heights
from skills.squeeze_plan import Stance, plan_stances


class SqueezeParams(ClosureParams):
    """Parameters of `squeeze`."""


class Squeeze(Skill):
    """Force-limited closures on one candidate.

    A round candidate is squeezed at three yaws, 60 degrees apart; a box-like one on three parallel tracks across
    its short side. Layers go from low to high: the first closure centres the object where it cannot topple.

    SUCCESS: at least one stable layer; `touchset` holds all of them.
    FAILURE `nothing_felt`: no closure reached a plateau on anything.
    FAILURE `no_squeeze`: the object does not fit between the open jaws, or its neighbours leave the fingers no room.
    """

    Params = SqueezeParams
    params: SqueezeParams
    candidate = In(Candidate, "what to squeeze")
    known = In(tuple, "all candidates, to keep clear of", key="candidates", required=False)
    touchset = Out(TouchSet, "what was felt")

    def run(self) -> SkillRun:
        """See the class."""
        candidate = self.candidate
        arm = self.context.arm
        others = tuple(c for c in (self.known or ()) if c.index != candidate.index)
        sequences: list[TouchSequence] = []
        refusals: list[str]
        with keeping_clear_of(arm, others):
            heights = layer_heights(candidate, arm.description.gripper, self.params)
            container = self.context.world.container
            stances, refusals = yield from plan_stances(
                candidate, arm, container, float(heights[0]), (self.params.side_gap_m, 0.5 * self.params.side_gap_m)
            )
            for at in stances:
                try:
                    sequences.append((yield from self._sequence(candidate, at, heights)))
                except MotionRefused as refusal:
                    refusals.append(str(refusal))
        touchset = TouchSet(candidate, tuple(sequences))
        stable = sum(layer.stable for layer in touchset.layers)
        self.event("touchset", touchset=touchset, refusals=refusals)
        if not sequences:
            raise SkillFailed(
                "no_squeeze", f"no squeeze of candidate {candidate.index} is possible: {'; '.join(refusals[:3])}"
            )
        if stable == 0:
            raise SkillFailed(
                "nothing_felt",
                f"no closure on candidate {candidate.index} reached a plateau",
                advice="the object may have moved away; trace it again",
                closures=len(touchset.layers),
            )
        self.touchset = touchset

    def _sequence(self, candidate: Candidate, at: Stance, heights: Array) -> Motion[TouchSequence]:
        """Open over the candidate, close at each height from below, rise."""
        hand = Squeezing(self.context, candidate, at, self.params)
        layers: list[Layer] = []
        yield from hand.go_down(float(heights[0]))
        for height in heights:
            if not (yield from hand.move_to(float(height))):
                break  # caught under something that sticks out; the layers below are good
            try:
                layers.append((yield from hand.close()))
            except MotionRefused as refusal:  # what slopes or stands free here does so higher up, too
                self.event("note", text=f"a closure {height * 1e3:.0f} mm above the floor was given up: {refusal}")
                break
        yield from hand.rise()
        return TouchSequence(np.asarray(at.position_K_m), hand.yaw_K_rad, tuple(layers))
