"""An .npz of joint positions (`positions`, `joint_names`, `fps`) among the formats; see `simprep.motion.positions`."""

from pathlib import Path

from simprep.errors import MotionFileError
from simprep.motion.formats.format import Format, Glimpse, ReadOptions
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.positions import position_clip, read_positions


def _recognise(seen: Glimpse) -> str | None:
    return "joint positions (.npz)" if {"positions", "joint_names"} <= seen.entries else None


def _read(path: Path, options: ReadOptions) -> SourceClip:
    recording = read_positions(path)
    people = recording.positions.shape[1]
    if people != 1:
        raise MotionFileError(
            path, f"joint positions of {people} people, which `simprep duel import` reads; valid: one"
        )
    return position_clip(recording, 0, options.joint_map)


FORMAT = Format("positions", "joint positions", (".npz",), _recognise, _read)
