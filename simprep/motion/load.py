"""Loading a motion from any file of a format in `simprep.motion.formats.registry`."""

import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from simprep.archive import find_archive
from simprep.character import Character
from simprep.display import SelfShowing
from simprep.errors import MotionError, MotionFileError, SettingError
from simprep.humanoid_model import humanoid, humanoid_of_leg
from simprep.motion.formats.format import DEFAULT_OPTIONS, ReadMotion, ReadOptions
from simprep.motion.formats.registry import recognise
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.formats.text import MAX_FILE_BYTES
from simprep.motion.import_check import ImportCheck, check_import
from simprep.motion.joint_map import read_joint_map
from simprep.motion.motion import MAX_FPS, MIN_FPS, Motion
from simprep.motion.store import SCHEMA


@dataclass(frozen=True)
class ImportReport(SelfShowing):
    """What an import did.

    Attributes:
        frames: frames of the motion.
        fps: its frame rate [1/s].
        duration_s: its length [s].
        check: how far the result is from the source; None where nothing was retargeted.
        up: the file's vertical axis.
        scale: metres per file unit.
        warnings: everything that was decided, adapted or left out.
        recognised: what the file is, by its content.
        velocity_fps: frame rate that stored joint velocities fit, at the file's own number of frames [1/s]; None where
            there are none.
    """

    frames: int
    fps: float
    duration_s: float
    check: ImportCheck | None
    up: str
    scale: float
    warnings: tuple[str, ...]
    recognised: str = ""
    velocity_fps: float | None = None

    @property
    def residual_mm(self) -> float:
        """Mean distance between our joints and the source's with our bone lengths, root aligned [mm]."""
        return self.check.residual_mm if self.check else 0.0

    @property
    def doubtful(self) -> bool:
        """Whether some limb is not where the source has it (`simprep.motion.import_check`)."""
        return self.check is not None and self.check.doubtful

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(report)` and Jupyter show."""
        worst = self.check.worst_limb if self.check else None
        return self.recognised or "import", {
            "frames": f"{self.frames} at {self.fps:g}/s",
            "length [s]": round(self.duration_s, 2),
            "up": self.up,
            "metres per unit": self.scale,
            "residual [mm]": self.residual_mm if self.check else None,
            "worst limb": f"{worst}, 95 % within {self.check.limbs[worst].p95_deg:.1f} deg"
            if self.check and worst
            else None,
            "doubtful": self.doubtful,
            "warnings": len(self.warnings),
        }

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain values for JSON, the check's entries among them, limbs by name."""
        fields = {**asdict(self), "warnings": list(self.warnings), "residual_mm": self.residual_mm}
        del fields["check"]
        if self.check:
            fields |= {name: value for name, value in asdict(self.check).items() if name != "warnings"}
        return {**fields, "doubtful": self.doubtful}


@dataclass(frozen=True)
class ImportResult:
    """A motion, ready for use, and the report of its import."""

    motion: Motion
    report: ImportReport


def load_motion(
    path: str | Path,
    fps: float | None = None,
    up: str | None = None,
    scale: float | None = None,
    joint_map: Mapping[str, str] | str | Path | None = None,
    character: Character = humanoid(),
    file_fps: float | None = None,
    body_model: str | Path | None = None,
    clip: str | None = None,
) -> Motion:
    """Load a motion file and retarget it onto a character, its feet on the floor z = 0.

    A Python warning says if the motion is doubtful, that is if a limb is not where the file has it. `import_motion`
    gives the whole report.

    Args:
        path: a motion file of any format that is read (docs/formats.md), or a folder with one .npz of simprep.
        fps: output frame rate [1/s]; None: the file's, at most 60.
        up: the file's vertical axis, `x`, `y` or `z`; None to find it.
        scale: metres per file unit; None to find it.
        joint_map: our parts to the file's joint names, or a JSON file with that; for foreign names.
        character: who moves (a file that states its character keeps it).
        file_fps: frame rate of the file, where its format does not state it, or states a wrong one [1/s].
        body_model: SMPL body model (.npz) for the bones of AMASS files; None for a mean body.
        clip: which clip of a file with several; None if there is only one.

    Raises:
        SimprepError: the file or a setting cannot be used; the message says why and what is valid.
    """
    result = import_motion(path, fps, up, scale, joint_map, character, file_fps, body_model, clip)
    if result.report.doubtful:
        warnings.warn(f"{path}: doubtful import: {result.report.warnings[0]}", stacklevel=2)
    return result.motion


def import_motion(
    path: str | Path,
    fps: float | None = None,
    up: str | None = None,
    scale: float | None = None,
    joint_map: Mapping[str, str] | str | Path | None = None,
    character: Character = humanoid(),
    file_fps: float | None = None,
    body_model: str | Path | None = None,
    clip: str | None = None,
) -> ImportResult:
    """Load a motion file with a report; arguments and errors as for `load_motion`."""
    path = find_archive(path, "simprep motion", SCHEMA)
    if isinstance(joint_map, str | Path):
        joint_map = read_joint_map(joint_map)
    if file_fps is not None and not MIN_FPS <= file_fps <= MAX_FPS:
        raise SettingError(f"frame rate of the file {file_fps} 1/s; valid: {MIN_FPS:g} to {MAX_FPS:g}")
    model = None if body_model is None else Path(body_model)
    content, recognised = read_file(path, ReadOptions(character, file_fps, model, joint_map, clip))
    if isinstance(content, ReadMotion):
        if up is not None or scale is not None:
            content = replace(
                content, notes=(*content.notes, "taken as it is: vertical axis and scale are not applied")
            )
        result = as_it_is(content, fps)
    else:
        clips = [content]
        del content  # so that retargeting can let go of what may be hundreds of megabytes
        result = retarget_clip(clips.pop(), fps, up, scale, joint_map, character)
    return replace(result, report=replace(result.report, recognised=recognised))


def read_file(path: Path, options: ReadOptions = DEFAULT_OPTIONS) -> tuple[SourceClip | ReadMotion, str]:
    """Read a motion file of any format, before any retargeting; also what was recognised, in words.

    Raises:
        MotionFileError: missing, too large, of no known format, or malformed.
    """
    if not path.is_file():
        raise MotionFileError(path, "no such file")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise MotionFileError(path, f"larger than {MAX_FILE_BYTES // 10**6} MB")
    form, recognised = recognise(path)
    assert form.read is not None
    return _at_rate(form.read(path, options), options.file_fps), recognised


def _at_rate(content: SourceClip | ReadMotion, fps: float | None) -> SourceClip | ReadMotion:
    """What was read at the frame rate that the user says the file has, whatever it states."""
    stated = content.motion.fps if isinstance(content, ReadMotion) else content.fps
    if fps is None or abs(fps - stated) < 1e-6 * fps:
        return content
    notes = (*content.notes, f"the file states {stated:g} frames/s; taken as {fps:g}, as asked for")
    if isinstance(content, ReadMotion):
        return replace(content, motion=replace(content.motion, fps=fps), notes=notes)
    return replace(content, fps=fps, notes=notes)


def retarget_clip(
    clip: SourceClip,
    fps: float | None = None,
    up: str | None = None,
    scale: float | None = None,
    joint_map: Mapping[str, str] | str | Path | None = None,
    character: Character | None = humanoid(),
    keep_travel: bool = False,
) -> ImportResult:
    """Retarget a foreign skeleton's motion; errors as for `load_motion`.

    Args:
        clip: the file as read.
        fps: output frame rate [1/s]; None: the file's, at most 60.
        up: the file's vertical axis; None to find it.
        scale: metres per file unit; None to find it.
        joint_map: our parts to the file's joint names, or a JSON file with that.
        character: who moves; None for the humanoid with legs as long as the person's in the file. Its travel needs no
            scaling, so several people keep the distances between them.
        keep_travel: do not scale the path over the floor by the length of the legs.
    """
    from simprep.motion.ground import place_on_floor
    from simprep.motion.joint_map import find_joints
    from simprep.motion.normalise import leg_length, normalise
    from simprep.motion.targets import build_targets

    path, title, names = clip.path, clip.format, clip.names
    if isinstance(joint_map, str | Path):
        joint_map = read_joint_map(joint_map)
    if clip.by_part:
        joint_map = None
    joints = find_joints(path, clip.names, clip.parents, joint_map)
    source = normalise(clip, joints, fps, up, scale)
    del clip
    if character is None:
        try:
            character = humanoid_of_leg(leg_length(source.clip.positions, joints))
        except SettingError as error:
            raise MotionFileError(
                path, f"the person's {error}; another length unit can be given with --scale"
            ) from None
    body = character.skeleton
    targets = build_targets(source, joints, body, keep_travel)
    rate, decided, up, scale = source.clip.fps / source.stride, source.warnings, source.up, source.scale
    del source
    try:
        placed = place_on_floor(targets, body)
    except MotionError as error:
        raise MotionFileError(path, str(error)) from None
    motion = Motion(
        qpos=placed.qpos,
        fps=rate,
        contacts=placed.contacts,
        name=path.stem,
        source=f"{title} file {path.name}",
        loop=targets.step is not None,
        character=character,
    )
    check = check_import(placed.qpos, placed.unsettled, targets.output(), body)
    notes = [*check.warnings, *decided, *targets.warnings, *placed.warnings]
    if joints.unused:
        shown = ", ".join(joints.unused[:12]) + (", ..." if len(joints.unused) > 12 else "")
        notes.append(
            f"{len(joints.unused)} of {sum(not name.endswith('_end') for name in names)} joints drive nothing: {shown}"
        )
    report = ImportReport(len(motion), motion.fps, motion.duration, check, up, scale, tuple(notes))
    return ImportResult(motion, report)


def read_source(path: Path) -> SourceClip:
    """Read a foreign skeleton's motion, of a format that is recognised by content.

    Raises:
        MotionFileError: unknown format, malformed, or joint angles of a character of ours.
    """
    content, recognised = read_file(path)
    if isinstance(content, ReadMotion):
        raise MotionFileError(path, f"{recognised}, not a foreign skeleton; import it first")
    return content


def as_it_is(content: ReadMotion, fps: float | None) -> ImportResult:
    """A motion of ours as the result of an import, at another frame rate if one is given [1/s]."""
    from simprep.motion.edit import resample

    motion = content.motion
    if fps is not None:
        motion = resample(motion, fps)
    report = ImportReport(
        len(motion), motion.fps, motion.duration, None, content.up, content.scale, content.notes,
        velocity_fps=content.velocity_fps,
    )  # fmt: skip
    return ImportResult(motion, report)
