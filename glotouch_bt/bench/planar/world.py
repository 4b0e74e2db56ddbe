"""A planar world with container, objects and ball that executes the `Move`s of exploration plans by geometry.

Modelled: contact position (signed distances of the probe sections), overshoot, object motion, force direction, and the
scatter of all of these. Not modelled: time, the arm, the wrist sensor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from glotouch_bt.bench.planar.section import SENSING_HEIGHT_M, FeltSection
from glotouch_bt.perception.search import Move, MoveKind, MoveOutcome
from glotouch_bt.perception.touch import Contact, contact_point, estimate_push
from glotouch_bt.robot import Array

MARCH_M = 0.0005
"""Step along a move at which distances are evaluated; a graze shallower than a micrometre may be missed."""
PATH_M = 0.002
WALL = -1
"""Object index that stands for a wall."""


@dataclass(frozen=True, kw_only=True)
class ContactModel:
    """Parameters of a contact. Defaults measured in MuJoCo, nominal conditions.

    Attributes:
        localisation_sd_m: Standard deviation of the contact position, each axis.
        overshoot_m: Travel of the ball after the onset, by kind of move.
        overshoot_spread: Relative standard deviation of the overshoot.
        friction: Friction coefficient of ball on object.
        direction_sd_rad: Standard deviation of the force direction.
        pressure_radius: Radius of gyration of the floor pressure, as a fraction of the object's reach; it decides how
            far an off-centre push rotates the object.
        give_m: Overshoot taken up by bending of probe and arm instead of object motion.
        touch_force_N: Reported force.
    """

    localisation_sd_m: float = 0.0001
    overshoot_m: Mapping[MoveKind, float] = field(
        default_factory=lambda: {"sweep": 0.00095, "step": 0.00135, "probe": 0.00065}
    )
    overshoot_spread: float = 0.12
    friction: float = 0.2
    direction_sd_rad: float = np.deg2rad(3.0)
    pressure_radius: float = 0.5
    give_m: float = 0.0002
    touch_force_N: float = 1.0


class PlanarWorld:
    """One layout and the ball in it.

    Args:
        sections: Probe sections of the objects in the container.
        poses: (k, 3) x m, y m, yaw rad of their mesh frames in K.
        half_extent_m: (2,) half of the container's interior.
        tip_radius_m: Radius of the ball.
        rng: Random stream of all scatter.
        model: Contact parameters.
        start_K_m: (2,) initial position of the ball, raised.
    """

    def __init__(
        self,
        sections: Sequence[FeltSection],
        poses: Array,
        half_extent_m: Array,
        tip_radius_m: float,
        rng: np.random.Generator,
        model: ContactModel | None = None,
        start_K_m: Array | None = None,
    ) -> None:
        self.sections = tuple(sections)
        self.poses = np.array(poses, dtype=np.float64).reshape(-1, 3)
        self.start_poses = self.poses.copy()
        self.half_m = np.asarray(half_extent_m, dtype=np.float64) - tip_radius_m
        self.tip_radius_m = tip_radius_m
        self._rng, self._model = rng, model or ContactModel()
        self._reach = np.array([s.reach_m for s in self.sections])
        self.tip_K_m: Array = np.zeros(2) if start_K_m is None else np.array(start_K_m, dtype=np.float64)
        self.lowered = False
        self.travel_m = 0.0

    def to_K(self, i: int, points_m: Array) -> Array:
        """Transform points (n, 2) from object i's mesh frame to K."""
        x, y, yaw = self.poses[i]
        c, s = np.cos(yaw), np.sin(yaw)
        return np.asarray(points_m @ np.array([[c, s], [-s, c]]) + (x, y))

    def clearance(self, points_K_m: Array, i: int, *, above: bool = False) -> Array:
        """Return signed distances (n,) of ball centres (n, 2) from touching object i."""
        section = self.sections[i]
        return (section.above if above else section.side)(self._to_object(i, points_K_m))

    def execute(self, move: Move) -> MoveOutcome:
        """Execute one move; the planar path length adds to the travel."""
        goal = np.asarray(move.goal_K_m, dtype=np.float64)[:2]
        if move.kind == "hop":
            return self._hop(goal)
        if not self.lowered:
            return self._refuse("the ball is raised; only a hop brings it down")
        if move.kind == "retreat":
            felt = self._go(np.clip(goal, -self.half_m, self.half_m), None)
            self._make_room()
            return felt
        return self._guarded(move.kind, goal)

    def _refuse(self, why: str) -> MoveOutcome:
        return MoveOutcome(self.tip_K_m, np.zeros((0, 2)), refused=why)

    def _go(self, goal: Array, contact: Contact | None) -> MoveOutcome:
        """Lowered, in a straight line."""
        length = float(np.linalg.norm(goal - self.tip_K_m))
        n = max(int(np.ceil(length / PATH_M)), 1)
        path = self.tip_K_m + np.linspace(0.0, 1.0, n + 1)[:, None] * (goal - self.tip_K_m)
        self.travel_m += length
        self.tip_K_m = goal
        return MoveOutcome(goal, path, contact)

    def _hop(self, goal: Array) -> MoveOutcome:
        if bool((np.abs(goal) > self.half_m).any()):
            return self._refuse("a wall is in the way")
        self.travel_m += float(np.linalg.norm(goal - self.tip_K_m))
        self.tip_K_m, self.lowered = goal, False
        gaps = [float(self.clearance(goal[None], i, above=True)[0]) for i in range(len(self.sections))]
        if gaps and min(gaps) <= 0.0:
            i = int(np.argmin(gaps))
            height = self.sections[i].landing_height_m(self._to_object(i, goal[None])[0])
            down = np.array([0.0, 0.0, -1.0])
            tip = np.array([*goal, height])
            contact = Contact(0.0, tip, down, -down, goal.copy(), self._model.touch_force_N)
            return MoveOutcome(goal, np.zeros((0, 2)), contact)
        self.lowered = True
        return MoveOutcome(goal, goal[None, :].copy())

    def _guarded(self, kind: MoveKind, goal: Array) -> MoveOutcome:
        way = goal - self.tip_K_m
        length = float(np.linalg.norm(way))
        if length < 1e-9:
            return self._go(goal, None)
        u = way / length
        at, i = self._first_touch(u, length)
        if i is None:
            return self._go(goal, None)
        onset = self.tip_K_m + at * u
        normal = self._wall_normal(onset) if i == WALL else self._normal(i, onset)
        reaction = self._reaction(normal, u)
        over = self._model.overshoot_m.get(kind, 0.0) * (1.0 + self._model.overshoot_spread * self._rng.normal())
        over = 0.0 if i == WALL else max(over, 0.0)
        if i != WALL:
            self._push(i, onset, reaction, normal, over * u)
        contact = self._contact(onset, u, reaction, over * u)
        return self._go(onset + over * u, contact)

    def _first_touch(self, u: Array, length: float) -> tuple[float, int | None]:
        """Return the distance along u to the first touch, and what is touched; (length, None) without a touch."""
        best, which = self._to_wall(u, length)
        along = (self.poses[:, :2] - self.tip_K_m) @ u
        off = self.poses[:, :2] - self.tip_K_m - np.clip(along, 0.0, length)[:, None] * u
        for i in np.nonzero(np.hypot(off[:, 0], off[:, 1]) < self._reach)[0]:
            first = max(float(along[i]) - self._reach[i], 0.0)
            last = min(float(along[i]) + self._reach[i], best)
            if last <= first:
                continue
            t = np.linspace(first, last, max(int(np.ceil((last - first) / MARCH_M)), 1) + 1)
            gap = self.clearance(self.tip_K_m + t[:, None] * u, int(i))
            touch = _crossing(t, gap)
            if touch is None and gap[0] <= 0.0 and float(self._normal(int(i), self.tip_K_m) @ u) < 0.0:
                touch = first  # pressed against it already, and going on
            if touch is not None and touch < best:
                best, which = touch, int(i)
        return best, which

    def _to_wall(self, u: Array, length: float) -> tuple[float, int | None]:
        room = np.where(u > 0, self.half_m - self.tip_K_m, self.half_m + self.tip_K_m)
        way = float(np.min(np.maximum(room, 0.0) / np.maximum(np.abs(u), 1e-12)))
        return (way, WALL) if way < length else (length, None)

    def _wall_normal(self, onset: Array) -> Array:
        gap = self.half_m - np.abs(onset)
        normal = np.zeros(2)
        axis = int(np.argmin(gap))
        normal[axis] = -np.sign(onset[axis])
        return normal

    def _to_object(self, i: int, points_K_m: Array) -> Array:
        x, y, yaw = self.poses[i]
        c, s = np.cos(yaw), np.sin(yaw)
        return np.asarray((points_K_m - (x, y)) @ np.array([[c, -s], [s, c]]))

    def _normal(self, i: int, tip_K_m: Array) -> Array:
        """Outward normal (2,) of object i's forbidden set at a place in K."""
        local = self.sections[i].side.gradient(self._to_object(i, tip_K_m[None])[0])
        c, s = np.cos(self.poses[i, 2]), np.sin(self.poses[i, 2])
        return np.array([c * local[0] - s * local[1], s * local[0] + c * local[1]])

    def _reaction(self, normal: Array, u: Array) -> Array:
        """Force on the ball: the normal turned against its sliding, by the friction angle or until it sticks."""
        against = -u
        angle = float(np.arctan2(normal[0] * against[1] - normal[1] * against[0], normal @ against))
        limit = float(np.arctan(self._model.friction))
        return _turned(normal, float(np.clip(angle, -limit, limit)))

    def _push(self, i: int, onset: Array, reaction: Array, normal: Array, way: Array) -> None:
        """The object gives way to the ball, quasi-statically: a limit surface that is an ellipsoid about its centre.

        The motion of an object pushed by a force F at an arm c from its centre is along (F, (c x F) / rho^2) (Lynch,
        Maekawa and Tanie, IROS 1992, with an ellipsoid); its length follows from the touched place keeping out of the
        ball along the normal.
        """
        centre = self.to_K(i, self.sections[i].pressed_m[None])[0]
        arm = onset - self.tip_radius_m * normal - centre
        rho = self._model.pressure_radius * self._reach[i]
        force = -reaction
        turn = float(arm[0] * force[1] - arm[1] * force[0]) / rho**2
        at_contact = force + turn * np.array([-arm[1], arm[0]])
        inwards = float(at_contact @ -normal)
        needed = float(way @ -normal) - self._model.give_m
        if needed <= 0.0 or inwards <= 1e-6:
            return
        scale = needed / inwards
        x, y, yaw = self.poses[i]
        angle = scale * turn
        c, s = np.cos(angle), np.sin(angle)
        origin = np.array([[c, -s], [s, c]]) @ (np.array([x, y]) - centre) + centre + scale * force
        self.poses[i] = (*origin, yaw + angle)

    def _make_room(self) -> None:
        """An unguarded move ends where it was meant to: what stands there is pushed aside."""
        for i in range(len(self.sections)):
            gap = float(self.clearance(self.tip_K_m[None], i)[0])
            if gap < 0.0:
                self.poses[i, :2] += gap * self._normal(i, self.tip_K_m)

    def _contact(self, onset: Array, u: Array, reaction: Array, way: Array) -> Contact:
        """As the wrist would report it."""
        m = self._model
        felt = onset + m.localisation_sd_m * self._rng.normal(size=2)
        direction = _turned(reaction, m.direction_sd_rad * float(self._rng.normal()))
        point = contact_point(felt, self.tip_radius_m, u, direction)
        way = estimate_push(way + m.give_m * direction, direction)
        tip = np.array([*felt, SENSING_HEIGHT_M])
        return Contact(
            0.0, tip, np.array([*u, 0.0]), np.array([*direction, 0.0]), point, m.touch_force_N, pushed_K_m=way
        )


def _crossing(t: Array, gap: Array) -> float | None:
    """Return the place t at which the gap (n,) first falls from above zero to zero or below; None if never."""
    falls = np.nonzero((gap[:-1] > 0.0) & (gap[1:] <= 0.0))[0]
    if len(falls) == 0:
        return None
    k = int(falls[0])
    return float(t[k] + (t[k + 1] - t[k]) * gap[k] / (gap[k] - gap[k + 1]))


def _turned(v: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])
