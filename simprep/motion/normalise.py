"""From file units, axes and rates to metres, z up and a working frame rate. Every decision is reported.

The vertical axis comes from the format, or from how the skeleton stands; the length unit from the file, or from the leg
length. An inserted rest pose is recognised by the jump after it.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray, IndexArray
from simprep.character import SIDES
from simprep.errors import MotionFileError, SettingError
from simprep.motion.formats.skeleton import MAX_VALUES, SourceClip
from simprep.motion.joint_map import JointMap
from simprep.motion.motion import MAX_FPS, MIN_FPS

WORKING_FPS = 60.0
"""Highest output rate by default [1/s]."""
ACCLAIM_UNIT_M = 0.0254 / 0.45
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "CMU (0.45 inch)": ACCLAIM_UNIT_M, "foot": 0.3048}
"""Metres per unit of lengths found in motion files."""
LEG_RANGE_M = (0.55, 1.1)
"""Thigh plus shank of people of 1.2 m (a child) to 2.2 m."""
USUAL_LEG_M = (0.65, 1.0)
"""Thigh plus shank of people of 1.35 to 2.0 m, nearly all. A unit that gives another length is a guess."""
RARE_LEG_M = (0.35, 1.3)
"""Thigh plus shank of anybody, from a small child to a giant in a game; other possible units are named within it."""
RARE_UNITS = {"dm": 0.1}
"""Metres per unit of lengths that are named where a guess is unsure, but never guessed."""
FOOTWORK_FPS = 120.0
"""Feet are placed at this frame rate at least [1/s]."""
LARGEST_STRIDE = 8
"""Most frames that are made out of one of a slow file."""
FARTHEST_M = 10_000.0
FASTEST = 50.0
"""Highest plausible speed of the root [m/s]."""
UP_ROTATIONS = {
    "z": np.eye(3),
    # y up, facing z (the usual in BVH): z becomes x, x becomes y
    "y": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "x": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
}


@dataclass(frozen=True)
class Normalised:
    """A source clip in metres and z up, with what was decided.

    Attributes:
        clip: the clip in SI units.
        reference: positions (J, 3) and orientations (J, 3, 3) of a pose of the file that stands with straight arms;
            None without such a pose.
        up: the file's vertical axis.
        scale: metres per file unit.
        warnings: decisions the user should know of.
        stride: frames of the clip per frame of the result.
    """

    clip: SourceClip
    reference: tuple[FloatArray, FloatArray] | None
    up: str
    scale: float
    warnings: tuple[str, ...]
    stride: int = 1


def normalise(
    clip: SourceClip, joints: JointMap, fps: float | None = None, up: str | None = None, scale: float | None = None
) -> Normalised:
    """Bring a clip to SI units, z up, and a frame rate at which feet can be placed.

    That rate is a multiple of the result's, at least `FOOTWORK_FPS`: feet then touch down at the same time whatever the
    file's rate.

    Args:
        clip: the clip as read.
        joints: its joint map.
        fps: output frame rate [1/s]; None: the file's, at most `WORKING_FPS`.
        up: vertical axis `x`, `y` or `z`; None to find it.
        scale: metres per file unit; None to find it.

    Raises:
        SettingError: an override outside its range.
        MotionFileError: no plausible unit or vertical axis.
    """
    if up is not None and up not in UP_ROTATIONS:
        raise SettingError(f"up axis {up!r}; valid: {', '.join(UP_ROTATIONS)}")
    if scale is not None and not (np.isfinite(scale) and 1e-6 <= scale <= 1e3):
        raise SettingError(f"scale {scale} m per unit; valid: 1e-06 to 1000")
    if fps is not None and not (np.isfinite(fps) and MIN_FPS <= fps <= MAX_FPS):
        raise SettingError(f"frame rate {fps} 1/s; valid: {MIN_FPS:g} to {MAX_FPS:g}")
    warnings = list(clip.notes)
    scale = _length_unit(clip, joints, scale, warnings)
    clip, inserted = _drop_inserted_pose(clip, joints, warnings)
    up = _vertical(clip, joints, inserted, up, warnings)
    turn = UP_ROTATIONS[up]
    if clip.format == "DeepMimic" and up == "y":  # faces x, z to the right
        turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    candidates = [(clip.rest_positions, clip.rest_rotations)]
    if inserted is not None:
        candidates.insert(0, inserted)
    reference = None
    for positions, rotations in candidates:
        turned = (positions @ turn.T * scale, turn @ rotations)
        if _stands(turned[0], joints):
            reference = turned
            break
    _check_travel(clip, joints, scale)
    wanted = fps or clip.fps
    if fps is None and clip.fps > WORKING_FPS * 1.001:
        wanted = working_rate(clip.fps)
        warnings.append(f"frame rate reduced from {clip.fps:g} to {wanted:g} 1/s (--fps chooses another)")
    clip, stride = _resample(clip, joints, wanted)  # first, since it leaves frames out
    clip = replace(
        clip,
        positions=clip.positions @ turn.T * scale,
        # joint by joint, as readers lay them in memory
        rotations=np.swapaxes(turn @ np.swapaxes(clip.rotations, 0, 1), 0, 1),
        rest_positions=clip.rest_positions @ turn.T * scale,
        rest_rotations=turn @ clip.rest_rotations,
        step=None if clip.step is None else turn @ clip.step * scale,
    )
    return Normalised(clip, reference, up, scale, tuple(warnings), stride)


def working_rate(fps: float) -> float:
    """Rate of the result by default: at most `WORKING_FPS`, an integer fraction of the file's, which keeps its frames [1/s]."""
    return fps / max(1.0, float(np.ceil(fps / WORKING_FPS - 1e-3)))


