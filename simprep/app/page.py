"""One browser tab: its own view, time line and controls of the shared session. Needs the extra `app`."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from simprep.app.display import GHOST_COLOUR, GHOST_OPACITY, Display
from simprep.app.floor_drawing import FloorDrawing
from simprep.app.lane import LANE_M
from simprep.app.moments import FPS, HISTORY_S, Moment
from simprep.app.playback import Playback
from simprep.app.session import SCENES, Session
from simprep.app.stage import BALL, LAUNCHES
from simprep.arrays import FloatArray
from simprep.duel.stream.stream import player_name
from simprep.errors import MissingExtraError, SimprepError
from simprep.preparation.scenario import ARMS

try:
    import viser
    from mjviser import ViserMujocoScene
except ImportError:
    raise MissingExtraError("the live page", "app") from None

CHART_S, CHART_EVERY_S = 12.0, 0.25
"""Time that the charts span, and how often they are drawn anew [s]."""
HOTKEYS = {"punch": "P", "kick": "K", "duck": "D", "jump": "J", "crawl": "C"}
DUEL_HOTKEYS = {"left punch": "Q", "right punch": "E", "left kick": "Z", "right kick": "V"}
NOBODY = "nobody"
BESIDE_COLOUR = "#4080cc"
"""Of the second lane's line in the chart: its character's."""
CLICKS = ("goal with target", "goal only", "ball")
FOLLOW_M, BESIDE_M = 1.6, 0.9
"""The camera comes along when who is watched is so far from where it began, and looks so far beside [m]."""
LAMPS = (((-3.0, -5.0, 4.0), 2.5), ((5.0, -2.0, 3.0), 1.2), ((0.0, 5.0, 3.0), 1.5))
"""Where light comes from, and how strong: bodies are drawn as metal, to which light from everywhere is none."""
DRAG_N_PER_M, HARDEST_DRAG_N = 400.0, 600.0
"""How hard a drag pushes for 0.2 s: for each metre, and at most [N/m, N]."""
ABOUT = (
    "Click the floor to set a goal. Drag a body to push it (400 N a metre, for 0.2 s). Solid: the simulated body. Transparent blue: its reference, which is no simulation. "
    "On the floor: support polygon (green), COM (black), XcoM (orange), centre of pressure (pink). "
    "Two arms side by side: the one behind is drawn 2.5 m to the left of where it is, in blue, also in the chart. "
    "The chart's margin is clipped to ±0.3 m; in flight it is shown as -0.3."
)


class Page:
    """One tab.

    Args:
        client: the tab.
        session: what it shows and steers; other tabs do too.
    """

    def __init__(self, client: viser.ClientHandle, session: Session) -> None:
        self.client, self.session = client, session
        self._version, self._shown_time, self._chart_at = -1, -1.0, 0.0
        self._frames: list[float] = []
        self._focus, self._playback = np.zeros(2), Playback()
        self._display: Display | None = None
        self._duel = False
        self._scene: ViserMujocoScene | None = None
        self._marks: FloorDrawing | None = None
        self._ghosts: dict[int, viser.MeshHandle] = {}
        client.gui.configure_theme(show_share_button=False, show_logo=False, control_width="large")
        self._build_status()
        self._build_controls()
        self._build_time()
        for scope in (HOTKEYS, DUEL_HOTKEYS):  # J is a jump in both
            for name, key in scope.items():
                command: Any = client.gui.add_command(name, hotkey=key)  # type: ignore[arg-type]
                command.on_trigger(self._does(partial(session.launch, name)))
        client.scene.on_click()(self._clicked)

    def update(self) -> None:
        """Draw what is new."""
        session, now = self.session, time.perf_counter()
        if self._version != session.version:
            self._rebuild()
        if (newest := session.newest) is None or self._scene is None or self._display is None or self._marks is None:
            return
        back = self._playback.behind(newest.time, session.rate, now) if self._live.value else self._back.value
        if (found := session.history.between(back)) is None:
            return
        moment, after, share = found
        shown = moment.time + share * (after.time - moment.time)
        if shown != self._shown_time:
            self._shown_time = shown
            self._frames = [*(one for one in self._frames if one > now - 2.0), now]
            with self.client.atomic():
                data = self._display.pose(moment, after, share)
                self._scene.update_from_mjdata(data)
                for number, ghost in self._ghosts.items() if self._with_ghost.value else ():
                    ghost.position, ghost.wxyz = data.xpos[number], data.xquat[number]
                self._marks.show(moment, self._with_marks.value)
            self._follow(moment)
        if now - self._chart_at > CHART_EVERY_S:
            self._chart_at = now
            self._write_status(moment)
            self._draw_charts(moment)

    def _rebuild(self) -> None:
        """Another world: draw its bodies instead."""
        with self.session.lock:
            version, (stage, characters) = self.session.version, self.session.shown
        scene, session = self.client.scene, self.session
        scene.reset()
        scene.set_up_direction("+z")
        self._display = Display(characters, stage)
        self._scene = ViserMujocoScene(self.client, self._display.model, 1)  # type: ignore[arg-type]
        self._scene.camera_tracking_enabled = False
        # what costs a browser that draws in software half its frames each: shadows, and surroundings that are mirrored
        scene.configure_default_lights(enabled=False)
        scene.configure_environment_map(None)
        for number, (place, intensity) in enumerate(LAMPS):
            scene.add_light_directional(f"/lamps/{number}", position=place, intensity=intensity)
        self._ghosts = {
            number: scene.add_mesh_simple(
                f"/ghosts/{number}", vertices, faces, color=GHOST_COLOUR, opacity=GHOST_OPACITY, cast_shadow=False
            )
            for number, (vertices, faces) in self._display.ghosts.items()
        }
        self._marks = FloorDrawing(self.client, len(characters))
        self._version, self._shown_time = version, -1.0
        if session.is_duel != self._duel:  # two ghosts hide the blows, unless one asks for them
            self._with_ghost.value = not session.is_duel
        self._duel = session.is_duel
        self._show_ghost()
        for group in self._scene._mesh_groups:  # mjviser passes no events on
            if all(self._display.grabbed(int(one)) is not None for one in group.body_ids):
                group.handle.on_drag("left")(partial(self._dragged, [int(one) for one in group.body_ids]))
        self._focus = np.zeros(2) if self.session.is_duel else np.array([1.3, 0.0])
        x = float(self._focus[0]) + BESIDE_M  # the controls cover the right of the page
        two = len(self.session.lanes) > 1  # from higher up, so that who is in front does not hide who is behind
        self.client.camera.position = (x, -4.4, 3.6 if two else 1.9)
        self.client.camera.look_at = (x, LANE_M / 2, 0.6) if two else (x, 0.0, 0.75)

    @property
    def frame_rate(self) -> float:
        """Frames that were sent lately [1/s]."""
        return len(self._frames) / 2.0

    def _follow(self, moment: Moment) -> None:
        """Bring the camera along where who is watched goes too far away."""
        centre = np.mean([one[:2] for one in moment.bodies[: 2 if self.session.is_duel else 1]], axis=0)
        if not self._with_camera.value or np.linalg.norm(centre - self._focus) < FOLLOW_M:
            return
        way = np.array([*(centre - self._focus), 0.0])
        camera, self._focus = self.client.camera, centre
        with self.client.atomic():
            position, look_at = np.array(camera.position) + way, np.array(camera.look_at) + way
            camera.position, camera.look_at = position, look_at

    def _build_status(self) -> None:
        gui = self.client.gui
        self._status = gui.add_markdown("")
        self._level = gui.add_progress_bar(0.0)
        self._charts = [
            gui.add_uplot(
                (np.zeros(2), *(np.zeros(2) for _ in lines)),
                ({"label": "time [s]"}, *({"label": name, "stroke": colour, "width": 2} for name, colour in lines)),
                height=150,
                padding=(10, 8, 0, 0),
                scales={"x": {"time": False}, "y": {"range": span}},
                legend={"show": False},
                axes=({"size": 32}, {"label": label, "labelSize": 16, "size": 44}),
            )
            for label, lines, span in (
                ("α", (("α", "#e67800"),), (0.0, 1.0)),
                ("margin [m]", (("beside", BESIDE_COLOUR), ("margin", "#148c50")), (-0.3, 0.3)),
            )
        ]

    def _build_controls(self) -> None:
        gui, session = self.client.gui, self.session
        with gui.add_folder("Scene"):
            self._scenes = gui.add_dropdown("scene", SCENES, initial_value=session.settings.scene)
            self._scenes.on_update(self._does(lambda: session.restart(self._scenes.value)))
            gui.add_button("begin anew").on_click(self._does(session.restart))
            gui.add_button("do the scene's tasks").on_click(self._does(session.begin_tasks))
        with gui.add_folder("Preparation"):
            self._click = gui.add_dropdown("a click sets", CLICKS, initial_value=CLICKS[0])
            self._target = gui.add_dropdown("target", tuple(LAUNCHES), initial_value="kick")
            self._arm = gui.add_dropdown("arm", ARMS, initial_value=session.settings.arm)
            self._arm.on_update(self._does(lambda: session.switch(self._arm.value)))
            self._beside = gui.add_dropdown(
                "beside it", (NOBODY, *ARMS), initial_value=session.settings.beside or NOBODY
            )
            self._beside.on_update(self._does(self._show_beside))
            for name, key in HOTKEYS.items():
                gui.add_button(f"{name} ({key})").on_click(self._does(partial(session.launch, name)))
        with gui.add_folder("Duel: the avatar", expand_by_default=False):
            for name, key in (*DUEL_HOTKEYS.items(), ("jump", HOTKEYS["jump"])):
                gui.add_button(f"{name} ({key})").on_click(self._does(partial(session.launch, name)))
        with gui.add_folder("Push from outside", expand_by_default=False):
            force = gui.add_slider("force [N]", 20, 600, 10, 150)
            angle = gui.add_slider("direction [deg]", -180, 180, 15, 90)
            gui.add_button("push for 0.2 s").on_click(self._does(lambda: session.push(force.value, angle.value)))
        gui.add_markdown(ABOUT)

    def _build_time(self) -> None:
        gui, session = self.client.gui, self.session
        with gui.add_folder("Time"):
            self._live = gui.add_checkbox("live", True)
            self._back = gui.add_slider("seconds back (this tab)", 0.0, HISTORY_S, 1 / FPS, 0.0, disabled=True)
            self._live.on_update(lambda _: setattr(self._back, "disabled", self._live.value))
            gui.add_button("pause / go on (all tabs)").on_click(self._does(lambda: session.pause(not session.paused)))
            gui.add_button("single step").on_click(self._does(session.single_step))
            self._with_ghost = gui.add_checkbox("reference as a ghost", True)
            self._with_ghost.on_update(lambda _: self._show_ghost())
            self._with_camera = gui.add_checkbox("camera follows", True)
            self._with_marks = gui.add_checkbox("balance on the floor", True)
            name = gui.add_text("name", "motion")
            gui.add_button("save this as a motion").on_click(self._does(lambda: session.save(name.value)))

    def _show_ghost(self) -> None:
        for ghost in self._ghosts.values():
            ghost.visible = self._with_ghost.value
        self._shown_time = -1.0  # hidden ones stayed where they were

    def _show_beside(self) -> None:
        arm = None if self._beside.value == NOBODY else self._beside.value
        if arm != self.session.settings.beside:
            self.session.show_beside(arm)

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        if direction[2] > -1e-3 or origin[2] <= 0:
            return  # above the horizon
        x, y, _ = origin - origin[2] / direction[2] * direction
        # what is drawn beside is simulated at the same place as the first
        point = float(x), float(y) - (LANE_M if len(self.session.lanes) > 1 and y > LANE_M / 2 else 0.0)
        target = self._target.value if self._click.value == CLICKS[0] and not self.session.is_duel else None
        if self._click.value == BALL:
            self._do(lambda: self.session.set_ball(point))
        else:
            self._do(lambda: self.session.set_goal(point, target))

    def _dragged(self, bodies: list[int], event: Any) -> None:
        """A body that is dragged is pushed that way when it is let go, the harder the farther."""
        if event.phase != "end" or self._display is None:
            return
        way = np.array(event.end_position)[:2] - np.array(event.start_position)[:2]
        force = min(DRAG_N_PER_M * float(np.linalg.norm(way)), HARDEST_DRAG_N)
        grabbed = self._display.grabbed(bodies[(event.instance_index or 0) % len(bodies)])
        if grabbed is not None and force > 1.0:
            self._do(lambda: self.session.push(force, float(np.degrees(np.arctan2(way[1], way[0]))), 0.2, *grabbed))

    def _does(self, action: Callable[[], Any]) -> Callable[[Any], None]:
        return lambda _: self._do(action)

    def _do(self, action: Callable[[], Any]) -> None:
        """What a user asks for; what cannot be is told, not raised."""
        try:
            action()
        except SimprepError as error:
            self.session.told = str(error)

    def _write_status(self, moment: Moment) -> None:
        session, caption = self.session, moment.caption
        state = "paused" if session.paused else f"simulated at **{session.rate:.2f} × real time**"
        if session.ended:
            state = f"the simulation {session.ended}"
        if not self._live.value:
            state += f", looking back at {moment.time:.2f} s"
        shown = self.frame_rate
        lines = [
            f"{state}, {shown:.0f} frames/s shown; time {moment.time:.2f} s",
            f"preset {session.settings.preset}, seed {session.settings.seed}; arm {session.settings.arm}"
            + (f" (front), {session.settings.beside} (behind)" if session.settings.beside else ""),
            *(f"**{doing}**" for doing in caption.doing),
            *(f"{words}: {chance:.0%}" for words, chance in caption.chances),
            _fallen(moment, session.is_duel, len(session.director.characters)),
            f"outside force {np.linalg.norm(moment.push):.0f} N" if any(moment.push) else "outside force: none",
            f"_{session.told}_",
        ]
        self._status.content = "\n\n".join(line for line in lines if line)
        level = caption.level
        self._level.value = 0.0 if np.isnan(level) else 100 * level
        self._level.visible = not session.is_duel
        if self._scenes.value != session.settings.scene:
            self._scenes.value = session.settings.scene
        if self._beside.value != (session.settings.beside or NOBODY):
            self._beside.value = session.settings.beside or NOBODY

    def _draw_charts(self, moment: Moment) -> None:
        shown = [one for one in self.session.history.all() if moment.time - CHART_S <= one.time <= moment.time][::4]
        if len(shown) < 2:
            return
        times = np.array([one.time for one in shown])
        count = len(self.session.director.characters)
        beside = count if len(shown[-1].marks) > count else 0  # without a second lane, its line lies under the first
        self._charts[0].data = (times, np.nan_to_num([one.caption.level for one in shown]))
        self._charts[1].data = (times, _margins(shown, beside), _margins(shown, 0))


def _margins(moments: list[Moment], body: int) -> FloatArray:
    """Margins of stability of a body for the chart [m]: cut, and at the lower edge in flight."""
    margins = [one.marks[body].margin if body < len(one.marks) else np.nan for one in moments]
    return np.clip(np.nan_to_num(margins, nan=-0.3), -0.3, 0.3)


def _fallen(moment: Moment, duel: bool, count: int) -> str:
    """Who is down, in words; `count` bodies are in each lane."""
    if not moment.fallen:
        return ""
    if duel:  # the fight waits for who gets up
        return f"**DOWN**: {', '.join(map(player_name, moment.fallen))}"
    led = [one // count for one in moment.fallen if one % count == 0]
    if len(moment.bodies) > count and led:
        return f"**FALLEN**: {' and '.join(('in front', 'behind')[one] for one in led)}; begin anew"
    return "**FALLEN**: begin anew" if led else "**an opponent is down**"
