"""Film strips: poses of one or more motions at the same instants, one row each, as in Fig. 6 of the 2013 paper."""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.errors import MissingExtraError, SettingError
from simprep.files import atomic_path
from simprep.motion.edit import sample
from simprep.motion.motion import Motion
from simprep.report.gl import Canvas, find_backend
from simprep.report.replay.actor import Prop
from simprep.scene import SceneSettings, scene_spec

HEADER_PX = 22
OTHER_TINTS = ((0.80, 0.30, 0.28, 0.55), (0.55, 0.38, 0.70, 0.55))
"""Colours of other people, in turn; they hide nothing, as they are somewhat transparent."""
REFERENCE_TINTS = ((0.65, 0.66, 0.7, 0.35),)
"""Colour of a reference that is drawn over its body."""
ROOM_M = 1.1
"""Kept free around people at the sides of a picture."""
INK, FAINT = (30, 30, 34), (120, 120, 126)


@dataclass(frozen=True)
class Row:
    """One row of a strip.

    Attributes:
        label: printed above the row.
        motion: what is drawn; a simulated run's is `run.simulated_motion()`.
        end_note: printed where the motion is over before the strip is, such as `fell at 2.31 s`.
        others: people drawn tinted beside the motion, at the same instants.
        props: where obstacles of the strip's scene, found by their names, are over time.
    """

    label: str
    motion: Motion
    end_note: str = "ended"
    others: tuple[Motion, ...] = ()
    props: tuple[Prop, ...] = ()


@dataclass(frozen=True)
class StripSettings:
    """Layout and camera of a strip.

    Attributes:
        columns: pictures per row, evenly spaced over the longest motion; `times_s` overrides it.
        width_px: width of one picture.
        height_px: height of one picture.
        times_s: instants of the pictures [s], one column each; None for evenly spaced ones.
        azimuth_deg: camera direction: 90 looks along y, so that who walks along x walks to the right.
        elevation_deg: camera elevation, negative looks down.
        extent_m: height of the world seen in a picture [m]; more where others would not fit in.
        marks: labels of instants [s], printed at the nearest picture, such as `{"launch": 2.1}`.
        scene: obstacles to draw; its bodies are replaced by each motion's.
        note: printed below the strip.
        tints: colours and opacities of other people, in turn.
    """

    columns: int = 9
    width_px: int = 196
    height_px: int = 216
    times_s: tuple[float, ...] | None = None
    azimuth_deg: float = 112.0
    elevation_deg: float = -9.0
    extent_m: float = 2.35
    marks: dict[str, float] = field(default_factory=dict)
    scene: SceneSettings = field(default_factory=SceneSettings)
    note: str = ""
    tints: tuple[tuple[float, float, float, float], ...] = OTHER_TINTS


def film_strip(
    rows: Sequence[Row], settings: StripSettings | None = None, stage: "Stage | None" = None
) -> NDArray[np.uint8]:
    """Draw a strip as RGB picture (height, width, 3). The camera follows the root of each row at a fixed height.

    Args:
        rows: at least one.
        settings: layout and camera.
        stage: where to draw, of the same size, camera and scene; None for one of its own. Sharing one halves the time.

    Raises:
        NoGlError: nothing can draw off screen here.
        MissingExtraError: pillow is not installed.
        SettingError: no rows, or fewer than 2 pictures a row.
    """
    settings = settings or StripSettings()
    if not rows:
        raise SettingError("a film strip of no rows; valid: 1 or more")
    times = np.linspace(0.0, max(row.motion.duration for row in rows), settings.columns)
    if settings.times_s is not None:
        times = np.array(settings.times_s, dtype=np.float64)
    if len(times) < 2:
        raise SettingError(f"a film strip of {len(times)} columns; valid: 2 or more")
    image_module, draw_module, font = pillow()
    row_px = HEADER_PX + settings.height_px
    height_px = len(rows) * row_px + HEADER_PX * (2 if settings.note else 1)
    page = image_module.new("RGB", (len(times) * settings.width_px, height_px), "white")
    pen = draw_module.Draw(page)
    with contextlib.ExitStack() as stack:
        stage = stage or stack.enter_context(Stage(settings))
        drawn = [stage.pictures(row.motion, times, row.others, row.props) for row in rows]
    for index, row in enumerate(rows):
        top = index * row_px
        pen.text((6, top + 3), row.label.replace("→", "->"), fill=INK, font=font)  # the font has no arrow
        for column, picture in enumerate(drawn[index]):
            corner = (column * settings.width_px, top + HEADER_PX)
            over = times[column] > row.motion.duration + 1e-6
            tile = image_module.fromarray(picture)
            if over:
                tile = image_module.blend(
                    tile.convert("L").convert("RGB"), image_module.new("RGB", tile.size, "white"), 0.6
                )
            page.paste(tile, corner)
            if over:
                pen.text((corner[0] + 6, corner[1] + 4), row.end_note, fill=(170, 40, 30), font=font)
    bottom = len(rows) * row_px + 3
    for column, time in enumerate(times):
        pen.text((column * settings.width_px + 6, bottom), f"{time:.2f} s", fill=FAINT, font=font)
    for name, time in settings.marks.items():
        column = int(np.argmin(np.abs(times - time)))
        pen.text((column * settings.width_px + 56, bottom), f"{name} {time:.2f} s", fill=(170, 40, 30), font=font)
    if settings.note:
        pen.text((6, bottom + HEADER_PX), settings.note, fill=INK, font=font)
    return np.asarray(page)