def _check_travel(clip: SourceClip, joints: JointMap, scale: float) -> None:
    """Refuse roots that no person moves like: damaged numbers; `scale` are metres per file unit."""
    root = clip.positions[:, joints.trunk[0]] * scale
    far = np.linalg.norm(root, axis=-1)
    if far.max() > FARTHEST_M:
        frame = int(np.argmax(far))
        raise MotionFileError(
            clip.path, f"frame {frame}: the root is {far[frame]:.3g} m from the origin; valid: up to {FARTHEST_M:g} m"
        )
    speed = np.linalg.norm(np.diff(root, axis=0), axis=-1) * clip.fps
    if len(speed) and speed.max() > FASTEST:
        frame = int(np.argmax(speed))
        raise MotionFileError(
            clip.path, f"frame {frame + 1}: the root jumps, at {speed[frame]:.3g} m/s; valid: up to {FASTEST:g} m/s"
        )


def leg_length(positions: FloatArray, joints: JointMap) -> float:
    """Thigh plus shank, of positions (T, J, 3): median over the frames, mean of both sides [unit of the positions]."""
    lengths = []
    for side in SIDES:
        thigh, shank, foot = (joints.joints[f"{side}_{part}"] for part in ("thigh", "shank", "foot"))
        for a, b in ((thigh, shank), (shank, foot)):
            lengths.append(float(np.median(np.linalg.norm(positions[:, a] - positions[:, b], axis=-1))))
    return sum(lengths) / 2


def _length_unit(clip: SourceClip, joints: JointMap, scale: float | None, warnings: list[str]) -> float:
    leg = leg_length(clip.positions, joints)
    if not leg > 1e-9:
        raise MotionFileError(clip.path, "the legs have no length: thigh, shank and foot joints coincide")
    low, high = LEG_RANGE_M
    given = clip.unit_m if scale is None else scale
    if given is not None:
        if not 0.5 * low <= leg * given <= 2 * high:
            raise MotionFileError(
                clip.path,
                f"with {given:g} m per unit the leg is {leg * given:.3g} m long; valid: {0.5 * low:g} to {2 * high:g} m. "
                "Another length unit can be given with --scale",
            )
        if not low <= leg * given <= high:
            warnings.append(f"leg of {leg * given:.2f} m with {given:g} m per unit: an unusual person, or another unit")
        return given
    fits = {name: unit for name, unit in UNITS.items() if low <= leg * unit <= high}
    if not fits:
        raise MotionFileError(
            clip.path,
            f"the leg (thigh plus shank) is {leg:.4g} file units long, which fits a person in none of "
            f"{', '.join(UNITS)}; give the metres per unit with --scale",
        )
    name, unit = min(fits.items(), key=lambda item: abs(leg * item[1] - 0.85))
    warnings.append(
        f"length unit not stated: {name} ({unit:.6g} m), as the leg is then {leg * unit:.2f} m long{_doubt(leg, name)}"
    )
    return unit


