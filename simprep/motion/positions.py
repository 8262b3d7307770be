"""People recorded as joint positions alone (depth cameras, pose estimators): gaps filled, noise filtered, made clips.

The file is an .npz with `positions` (T, J, 3) or (T, 2, J, 3), `joint_names` (J) and `fps`. The joints must name both
legs (hip, knee, ankle or foot) and both arms (shoulder, elbow, wrist or hand); neck, head, trunk and toes are used
where given. What positions cannot tell (twists, how a hand is turned) stays neutral.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from simprep.archive import open_arrays, texts
from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.errors import MotionFileError, SettingError
from simprep.motion.formats.foreign import npz_kind
from simprep.motion.formats.numbers import LARGEST
from simprep.motion.formats.skeleton import MAX_VALUES, SourceClip, check_size
from simprep.motion.joint_map import LIMB_PARTS, ROLES, guess_roles, shown_names
from simprep.motion.motion import MAX_FPS, MIN_FPS
from simprep.motion.targets import frame_from, unit

TRUNK_NAMES = ("torso", "spine", "chest", "spinemid", "thorax", "spineshoulder")
"""Joints between hips and neck that are used, in lower case without separators."""


@dataclass(frozen=True)
class PositionSettings:
    """How recorded positions are cleaned.

    Attributes:
        longest_gap_s: shorter gaps of a joint are interpolated, a longer one is an error [s].
        cutoff_hz: low-pass of the positions (Butterworth, order 4, no delay); 0 for none. Fast kicks move joints little
            above 6 Hz; a depth camera's jitter is mostly above [1/s].
        lowest_fps: slower recordings are interpolated to a whole multiple of their rate, since feet and accelerations
            are judged frame by frame [1/s].
    """

    longest_gap_s: float = 0.25
    cutoff_hz: float = 6.0
    lowest_fps: float = 30.0

    def __post_init__(self) -> None:
        if not 0 <= self.longest_gap_s <= 2:
            raise SettingError(f"longest gap {self.longest_gap_s} s; valid: 0 to 2")
        if not 0 <= self.cutoff_hz <= 100:
            raise SettingError(f"cutoff {self.cutoff_hz} 1/s; valid: 0 (none) to 100")
        if not 0 <= self.lowest_fps <= 120:
            raise SettingError(f"lowest frame rate {self.lowest_fps} 1/s; valid: 0 to 120")


DEFAULT_SETTINGS = PositionSettings()


@dataclass(frozen=True)
class Recording:
    """Joint positions of one or several people as a file holds them.

    Attributes:
        path: the file.
        positions: (T, people, J, 3) in file units and axes; NaN where a joint was not seen.
        names: J joint names.
        fps: frame rate [1/s].
    """

    path: Path
    positions: FloatArray
    names: tuple[str, ...]
    fps: float


def read_positions(path: str | Path) -> Recording:
    """Read an .npz with `positions` (T, J, 3) or (T, people, J, 3), `joint_names` (J) and `fps`.

    Raises:
        MotionFileError: missing, unreadable, or an entry missing or of the wrong shape.
    """
    path = Path(path)
    with open_arrays(path, "file of joint positions") as archive:
        missing = [key for key in ("positions", "joint_names", "fps") if key not in archive]
        if missing:
            kind = npz_kind(archive.files)
            raise MotionFileError(
                path, kind or f"no {', '.join(missing)}; joint positions need positions, joint_names, fps"
            )
        given = archive["positions"]
        names = texts(archive["joint_names"])
        fps = float(archive["fps"])
        if given.dtype.kind not in "fiu":
            raise MotionFileError(path, f"positions of {given.dtype}; valid: numbers")
        if given.ndim == 3:
            given = given[:, None]
        if given.ndim != 4 or given.shape[2:] != (len(names), 3) or not len(given):
            raise MotionFileError(
                path, f"positions {given.shape} for {len(names)} joint names; valid: (T, J, 3) or (T, 2, J, 3)"
            )
        if given.size * 3 > MAX_VALUES:
            raise MotionFileError(path, f"{given.size} numbers; valid: up to {MAX_VALUES // 3}")
        positions = np.asarray(given, dtype=np.float64)
    if not (np.isfinite(fps) and MIN_FPS <= fps <= MAX_FPS):
        raise MotionFileError(path, f"frame rate {fps} 1/s; valid: {MIN_FPS:g} to {MAX_FPS:g}")
    far = np.isfinite(positions) & (np.abs(positions) > LARGEST)
    if far.any():
        raise MotionFileError(path, f"a position is {positions[far][0]:g}; valid: numbers up to {LARGEST:g}")
    return Recording(path, positions, names, fps)


def position_clip(
    recording: Recording,
    person: int = 0,
    joint_map: Mapping[str, str] | None = None,
    settings: PositionSettings = DEFAULT_SETTINGS,
) -> SourceClip:
    """One person's clip for `retarget_clip`, in file units and axes, with joints named by our parts.

    Orientations follow from positions. The clip's notes say what was interpolated, filtered and estimated.

    Args:
        recording: the file.
        person: which of its people.
        joint_map: our parts to the file's joint names, for names that are not recognised.
        settings: gaps, noise and rate.

    Raises:
        MotionFileError: a needed joint is missing, or not seen for too long: the message names the frame.
        UnknownNameError: the joint map names no part of ours.
    """
    path, notes = recording.path, []
    people = recording.positions.shape[1]
    if not 0 <= person < people:
        raise MotionFileError(path, f"holds {people} {'person' if people == 1 else 'people'}; no person {person + 1}")
    roles = _roles(recording, joint_map)
    used = sorted({*roles.values(), *(trunk := _trunk_joint(recording.names, roles))})
    positions, filled = fill_gaps(path, recording, person, used, settings.longest_gap_s)
    if filled:
        notes.append(f"{filled} unseen joint positions in short gaps interpolated")
    factor = max(1, int(np.ceil(settings.lowest_fps / recording.fps - 1e-9)))
    check_size(path, len(positions) * factor, max(len(recording.names), len(ROLES)))
    positions, fps = _cleaned(positions, recording.fps, settings, notes)
    spread = _limb_variation(positions, roles)
    if spread > 0.15:
        notes.append(f"limbs change their length by {100 * spread:.0f} % (standard deviation of the worst): noisy data")
    at = {role: positions[:, index] for role, index in roles.items()}
    if "neck" not in at:
        at["neck"] = (at["left_upper_arm"] + at["right_upper_arm"]) / 2
        notes.append("no neck joint: halfway between the shoulders")
    at = {"hips": (at["left_thigh"] + at["right_thigh"]) / 2, **at}
    if trunk:
        at["spine"] = positions[:, trunk[0]]
    if "left_toe" not in at or "right_toe" not in at:
        at |= _estimated_toes(at)
        notes.append("no toes: the feet point where the pelvis faces, flat while low")
    return _assemble(recording, at, fps, notes)


def centres(recording: Recording) -> FloatArray:
    """Where each person is: mean (T, people, 3) of the joints seen in every frame, unfiltered [file unit]."""
    seen = np.isfinite(recording.positions).all(axis=-1, keepdims=True)
    count = seen.sum(axis=2)
    out = np.where(seen, recording.positions, 0.0).sum(axis=2) / np.maximum(count, 1)
    frames = np.arange(len(out))
    for person in range(out.shape[1]):
        known = np.flatnonzero(count[:, person, 0])
        for axis in range(3) if len(known) else ():
            out[:, person, axis] = np.interp(frames, known, out[known, person, axis])
    return np.asarray(out)


def fill_gaps(
    path: Path, recording: Recording, person: int, joints: list[int], longest_s: float
) -> tuple[FloatArray, int]:
    """Interpolate a person's joints linearly over gaps up to `longest_s` [s]; at the ends the nearest one is held.

    Returns:
        (T, J, 3) positions, complete for these joints, and the number of positions filled in.

    Raises:
        MotionFileError: a longer gap; the message names its first frame and joint.
    """
    positions = recording.positions[:, person].copy()
    longest = int(np.floor(longest_s * recording.fps + 1e-9))
    frames = np.arange(len(positions))
    total = 0
    for joint in joints:
        seen = np.isfinite(positions[:, joint]).all(axis=-1)
        if seen.all():
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[True], seen, [True]]).astype(int)))
        for first, after in edges.reshape(-1, 2):
            if after - first > longest or not seen.any():
                raise MotionFileError(
                    path,
                    f"person {person + 1}, frame {first}: joint {recording.names[joint]!r} is not seen for "
                    f"{after - first} frames ({(after - first) / recording.fps:.2f} s); gaps up to {longest_s:g} s are filled",
                )
        total += int((~seen).sum())
        for axis in range(3):
            positions[:, joint, axis] = np.interp(frames, frames[seen], positions[seen, joint, axis])
    return positions, total


def _roles(recording: Recording, joint_map: Mapping[str, str] | None) -> dict[str, int]:
    roles = guess_roles(recording.path, recording.names, joint_map)
    for side in SIDES:
        for end, base in ((f"{side}_toe", f"{side}_foot"), (f"{side}_hand_tip", f"{side}_hand")):
            if roles.get(end) == roles.get(base):
                roles.pop(end, None)
    needed = [f"{side}_{part}" for side in SIDES for part in LIMB_PARTS]
    missing = [role for role in needed if role not in roles]
    if missing:
        raise MotionFileError(
            recording.path,
            f"no joint found for {', '.join(missing)}; joints of the file: {shown_names(recording.names, 40)}. "
            'A joint map (--joint-map FILE with {"part": "joint name"}) can name them',
        )
    return {role: roles[role] for role in ROLES if role in roles and not role.endswith("hand_tip")}


def _trunk_joint(names: tuple[str, ...], roles: Mapping[str, int]) -> list[int]:
    plain = ["".join(letter for letter in name.lower() if letter.isalnum()) for name in names]
    found = [plain.index(name) for name in TRUNK_NAMES if name in plain]
    return [joint for joint in found if joint not in roles.values()][:1]


def _cleaned(
    positions: FloatArray, fps: float, settings: PositionSettings, notes: list[str]
) -> tuple[FloatArray, float]:
    from scipy.interpolate import CubicSpline
    from scipy.signal import butter, sosfiltfilt

    known = np.isfinite(positions).all(axis=(0, 2))
    out = positions.copy()
    if 0 < settings.cutoff_hz < 0.45 * fps and len(positions) > 15:
        sections = butter(2, settings.cutoff_hz, fs=fps, output="sos")  # order 4 after both passes
        out[:, known] = sosfiltfilt(sections, positions[:, known], axis=0)
        notes.append(f"positions low-pass filtered at {settings.cutoff_hz:g} Hz")
    factor = int(np.ceil(settings.lowest_fps / fps - 1e-9))
    if factor > 1 and len(positions) > 3:
        frames = np.arange((len(positions) - 1) * factor + 1) / factor
        fine = np.full((len(frames), *positions.shape[1:]), np.nan)
        fine[:, known] = CubicSpline(np.arange(len(positions)), out[:, known], axis=0)(frames)
        notes.append(f"interpolated from {fps:g} to {fps * factor:g} frames per second")
        return fine, fps * factor
    return out, fps


def _limb_variation(positions: FloatArray, roles: Mapping[str, int]) -> float:
    """Largest coefficient of variation of a limb bone's length."""
    worst = 0.0
    for side in SIDES:
        for first, second in (("thigh", "shank"), ("shank", "foot"), ("upper_arm", "forearm"), ("forearm", "hand")):
            bone = positions[:, roles[f"{side}_{first}"]] - positions[:, roles[f"{side}_{second}"]]
            lengths = np.linalg.norm(bone, axis=-1)
            worst = max(worst, float(lengths.std() / max(lengths.mean(), 1e-12)))
    return worst


