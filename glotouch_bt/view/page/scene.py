"""Draws a `SceneState` as a 3D scene. Only what has changed since the last state is sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh

from glotouch_bt.report.scene import shapes
from glotouch_bt.report.state import (
    CandidateOutline,
    FeltPatch,
    FittedTarget,
    GhostObject,
    PlannedGrasp,
    SceneState,
    felt_points_P,
)
from glotouch_bt.robot import Array, Pose, RobotDescription

if TYPE_CHECKING:
    import viser

    from glotouch_bt.report.state import RunSetup

Colour = shapes.Colour
DEEP_M = 1e-3
"""Indentation with the brightest colour of a patch. Source: ours; the gel of the shipped gripper is 1.5 mm deep."""


class SceneDrawing:
    """The 3D part of the page.

    Args:
        server: Where to draw.
        setup: The unchanging part of the run.

    Attributes:
        shown: Which layers are visible, by name; set with `show`.
    """

    def __init__(self, server: viser.ViserServer, setup: RunSetup) -> None:
        self._server, self._scene, self._setup = server, server.scene, setup
        self._drawn: dict[str, Any] = {}
        self._handles: dict[str, list[Any]] = {}
        self._joints: list[Any] = []
        self._fingers: dict[str, Any] = {}
        self._probe: list[Any] = []
        self._ghost_bodies: tuple[GhostObject, ...] = ()
        self.shown = {"touches": True, "outlines": True, "patches": True, "grasp": True, "fit": True}
        scene = self._scene
        scene.set_up_direction("+z")
        scene.world_axes.visible = False
        scene.configure_environment_map(hdri=None)
        scene.configure_default_lights(enabled=False)
        scene.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(196, 190, 184), intensity=2.6)
        for name, position, intensity in (("sun", (0.9, -0.5, 2.2), 1.6), ("fill", (-1.0, -1.8, 1.0), 0.6)):
            scene.add_light_directional(
                f"/light/{name}", intensity=intensity, position=position, cast_shadow=name == "sun"
            )
        self._draw_world()
        if setup.description is not None:
            self._draw_robot(setup.description)
        self._look()

    def show(self, layer: str, visible: bool) -> None:
        """Show or hide a layer."""
        self.shown[layer] = visible
        for handle in self._handles.get(layer, ()):
            handle.visible = visible

    def ghost(self, bodies: tuple[GhostObject, ...]) -> None:
        """Draw the true objects of a simulation, or none."""
        if bodies == self._ghost_bodies:
            return
        self._ghost_bodies = bodies
        self._clear("ghost")
        for i, body in enumerate(bodies):
            found = shapes.true_mesh(body, self._setup)
            style: dict[str, Any] = {"color": shapes.GHOST, "opacity": 0.35, "side": "double", "cast_shadow": False}
            if found is not None:
                style |= {"wxyz": body.quat, "position": body.position_B_m}
                handle = self._scene.add_mesh_simple(f"/ghost/{i}", *found, **style)
            else:
                floor = float(self._setup.pose_B_K.position_m[2])
                closed = np.concatenate([body.outline_B_m, body.outline_B_m[:1]])
                handle = self._scene.add_mesh_simple(
                    f"/ghost/{i}", *shapes.prism(closed, 0.02), **style, position=(0, 0, floor)
                )
            centre = body.outline_B_m.mean(axis=0)
            label = self._scene.add_label(
                f"/ghost/label{i}", f"true: {body.name}", position=(*centre, body.position_B_m[2]),
                anchor="top-center", font_screen_scale=0.8,
            )  # fmt: skip
            self._handles.setdefault("ghost", []).extend([handle, label])

    def draw(self, state: SceneState) -> None:
        """Draw a state."""
        with self._server.atomic():
            if state.q is not None and self._changed("q", state.q.tobytes()) and self._setup.description is not None:
                for handle, pose in zip(
                    self._joints, shapes.joint_poses(self._setup.description, state.q), strict=True
                ):
                    handle.wxyz = pose.quat
            if self._changed("aperture", round(state.aperture_m, 5)):
                for name, side in (("left", 1.0), ("right", -1.0)):
                    if name in self._fingers:
                        self._fingers[name].position = shapes.finger_shift_m(state.aperture_m, side)
            if self._changed("tip", (state.tip_m, state.probe_lost)):
                self._place_probe(state.tip_m, lost=state.probe_lost)
            if self._changed("touches", len(state.touches)):
                self._touches(state)
            looks = tuple(
                (o.index, id(o), state.states.get(o.index, "found"), _percent(state, o.index)) for o in state.outlines
            )
            if self._changed("outlines", looks):
                self._outlines(state)
            if self._changed("patches", len(state.patches)):
                self._patches(state.patches)
            if self._changed("grasp", id(state.grasp)):
                self._grasp(state.grasp)
            if self._changed("fit", state.fit):
                self._fit(state.fit)
            if self._changed("pads", None if state.pads is None else (id(state.pads), state.aperture_m)):
                self._pads(state)

    def _changed(self, name: str, value: object) -> bool:
        if name in self._drawn and self._drawn[name] == value:
            return False
        self._drawn[name] = value
        return True

    def _clear(self, layer: str) -> None:
        for handle in self._handles.pop(layer, ()):
            handle.remove()

    def _add(self, layer: str, handle: Any) -> None:
        self._handles.setdefault(layer, []).append(handle)
        handle.visible = self.shown.get(layer, True)

    def _look(self) -> None:
        """Set the first view: the container from the side away from the robot's base, and the hand above it."""
        K = self._setup.pose_B_K.position_m
        away = np.array([K[0], K[1], 0.0])
        away = away / max(float(np.linalg.norm(away)), 1e-9) if np.linalg.norm(away) > 1e-6 else np.array([1.0, 0, 0])
        side = np.array([away[1], -away[0], 0.0])
        camera = self._server.initial_camera
        camera.position = K + 0.60 * away + 0.80 * side + np.array([0.0, 0.0, 0.80])
        camera.look_at = K - 0.09 * away + 0.02 * side + np.array([0.0, 0.0, 0.18])
        camera.fov = np.deg2rad(42.0)

    def _draw_world(self) -> None:
        scene, setup = self._scene, self._setup
        scene.add_frame("/K", show_axes=False, wxyz=setup.pose_B_K.quat, position=setup.pose_B_K.position_m)
        if setup.holder is not None:
            grasp = setup.holder.pose_B_grasp
            scene.add_frame("/stand", show_axes=False, wxyz=grasp.quat, position=grasp.position_m)
        for solid in shapes.world_solids(setup):
            self._solids(f"/{solid.frame}", [solid])
        corners = shapes.rim(setup)
        if len(corners):
            scene.add_line_segments(
                "/K/rim", np.stack([corners[:-1], corners[1:]], axis=1), (120, 102, 78),
                thickness=1.5, thickness_units="screen",
            )  # fmt: skip

    def _solids(self, above: str, solids: list[shapes.Solid]) -> None:
        for s in solids:
            look: dict[str, Any] = {"flat_shading": not s.smooth}
            if s.opacity < 1.0:
                look |= {"opacity": s.opacity, "side": "double"}
            if s.name == "table":
                look["cast_shadow"] = False
            self._scene.add_mesh_simple(f"{above}/{s.name}", s.vertices_m, s.faces, color=s.colour, **look)

    def _draw_robot(self, description: RobotDescription) -> None:
        scene = self._scene
        names = shapes.joint_frames(description)
        self._joints = [
            scene.add_frame(f"/{name}", show_axes=False, position=pose.position_m, wxyz=pose.quat)
            for name, pose in zip(names, shapes.joint_poses(description, np.array(description.home_q)), strict=True)
        ]
        hand = f"/{names[-1]}/hand"
        self._pads_frame = f"{hand}/P"
        flange, pads = description.pose_last_E, description.gripper.pose_E_P
        scene.add_frame(hand, show_axes=False, position=flange.position_m, wxyz=flange.quat)
        scene.add_frame(self._pads_frame, show_axes=False, position=pads.position_m, wxyz=pads.quat)
        for name in ("left", "right"):
            self._fingers[name] = scene.add_frame(f"{self._pads_frame}/{name}", show_axes=False)
        above = {
            "base": "/base",
            "hand": hand,
            "left": f"{self._pads_frame}/left",
            "right": f"{self._pads_frame}/right",
        }
        for solid in shapes.robot_solids(description):
            self._solids(above.get(solid.frame, f"/{solid.frame}"), [solid])

    def _place_probe(self, tip_m: float | None, *, lost: bool) -> None:
        """Draw the probe in the hand, in its stand, or not at all if it is lost."""
        for handle in self._probe:
            handle.remove()
        self._probe = []
        probe, holder = self._setup.probe, self._setup.holder
        if lost or probe is None or (tip_m is None and holder is None):
            return
        if tip_m is None and holder is not None:
            pose, above = holder.pose_B_grasp, "/probe"
        elif self._joints:
            pose = Pose(np.array([0.0, 0.0, (tip_m or 0.0) - probe.grasp_to_tip_m]))
            above = f"{self._pads_frame}/probe"
        else:
            return
        self._probe = [self._scene.add_frame(above, show_axes=False, wxyz=pose.quat, position=pose.position_m)]
        self._solids(above, shapes.probe_solids(probe))

    def _touches(self, state: SceneState) -> None:
        self._clear("touches")
        if not state.touches:
            return
        points = np.stack([t.point_K_m for t in state.touches])
        ends = points + shapes.REACTION_M * np.stack([t.outward_K for t in state.touches])
        ball = trimesh.creation.icosphere(1, shapes.TOUCH_RADIUS_M)
        self._add("touches", self._scene.add_batched_meshes_simple(
            "/K/touches", np.array(ball.vertices), np.array(ball.faces), batched_positions=points,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(points), 1)), batched_colors=shapes.TOUCH,
            cast_shadow=False,
        ))  # fmt: skip
        self._add("touches", self._scene.add_line_segments(
            "/K/reactions", np.stack([points, ends], axis=1), shapes.TOUCH, thickness=2.0, thickness_units="screen",
        ))  # fmt: skip

    def _outlines(self, state: SceneState) -> None:
        self._clear("outlines")
        for o in state.outlines:
            colour = shapes.STATE_COLOURS[state.states.get(o.index, "found")]
            self._outline(o, colour, _percent(state, o.index), faded=state.states.get(o.index) in ("excluded", "taken"))

    def _outline(self, o: CandidateOutline, colour: Colour, percent: str, *, faded: bool) -> None:
        name, height = f"/K/candidate{o.index}", max(o.height_m, shapes.MIN_HEIGHT_M)
        vertices, faces = shapes.prism(o.outline_K_m, height)
        self._add("outlines", self._scene.add_mesh_simple(
            f"{name}/wall", vertices, faces, color=colour, opacity=0.16 if faded else 0.30, side="double",
            cast_shadow=False, receive_shadow=False,
        ))  # fmt: skip
        width = np.maximum(shapes.SDS * o.sd_m, shapes.MIN_BAND_M)
        vertices, faces = shapes.band(o.outline_K_m, width[:, None] * o.normal_K, height)
        self._add("outlines", self._scene.add_mesh_simple(
            f"{name}/band", vertices, faces, color=colour, opacity=0.5 if faded else 0.85, side="double",
            cast_shadow=False, receive_shadow=False,
        ))  # fmt: skip
        centre = o.outline_K_m[:-1].mean(axis=0)
        self._add("outlines", self._scene.add_label(
            f"{name}/label", f"{o.index}{percent}", position=(*centre, height + 0.012), anchor="bottom-center",
        ))  # fmt: skip

    def _patches(self, patches: tuple[FeltPatch, ...]) -> None:
        self._clear("patches")
        if not patches:
            return
        points = np.concatenate([p.points_K_m for p in patches])
        colours = _heat(np.concatenate([p.depth_m for p in patches]))
        if len(points):
            self._add("patches", self._scene.add_point_cloud(
                "/K/patches", points, colours, point_size=0.0011, point_shape="circle",
            ))  # fmt: skip

    def _pads(self, state: SceneState) -> None:
        """Draw what the gels feel now, at the fingers."""
        self._clear("pads")
        if state.pads is None or not self._joints:
            return
        points, depth = felt_points_P(*state.pads, state.aperture_m, self._setup.window_m)
        if len(points):
            self._add("pads", self._scene.add_point_cloud(
                f"{self._pads_frame}/felt", points, _heat(depth), point_size=0.0011, point_shape="circle",
            ))  # fmt: skip

    def _fit(self, fit: FittedTarget | None) -> None:
        """Draw the target's mesh where it was recognised, on the side on which it is taken to stand."""
        self._clear("fit")
        found = None if fit is None else shapes.fitted_mesh(fit, self._setup)
        if found is not None:
            self._add("fit", self._scene.add_mesh_simple(
                "/K/fit", *found, color=shapes.FIT, opacity=0.55, cast_shadow=False, receive_shadow=False,
            ))  # fmt: skip

    def _grasp(self, grasp: PlannedGrasp | None) -> None:
        """Draw the two pads of a planned grasp at its opening, and the way down."""
        self._clear("grasp")
        if grasp is None:
            return
        pose = Pose.pointing_down(grasp.position_K_m, grasp.yaw_rad)
        for name, side in (("left", 1.0), ("right", -1.0)):
            centre = pose.apply((0.0, side * (0.5 * grasp.opening_m + 0.004), -0.02))
            self._add("grasp", self._scene.add_box(
                f"/K/grasp/{name}", color=shapes.PLAN, opacity=0.55, dimensions=(0.022, 0.008, 0.07), wxyz=pose.quat,
                position=centre, cast_shadow=False,
            ))  # fmt: skip
        ways = [((0.0, 0.0, -0.16), (0.0, 0.0, -0.03)), *(
            ((0.0, s * 0.5 * grasp.opening_m, 0.0), (0.0, s * 0.5 * grasp.aperture_m, 0.0)) for s in (1.0, -1.0)
        )]  # fmt: skip
        self._add("grasp", self._scene.add_arrows(
            "/K/grasp/ways", pose.apply(np.array(ways)), shapes.PLAN,
            shaft_radius=0.0016, head_radius=0.005, head_length=0.012,
        ))  # fmt: skip


def _percent(state: SceneState, index: int) -> str:
    share = next((s.probability for s in state.shares if s.index == index), None)
    return "" if share is None else f"  ·  {100 * share:.0f} %"


def _heat(depth_m: Array) -> Any:
    """Return the colours (n, 3) of indentations: the ramp of the depth maps."""
    from glotouch_bt.report import palette

    ramp = palette()
    return ramp[(np.clip(0.35 + 0.65 * depth_m / DEEP_M, 0.0, 1.0) * 254).astype(int)]