def _doubt(leg: float, chosen: str) -> str:
    """What to add if the chosen unit gives an unusual leg: which other units are possible."""
    units = {**UNITS, **RARE_UNITS}
    low, high = USUAL_LEG_M
    if low <= leg * units[chosen] <= high:
        return ""
    others = [
        f"{name} ({unit:.6g} m, a leg of {leg * unit:.2f} m)"
        for name, unit in units.items()
        if name != chosen and RARE_LEG_M[0] <= leg * unit <= RARE_LEG_M[1]
    ]
    possible = f"; also possible: {', '.join(others)}" if others else ""
    return (
        f"; a guess at the edge of its range ({LEG_RANGE_M[0]:g} to {LEG_RANGE_M[1]:g} m){possible}. "
        "--scale gives the unit"
    )


def _vertical(
    clip: SourceClip,
    joints: JointMap,
    inserted: tuple[FloatArray, FloatArray] | None,
    up: str | None,
    warnings: list[str],
) -> str:
    if up is not None:
        return up
    if clip.up is not None:
        return clip.up
    legs = leg_length(clip.positions, joints)
    # of a standing person the neck is more than a leg length above the ankles, of a lying or crawling one it is not
    for what, positions in (
        ("the motion", clip.positions),
        ("the inserted rest pose", None if inserted is None else inserted[0][None]),
        ("the rest pose", clip.rest_positions[None]),
    ):
        if positions is None:
            continue
        ankles = (positions[:, joints.joints["left_foot"]] + positions[:, joints.joints["right_foot"]]) / 2
        rise = np.median(positions[:, joints.joints["neck"]] - ankles, axis=0) / legs
        axis = int(np.argmax(rise))
        others = np.delete(np.abs(rise), axis)
        if rise[axis] > 0.9 and rise[axis] > 1.5 * others.max():
            name = "xyz"[axis]
            warnings.append(f"vertical axis not stated: {name}, along which the person stands in {what}")
            return name
    raise MotionFileError(
        clip.path, "the vertical axis cannot be told: nobody stands upright in it; give it with --up x, y or z"
    )


def _drop_inserted_pose(
    clip: SourceClip, joints: JointMap, warnings: list[str]
) -> tuple[SourceClip, tuple[FloatArray, FloatArray] | None]:
    """Remove a first frame from which the motion jumps: a rest pose that some exporters insert."""
    if len(clip.positions) < 8:
        return clip, None
    used = sorted(joints.joints.values())
    relative = clip.positions[:60, used] - clip.positions[:60, joints.trunk[0]][:, None]
    jumps = np.linalg.norm(np.diff(relative, axis=0), axis=-1).mean(axis=-1)
    leg = leg_length(clip.positions, joints)
    if jumps[0] < 10 * np.median(jumps[1:]) or jumps[0] < 3 * jumps[1:].max() or jumps[0] < 0.05 * leg:
        return clip, None
    usual = float(np.median(jumps[1:]))
    farther = f"{jumps[0] / usual:.0f} times farther after it than" if usual > 0 else "after it and stand still"
    warnings.append(f"frame 0 left out: an inserted rest pose (the joints jump {farther} between other frames)")
    reference = clip.positions[0], clip.rotations[0]
    return replace(clip, positions=clip.positions[1:], rotations=clip.rotations[1:]), reference