def save_film_strip(rows: Sequence[Row], path: str | Path, settings: StripSettings | None = None) -> Path:
    """Draw a strip (`film_strip`) and write it as PNG with a palette of 256 colours, atomically."""
    return save_picture(film_strip(rows, settings), path)


def save_picture(picture: NDArray[np.uint8], path: str | Path, colours: int = 256) -> Path:
    """Write an RGB picture (height, width, 3) as PNG with a palette of so many colours, atomically."""
    image = pillow()[0].fromarray(picture).quantize(colours)
    with atomic_path(path) as temporary:
        image.save(temporary, format="PNG", optimize=True)
    return Path(path)


class Stage:
    """Draws motions off screen as the camera of a strip sees them; a context manager that holds a GL context.

    Entering it raises NoGlError where nothing can draw off screen.

    Args:
        settings: size of the pictures, camera and scene.
    """

    def __init__(self, settings: StripSettings) -> None:
        self._settings = settings
        self._canvases: dict[tuple[Character, ...], tuple[Any, Canvas]] = {}

    def __enter__(self) -> "Stage":
        self._gl = find_backend().context(self._settings.width_px, self._settings.height_px)
        return self

    def __exit__(self, *problem: object) -> None:
        self._canvases.clear()  # GL objects go before the context they live in
        self._gl.free()

    def pictures(
        self, motion: Motion, times: FloatArray, others: Sequence[Motion] = (), props: Sequence[Prop] = ()
    ) -> list[NDArray[np.uint8]]:
        """Pictures of a motion, N of (height, width, 3).

        Args:
            motion: the motion.
            times: (N,) instants [s], held at the ends.
            others: people drawn beside it.
            props: obstacles of the scene that move.
        """
        import mujoco

        settings = self._settings
        bodies = (motion.character, *(other.character for other in others))
        if bodies not in self._canvases:
            model = _model(bodies, settings)
            self._canvases[bodies] = model, Canvas(model, settings.width_px, settings.height_px, self._gl)
        model, canvas = self._canvases[bodies]
        data = mujoco.MjData(model)
        camera = mujoco.MjvCamera()
        camera.azimuth, camera.elevation = settings.azimuth_deg, settings.elevation_deg
        field_of_view = np.deg2rad(model.vis.global_.fovy)
        azimuth = np.deg2rad(settings.azimuth_deg)
        axes = np.array([[np.sin(azimuth), np.cos(azimuth)], [-np.cos(azimuth), np.sin(azimuth)]])  # right, away
        aspect = settings.width_px / settings.height_px
        pictures = []
        moving = [(model.geom(prop.shape.name).id, *prop.at(times)) for prop in props]
        for number, poses in enumerate(np.stack([sample(each, times) for each in (motion, *others)], axis=1)):
            data.qpos[:] = poses.ravel()
            for geom, places, orientations in moving:
                model.geom_pos[geom], model.geom_quat[geom] = places[number], orientations[number]
            mujoco.mj_forward(model, data)
            seen = poses[:, :2] @ axes
            middle = axes @ (seen.min(axis=0) + seen.max(axis=0)) / 2
            extent = max(settings.extent_m, (np.ptp(seen[:, 0]) + ROOM_M) / aspect) if others else settings.extent_m
            # half of the depth more, so that the nearest are in the picture too
            camera.distance = extent / 2 / np.tan(field_of_view / 2) + np.ptp(seen[:, 1]) / 2
            camera.lookat[:] = [*middle, 0.42 * settings.extent_m]
            pictures.append(canvas.draw(data, camera))
        return pictures


def _model(bodies: Sequence[Character], settings: StripSettings) -> Any:
    """A scene with the first body; the others are added tinted, touching nothing."""
    fixed = tuple(replace(thing, mass=0.0) for thing in settings.scene.obstacles)
    spec = scene_spec(SceneSettings((bodies[0],), fixed, settings.scene.timestep))
    for number, character in enumerate(bodies[1:]):
        other = character.build()
        for geom in other.geoms:
            geom.contype = geom.conaffinity = 0
            geom.material = ""
            geom.rgba = np.array(settings.tints[number % len(settings.tints)])
        spec.attach(other, prefix=f"other{number}_", frame=spec.worldbody.add_frame())
    return spec.compile()


def pillow() -> tuple[Any, Any, Any]:
    """Pillow's Image and ImageDraw modules and the font of labels; MissingExtraError if pillow is not installed."""
    try:
        from PIL import Image, ImageDraw, ImageFont
    except ImportError:
        raise MissingExtraError("drawing film strips", "report") from None
    return Image, ImageDraw, ImageFont.load_default(size=14)
