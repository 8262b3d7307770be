"""Robot motions as named arrays: what BeyondMimic, mjlab, holosoma, OmniRetarget, GMR, ASAP and PBHC store.

The same keys come in .npz files and in pickles. Which format it is shows in the keys, and the rest in the content.
"""

import contextlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from simprep.archive import open_arrays
from simprep.arrays import FloatArray
from simprep.errors import MotionFileError
from simprep.motion.formats.robot_clip import RobotClip, StoredBodies, all_unit, first_bad, numeric, stated_fps, wxyz
from simprep.motion.formats.safe_pickle import read_pickle

BODIES = {"joint_pos", "body_pos_w", "body_quat_w"}
GMR = {"root_pos", "root_rot", "dof_pos"}
ASAP = {"root_trans_offset", "root_rot", "dof"}
SAME_TURN = 0.02
"""Root orientations that differ by at most this are the same [rad]."""
HOLOSOMA_FPS = 30.0
"""Frame rate of files of `qpos` that state none, by the documentation of their tools [1/s]."""
KINDS = (
    "joint_pos, body_pos_w and body_quat_w; qpos; root_pos, root_rot and dof_pos; root_trans_offset, root_rot and dof"
)
"""Keys by which formats are recognised."""


def robot_arrays_kind(names: set[str]) -> str | None:
    """Format of arrays with these names; None if they are no robot's motion."""
    if names >= BODIES:
        return "BeyondMimic, mjlab or holosoma"
    if names >= GMR:
        return "GMR"
    if names >= ASAP:
        return "ASAP or PBHC"
    if "qpos" in names and "header" not in names:
        return "holosoma or OmniRetarget"
    return None


def read_robot_npz(path: Path) -> RobotClip:
    """Read an .npz of a robot's motion.

    Raises:
        MotionFileError: unreadable, of no known kind, or malformed.
    """
    arrays = {}
    with open_arrays(path, "robot motion") as archive:
        for name in archive.files:
            with contextlib.suppress(ValueError):  # an array of objects, which may hold anything: not needed
                arrays[name] = archive[name]
    return clip_of_arrays(path, arrays)


def read_robot_pickle(path: Path, clip: str | None = None) -> RobotClip:
    """Read a pickle of GMR, or of ASAP or PBHC, which may hold several clips.

    Args:
        path: the file.
        clip: name of the clip; needed if there are several.

    Raises:
        MotionFileError: unreadable, unsafe, of no known kind, malformed, or several clips and none named.
    """
    content = read_pickle(path)
    if not isinstance(content, dict):
        raise MotionFileError(path, f"a pickle of a {type(content).__name__}; valid: a dict with {KINDS}")
    if robot_arrays_kind(_names(content)) is None:
        clips = {
            str(name): one
            for name, one in content.items()
            if isinstance(one, dict) and robot_arrays_kind(_names(one)) is not None
        }
        if not clips:
            raise MotionFileError(
                path, f"a pickle with {_shown(sorted(map(str, content)))}; valid: {KINDS}, or a dict of such"
            )
        if clip is None and len(clips) > 1:
            raise MotionFileError(path, f"{len(clips)} clips; name one with --clip: {_shown(list(clips))}")
        if clip is not None and clip not in clips:
            raise MotionFileError(path, f"no clip {clip!r}; valid: {_shown(list(clips))}")
        content = clips[clip] if clip is not None else next(iter(clips.values()))
    return clip_of_arrays(path, {str(name): value for name, value in content.items()})


def clip_of_arrays(path: Path, arrays: Mapping[str, Any]) -> RobotClip:
    """A motion from named arrays of any of the known kinds.

    Raises:
        MotionFileError: of no known kind, or malformed.
    """
    names = set(arrays)
    if names >= BODIES:
        return _with_bodies(path, arrays)
    if names >= GMR:
        return _gmr(path, arrays)
    if names >= ASAP:
        return _asap(path, arrays)
    if "qpos" in names:
        return _qpos(path, arrays)
    raise MotionFileError(path, f"no robot motion: it holds {_shown(sorted(names))}; valid: {KINDS}")


