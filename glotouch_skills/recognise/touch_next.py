"""Make the most informative closure, one a call, until it is known which candidate is the target."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.perception import recognition
from glotouch_bt.perception.recognition import CHANGE_S, PARTS, ProbeTouch
from glotouch_bt.perception.touch import Candidate, Layer, TouchSequence, TouchSet
from glotouch_bt.perception.touch.calibration import JawZero
from glotouch_bt.robot import HOLD, Array, MotionRefused
from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Context, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import keeping_clear_of, neighbours
from glotouch_skills.common.planning import (
    TOO_LOW,
    ClosureParams,
    Option,
    Squeezing,
    Standing,
    best_rates,
    disturbance,
    find_target,
    options,
    pads_height_m,
)
from glotouch_skills.recognise.closure_space import fitting_stance, lacking_space

if TYPE_CHECKING:
    from glotouch_bt.perception.recognition import Belief, TargetModel

MAX_VAIN_CLOSURES = 4
"""Number of closures without any plateau after which a candidate is skipped and doubted: it is not where it was
traced."""

MEASURE_S = CHANGE_S + 34.0
"""Robot time of taking the probe again and measuring one candidate. Source: as of `CHANGE_S` and `next_probe`."""
STILL_THERE_M = 0.003
"""After a resume, the hand still stands beside its candidate if it moved by less than this."""


class TouchNextParams(ClosureParams):
    """Parameters of `touch_next`."""

    target: str = param(
        "The object to find: an STL file, the name of one in the world's object folder, or touched:NAME", names="stl"
    )
    confidence: float = param(
        "Sufficient probability that it is the likeliest candidate, if the target is one of them",
        default=0.97,
        gt=0.5,
        lt=1.0,
    )
    unmeasured: bool = param("Touch candidates that the probe did not measure, too", default=False)
    min_gain_nats: float = param("Smallest expected gain of a closure", default=0.02, ge=0.0)


class TouchNext(Skill):
    """Make the closure with the largest expected information gain per time, over all candidates, yaws and heights.

    Repeat it until `decided`; then `match` says which candidate is the target.

    SUCCESS: one closure was tried, or `decided` is true and the hand is high: one candidate, or none, is the target
    with the required confidence, or no closure would be informative, or those that would be lack space.
    """

    Params = TouchNextParams
    params: TouchNextParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty", "fingers"}), "wrist": frozenset({"tared"})}
    POSTCONDITIONS: ClassVar = {"hand": "empty"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED, "empty"})}
    USES: ClassVar = frozenset({"arm"})

    NO_CANDIDATES = Failure(
        "no_candidates",
        "there is nothing to touch",
        advice="explore first; candidates that were put back are not touched again",
    )
    FAILURES: ClassVar = (TOO_LOW, MOTION_REFUSED.with_meaning("the hand cannot rise"))

    candidates = In(tuple, "objects that may be touched", element=Candidate)
    felt = In(tuple, "touches so far", key="touchsets", element=TouchSet, required=False)
    rejected = In(tuple, "indices of rejected candidates", required=False, expected=False)
    probed = In(
        tuple, "what the probe measured; not given: everything", element=ProbeTouch, required=False, expected=False
    )
    refused_before = In(
        tuple, "closures that could not be made", key="refused", element=tuple, required=False, expected=False
    )
    doubtful_before = In(
        tuple, "indices of candidates on which closures met something", key="doubtful", element=int, required=False,
        expected=False,
    )  # fmt: skip
    jaw_zero = In(JawZero, "offset of the reported aperture", required=False, expected=False)
    touchsets = Out(tuple, "touches, one TouchSet for each candidate", element=TouchSet)
    refused = Out(
        tuple, "closures that could not be made: candidate, yaw in degrees, height and place in mm, and if it was tried"
    )
    doubtful = Out(
        tuple,
        "indices of candidates that may be elsewhere or have another outline: a closure met something, all met "
        "nothing, or the jaws do not span the outline, and none felt them",
        element=int,
    )
    in_doubt = Out(int, "number of these")
    absent = Out(float, "probability that none of the candidates is the target")
    cramped = Out(
        tuple, "indices of candidates on which closures lack only space, most probable first", element=int, always=True
    )
    lacks_space = Out(bool, "closures on `cramped` would tell more if they had space", always=True)
    decided = Out(bool, "no further closure is needed")

    def __init__(self, name: str, params: SkillParams, context: Context) -> None:
        super().__init__(name, params, context)
        self._model: TargetModel | None = None
        self._down: Squeezing | None = None
        self._hopeless: frozenset[int] = frozenset()
        self._stood_B_m: Array | None = None
        self._unfit: dict[int, list[str]] = {}

    def remember(self) -> object:
        """See `Skill`: the stance of a lowered hand."""
        if self._down is None:
            return None
        return self._down.candidate, self._down.at, self.context.arm.pose_B_P.position_m

    def recall(self, remembered: Any) -> None:
        """See `Skill`. The hand counts as lowered only if it has not moved when the skill begins."""
        if remembered is not None:
            candidate, at, self._stood_B_m = remembered
            self._down = Squeezing(self.context, candidate, at, self.params, self.jaw_zero)

    def run(self) -> SkillRun:
        """See the class."""
        self.cramped, self.lacks_space = (), False
        candidates: tuple[Candidate, ...] = self.candidates
        wanted = [c for c in candidates if c.index not in (self.rejected or ())]
        if not wanted:
            raise self.NO_CANDIDATES("there is no candidate to touch", candidates=len(candidates))
        touchsets: tuple[TouchSet, ...] = self.felt or ()
        self.refused = refused = self.refused_before or ()
        self._doubt(self.doubtful_before or ())
        before = [_state(t.candidate) for t in touchsets]
        if before != [_state(c) for c in wanted]:  # found, rejected, or measured anew
            made = {t.candidate.index: t.sequences for t in touchsets}
            touchsets = tuple(TouchSet(c, made.get(c.index, ())) for c in wanted)
            same = {c.index for c in wanted if _state(c) in before}
            # What did not fit may fit now: it depends on the others, too.
            self.refused = tuple(key for key in refused if key[0] in same and key[-1])
            self._down = None
        down, self._down = self._down, None  # after a preemption the hand's place is unknown
        stood, self._stood_B_m = self._stood_B_m, None
        if stood is not None and np.linalg.norm(self.context.arm.pose_B_P.position_m - stood) > STILL_THERE_M:
            down = None
        self.touchsets, self.decided = touchsets, False
        yield HOLD  # the computation takes longer than a control period; on hardware the arm holds meanwhile
        belief = recognition.infer_belief(self._target_model(), touchsets)
        self.absent = float(belief.ranking.p_absent)
        vain = (t for t in touchsets if not any(layer.stable for layer in t.layers))
        self._hopeless = frozenset(t.candidate.index for t in vain if len(t.layers) >= MAX_VAIN_CLOSURES)
        self._doubt((*self.doubtful, *self._hopeless))
        why = recognition.enough(belief, self.params.confidence, self._hopeless)
        chosen = None if why else self._choose(belief, down)
        self._tell_unfit()
        if not why and (chosen is None or self.refused):
            found = self._options(belief, None)
            self.cramped = self._lacking_space(belief, found)
            self.lacks_space = bool(self.cramped)
            if chosen is None:  # the target fits between the jaws; an outline that does not is wrong
                too_wide = recognition.hardly_felt(belief) - {o.closure.candidate for o in found}
                self._doubt((*self.doubtful, *too_wide))
        if chosen is not None and chosen.closure.candidate in self._unmeasured(belief):
            why = f"candidate {chosen.closure.candidate} would tell most, once the probe has measured it"
        if why or chosen is None:
            yield from self._end(belief, down, why or "no closure is expected to tell more")
            return
        try:
            down, layer = yield from self._touch(candidates, chosen, down)
        except MotionRefused as refusal:
            self._refuse(chosen, tried=True)
            self._doubt((*self.doubtful, chosen.closure.candidate))
            self.event("note", text=f"a closure on candidate {chosen.closure.candidate} was not made: {refusal}")
            return
        self._down = down
        self.touchsets = touchsets = tuple(
            _with_layer(t, down, layer) if t.candidate.index == chosen.closure.candidate else t for t in touchsets
        )
        self.event(
            "closure",
            number=sum(len(t.layers) for t in touchsets),
            chosen=chosen.closure,
            seconds=chosen.seconds,
            stable=layer.stable,
            probability={m.index: m.probability for m in belief.ranking.matches},
            p_absent=belief.ranking.p_absent,
        )

    def _doubt(self, indices: Iterable[int]) -> None:
        """Set the candidates that may be elsewhere or have another outline."""
        self.doubtful = tuple(sorted(set(indices)))
        self.in_doubt = len(self.doubtful)

    def _target_model(self) -> TargetModel:
        """Return the target's model, kept in memory.

        Raises:
            SkillFailed: `too_low`.
        """
        if self._model is None:
            gripper = self.context.arm.description.gripper
            self._model = find_target(self.params.target, self.context.world.objects, gripper).model
        return self._model

    def _choose(self, belief: Belief, down: Squeezing | None) -> Option | None:
        """Return the feasible closure with the most gain per time, or None if none gains enough.

        It may be on a candidate that the probe must measure first; the time of that counts.
        """
        p = self.params
        found = [o for o in self._options(belief, down) if not self._was_refused(o)]
        found = [o for o in found if o.closure.candidate not in self._hopeless]
        later = self._unmeasured(belief)
        found = [replace(o, seconds=o.seconds + MEASURE_S) if o.closure.candidate in later else o for o in found]
        if not found:
            return None
        closures = [c for o in found for c in (o.closure, *o.after)]
        gains = np.split(recognition.expected_gain(belief, closures), np.cumsum([1 + len(o.after) for o in found])[:-1])
        rates = best_rates(found, gains)
        worth = np.array([g.max() for g in gains]) >= p.min_gain_nats
        quick = np.array([1.0 / o.seconds for o in found])
        wanted = recognition.wanted(belief, p.confidence, self._hopeless)
        hardly_felt = recognition.hardly_felt(belief)
        for score in (
            quick * [o.closure.candidate in wanted for o in found],
            rates * worth,
            quick * [o.closure.candidate in hardly_felt for o in found],
        ):
            option = self._first(belief, found, gains, score, down)
            if option is not None:
                return option
        return None

    def _options(self, belief: Belief, down: Squeezing | None) -> list[Option]:
        """Return all closures that were not made yet, also those that were refused."""
        arm = self.context.arm
        hand_K_m = (self.context.world.container.pose_B_K.inverse() @ arm.pose_B_P).position_m
        standing = None if down is None else Standing(down.candidate.index, down.at, float(hand_K_m[2]))
        return options(belief.touchsets, standing, hand_K_m, arm.felt, arm.description.gripper, self.params)

    def _unmeasured(self, belief: Belief) -> frozenset[int]:
        """Return the candidates whose outline or top the probe did not measure, unless the jaws may close on them."""
        if self.probed is None or self.params.unmeasured:
            return frozenset()
        tried = [t.candidate for t in self.probed]
        return frozenset(t.candidate.index for t in belief.touchsets if tried.count(t.candidate.index) < len(PARTS))

    def _first(
        self, belief: Belief, found: list[Option], gains: list[Array], score: Array, down: Squeezing | None
    ) -> Option | None:
        """Return the feasible option of the highest positive score."""
        for i in np.argsort(-score, kind="stable").tolist():
            if score[i] <= 0.0:
                break
            option: Option = found[i]
            if self._was_refused(option):
                continue
            try:
                at = option.at
                if down is None or at is not down.at:
                    at = fitting_stance(self.context, belief, option, self.params.side_gap_m)
            except MotionRefused as refusal:
                self._refuse(option, tried=False)
                self._unfit.setdefault(option.closure.candidate, []).append(str(refusal))
                continue
            # The gain stays that of the option: a stance this close is expected to tell about the same.
            made = replace(option.closure, yaw_K_rad=at.yaw_K_rad, position_K_m=at.position_K_m)
            return replace(option, at=at, instead_of=option.at, closure=replace(made, gain_nats=float(gains[i][0])))
        return None

    def _lacking_space(self, belief: Belief, found: list[Option]) -> tuple[int, ...]:
        """Return the candidates for whose closures, of those found, space should be made, most probable first."""
        p, later = self.params, self._unmeasured(belief)
        refused = [o for o in found if self._was_refused(o) and o.closure.candidate not in later]
        wanted = recognition.wanted(belief, p.confidence, self._hopeless) | recognition.hardly_felt(belief)
        return lacking_space(self.context, belief, refused, p, p.min_gain_nats, wanted)

    def _tell_unfit(self) -> None:
        """Note the closures that were found not to fit, and the most frequent cause for each candidate."""
        for index, causes in self._unfit.items():
            cause, _ = Counter(causes).most_common(1)[0]
            self.event("note", text=f"{len(causes)} of the closures on candidate {index} do not fit: {cause}")
        self._unfit.clear()

    def _refuse(self, option: Option, *, tried: bool) -> None:
        """Record that a closure could not be made, or that the hand does not fit, for this skill and for later ones."""
        self.refused = (*self.refused, (*_key(option), tried))

    def _was_refused(self, option: Option) -> bool:
        key = _key(option)
        return (*key, True) in self.refused or (*key, False) in self.refused

    def _touch(
        self, candidates: tuple[Candidate, ...], chosen: Option, down: Squeezing | None
    ) -> Motion[tuple[Squeezing, Layer]]:
        """Move to the option's stance and close.

        Raises:
            MotionRefused: It could not be made; the hand is high.
        """
        index = chosen.closure.candidate
        hand = down
        if hand is None or hand.at is not chosen.at:
            yield from self._rise(down)
            (candidate,) = (c for c in candidates if c.index == index)
            hand = Squeezing(self.context, candidate, chosen.at, self.params, self.jaw_zero)
        with keeping_clear_of(self.context.arm, neighbours(candidates, index)):
            if hand is not down:
                yield from hand.go_down(chosen.closure.height_m)
            elif not (yield from hand.move_to(chosen.closure.height_m)):
                yield from hand.rise()
                raise MotionRefused("squeeze", "the open hand is caught under something")
            try:
                layer, object_motion = yield from hand.close()
            except MotionRefused:
                yield from hand.rise()
                raise
        if (moved := disturbance(hand.candidate, layer, object_motion)) is not None:
            self.event("object_moved", **moved)
        elif layer.stable:  # it is where it was traced
            self._doubt(i for i in self.doubtful if i != index)
        return hand, layer

    def _rise(self, down: Squeezing | None) -> Motion[None]:
        """Rise if the hand is low; after a preemption, from an unknown stance."""
        if down is not None:
            yield from down.rise()
            return
        arm = self.context.arm
        lift = self.params.headroom_m + arm.description.gripper.fingertip_below_P_m - pads_height_m(self.context)
        if lift > 0.0:
            yield from arm.shift([0.0, 0.0, lift], self.params.travel_speed_m_s, check=False, what="rise")

    def _end(self, belief: Belief, down: Squeezing | None, why: str) -> Motion[None]:
        yield from self._rise(down)
        for touchset in belief.touchsets:
            if touchset.sequences:
                self.event("touchset", touchset=touchset, refusals=[])
        self.event(
            "decided",
            why=why,
            closures=sum(len(t.layers) for t in belief.touchsets),
            stances=sum(len(t.sequences) for t in belief.touchsets),
            candidates=sum(bool(t.layers) for t in belief.touchsets),
            cramped=self.cramped,
            ranking=belief.ranking,
        )
        self.decided = True


def _with_layer(touchset: TouchSet, hand: Squeezing, layer: Layer) -> TouchSet:
    """Return the TouchSet with one more layer, in the sequence of the hand's stance or in a new one."""
    last = touchset.sequences[-1] if touchset.sequences else None
    if last is not None and last.position_K_m is hand.at.position_K_m:
        return replace(touchset, sequences=(*touchset.sequences[:-1], replace(last, layers=(*last.layers, layer))))
    begun = TouchSequence(hand.at.position_K_m, hand.yaw_K_rad, (layer,))
    return replace(touchset, sequences=(*touchset.sequences, begun))


def _state(candidate: Candidate) -> tuple[int, float, int]:
    """Return what changes when the probe measures a candidate: index, height and number of contacts."""
    return candidate.index, candidate.height_m, len(candidate.contacts)


def _key(option: Option) -> tuple[int, int, int, int]:
    """Return the key of a refused option: candidate, yaw in degrees, height and place along x_P in mm.

    It is that of the planned stance: otherwise the option would be tried at the stance close to it without end.
    """
    at = option.instead_of or option.at
    along = float(at.position_K_m @ [np.cos(at.yaw_K_rad), np.sin(at.yaw_K_rad)])
    c = option.closure
    return c.candidate, round(np.rad2deg(at.yaw_K_rad)), round(1e3 * c.height_m), round(1e3 * along)
