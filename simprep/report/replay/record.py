"""A replay as a recording of viser: what its web client plays from inside a page, without a server.

viser is asked as for a live scene. Its server listens on this machine alone, for the moment of the recording; nobody
connects to it.
"""

import contextlib
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import FloatArray
from simprep.errors import MissingExtraError, SimprepError
from simprep.report.replay.actor import FLASH_S, Flash, Prop, Replay
from simprep.report.replay.meshes import obstacle_mesh
from simprep.report.replay.shown import Part, ShownActor, rgb
from simprep.scene import Obstacle

FPS = 30.0
"""Frames of a replay [1/s], of a long one less."""
FRAME_LIMIT = 900
"""A replay has at most so many frames, so that an hour fits into a file too."""
FOLLOW_S = 0.5
"""The view follows the bodies smoothly: standard deviation of the filter [s]."""
STILL_M = 1.0
"""The view stays where it is while the bodies stay within so much [m]."""
RECORDING_MARK = "@@RECORDING@@"
"""Stands for a recording in the page of the viewer."""
_EMBEDDED = re.compile(r'__VISER_EMBED_DATA__\s*=\s*"([A-Za-z0-9+/=]*)"')
MARK_S = 0.6
"""The name of an event is shown so long [s]."""
MARK_M = 2.15
"""At this height [m]."""
ROOT = "/world"
SOFT, HARD = (191, 64, 64), (140, 115, 90)


@dataclass(frozen=True)
class Recording:
    """A replay for a page.

    Attributes:
        data: the recording, base64.
        viewer: an HTML page that plays it, with `RECORDING_MARK` in place of the data. It is the same for every recording.
    """

    data: str
    viewer: str


def replay_times(replay: Replay) -> tuple[FloatArray, float]:
    """Times (T,) of the frames of a recording [s], from 0 to the end, and their rate [1/s]."""
    duration = replay.duration
    fps = min(FPS, (FRAME_LIMIT - 1) / duration) if duration > 0 else FPS
    return np.arange(int(duration * fps + 1e-6) + 1) / fps, fps


def record(replay: Replay) -> Recording:
    """The recording: messages over time, packed by viser, and its player.

    The scene's root `/world` moves against the bodies, so that a view that stays follows them. Below it everything has
    world coordinates (and `Actor.place`): `/world/LABEL/simulated/...` is the tree of a body's segments, and
    `reference`, `support`, `com` and `force` are beside it. Positions are rounded to 1/4096 m, quaternions to 1/16384.

    Args:
        replay: what to show.

    Raises:
        MissingExtraError: viser is not installed.
    """
    times, fps = replay_times(replay)
    with _server() as server:
        scene = server.scene
        scene.set_up_direction("+z")
        _set_view(server, replay)
        world = scene.add_frame(ROOT, show_axes=False)
        scene.add_grid(f"{ROOT}/floor", width=60, height=60, cell_size=0.5, section_size=1.0, shadow_opacity=0.2)
        for number, obstacle in enumerate(replay.obstacles):
            _add_thing(scene, f"{ROOT}/{_safe(obstacle.name)}_{number}", obstacle)
        names = _names([actor.label for actor in replay.actors])
        parts: list[Part] = [ShownActor(scene, f"{ROOT}/{n}", a, times) for n, a in zip(names, replay.actors)]
        parts += [_MovingProp(scene, f"{ROOT}/prop_{n}", prop, times) for n, prop in enumerate(replay.props)]
        parts += [_ShownFlash(scene, f"{ROOT}/contact_{n}", flash, times) for n, flash in enumerate(replay.flashes)]
        path = _followed(replay, times, fps)
        parts += [_ShownMark(scene, f"{ROOT}/event_{n}", *mark, path, times) for n, mark in enumerate(replay.marks)]
        recording = server.get_scene_serializer()
        for frame in range(len(times)):
            world.position = (*(float(value) for value in -path[frame]), 0.0)
            for part in parts:
                part.show(frame)
            recording.insert_sleep(1 / fps)
        return _split(recording.as_html())


def _split(page: str) -> Recording:
    """viser's page with a recording in it as the recording and the page around it."""
    found = _EMBEDDED.search(page)
    if found is None:
        raise SimprepError("this version of viser writes another kind of page; valid: viser 1.1")
    return Recording(found[1], page[: found.start(1)] + RECORDING_MARK + page[found.end(1) :])


def _viser() -> Any:
    try:
        import viser
    except ImportError:
        raise MissingExtraError("a replay", "report") from None
    return viser


