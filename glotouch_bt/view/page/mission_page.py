"""The page: the 3D scene, its panels and its controls. It draws states and sends requests; it reads no file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from glotouch_bt.report.state import GhostObject, Player, RunModel, SceneState
from glotouch_bt.robot import GlotouchError
from glotouch_bt.view.page import charts, panels
from glotouch_bt.view.page.scene import SceneDrawing

if TYPE_CHECKING:
    import viser

    from glotouch_bt.report.state import RunSetup

LEFT_PX, RIGHT_PX = 316, 372
"""Widths of the panels. Source: ours; at 1400 pixels they leave half of the width to the scene."""
SPEEDS = ("0.5×", "1×", "2×", "5×", "10×")
BACK, ON, LIVE, FAILED_BEFORE, FAILED_NEXT = "−5 s", "+5 s", "end", "◀ failure", "failure ▶"
LAYERS = {
    "touches": "contacts",
    "outlines": "candidates",
    "patches": "felt patches",
    "grasp": "planned grasp",
    "fit": "target as recognised",
}
HIDDEN, AT_START, AT_END = "hidden", "at the start", "at the end"
SLIDER_STEP_S = 0.01
UNDRAWABLE = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, GlotouchError)
"""Errors of data of another version, which cost only the scene."""


@dataclass(frozen=True)
class MissionControls:
    """Requests to a running mission; each returns at once."""

    pause: Callable[[], None]
    go_on: Callable[[], None]
    stop: Callable[[], None]


class Page:
    """The page of one run, for everyone who has it open: they share its time line, each has a camera.

    Args:
        server: An empty page.
        player: Its clock.
        controls: Requests to the mission, or None if it can only be watched.

    Attributes:
        html: The panels, by name.
        ghost_switch: Switch of the true objects; hidden while there are none.
        mission_buttons: Buttons of the requests, or None.
    """

    def __init__(self, server: viser.ViserServer, player: Player, controls: MissionControls | None) -> None:
        self._server, self._player = server, player
        self._model = RunModel()
        self._scene: SceneDrawing | None = None
        self._truth: dict[str, tuple[GhostObject, ...]] = {}
        self._texts: dict[str, str] = {}
        self._facts: list[str] = []
        self._target = "the target"
        self._undrawn = ""
        self._question: Any = None
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(37, 103, 201))
        gui.set_panel_label("GLoTouch")
        gui.main_panel.dock_left()
        gui.main_panel.set_width(LEFT_PX)
        self.html: dict[str, Any] = {"status": gui.add_html("")}
        self.mission_buttons = None if controls is None else self._mission_controls(controls)
        self._time_line()
        with gui.add_folder("Behavior tree"):
            self.html["tree"] = gui.add_html("")
        self._switches()
        right = gui.add_panel()
        with right.add_tab("Mission"):
            for name, title in (
                ("posterior", "Candidates"),
                ("gels", "Gels"),
                ("signals", "Signals"),
                ("log", "Events"),
            ):
                with gui.add_folder(title):
                    self.html[name] = gui.add_html("")
        right.dock_right()
        right.set_width(RIGHT_PX)

    @property
    def switches(self) -> tuple[object, ...]:
        """The switches that `draw` obeys."""
        return self._whole.value, self.ghost_switch.value

    def begin(self, model: RunModel, setup: RunSetup) -> None:
        """Start with the content of a record."""
        self._model = model
        self._server.scene.reset()
        try:
            self._scene = SceneDrawing(self._server, setup)
        except UNDRAWABLE as e:
            self._scene, self._undrawn = None, f"the scene cannot be drawn ({type(e).__name__}: {e})"
        self._show_layers()
        run = {} if model.record is None else model.record.run
        parameters = run.get("parameters")
        target = parameters.get("target") if isinstance(parameters, dict) else None
        self._target = str(target or "the target")
        conditions = run.get("conditions")
        named = {
            "mission": run.get("mission"), "target": target, "seed": run.get("seed"),
            "conditions": conditions.get("name") if isinstance(conditions, dict) else None,
            "robot": run.get("backend") if setup.description is None else setup.description.name,
        }  # fmt: skip
        shown = [panels.fact(k, v) for k, v in named.items() if v is not None]
        self._facts = [" &nbsp; ".join(shown[:2]), " &nbsp; ".join(shown[2:])]
        self._server.gui.set_panel_label(str(run.get("mission") or "GLoTouch"))

    def set_truth(self, truth: dict[str, tuple[GhostObject, ...]]) -> None:
        """Offer the true objects of a simulation, by the words of their switch."""
        if self._truth.keys() != truth.keys():
            self.ghost_switch.options = (HIDDEN, *truth)
            self.ghost_switch.visible = bool(truth)
        self._truth = truth

    def draw(self, state: SceneState, note: str = "", tone: str = "") -> None:
        """Show a state, and a note below the head."""
        running = [n.rsplit("/", 1)[-1] for n, s in state.nodes.items() if s == "RUNNING"]
        facts = [*self._facts, panels.fact("skill", running[-1])] if running else self._facts
        try:
            if self._scene is not None:
                self._scene.draw(state)
                self._scene.ghost(self._truth.get(self.ghost_switch.value, ()))
        except UNDRAWABLE as e:
            self._scene, self._undrawn = None, f"the scene cannot be drawn any more ({type(e).__name__}: {e})"
        if self._undrawn:
            note, tone = self._undrawn, "bad"
        if self.mission_buttons is not None:
            self.mission_buttons.visible = not self._model.ended
            if self._model.ended and self._question is not None:
                if not self._question.closed:  # viser warns about a second close
                    self._question.close()
                self._question = None
        self._set("status", panels.status(state, facts, note, tone))
        self._set("tree", panels.tree(state, whole=self._whole.value))
        self._set("posterior", panels.posterior(state, self._target))
        self._set("gels", panels.gels(state))
        self._set("log", panels.log(state.log))
        self._set("signals", charts.signals(self._model, state.t_s))
        self._set("strip", charts.strip(self._model, state.t_s))
        word = "freeze view" if self._player.moving else "play"
        label = f"{word} ({self._player.speed:g}×)" if word == "play" else word
        if self._play.label != label:
            self._play.label = label
        start, end = self._model.span_s
        if self._slider.max != max(end, start + 1.0):
            self._slider.max = max(end, start + 1.0)
        if abs(self._slider.value - state.t_s) > SLIDER_STEP_S:
            setattr(self._slider, "value", state.t_s)  # noqa: B010  mypy takes it for read-only

    def _set(self, name: str, text: str) -> None:
        if self._texts.get(name) != text:
            self._texts[name] = text
            self.html[name].content = text

    def _mission_controls(self, controls: MissionControls) -> viser.GuiButtonGroupHandle:
        gui = self._server.gui
        buttons = gui.add_button_group("mission", ("pause", "go on", "stop"))

        @buttons.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.target.value == "pause":
                controls.pause()
            elif event.target.value == "go on":
                controls.go_on()
            else:
                self._confirm_stop(controls)

        return buttons

    def _confirm_stop(self, controls: MissionControls) -> None:
        gui = self._server.gui
        self._question = modal = gui.add_modal("Stop the mission?")
        with modal:
            gui.add_markdown(
                "The arm stops, rises if it is free, and holds. The mission ends; it can be resumed later."
            )
            yes, no = gui.add_button("Stop it", color="red"), gui.add_button("Let it run")

        @yes.on_click
        def _(_: object) -> None:
            controls.stop()
            modal.close()

        no.on_click(lambda _: modal.close())

    def _switches(self) -> None:
        gui = self._server.gui
        with gui.add_folder("Show", expand_by_default=False):
            self._boxes = {name: gui.add_checkbox(title, True) for name, title in LAYERS.items()}
            self._whole = gui.add_checkbox("whole tree", False)
            self.ghost_switch = gui.add_dropdown("true objects", (HIDDEN,), visible=False)
        for box in self._boxes.values():
            box.on_update(lambda _: self._show_layers())

    def _show_layers(self) -> None:
        for name, box in self._boxes.items():
            if self._scene is not None:
                self._scene.show(name, box.value)

    def _time_line(self) -> None:
        gui, player = self._server.gui, self._player
        with gui.add_folder("Time"):
            self.html["strip"] = gui.add_html("")
            self._slider = gui.add_slider("t, s", 0.0, 1.0, SLIDER_STEP_S, 0.0)
            moves = gui.add_button_group("go to", (BACK, ON, LIVE, FAILED_BEFORE, FAILED_NEXT))
            speeds = gui.add_button_group("speed", SPEEDS)
            self._play = gui.add_button("play")
        self._play.on_click(lambda _: player.toggle(self._model.span_s))

        @self._slider.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                player.seek(float(event.target.value))

        @moves.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            self._move(event.target.value)

        @speeds.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            player.set_speed(float(event.target.value.rstrip("×")))

    def _move(self, word: str) -> None:
        player = self._player
        if word in (BACK, ON):
            player.jump(-5.0 if word == BACK else 5.0)
        elif word == LIVE:
            player.follow()
        else:
            player.to_mark(self._model.marks.stamps, forward=word == FAILED_NEXT)
