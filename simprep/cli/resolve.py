"""From what a person types (a name in the library or a file) to a Motion."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from simprep.errors import SettingError, UnknownNameError

if TYPE_CHECKING:
    from simprep.character import Character
    from simprep.motion.load import ImportResult
    from simprep.motion.motion import Motion

DEFAULT_LOOP_S = 6.0


def resolve_motion(
    text: str, warn: Callable[[str], None], library: Path | None = None, robot: str | None = None
) -> Motion:
    """The motion a person means.

    Args:
        text: name of a built-in motion or of a clip in the user's library, or path of a motion file or of a folder with one
            of ours.
        warn: receives what an import decided, adapted or left out, a line each.
        library: folder of the user's clips; None for SIMPREP_LIBRARY, where set.
        robot: name or file of the body that it shall be a motion of (`simprep.characters.character_of_name`); None
            for the motion's own, or the humanoid.

    Raises:
        RobotFileError: the robot's files cannot be used.
        UnknownNameError: none of them; the message lists the names and the file types.
        SimprepError: the user's library cannot be read.
        MotionFileError: it looks like a path, and the file is missing or cannot be read.
    """
    body = resolve_robot(robot)
    if Path(text).suffix or len(Path(text).parts) > 1:
        return _imported(text, body, warn)

    from simprep.library.user import find_entry

    try:
        entry = find_entry(text, library)
    except UnknownNameError as error:
        if Path(text).is_dir():  # after the names: a folder called `walk` does not hide the walk
            return _imported(text, body, warn)
        from simprep.motion.formats.registry import readable

        choices = (*error.choices, f"or the path of a file: {readable()}")
        raise UnknownNameError("motion", text, choices) from None
    motion = entry.generate()
    return motion if body is None else _onto(motion, body, warn)


def resolve_robot(robot: str | None) -> Character | None:
    """The body that `--robot` names; None without it.

    Raises:
        UnknownNameError: no such body.
        RobotFileError: its files cannot be used.
    """
    if robot is None:
        return None
    from simprep.characters import character_of_name

    return character_of_name(robot)


def _onto(motion: Motion, body: Character, warn: Callable[[str], None]) -> Motion:
    """A motion on a body, as it is if it is that body's already; `warn` receives what the retargeting says.

    Raises:
        MotionFileError: it cannot be retargeted.
    """
    from simprep.motion.transfer import onto

    return onto(motion, body, lambda line: warn(f"{motion.name} on {body.name}: {line}"))


def imported(path: str | Path, body: Character | None, **reading: Any) -> ImportResult:
    """`simprep.motion.transfer.import_onto`, which is slow to import."""
    from simprep.motion.transfer import import_onto

    return import_onto(path, body, **reading)


def _imported(path: str, body: Character | None, warn: Callable[[str], None]) -> Motion:
    result = imported(path, body)
    for line in result.report.warnings:
        warn(f"{Path(path).name}: {line}")
    return result.motion


def parse_frames(text: str) -> tuple[int | None, int | None]:
    """Read `a:b`, either end of which may be left out.

    Raises:
        SettingError: not of this form.
    """
    first, colon, after = text.partition(":")
    try:
        if not colon:
            raise ValueError
        return (int(first) if first else None), (int(after) if after else None)
    except ValueError:
        raise SettingError(
            f"--frames {text!r}; valid: a:b, frame a up to but not including b, either may be left out"
        ) from None


def select(motion: Motion, frames: str | None, seconds: float | None, warn: Callable[[str], None]) -> Motion:
    """Cut a motion to frames `a:b`, then bring it to a length: loops are repeated, other motions cut.

    Args:
        motion: the motion.
        frames: `a:b` or None for all; what goes beyond the end is left out, and that is said.
        seconds: length [s]; None for 6 s of a loop, all of anything else.
        warn: receives what was left out.

    Raises:
        SettingError: malformed frames or a length that is not positive.
        MotionError: the frames are empty, or begin outside the motion.
    """
    from simprep.motion.edit import cut, to_length

    if seconds is not None and not 0 < seconds <= 600:
        raise SettingError(f"--seconds {seconds:g}; valid: above 0, at most 600")
    if frames is not None:
        first, after = parse_frames(frames)
        first, after = first or 0, len(motion) if after is None else after
        if first < len(motion) < after:
            warn(
                f"{motion.name}: --frames {frames} goes beyond its {len(motion)} frames; {first}:{len(motion)} is used"
            )
            after = len(motion)
        motion = cut(motion, first, after)
    if seconds is None:
        seconds = DEFAULT_LOOP_S if motion.loop else motion.duration
    return to_length(motion, seconds)