def _estimated_toes(at: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Points before the ankles: level and ahead of the pelvis while the ankle is low, square to a raised shank."""
    ankles = (at["left_foot"] + at["right_foot"]) / 2
    rise = np.median(at["neck"] - ankles, axis=0)
    up = np.zeros(3)
    up[np.argmax(np.abs(rise))] = np.sign(rise[np.argmax(np.abs(rise))])
    forward = np.cross(at["left_thigh"] - at["right_thigh"], up)
    leg = max(float(np.median(np.linalg.norm(at["left_thigh"] - at["left_foot"], axis=-1))), 1e-9)
    out = {}
    for side in SIDES:
        ankle = at[f"{side}_foot"]
        shank = unit(ankle - at[f"{side}_shank"])
        square = unit(forward - shank * (forward * shank).sum(axis=-1, keepdims=True))
        height = ankle @ up
        lift = np.clip((height - np.percentile(height, 5)) / leg / 0.2, 0.0, 1.0)[:, None]
        out[f"{side}_toe"] = ankle + 0.2 * leg * unit((1 - lift) * unit(forward) + lift * square)
    return out


def _assemble(recording: Recording, at: dict[str, FloatArray], fps: float, notes: list[str]) -> SourceClip:
    """A tree of joints named by our parts, with orientations that follow the bones."""
    names = ["hips", *(["spine"] if "spine" in at else []), "neck", *(["head"] if "head" in at else [])]
    names += [f"{side}_{part}" for side in SIDES for part in LIMB_PARTS]
    names += [f"{side}_toe" for side in SIDES]
    trunk = "spine" if "spine" in at else "hips"
    parent = {"spine": "hips", "neck": trunk, "head": "neck"}
    for side in SIDES:
        parent |= {f"{side}_thigh": "hips", f"{side}_upper_arm": trunk}
        for chain in (("thigh", "shank", "foot", "toe"), ("upper_arm", "forearm", "hand")):
            parent |= {f"{side}_{lower}": f"{side}_{upper}" for upper, lower in pairwise(chain)}
    # a tree lists parents first; the names above already do
    parents = np.array([names.index(parent[name]) if name in parent else -1 for name in names], dtype=np.intp)
    positions = np.stack([at[name] for name in names], axis=1)
    pelvis = frame_from(at["left_thigh"] - at["right_thigh"], at["neck"] - at["hips"])
    thorax = frame_from(at["left_upper_arm"] - at["right_upper_arm"], at["neck"] - at[trunk])
    rotations = np.empty((*positions.shape, 3))
    for number, name in enumerate(names):
        lower = name.endswith(("thigh", "shank", "foot", "toe")) or name == "hips"
        rotations[:, number] = pelvis if lower else thorax
        if name.endswith("_foot"):
            side = name.removesuffix("_foot")
            pointing, shank = at[f"{side}_toe"] - at[name], at[name] - at[f"{side}_shank"]
            left = pelvis[..., 1] - unit(pointing) * (pelvis[..., 1] * unit(pointing)).sum(axis=-1, keepdims=True)
            rotations[:, number] = frame_from(left, -shank)
    if flat := _turn_on(rotations):
        notes.append(f"points of a joint and its neighbours on one line or spot: {flat} orientations are those before")
    rest = np.zeros((len(names), 3))  # no pose of the file is known to stand straight
    return SourceClip(
        recording.path,
        "joint positions",
        tuple(names),
        parents,
        positions,
        rotations,
        rest,
        np.tile(np.eye(3), (len(names), 1, 1)),
        fps,
        notes=tuple(notes),
        by_part=True,
    )


def _turn_on(rotations: FloatArray) -> int:
    """Replace frames (T, J, 3, 3) that are no rotations by those before, else after, else none; returns how many."""
    good = np.abs(np.linalg.det(rotations) - 1) < 1e-6
    frames = np.arange(len(good))
    for joint in np.flatnonzero(~good.all(axis=0)):
        known = np.flatnonzero(good[:, joint])
        if len(known):
            nearest = known[np.clip(np.searchsorted(known, frames, side="right") - 1, 0, None)]
            rotations[:, joint] = rotations[nearest, joint]
        else:
            rotations[:, joint] = np.eye(3)
    return int((~good).sum())
