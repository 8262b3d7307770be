"""Two people from one file or two, in one frame of reference."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simprep.archive import find_archive, schema_of
from simprep.character import Character
from simprep.duel.stream.store import SCHEMA, read_stream
from simprep.duel.stream.stream import PLAYERS, DuelStream, StreamReport, check_stream, swapped_frames
from simprep.errors import MotionError, MotionFileError
from simprep.motion.formats.bvh import read_bvh_people
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.joint_map import read_joint_map
from simprep.motion.load import ImportReport, ImportResult, import_motion, read_source, retarget_clip
from simprep.motion.motion import Motion
from simprep.motion.positions import DEFAULT_SETTINGS, PositionSettings, centres, position_clip, read_positions
from simprep.motion.store import SCHEMA as MOTION_SCHEMA


@dataclass(frozen=True)
class PairImport:
    """Two people: their stream, its report, and what each person's import decided (nothing for a saved stream)."""

    stream: DuelStream
    report: StreamReport
    imports: tuple[ImportReport, ...]


def import_pair(
    a: str | Path,
    b: str | Path | None = None,
    fps: float | None = None,
    up: str | None = None,
    scale: float | None = None,
    joint_map: Mapping[str, str] | str | Path | None = None,
    settings: PositionSettings = DEFAULT_SETTINGS,
    bodies: tuple[Character, Character] | None = None,
) -> PairImport:
    """Import two people recorded together: the stream and its reports.

    Each person moves a humanoid with legs as long as theirs, so neither strides nor the distance between the two are
    scaled. With other `bodies` the distance is kept and strides are stretched. The vertical axis and length unit found
    for A hold for B. Motions and streams that simprep saved are taken as they are.

    Args:
        a: person A (.bvh, .amc, DeepMimic, .npz of simprep or of joint positions); or both people in one .npz, one .bvh
            with two ROOTs, or a folder with one .npz of simprep.
        b: person B of the same take; None where `a` holds both.
        fps: output frame rate [1/s]; None: the files', at most 60.
        up: vertical axis of the files; None to find it.
        scale: metres per file unit; None to find it.
        joint_map: our parts to the files' joint names, or a JSON file with that.
        settings: cleaning of joint positions.
        bodies: of A and B instead of their own, such as those of a clip that this one is to be joined to.

    Raises:
        MotionFileError: a file cannot be used, holds one person where two are needed, or does not fit the other.
        MotionError: the people are too far apart.
        SettingError: an option outside its range.
    """
    if isinstance(joint_map, str | Path):
        joint_map = read_joint_map(joint_map)
    if b is None:
        a = find_archive(a, "two-person stream", SCHEMA)
        if _schema(a) == SCHEMA:
            stream = read_stream(a)
            return PairImport(stream, check_stream(stream), ())
        clips, notes = _clips_of_one(a, joint_map, settings)
    else:
        a, b = (find_archive(path, "simprep motion", MOTION_SCHEMA) for path in (a, b))
        if _schema(a) == MOTION_SCHEMA and _schema(b) == MOTION_SCHEMA:
            results = (import_motion(a, fps), import_motion(b, fps))
            return _pair(a, b, results, ())
        clips, notes = (_clip(a, joint_map, settings), _clip(b, joint_map, settings)), ()
        _check_together(*clips)
    character = bodies or (None, None)
    first = retarget_clip(clips[0], fps, up, scale, joint_map, character[0], keep_travel=True)
    up, scale = first.report.up, first.report.scale
    second = retarget_clip(clips[1], fps, up, scale, joint_map, character[1], keep_travel=True)
    return _pair(a, b, (first, second), notes)


