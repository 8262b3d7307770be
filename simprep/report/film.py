"""Films: a motion or several drawn frame by frame off screen, as MP4 or as GIF."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simprep.errors import MissingExtraError, SettingError
from simprep.files import atomic_path
from simprep.motion.motion import Motion
from simprep.report.film_strip import Stage, StripSettings, pillow

FILMS = (".mp4", ".gif")
"""Endings of the files that can be written."""
CHUNK = 30
"""Pictures in memory at once."""
GIF_COLOURS = 64


def save_film(
    path: str | Path,
    motion: Motion,
    others: tuple[Motion, ...] = (),
    fps: float = 30.0,
    settings: StripSettings | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Path:
    """Draw a film and write it, atomically. The camera follows the bodies.

    Args:
        path: `.mp4` (needs imageio-ffmpeg) or `.gif` (needs pillow).
        motion: drawn opaque.
        others: drawn tinted and transparent, at the same time and place.
        fps: pictures per second of the film [1/s].
        settings: size of the picture, camera and scene.
        progress: called with the share that is drawn.

    Raises:
        SettingError: another ending, an odd size of an MP4, or a frame rate outside 1 to 60.
        NoGlError: nothing can draw off screen here; the message names the package.
        MissingExtraError: the encoder is not installed.
    """
    path, settings = Path(path), settings or StripSettings(width_px=640, height_px=480)
    suffix = path.suffix.lower()
    if suffix not in FILMS:
        raise SettingError(f"a film named {path.name}; valid endings: {', '.join(FILMS)}")
    if not 1 <= fps <= 60:
        raise SettingError(f"a film of {fps:g} pictures per second; valid: 1 to 60")
    size = (settings.width_px, settings.height_px)
    if suffix == ".mp4" and (size[0] % 2 or size[1] % 2):
        raise SettingError(f"an MP4 of {size[0]} x {size[1]} pixels; valid: even numbers")
    write = _mp4_writer() if suffix == ".mp4" else _gif_writer()
    duration = max(each.duration for each in (motion, *others))
    times = np.arange(max(1, round(duration * fps)) + 1) / fps

    def pictures() -> Iterator[NDArray[np.uint8]]:
        with Stage(settings) as stage:
            for first in range(0, len(times), CHUNK):
                yield from stage.pictures(motion, times[first : first + CHUNK], others)
                progress(min(1.0, (first + CHUNK) / len(times)))

    with atomic_path(path) as temporary:
        write(temporary, pictures(), fps, size)
    return path


Writer = Callable[[Path, Iterator[NDArray[np.uint8]], float, tuple[int, int]], None]


def _mp4_writer() -> Writer:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise MissingExtraError("writing an MP4", "video") from None

    def write(path: Path, pictures: Iterator[NDArray[np.uint8]], fps: float, size: tuple[int, int]) -> None:
        # the format is named because the temporary file's ending does not tell it
        encoder = imageio_ffmpeg.write_frames(
            str(path),
            size,
            fps=fps,
            quality=7,
            macro_block_size=2,
            output_params=["-f", "mp4"],
            ffmpeg_log_level="error",
        )
        encoder.send(None)
        try:
            for picture in pictures:
                encoder.send(np.ascontiguousarray(picture))
        finally:
            encoder.close()

    return write


def _gif_writer() -> Writer:
    image_module: Any = pillow()[0]

    def write(path: Path, pictures: Iterator[NDArray[np.uint8]], fps: float, size: tuple[int, int]) -> None:
        images = (image_module.fromarray(picture).quantize(GIF_COLOURS) for picture in pictures)
        first = next(images)
        first.save(path, format="GIF", save_all=True, append_images=images, duration=round(1000 / fps), loop=0)

    return write