def _with_bodies(path: Path, arrays: Mapping[str, Any]) -> RobotClip:
    joint_pos = numeric(path, "joint_pos", arrays["joint_pos"], ndim=2)
    positions = numeric(path, "body_pos_w", arrays["body_pos_w"], ndim=3)
    quats = numeric(path, "body_quat_w", arrays["body_quat_w"], ndim=3)
    frames, count = len(joint_pos), positions.shape[1]
    if not frames or not count:
        raise MotionFileError(path, f"{frames} frames of {count} bodies; valid: 1 or more of each")
    if positions.shape[::2] != (frames, 3) or quats.shape != (*positions.shape[:2], 4):
        raise MotionFileError(
            path,
            f"body_pos_w {positions.shape} and body_quat_w {quats.shape}; valid: ({frames}, bodies, 3) and (.., 4)",
        )
    velocity = numeric(path, "joint_vel", arrays["joint_vel"], ndim=2) if "joint_vel" in arrays else None
    notes: list[str] = []
    root = 0
    if positions.shape[1] > 1 and np.abs(positions[:, 0]).max() < 1e-6 and np.abs(quats[:, 0, 1:]).max() < 1e-6:
        root = 1
        positions, quats = positions[:, 1:], quats[:, 1:]
        notes.append("the first stored body is the world: left out")
    # the full qpos begins with the pose of the root body
    full = joint_pos.shape[1] > 7 and (
        np.abs(joint_pos[:, :3] - positions[:, 0]).max() < 1e-4 and _turn(joint_pos[:, 3:7], quats[:, 0]) < SAME_TURN
    )
    if full:
        notes.append("joint_pos holds the whole qpos, as holosoma's training files do")
        joint_pos = joint_pos[:, 7:]
        velocity = velocity[:, 6:] if velocity is not None and velocity.shape[1] == joint_pos.shape[1] + 6 else None
    kind = "holosoma .npz" if full or root else "BeyondMimic or mjlab .npz"
    if objects := sorted(name for name in arrays if name.startswith("object_")):
        notes.append(f"the motion of an object is left out: {', '.join(objects)}")
    return RobotClip(
        path, kind, positions[:, 0], quats[:, 0], joint_pos,
        joints=_stored_names(path, arrays, ("joint_names",)), fps=_fps(path, arrays),
        bodies=StoredBodies(positions, quats, _body_names(path, arrays, ("body_names",), positions.shape[1], root)),
        joint_velocity=velocity if velocity is not None and velocity.shape == joint_pos.shape else None, whole_qpos=full,
        notes=tuple(notes),
    )  # fmt: skip


def _gmr(path: Path, arrays: Mapping[str, Any]) -> RobotClip:
    bodies = None
    if _there(arrays, "local_body_pos"):
        positions = numeric(path, "local_body_pos", arrays["local_body_pos"], ndim=3)
        frames = len(numeric(path, "root_pos", arrays["root_pos"]))
        if positions.shape[::2] != (frames, 3):
            raise MotionFileError(path, f"local_body_pos has shape {positions.shape}; valid: ({frames}, bodies, 3)")
        bodies = StoredBodies(
            positions, None, _body_names(path, arrays, ("link_body_list",), positions.shape[1], 0), in_root=True
        )
    return RobotClip(
        path, "GMR", numeric(path, "root_pos", arrays["root_pos"]), wxyz(_root_rot(path, arrays)),
        numeric(path, "dof_pos", arrays["dof_pos"]), joints=_stored_names(path, arrays, ("joint_names", "dof_names")),
        fps=_fps(path, arrays), bodies=bodies, notes=("root quaternion read as xyzw, as the format has it",),
    )  # fmt: skip


def _asap(path: Path, arrays: Mapping[str, Any]) -> RobotClip:
    stored = _root_rot(path, arrays)
    quat, note = wxyz(stored), "root quaternion read as xyzw, as the format has it"
    if _there(arrays, "pose_aa"):
        from scipy.spatial.transform import Rotation

        turns = numeric(path, "pose_aa", arrays["pose_aa"])
        if turns.shape[:1] != (len(stored),) or turns.size % (3 * len(stored)) or not turns.size:
            raise MotionFileError(path, f"pose_aa has shape {turns.shape}; valid: ({len(stored)}, bodies, 3)")
        turns = turns.reshape(len(stored), -1)
        if bad := first_bad(turns):
            raise MotionFileError(path, f"pose_aa in frame {bad[0]}, number {bad[1]} is {bad[2]:g}")
        axis_angle = turns[:, :3]
        root = Rotation.from_rotvec(axis_angle).as_quat(scalar_first=True)
        if _turn(quat, root) < SAME_TURN:
            note = "root quaternion is xyzw, as pose_aa confirms"
        elif _turn(stored, root) < SAME_TURN:
            quat, note = stored, "root quaternion is wxyz, not the format's xyzw, as pose_aa shows: read as wxyz"
        else:
            note += "; pose_aa has another root orientation"
    return RobotClip(
        path, "ASAP or PBHC", numeric(path, "root_trans_offset", arrays["root_trans_offset"]), quat,
        numeric(path, "dof", arrays["dof"]), joints=_stored_names(path, arrays, ("joint_names", "dof_names")),
        fps=_fps(path, arrays), notes=(note,),
    )  # fmt: skip