def _pair(a: Path, b: Path | None, results: tuple[ImportResult, ImportResult], notes: tuple[str, ...]) -> PairImport:
    motions: list[Motion] = []
    for player, result in zip(PLAYERS, results):
        name = result.motion.name if b is not None else f"{a.stem}_{player}"
        motions.append(replace(result.motion, name=name, loop=False))
    name = a.stem if b is None else f"{a.stem}+{b.stem}"
    try:
        stream = DuelStream((motions[0], motions[1]), clips=(name,), name=name)
    except MotionError as error:
        if b is not None and len(motions[0]) != len(motions[1]):
            raise MotionFileError(
                b, f"{len(motions[1])} frames where {a.name} gives {len(motions[0])}; both must be recorded together"
            ) from None
        raise MotionFileError(a, str(error)) from None
    report = check_stream(stream)
    known = [note for note in notes if note not in report.warnings]
    report = replace(report, warnings=(*known, *report.warnings))
    return PairImport(stream, report, tuple(result.report for result in results))


def _clips_of_one(
    path: Path, joint_map: Mapping[str, str] | None, settings: PositionSettings
) -> tuple[tuple[SourceClip, SourceClip], tuple[str, ...]]:
    if path.suffix.lower() != ".npz":
        if not path.is_file():
            raise MotionFileError(path, "no such file")
        clips = read_bvh_people(path) if path.suffix.lower() == ".bvh" else (read_source(path),)
        if len(clips) == 1:
            both = "one file with both people (.npz of joint positions, .bvh of two ROOTs)"
            raise MotionFileError(path, f"holds one person; give the other one's file too, or {both}")
        if len(clips) != 2:
            raise MotionFileError(path, f"holds {len(clips)} people, one for each ROOT; a stream needs 2")
        return (clips[0], clips[1]), ()
    if _schema(path) == MOTION_SCHEMA:
        raise MotionFileError(path, "a motion of one person; give the other one's file too")
    recording = read_positions(path)
    people = recording.positions.shape[1]
    if people != 2:
        raise MotionFileError(path, f"holds {people} {'person' if people == 1 else 'people'}; a stream needs 2")
    one, two = (position_clip(recording, person, joint_map, settings) for person in range(2))
    leg = float(np.median(np.linalg.norm(np.diff(one.positions[:, _leg(one)], axis=1), axis=-1).sum(axis=1)))
    # the speed limit is in metres, which the file's unit may not be: a leg is about 0.85 m
    swapped = swapped_frames(centres(recording) * (0.85 / leg), recording.fps)
    notes = [
        f"the two people seem to exchange names at frame {frame} ({frame / recording.fps:.2f} s)" for frame in swapped
    ]
    return (one, two), tuple(notes)


def _leg(clip: SourceClip) -> list[int]:
    return [clip.names.index(f"left_{part}") for part in ("thigh", "shank", "foot")]


def _clip(path: Path, joint_map: Mapping[str, str] | None, settings: PositionSettings) -> SourceClip:
    if not path.is_file():
        raise MotionFileError(path, "no such file")
    if path.suffix.lower() != ".npz":
        return read_source(path)
    schema = _schema(path)
    if schema is not None:
        raise MotionFileError(path, f"a file of simprep with schema {schema!r} beside one that is not; import it first")
    recording = read_positions(path)
    if recording.positions.shape[1] != 1:
        raise MotionFileError(path, f"holds {recording.positions.shape[1]} people; give it alone")
    return position_clip(recording, 0, joint_map, settings)


def _check_together(a: SourceClip, b: SourceClip) -> None:
    if abs(a.fps - b.fps) > 1e-3 * a.fps:
        raise MotionFileError(
            b.path, f"{b.fps:g} frames per second where {a.path.name} has {a.fps:g}; both must be recorded together"
        )
    if len(a.positions) != len(b.positions):
        raise MotionFileError(
            b.path,
            f"{len(b.positions)} frames where {a.path.name} has {len(a.positions)}; both must be recorded together",
        )


def _schema(path: Path) -> str | None:
    """Schema of a file of ours; None for anything else."""
    if path.suffix.lower() != ".npz" or not path.is_file():
        return None
    return schema_of(path)
