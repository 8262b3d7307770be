"""What files hold of two people: one file with both, a folder with one file of each, or two files."""

from pathlib import Path

import numpy as np

from simprep.archive import schema_of
from simprep.duel.stream.stream import PLAYERS, swap_warning, swapped_frames
from simprep.errors import MotionFileError
from simprep.motion.formats.bvh import read_bvh_people
from simprep.motion.formats.format import ReadMotion, ReadOptions
from simprep.motion.formats.interhuman import read_interhuman
from simprep.motion.formats.registry import recognise
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.load import read_file
from simprep.motion.positions import PositionSettings, centres, position_clip, read_positions
from simprep.motion.store import SCHEMA as MOTION_SCHEMA

Content = SourceClip | ReadMotion
INTER_X = ("P1.npz", "P2.npz")
"""Files of the two people in a folder of Inter-X."""
LEG_M = 0.85
"""Length of a leg that tells the unit of positions well enough to judge their speed [m]."""


def files_of_folder(path: Path) -> tuple[Path, Path] | None:
    """The files of both people in a folder as Inter-X lays it out; None for anything else."""
    one, two = (path / name for name in INTER_X)
    return (one, two) if one.is_file() and two.is_file() else None


def people_of_file(
    path: Path, options: ReadOptions, settings: PositionSettings
) -> tuple[tuple[SourceClip, SourceClip], tuple[str, ...], str]:
    """Clips of both people in one file, notes, and what was recognised.

    Raises:
        MotionFileError: missing, malformed, or not of two people.
    """
    if not path.is_file():
        raise MotionFileError(path, "no such file")
    form, recognised = recognise(path)
    if form.name == "interhuman":
        return read_interhuman(path, options), (), recognised
    if form.name == "positions":
        return *_recorded(path, options, settings), recognised
    if path.suffix.lower() == ".npz" and schema_of(path) == MOTION_SCHEMA:
        raise MotionFileError(path, "a motion of one person; give the other one's file too")
    clips = read_bvh_people(path) if form.name == "bvh" else (read_file(path)[0],)
    if len(clips) == 1:
        both = "one file with both people (.npz of joint positions, .bvh of two ROOTs, .pkl of InterHuman)"
        raise MotionFileError(path, f"holds one person; give the other one's file too, or {both}")
    if len(clips) != 2:
        raise MotionFileError(path, f"holds {len(clips)} people, one for each ROOT; an import takes 2")
    return (clips[0], clips[1]), (), recognised  # type: ignore[return-value]


def person_of_file(path: Path, options: ReadOptions, settings: PositionSettings) -> tuple[Content, str]:
    """What a file holds of one person, and what was recognised.

    Raises:
        MotionFileError: missing, malformed, of two people, or of simprep but no motion.
    """
    if not path.is_file():
        raise MotionFileError(path, "no such file")
    if path.suffix.lower() == ".npz" and (schema := schema_of(path)) not in (None, MOTION_SCHEMA):
        raise MotionFileError(path, f"a file of simprep with schema {schema!r}, no motion of one person")
    form, recognised = recognise(path)
    if form.name == "positions":
        recording = read_positions(path)
        if recording.positions.shape[1] != 1:
            raise MotionFileError(path, f"holds {recording.positions.shape[1]} people; give it alone")
        return position_clip(recording, 0, options.joint_map, settings), recognised
    return read_file(path, options)


def _recorded(
    path: Path, options: ReadOptions, settings: PositionSettings
) -> tuple[tuple[SourceClip, SourceClip], tuple[str, ...]]:
    recording = read_positions(path)
    people = recording.positions.shape[1]
    if people != 2:
        raise MotionFileError(path, f"holds {people} {'person' if people == 1 else 'people'}; an import takes 2")
    one, two = (position_clip(recording, person, options.joint_map, settings) for person in range(2))
    leg = [one.names.index(f"left_{part}") for part in ("thigh", "shank", "foot")]
    length = float(np.median(np.linalg.norm(np.diff(one.positions[:, leg], axis=1), axis=-1).sum(axis=1)))
    # the speed limit is in metres, which the file's unit may not be
    swapped = swapped_frames(centres(recording) * (LEG_M / length), recording.fps)
    return (one, two), tuple(swap_warning(PLAYERS, int(frame), recording.fps) for frame in swapped)
