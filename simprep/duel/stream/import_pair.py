"""Two people from one file or two, in one frame of reference."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from simprep.archive import find_archive, schema_of
from simprep.character import Character
from simprep.duel.stream.pair_sources import files_of_folder, people_of_file, person_of_file
from simprep.duel.stream.store import KIND, SCHEMA, read_stream
from simprep.duel.stream.stream import PLAYERS, DuelStream, StreamReport, check_stream
from simprep.errors import MotionError, MotionFileError, SettingError
from simprep.motion.edit import cut
from simprep.motion.formats.format import ReadMotion, ReadOptions
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.joint_map import read_joint_map
from simprep.motion.load import ImportReport, ImportResult, as_it_is, retarget_clip
from simprep.motion.motion import Motion
from simprep.motion.normalise import working_rate
from simprep.motion.positions import DEFAULT_SETTINGS, PositionSettings
from simprep.motion.store import SCHEMA as MOTION_SCHEMA

TOGETHER = "both must be recorded together, or the time of B's start after A's be given with --offset"
LARGEST_OFFSET_S = 36_000.0


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
    offset: float | None = None,
    file_fps: float | None = None,
    body_model: str | Path | None = None,
) -> PairImport:
    """Import two people recorded together: the stream and its reports.

    Each person moves a humanoid with legs as long as theirs, so neither strides nor the distance between the two are
    scaled. With other `bodies` the distance is kept and strides are stretched. The vertical axis and length unit found
    for A hold for B. Motions and streams that simprep saved are taken as they are.

    Args:
        a: person A, of any format that is read; or both people in one .npz of joint positions, one .bvh with two ROOTs, one
            .pkl of InterHuman, a folder of Inter-X (P1.npz, P2.npz), or a folder with one .npz of simprep.
        b: person B of the same take; None where `a` holds both.
        fps: output frame rate [1/s]; None: the files', at most 60.
        up: vertical axis of the files; None to find it.
        scale: metres per file unit; None to find it.
        joint_map: our parts to the files' joint names, or a JSON file with that.
        settings: cleaning of joint positions.
        offset: time of B's first frame after A's, where the two were not recorded from the same moment on [s]. The two are cut
            to the time that both have, and may have different lengths and frame rates. Inserted rest poses do not
            count. None: both must have the same frames.
        file_fps: frame rate of the files, where they do not state it [1/s].
        body_model: SMPL body model (.npz) for the bones of files of SMPL parameters; None for a mean body.
        bodies: of A and B instead of their own, such as those of a clip that this one is to be joined to.

    Raises:
        MotionFileError: a file cannot be used, holds one person where two are needed, or does not fit the other.
        MotionError: the people are too far apart.
        SettingError: an option outside its range.
    """
    if isinstance(joint_map, str | Path):
        joint_map = read_joint_map(joint_map)
    if offset is not None and not abs(offset) <= LARGEST_OFFSET_S:
        raise SettingError(f"offset {offset} s; valid: {-LARGEST_OFFSET_S:g} to {LARGEST_OFFSET_S:g}")
    options = ReadOptions(
        file_fps=file_fps, body_model=None if body_model is None else Path(body_model), joint_map=joint_map
    )
    if b is None and (files := files_of_folder(Path(a))):
        a, b = files
    notes: tuple[str, ...] = ()
    if b is None:
        a = find_archive(a, KIND, SCHEMA)
        if _schema(a) == SCHEMA:
            stream = read_stream(a)
            if len(stream.players) != 2:
                raise MotionFileError(a, f"holds {len(stream.players)} people; an import takes 2")
            return PairImport(stream, check_stream(stream), ())
        (one, two), notes, kind = people_of_file(a, options, settings)
        kinds = (kind, kind)
    else:
        a, b = (find_archive(path, "simprep motion", MOTION_SCHEMA) for path in (a, b))
        (first, kind), (second, other_kind) = (person_of_file(path, options, settings) for path in (a, b))
        kinds = (kind, other_kind)
        if isinstance(first, ReadMotion) and isinstance(second, ReadMotion):
            if offset is not None and fps is None and first.motion.fps != second.motion.fps:
                fps = min(first.motion.fps, second.motion.fps)
            return _pair(a, b, (as_it_is(first, fps), as_it_is(second, fps)), kinds, (), offset)
        if isinstance(first, ReadMotion) or isinstance(second, ReadMotion):
            raise MotionFileError(
                a if isinstance(first, ReadMotion) else b,
                "a motion of one of our characters beside a file that is not; import it first",
            )
        one, two = first, second
        if offset is None:
            _check_together(one, two)
        elif fps is None and abs(one.fps - two.fps) > 1e-3 * one.fps:
            fps = min(working_rate(one.fps), working_rate(two.fps))
    character = bodies or (None, None)
    result = retarget_clip(one, fps, up, scale, joint_map, character[0], keep_travel=True)
    up, scale = result.report.up, result.report.scale
    other = retarget_clip(two, fps, up, scale, joint_map, character[1], keep_travel=True)
    return _pair(a, b, (result, other), kinds, notes, offset)


def _pair(
    a: Path,
    b: Path | None,
    results: tuple[ImportResult, ImportResult],
    kinds: tuple[str, str],
    notes: tuple[str, ...],
    offset: float | None,
) -> PairImport:
    motions: list[Motion] = []
    for player, result in zip(PLAYERS, results):
        name = result.motion.name if b is not None else f"{a.stem}_{player}"
        motions.append(replace(result.motion, name=name, loop=False))
    name = a.stem if b is None else f"{a.stem}+{b.stem}"
    try:
        if offset is not None:
            motions, cuts = _together(motions, offset)
            notes = (*notes, *cuts)
        stream = DuelStream((motions[0], motions[1]), clips=(name,), name=name)
    except MotionError as error:
        if b is not None and offset is None and len(motions[0]) != len(motions[1]):
            raise MotionFileError(
                b, f"{len(motions[1])} frames where {a.name} gives {len(motions[0])}; {TOGETHER}"
            ) from None
        raise MotionFileError(a, str(error)) from None
    report = check_stream(stream)
    known = [note for note in notes if note not in report.warnings]
    report = replace(report, warnings=(*known, *report.warnings))
    return PairImport(
        stream, report, tuple(replace(result.report, recognised=kind) for result, kind in zip(results, kinds))
    )


def _together(motions: list[Motion], offset: float) -> tuple[list[Motion], list[str]]:
    """The time that both were recorded, and what was cut.

    Args:
        motions: of A and B.
        offset: time of B's first frame after A's [s].

    Raises:
        MotionError: less than two frames in common, or different frame rates.
    """
    a, b = motions
    if abs(a.fps - b.fps) > 1e-6 * a.fps:
        raise MotionError(f"{a.fps:g} and {b.fps:g} frames per second; give one for both with --fps")
    shift = round(offset * a.fps)
    first = max(0, shift), max(0, -shift)
    count = min(len(motion) - start for motion, start in zip(motions, first))
    if count < 2:
        raise MotionError(
            f"{a.name} lasts {a.duration:.2f} s and {b.name} {b.duration:.2f} s: with an offset of {offset:g} s they have "
            "no time in common"
        )
    notes = [f"the time that both have: {count / a.fps:.2f} s"]
    if abs(shift / a.fps - offset) > 1e-3:
        notes.append(f"offset {offset:g} s rounded to whole frames: {shift / a.fps:.4f} s")
    parts = [cut(motion, start, start + count) for motion, start in zip(motions, first)]
    return [parts[0], replace(parts[1], fps=a.fps)], notes


def _check_together(a: SourceClip, b: SourceClip) -> None:
    if abs(a.fps - b.fps) > 1e-3 * a.fps:
        raise MotionFileError(b.path, f"{b.fps:g} frames per second where {a.path.name} has {a.fps:g}; {TOGETHER}")
    if len(a.positions) != len(b.positions):
        raise MotionFileError(
            b.path, f"{len(b.positions)} frames where {a.path.name} has {len(a.positions)}; {TOGETHER}"
        )


def _schema(path: Path) -> str | None:
    """Schema of a file of ours; None for anything else."""
    if path.suffix.lower() != ".npz" or not path.is_file():
        return None
    return schema_of(path)
