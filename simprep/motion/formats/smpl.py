"""AMASS and other files of SMPL, SMPL-H and SMPL-X parameters: rotation vectors of the joints, and the root's place.

The variants differ in the number of joints behind the 22 of the body, and in the names of their entries. `trans` moves
the model, not its pelvis: without the model the pelvis is off by one constant vector, which changes nothing but where the
motion takes place.
"""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.archive import open_arrays
from simprep.arrays import FloatArray
from simprep.errors import MotionFileError
from simprep.motion.formats.format import Format, Glimpse, ReadOptions
from simprep.motion.formats.numbers import LARGEST
from simprep.motion.formats.skeleton import SourceClip, check_size, forward, tidy_fps
from simprep.motion.formats.smpl_skeleton import BODY, JOINTS, MEAN_OFFSETS, NAMES, PARENTS, offsets_of_model
from simprep.motion.motion import MAX_FPS, MIN_FPS

WHOLE = ("poses", "smpl_poses", "pose", "fullpose")
"""Entries with all joints (T, 3 N), the root first."""
ROOT = ("root_orient", "global_orient")
BODY_POSE = ("pose_body", "body_pose")
FASTEST_MPS = 15.0
"""Nobody moves faster over a whole clip; the fastest sprinters reach 12 [m/s]."""
PLACE = ("trans", "transl", "smpl_trans")
RATES = ("mocap_framerate", "mocap_frame_rate", "fps", "frame_rate", "framerate")
HANDS = {"pose_lhand", "pose_rhand"}
VARIANTS = {22: "SMPL body", 24: "SMPL", 52: "SMPL-H", 55: "SMPL-X"}
"""By number of joints."""
INTER_X_FPS = 120.0
"""Files of Inter-X state no frame rate; its documentation does (Xu et al. 2024) [1/s]."""
STANDING = 0.35
"""A person stands in a direction if the neck is usually this far from the ankles along it, and less along others [m]."""
AXES = {
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "x": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}
"""Turns the models' own axes, y up, into a file's, by its vertical axis."""


def smpl_clip(path: Path, entries: Mapping[str, Any], options: ReadOptions, rate: float | None = None) -> SourceClip:
    """A clip of one person's parameters, in the file's axes.

    Args:
        path: the file, for messages and the clip's name.
        entries: arrays and numbers by name.
        options: a body model, and the frame rate of files that state none.
        rate: frame rate that the file states elsewhere [1/s].

    Raises:
        MotionFileError: an entry that is missing or of the wrong shape, no frame rate, numbers beyond all sense.
    """
    poses, joints = _poses(path, entries)
    place = _rows(path, entries, PLACE, len(poses), 3)
    check_size(path, len(poses), len(JOINTS))
    notes: list[str] = []
    fps = _rate(path, entries, options, rate, notes)
    offsets, pelvis = _offsets(entries, options, notes)
    turn = float(np.median(np.linalg.norm(poses[:, 3 : 3 * BODY].reshape(len(poses), -1, 3), axis=-1).max(axis=1)))
    if turn > 2 * np.pi:
        notes.append(
            f"a joint is turned by {turn:.0f} rad, more than once around, in half of the frames: degrees? read as rad"
        )
    speed = float(np.linalg.norm(np.diff(place, axis=0), axis=1).mean() * fps) if len(place) > 1 else 0.0
    if speed > FASTEST_MPS:
        notes.append(f"the body moves at {speed:.0f} m/s in the mean: centimetres? read as m")
    local = np.tile(np.eye(3), (len(poses), len(JOINTS), 1, 1))
    turned = Rotation.from_rotvec(poses[:, : 3 * BODY].reshape(-1, 3)).as_matrix()
    local[:, :BODY] = turned.reshape(len(poses), BODY, 3, 3)
    positions, rotations = forward(PARENTS, offsets, local)
    positions += (place + pelvis)[:, None]
    up = _up(positions, notes)
    axes = AXES[up]
    rest, still = forward(PARENTS, offsets, np.tile(np.eye(3), (1, len(JOINTS), 1, 1)))
    if joints > BODY:
        notes.append(f"fingers, hands and face are not used: {joints - BODY} of {joints} joints")
    return SourceClip(
        path=path, format=VARIANTS.get(joints, "SMPL"), names=NAMES, parents=PARENTS, positions=positions,
        rotations=rotations, rest_positions=rest[0] @ axes.T, rest_rotations=axes @ still[0], fps=fps, unit_m=1.0, up=up,
        notes=tuple(notes),
    )  # fmt: skip


def _first(entries: Collection[str], names: Collection[str]) -> str | None:
    return next((name for name in names if name in entries), None)


def _numbers(path: Path, name: str, value: Any) -> FloatArray:
    values = np.asarray(value)
    if values.dtype.kind not in "fiu":
        raise MotionFileError(path, f"{name!r} holds {values.dtype}; valid: numbers")
    values = values.astype(np.float64)
    if not np.isfinite(values).all() or np.abs(values).max(initial=0.0) > LARGEST:
        raise MotionFileError(path, f"{name!r} holds NaN, infinity or a number beyond {LARGEST:g}")
    return values


