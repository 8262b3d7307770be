"""Loading a motion from any file: simprep's .npz, BVH, Acclaim, DeepMimic."""

import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from simprep.archive import find_archive
from simprep.character import Character
from simprep.errors import MotionError, MotionFileError, SettingError
from simprep.humanoid_model import humanoid, humanoid_of_leg
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.formats.text import MAX_FILE_BYTES
from simprep.motion.import_check import ImportCheck, check_import
from simprep.motion.motion import Motion
from simprep.motion.store import SCHEMA, read_motion

READABLE = ".npz, .bvh, .amc (with its .asf), .txt or .json (DeepMimic)"


@dataclass(frozen=True)
class ImportReport:
    """What an import did.

    Attributes:
        frames: frames of the motion.
        fps: its frame rate [1/s].
        duration_s: its length [s].
        check: how far the result is from the source; None where nothing was retargeted.
        up: the file's vertical axis.
        scale: metres per file unit.
        warnings: everything that was decided, adapted or left out.
    """

    frames: int
    fps: float
    duration_s: float
    check: ImportCheck | None
    up: str
    scale: float
    warnings: tuple[str, ...]

    @property
    def residual_mm(self) -> float:
        """Mean distance between our joints and the source's with our bone lengths, root aligned [mm]."""
        return self.check.residual_mm if self.check else 0.0

    @property
    def doubtful(self) -> bool:
        """Whether some limb is not where the source has it (`simprep.motion.import_check`)."""
        return self.check is not None and self.check.doubtful

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
) -> Motion:
    """Load a motion file and retarget it onto a character, its feet on the floor z = 0.

    A Python warning says if the motion is doubtful, that is if a limb is not where the file has it. `import_motion`
    gives the whole report.

    Args:
        path: .npz written by simprep or a folder with one, .bvh, .amc with its .asf beside it, or a DeepMimic
            .txt/.json.
        fps: output frame rate [1/s]; None: the file's, at most 60.
        up: the file's vertical axis, `x`, `y` or `z`; None to find it.
        scale: metres per file unit; None to find it.
        joint_map: our parts to the file's joint names, or a JSON file with that; for foreign names.
        character: who moves (an .npz keeps its own).

    Raises:
        SimprepError: the file or a setting cannot be used; the message says why and what is valid.
    """
    result = import_motion(path, fps, up, scale, joint_map, character)
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
) -> ImportResult:
    """Load a motion file with a report; arguments and errors as for `load_motion`."""
    path = find_archive(path, "simprep motion", SCHEMA)
    if not path.is_file():
        raise MotionFileError(path, "no such file")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise MotionFileError(path, f"larger than {MAX_FILE_BYTES // 10**6} MB")
    if path.suffix.lower() == ".npz":
        return _own(path, fps)
    return retarget_clip(read_source(path), fps, up, scale, joint_map, character)


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
    from simprep.motion.joint_map import find_joints, read_joint_map
    from simprep.motion.normalise import leg_length, normalise
    from simprep.motion.targets import build_targets

    path = clip.path
    if isinstance(joint_map, str | Path):
        joint_map = read_joint_map(joint_map)
    joints = find_joints(path, clip.names, clip.parents, joint_map)
    source = normalise(clip, joints, fps, up, scale)
    if character is None:
        try:
            character = humanoid_of_leg(leg_length(source.clip.positions, joints))
        except SettingError as error:
            raise MotionFileError(
                path, f"the person's {error}; another length unit can be given with --scale"
            ) from None
    body = character.skeleton
    targets = build_targets(source, joints, body, keep_travel)
    try:
        placed = place_on_floor(targets, body)
    except MotionError as error:
        raise MotionFileError(path, str(error)) from None
    motion = Motion(
        qpos=placed.qpos,
        fps=source.clip.fps / source.stride,
        contacts=placed.contacts,
        name=path.stem,
        source=f"{clip.format} file {path.name}",
        loop=targets.step is not None,
        character=character,
    )
    check = check_import(placed.qpos, placed.unsettled, targets.output(), body)
    notes = [*check.warnings, *source.warnings, *targets.warnings, *placed.warnings]
    if joints.unused:
        shown = ", ".join(joints.unused[:12]) + (", ..." if len(joints.unused) > 12 else "")
        notes.append(
            f"{len(joints.unused)} of {sum(not name.endswith('_end') for name in clip.names)} joints drive nothing: {shown}"
        )
    report = ImportReport(len(motion), motion.fps, motion.duration, check, source.up, source.scale, tuple(notes))
    return ImportResult(motion, report)


def read_source(path: Path) -> SourceClip:
    """Read a foreign motion file by its extension.

    Raises:
        MotionFileError: unknown extension, or the file is malformed.
    """
    suffix = path.suffix.lower()
    if suffix in (".txt", ".json"):
        from simprep.motion.formats.deepmimic import read_deepmimic

        return read_deepmimic(path)
    if suffix == ".bvh":
        from simprep.motion.formats.bvh import read_bvh

        return read_bvh(path)
    if suffix == ".amc":
        from simprep.motion.formats.acclaim import read_acclaim

        return read_acclaim(path)
    if suffix == ".asf":
        raise MotionFileError(path, "an Acclaim skeleton without motion; valid: its .amc file")
    raise MotionFileError(path, f"unknown extension {suffix!r}; valid: {READABLE}")


def _own(path: Path, fps: float | None) -> ImportResult:
    from simprep.motion.edit import resample

    motion = read_motion(path)
    if fps is not None:
        motion = resample(motion, fps)
    report = ImportReport(len(motion), motion.fps, motion.duration, None, "z", 1.0, ())
    return ImportResult(motion, report)
