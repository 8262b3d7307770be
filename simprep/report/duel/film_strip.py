"""Film strips of a stream, all people in one picture, rows of instants one below the other."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simprep.duel.stream.stream import DuelStream
from simprep.errors import SettingError
from simprep.physics.bodies import geom_owners, scene_bodies
from simprep.report.film_strip import FAINT, HEADER_PX, ROOM_M, StripSettings, pillow, save_picture
from simprep.report.gl import Canvas, find_backend
from simprep.scene import SceneSettings, build_scene

TINTS = ((0.36, 0.52, 0.72, 1.0), (0.78, 0.45, 0.36, 1.0), (0.42, 0.62, 0.44, 1.0), (0.58, 0.46, 0.70, 1.0))
"""Colours of A, B ..., in turn."""


def stream_strip(
    stream: DuelStream, frames: Sequence[int], captions: Sequence[str] = (), settings: StripSettings | None = None
) -> NDArray[np.uint8]:
    """Draw all people at some frames, seen from the side, as RGB picture (height, width, 3).

    Args:
        stream: of two people or more.
        frames: which to draw.
        captions: one for each frame, printed below its time; none for no captions.
        settings: size of a picture, pictures per row, camera.

    Raises:
        NoGlError: nothing can draw off screen here.
        MissingExtraError: pillow is not installed.
        SettingError: no frames, or one outside the stream.
    """
    settings = settings or StripSettings(columns=6, width_px=300, height_px=230, azimuth_deg=90.0, extent_m=2.5)
    if not len(frames) or min(frames) < 0 or max(frames) >= len(stream):
        raise SettingError(f"frames {list(frames)[:4]} ...; valid: at least one, from 0 to {len(stream) - 1}")
    image_module, draw_module, font = pillow()
    columns = min(settings.columns, len(frames))
    rows = -(-len(frames) // columns)
    cell = settings.height_px + HEADER_PX * (2 if captions else 1)
    page = image_module.new("RGB", (columns * settings.width_px, rows * cell), "white")
    pen = draw_module.Draw(page)
    for number, (frame, picture) in enumerate(zip(frames, _pictures(stream, frames, settings))):
        row, column = divmod(number, columns)
        corner = (column * settings.width_px, row * cell)
        page.paste(image_module.fromarray(picture), corner)
        pen.text(
            (corner[0] + 6, corner[1] + settings.height_px + 3), f"{frame / stream.fps:.2f} s", fill=FAINT, font=font
        )
        if captions:
            place = (corner[0] + 6, corner[1] + settings.height_px + HEADER_PX)
            pen.text(place, captions[number], fill=FAINT, font=font)
    return np.asarray(page)


def save_stream_strip(
    stream: DuelStream,
    frames: Sequence[int],
    path: str | Path,
    captions: Sequence[str] = (),
    settings: StripSettings | None = None,
) -> Path:
    """Draw a strip (`stream_strip`) and write it as PNG with a palette of 256 colours, atomically."""
    return save_picture(stream_strip(stream, frames, captions, settings), path)


def _pictures(stream: DuelStream, frames: Sequence[int], settings: StripSettings) -> list[NDArray[np.uint8]]:
    import mujoco

    bodies = tuple(motion.character for motion in stream.players)
    model = build_scene(SceneSettings(bodies, settings.scene.obstacles, settings.scene.timestep))
    owner, _ = geom_owners(model, scene_bodies(model, bodies))
    for geom in range(model.ngeom):
        if owner[geom] >= 0:
            model.geom_rgba[geom] = TINTS[owner[geom] % len(TINTS)]
            model.geom_matid[geom] = -1
    data = mujoco.MjData(model)
    camera = mujoco.MjvCamera()
    camera.elevation = settings.elevation_deg
    half_view = np.tan(np.deg2rad(model.vis.global_.fovy) / 2)
    aspect = settings.width_px / settings.height_px
    out = []
    gl_context = find_backend().context(settings.width_px, settings.height_px)
    try:
        canvas = Canvas(model, settings.width_px, settings.height_px, gl_context)
        for frame in frames:
            poses = [motion.qpos[frame] for motion in stream.players]
            data.qpos[:] = np.concatenate(poses)
            mujoco.mj_forward(model, data)
            roots = np.array([pose[:2] for pose in poses])
            middle, gap = roots.mean(axis=0), roots[1:].mean(axis=0) - roots[0]
            # A on the left, the others on the right, wherever they have turned to
            camera.azimuth = settings.azimuth_deg + np.degrees(np.arctan2(gap[1], gap[0]))
            farthest = float(np.linalg.norm(roots - middle, axis=1).max())
            # two are drawn at one scale, whatever their distance; more would not fit in
            extent = max(settings.extent_m, (2 * farthest + ROOM_M) / aspect) if len(poses) > 2 else settings.extent_m
            camera.distance = extent / 2 / half_view
            camera.lookat[:] = [*middle, 0.40 * settings.extent_m]
            out.append(canvas.draw(data, camera))
        del canvas
    finally:
        gl_context.free()
    return out