def _rows(path: Path, entries: Mapping[str, Any], names: Collection[str], count: int, width: int) -> FloatArray:
    """Values (T, width) of the first of these entries."""
    name = _first(entries, names)
    if name is None:
        raise MotionFileError(path, f"no {' or '.join(names)}; valid: parameters of SMPL, SMPL-H or SMPL-X")
    values = _numbers(path, name, entries[name])
    if values.size != count * width or len(values) != count:
        raise MotionFileError(path, f"{name!r} has shape {values.shape}; valid: ({count}, {width})")
    return values.reshape(count, width)


def _poses(path: Path, entries: Mapping[str, Any]) -> tuple[FloatArray, int]:
    """Rotation vectors (T, at least 66), the root's first, and how many joints the file has."""
    name = _first(entries, WHOLE)
    if name is not None:
        values = _numbers(path, name, entries[name])
        values = values.reshape(len(values), -1) if values.ndim in (2, 3) else values
        if values.ndim != 2 or not len(values) or values.shape[1] % 3 or values.shape[1] // 3 not in VARIANTS:
            valid = ", ".join(f"{3 * joints} ({title})" for joints, title in VARIANTS.items())
            raise MotionFileError(path, f"{name!r} has shape {values.shape}; valid: (T, N) with N of {valid}")
        return values, values.shape[1] // 3
    body = _first(entries, BODY_POSE)
    if body is None:
        raise MotionFileError(
            path, f"no {', '.join((*WHOLE, *BODY_POSE))}; valid: parameters of SMPL, SMPL-H or SMPL-X"
        )
    values = _numbers(path, body, entries[body])
    values = values.reshape(len(values), -1) if values.ndim in (2, 3) and len(values) else values
    if values.ndim != 2 or values.shape[1] not in (3 * (BODY - 1), 3 * (BODY + 1)):
        raise MotionFileError(path, f"{body!r} has shape {values.shape}; valid: (T, 63), or (T, 69) with SMPL's hands")
    root = _rows(path, entries, ROOT, len(values), 3)
    hands = bool(HANDS & set(entries)) or "pose_hand" in entries
    face = "pose_jaw" in entries
    joints = 55 if face else 52 if hands else 1 + values.shape[1] // 3
    return np.concatenate([root, values], axis=1), joints


def _rate(path: Path, entries: Mapping[str, Any], options: ReadOptions, rate: float | None, notes: list[str]) -> float:
    name = _first(entries, RATES)
    if rate is None and name is not None:
        rate = float(np.ravel(_numbers(path, name, entries[name]))[0])
    if rate is None and options.file_fps is not None:
        return options.file_fps
    if rate is None and set(entries) >= HANDS:
        notes.append(f"no frame rate stated: {INTER_X_FPS:g} frames/s, as Inter-X has with these entries")
        return INTER_X_FPS
    if rate is None:
        raise MotionFileError(path, f"no frame rate ({', '.join(RATES)}); give it with --file-fps")
    if not MIN_FPS <= rate <= MAX_FPS:
        raise MotionFileError(path, f"frame rate {rate:g} 1/s; valid: {MIN_FPS:g} to {MAX_FPS:g}")
    return tidy_fps(rate)


def _offsets(entries: Mapping[str, Any], options: ReadOptions, notes: list[str]) -> tuple[FloatArray, FloatArray]:
    if options.body_model is not None:
        betas = np.ravel(np.asarray(entries.get("betas", []), dtype=np.float64))
        notes.append(f"bones of {options.body_model.name} with the file's {len(betas)} betas")
        return offsets_of_model(options.body_model, betas)
    ignored = ", the betas are not used (--body-model FILE would)" if "betas" in entries else ""
    notes.append(f"bones of a mean body{ignored}")
    return MEAN_OFFSETS, np.zeros(3)


def _up(positions: FloatArray, notes: list[str]) -> str:
    """The vertical axis along which the person stands; AMASS's z where nobody stands."""
    ankles = positions[:, [NAMES.index("left_ankle"), NAMES.index("right_ankle")]].mean(axis=1)
    rise = np.median(positions[:, NAMES.index("neck")] - ankles, axis=0)
    axis = int(np.argmax(rise))
    if rise[axis] > 2 * STANDING and rise[axis] > 1.5 * np.delete(np.abs(rise), axis).max():
        up = "xyz"[axis]
        if up != "z":
            notes.append(f"vertical axis {up}, along which the person stands, though these files usually have z")
        return up
    notes.append("vertical axis z, as these files usually have; nobody stands upright in this one")
    return "z"


def variant(entries: Collection[str]) -> str | None:
    """Kind of a file of parameters by the names of its entries; None if it is none."""
    names = set(entries)
    whole = _first(names, WHOLE)
    if whole is None and not (_first(names, ROOT) and _first(names, BODY_POSE)):
        return None
    if _first(names, PLACE) is None:
        return None
    if "mocap_framerate" in names or "mocap_frame_rate" in names:
        return "AMASS, parameters of SMPL's family"
    return "Inter-X, parameters of SMPL-X" if names >= HANDS else "parameters of SMPL's family"


def _recognise(seen: Glimpse) -> str | None:
    return variant(seen.entries)


def _read(path: Path, options: ReadOptions) -> SourceClip:
    with open_arrays(path, "file of SMPL parameters") as archive:
        used = {*WHOLE, *ROOT, *BODY_POSE, *PLACE, *RATES, "betas"}
        entries = {name: archive[name] if name in used else None for name in archive.files}
    return smpl_clip(path, entries, options)


FORMAT = Format("smpl", "AMASS, SMPL", (".npz",), _recognise, _read)