def _qpos(path: Path, arrays: Mapping[str, Any]) -> RobotClip:
    qpos = numeric(path, "qpos", arrays["qpos"], ndim=2)
    if not len(qpos) or qpos.shape[1] < 8:
        raise MotionFileError(path, f"qpos has shape {qpos.shape}; valid: (frames, 7 of the root and the joint angles)")
    if bad := first_bad(qpos):
        raise MotionFileError(path, f"qpos in frame {bad[0]}, column {bad[1]} is {bad[2]:g}")
    first, last = all_unit(qpos[:, :4]), all_unit(qpos[:, 3:7])
    if first == last:
        state = "both qpos[:4] and qpos[3:7] are" if first else "neither qpos[:4] nor qpos[3:7] is"
        raise MotionFileError(path, f"{state} of norm 1 in every frame: where the root quaternion is cannot be told")
    position, quat = (qpos[:, 4:7], qpos[:, :4]) if first else (qpos[:, :3], qpos[:, 3:7])
    where = "quaternion first (OmniRetarget)" if first else "position first (MuJoCo)"
    return RobotClip(
        path, "holosoma or OmniRetarget .npz", position, quat, qpos[:, 7:],
        joints=_stored_names(path, arrays, ("joint_names",)), fps=_fps(path, arrays), usual_fps=HOLOSOMA_FPS,
        whole_qpos=True, notes=(f"qpos has the root's {where}, by the norms of both parts",),
    )  # fmt: skip


def _root_rot(path: Path, arrays: Mapping[str, Any]) -> FloatArray:
    """The root quaternions (T, 4) as the file has them."""
    stored = numeric(path, "root_rot", arrays["root_rot"], ndim=2)
    if not len(stored) or stored.shape[1] != 4:
        raise MotionFileError(path, f"root_rot has shape {stored.shape}; valid: (frames, 4), with 1 frame or more")
    return stored


def _turn(a: FloatArray, b: FloatArray) -> float:
    """Median angle between two orientations (T, 4), of the same component order [rad]."""
    norms = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    share = np.abs((a * b).sum(axis=1)) / np.where(norms > 0, norms, 1.0)
    return float(np.median(2 * np.arccos(np.clip(share, 0.0, 1.0))))


def _fps(path: Path, arrays: Mapping[str, Any]) -> float | None:
    return stated_fps(path, arrays["fps"]) if _there(arrays, "fps") else None


def _stored_names(path: Path, arrays: Mapping[str, Any], keys: tuple[str, ...]) -> tuple[str, ...] | None:
    for key in keys:
        if _there(arrays, key):
            names = np.asarray(arrays[key]).ravel()
            if names.dtype.kind != "U":
                raise MotionFileError(path, f"{key} holds {names.dtype}; valid: text")
            return tuple(str(name)[:200] for name in names)
    return None


def _body_names(
    path: Path, arrays: Mapping[str, Any], keys: tuple[str, ...], count: int, skipped: int
) -> tuple[str, ...] | None:
    names = _stored_names(path, arrays, keys)
    return names[skipped:] if names is not None and len(names) == count + skipped else None


def _there(arrays: Mapping[str, Any], key: str) -> bool:
    value = arrays.get(key)
    return value is not None and not (isinstance(value, np.ndarray) and value.dtype.kind == "O")


def _names(content: Mapping[Any, Any]) -> set[str]:
    return {str(name) for name in content}


def _shown(names: list[str]) -> str:
    return ", ".join(name[:40] for name in names[:12]) + (", ..." if len(names) > 12 else "")
