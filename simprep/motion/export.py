"""Writing a motion in any format, whole or not at all."""

from pathlib import Path

from simprep.errors import MotionFileError
from simprep.files import atomic_path
from simprep.motion.formats.format import Format
from simprep.motion.formats.registry import format_to_write
from simprep.motion.motion import Motion


def export_motion(motion: Motion, path: str | Path, form: str | Format | None = None) -> tuple[str, ...]:
    """Write a motion to a file of any format that is written (docs/formats.md), atomically.

    Args:
        motion: what to write.
        path: the file.
        form: the format or its name, such as `bvh`; None for the one that the extension stands for.

    Returns:
        What the format cannot keep, a sentence each.

    Raises:
        UnknownNameError: no such format.
        MotionError: the character has joints that the format cannot hold.
        MotionFileError: the file cannot be written.
        MissingExtraError: the format needs a library that is not installed.
    """
    path = Path(path)
    chosen = form if isinstance(form, Format) else format_to_write(path, form)
    assert chosen.write is not None
    try:
        with atomic_path(path) as temporary:
            return chosen.write(motion, temporary)
    except OSError as error:
        raise MotionFileError(path, f"cannot be written ({error.strerror})") from None