@contextlib.contextmanager
def _server() -> Iterator[Any]:
    viser = _viser()
    with contextlib.redirect_stdout(io.StringIO()):  # it tells its address, which nobody needs
        server = viser.ViserServer(host="127.0.0.1", port=8753, verbose=False)
    try:
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _set_view(server: Any, replay: Replay) -> None:
    """A camera in front and to the side, far enough for all bodies."""
    places = np.array([actor.place for actor in replay.actors])
    starts = places + np.array([actor.motion.qpos[0, :2] for actor in replay.actors])
    spread = float(np.linalg.norm(np.ptp(starts, axis=0)))
    distance = 3.1 + 0.6 * spread
    x, y = 0.65, -0.76
    if len(starts) > 1 and not places.any():  # people who face each other are seen from the side
        between = starts[1] - starts[0]
        x, y = np.array([between[1], -between[0]]) / max(float(np.linalg.norm(between)), 1e-9)
    server.initial_camera.position = (x * distance, y * distance, 0.9 + 0.32 * distance)
    server.initial_camera.look_at = (0.0, 0.0, 0.95)
    server.initial_camera.fov = 0.85


def _followed(replay: Replay, times: FloatArray, fps: float) -> FloatArray:
    """(T, 2) the place on the floor that is kept in the middle of the view [m], rounded."""
    from simprep.motion.edit import sample

    roots = np.mean([sample(actor.motion, times)[:, :2] for actor in replay.actors], axis=0)
    if np.ptp(roots, axis=0).max() < STILL_M:
        roots = np.repeat(roots.mean(axis=0, keepdims=True), len(times), axis=0)
    return np.round(gaussian_filter1d(roots, FOLLOW_S * fps, axis=0, mode="nearest"), 3)


def _add_thing(scene: Any, name: str, thing: Obstacle) -> Any:
    vertices, faces = obstacle_mesh(thing)
    colour = SOFT if thing.soft else HARD
    return scene.add_mesh_simple(
        name, vertices, faces, color=colour, flat_shading=not thing.ball, position=thing.position
    )


def _names(labels: Sequence[str]) -> list[str]:
    """Names of nodes, all different."""
    safe = [_safe(label) for label in labels]
    return [f"{name} {number + 1}" if safe.count(name) > 1 else name for number, name in enumerate(safe)]


def _safe(name: str) -> str:
    return name.replace("/", " ") or "body"


class _MovingProp:
    def __init__(self, scene: Any, name: str, prop: Prop, times: FloatArray) -> None:
        self._handle = _add_thing(scene, name, prop.shape)
        self._positions, self._orientations = prop.at(times)
        self._turns = prop.orientations is not None

    def show(self, frame: int) -> None:
        self._handle.position = tuple(float(value) for value in np.round(self._positions[frame], 3))
        if self._turns:
            self._handle.wxyz = tuple(float(value) for value in np.round(self._orientations[frame], 3))


class _ShownFlash:
    def __init__(self, scene: Any, name: str, flash: Flash, times: FloatArray) -> None:
        end_s = flash.start_s + max(flash.duration_s, FLASH_S)
        self._shown = (times >= flash.start_s - 0.5 * (times[1] if len(times) > 1 else 0)) & (times <= end_s)
        ball = scene.add_icosphere(
            name, radius=flash.radius, color=rgb("#ffb000"), opacity=0.8, position=flash.position, visible=False
        )
        self._handles = [ball]
        if flash.label:
            text = scene.add_label(f"{name}/label", flash.label, position=(0.0, 0.0, flash.radius), visible=False)
            self._handles.append(text)
        self._visible = False

    def show(self, frame: int) -> None:
        wish = bool(self._shown[frame])
        if wish != self._visible:
            self._visible = wish
            for handle in self._handles:
                handle.visible = wish


class _ShownMark:
    """The name of an event, above the bodies for a moment."""

    def __init__(self, scene: Any, name: str, text: str, at_s: float, path: FloatArray, times: FloatArray) -> None:
        self._shown = (times >= at_s - 1e-9) & (times < at_s + MARK_S)
        x, y = path[min(int(np.searchsorted(times, at_s)), len(path) - 1)]
        label = f"{text.replace('_', ' ')} {at_s:.2f} s"
        self._handle = scene.add_label(name, label, position=(float(x), float(y), MARK_M), visible=False)
        self._visible = False

    def show(self, frame: int) -> None:
        if bool(self._shown[frame]) != self._visible:
            self._visible = not self._visible
            self._handle.visible = self._visible