def _stands(positions: FloatArray, joints: JointMap) -> bool:
    """Whether a pose is an upright stand with straight arms, fit to calibrate orientations."""
    at = {role: positions[index] for role, index in joints.joints.items()}
    hips = (at["left_thigh"] + at["right_thigh"]) / 2
    for side in SIDES:
        leg = at[f"{side}_foot"] - at[f"{side}_thigh"]
        upper = at[f"{side}_forearm"] - at[f"{side}_upper_arm"]
        fore = at[f"{side}_hand"] - at[f"{side}_forearm"]
        if -leg[2] < 0.85 * np.linalg.norm(leg):
            return False
        if upper @ fore < 0.9 * np.linalg.norm(upper) * np.linalg.norm(fore):
            return False
    spine = at["neck"] - hips
    return bool(spine[2] > 0.9 * np.linalg.norm(spine))


def _resample(clip: SourceClip, joints: JointMap, fps: float) -> tuple[SourceClip, int]:
    """The clip at a multiple of a frame rate, and which multiple; exact where new frames fall on old ones."""
    n = len(clip.positions)
    values = n / clip.fps * fps * clip.rotations[0].size
    if values > MAX_VALUES:
        raise SettingError(
            f"frame rate {fps:g} 1/s: {n / clip.fps * fps:.0f} frames of {len(clip.names)} joints are too many"
        )
    stride = min(max(1, int(np.ceil(FOOTWORK_FPS / fps - 1e-3))), LARGEST_STRIDE, max(1, int(MAX_VALUES // values)))
    positions, rotations = clip.positions, clip.rotations
    if clip.step is None:
        frames = int(np.floor((n - 1) * fps * stride / clip.fps + 1e-9)) + 1
    else:  # a cycle keeps its period
        frames = max(2, round(n / clip.fps * fps)) * stride
        fps = clip.fps * frames / stride / n
        positions = np.concatenate([positions, positions[:1] + clip.step])
        rotations = np.concatenate([rotations, rotations[:1]])
    ratio = clip.fps / (fps * stride)
    step = round(ratio)
    if step >= 1 and abs(ratio - step) < 1e-6:
        return replace(clip, positions=positions[:n:step], rotations=rotations[:n:step], fps=fps * stride), stride
    at = np.minimum(np.arange(frames) * ratio, len(positions) - 1)
    new_positions, new_rotations = _between(clip.parents, positions, rotations, _used(clip, joints), at)
    return replace(clip, positions=new_positions, rotations=new_rotations, fps=fps * stride), stride


def _used(clip: SourceClip, joints: JointMap) -> list[int]:
    """Joints that drive something, and their ancestors."""
    used: set[int] = set()
    for joint in (*joints.joints.values(), *joints.trunk):
        while joint >= 0 and joint not in used:
            used.add(joint)
            joint = int(clip.parents[joint])
    return sorted(used)


def _between(
    parents: IndexArray, positions: FloatArray, rotations: FloatArray, used: list[int], at: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Positions (N, J, 3) and orientations (N, J, 3, 3) at fractions `at` (N,) of frames.

    Orientations are interpolated spherically, bones turn with their joints. Unused joints stay as in the frame before.
    """
    low = np.minimum(at.astype(int), max(len(positions) - 2, 0))
    out, turned = positions[low], rotations[low]
    if len(positions) < 2:
        return out, turned
    share = at - low
    off = share > 1e-9
    low, part = low[off], share[off, None]
    for joint in used:
        way = Rotation.from_matrix(np.swapaxes(rotations[:-1, joint], -1, -2) @ rotations[1:, joint]).as_rotvec()
        turned[off, joint] = rotations[low, joint] @ Rotation.from_rotvec(way[low] * part).as_matrix()
        parent = int(parents[joint])
        if parent < 0:
            out[off, joint] = (1 - part) * positions[low, joint] + part * positions[low + 1, joint]
            continue
        bone = np.einsum("tji,tj->ti", rotations[:, parent], positions[:, joint] - positions[:, parent])
        bone = (1 - part) * bone[low] + part * bone[low + 1]
        out[off, joint] = out[off, parent] + np.einsum("tij,tj->ti", turned[off, parent], bone)
    return out, turned
