"""DeepMimic motion clips (JSON text), as published with Peng et al. 2018, "DeepMimic".

A frame is: duration [s]; root position (y up) [m]; root quaternion (wxyz); quaternions of chest, neck, right hip; angle
of the right knee; quaternions of right ankle and shoulder; angle of the right elbow; the same for the left side. The
file has no skeleton: `_JOINTS` is the format's standard humanoid (x forward, y up, z to the right).
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from simprep.arrays import FloatArray
from simprep.errors import MotionFileError
from simprep.motion.formats.format import Format, Glimpse, ReadOptions
from simprep.motion.formats.numbers import LARGEST
from simprep.motion.formats.skeleton import SourceClip, forward, tidy_fps
from simprep.motion.formats.text import open_text
from simprep.motion.rotations import axis_rotation

_JOINTS = (
    # name, parent, offset from the parent [m], values in a frame (0: fixed, 1: angle about z, 4: quaternion)
    ("root", -1, (0.0, 0.0, 0.0), 4),
    ("chest", 0, (0.0, 0.236151, 0.0), 4),
    ("neck", 1, (0.0, 0.223894, 0.0), 4),
    ("right_hip", 0, (0.0, 0.0, 0.084887), 4),
    ("right_knee", 3, (0.0, -0.421546, 0.0), 1),
    ("right_ankle", 4, (0.0, -0.40987, 0.0), 4),
    ("right_shoulder", 1, (-0.02405, 0.2435, 0.18311), 4),
    ("right_elbow", 6, (0.0, -0.274788, 0.0), 1),
    ("right_wrist", 7, (0.0, -0.258947, 0.0), 0),
    ("left_hip", 0, (0.0, 0.0, -0.084887), 4),
    ("left_knee", 9, (0.0, -0.421546, 0.0), 1),
    ("left_ankle", 10, (0.0, -0.40987, 0.0), 4),
    ("left_shoulder", 1, (-0.02405, 0.2435, -0.18311), 4),
    ("left_elbow", 12, (0.0, -0.274788, 0.0), 1),
    ("left_wrist", 13, (0.0, -0.258947, 0.0), 0),
)
FRAME_LENGTH = 4 + sum(values for *_, values in _JOINTS)
MAX_JSON_BYTES = 20_000_000
DURATION_SPREAD = 50.0
"""The duration of a frame may differ from the median by at most this factor."""
LONGER = 10
"""Resampling to a constant rate makes at most this many times the frames of the file."""
SEAM_S = 0.3
"""Time over which each end of a cyclic clip is eased so that the last frame leads into the first [s]."""


def read_deepmimic(path: Path) -> SourceClip:
    """Read a clip.

    Raises:
        MotionFileError: no such file, wrong frame length, NaN, zero quaternions or durations.
    """
    frames, cyclic, notes = _parse(path)
    duration = frames[:, 0]
    step_s = duration[:-1] if len(frames) > 1 else duration
    if (step_s <= 0).any():
        bad = int(np.flatnonzero(step_s <= 0)[0])
        raise MotionFileError(path, f"frame {bad} has duration {step_s[bad]:g} s; valid: above 0")
    dt = float(np.median(step_s))
    if not 1e-3 <= dt <= 1:
        raise MotionFileError(path, f"frame duration {dt:g} s; valid: 0.001 to 1")
    if np.abs(step_s - dt).max() > 0.05 * dt:
        _check_durations(path, step_s, dt)
        frames = _uniform(frames, dt)
        notes.append(f"frame durations vary ({step_s.min():g} to {step_s.max():g} s): resampled to {dt:g} s")
    step = None
    if cyclic and len(frames) > 3:
        frames, gap = _close_loop(frames, dt)
        step = frames[-1, 1:4] - frames[0, 1:4]
        step[1] = 0.0
        frames = frames[:-1]
        notes.append(
            f"cyclic clip: the last frame only closes the cycle and is left out; the seam, a gap of up to "
            f"{np.degrees(gap):.0f} deg in a joint, is eased over {SEAM_S:g} s at each end"
        )
    parents = np.array([parent for _, parent, _, _ in _JOINTS], dtype=np.intp)
    offsets = np.array([offset for _, _, offset, _ in _JOINTS])
    local = _local_rotations(frames)
    positions, rotations = forward(parents, offsets, local)
    positions += frames[:, None, 1:4]
    identity = np.broadcast_to(np.eye(3), (1, len(_JOINTS), 3, 3))
    rest, _ = forward(parents, offsets, identity)
    return SourceClip(
        path=path,
        format="DeepMimic",
        names=tuple(name for name, *_ in _JOINTS),
        parents=parents,
        positions=positions,
        rotations=rotations,
        rest_positions=rest[0],
        rest_rotations=identity[0],
        fps=tidy_fps(1.0 / dt),
        unit_m=1.0,
        up="y",
        step=step,
        notes=tuple(notes),
    )


def _parse(path: Path) -> tuple[FloatArray, bool, list[str]]:
    with open_text(path, "DeepMimic JSON") as stream:
        if path.stat().st_size > MAX_JSON_BYTES:
            raise MotionFileError(path, f"larger than {MAX_JSON_BYTES // 10**6} MB, which no clip of this format is")
        text = stream.read()
    try:
        content: Any = json.loads(text)
    except RecursionError:
        raise MotionFileError(path, "nested too deeply for a DeepMimic clip") from None
    except json.JSONDecodeError as error:
        raise MotionFileError(path, f"not valid JSON ({error.msg})", error.lineno) from None
    except ValueError as error:
        raise MotionFileError(path, f"not valid JSON ({error})") from None
    if not isinstance(content, dict) or not isinstance(content.get("Frames"), list):
        raise MotionFileError(path, "no list 'Frames'; valid: a DeepMimic motion clip")
    rows = content["Frames"]
    if not rows:
        raise MotionFileError(path, "no frames")
    for number, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != FRAME_LENGTH:
            given = len(row) if isinstance(row, list) else type(row).__name__
            raise MotionFileError(path, f"frame {number} has {given} values; valid: {FRAME_LENGTH}")
        strange = next((value for value in row if type(value) not in (int, float)), None)
        if strange is not None or None in row:
            raise MotionFileError(path, f"frame {number} holds {str(strange)[:40]!r}, something other than numbers")
    try:
        frames = np.array(rows, dtype=np.float64)
    except OverflowError:
        raise MotionFileError(path, "'Frames' holds a whole number beyond all sense") from None
    notes: list[str] = []
    bad = np.flatnonzero(~np.isfinite(frames).all(axis=1))
    if len(bad):
        raise MotionFileError(path, f"frame {bad[0]} holds NaN or infinity")
    bad = np.flatnonzero((np.abs(frames) > LARGEST).any(axis=1))
    if len(bad):
        worst = frames[bad[0]][np.argmax(np.abs(frames[bad[0]]))]
        raise MotionFileError(path, f"frame {bad[0]} holds {worst:g}; valid: numbers up to {LARGEST:g}")
    for name, column, width in _columns():
        if width == 4:
            norm = np.linalg.norm(frames[:, column : column + 4], axis=1)
            # published clips hold linearly blended quaternions down to 0.6
            wrong = np.flatnonzero((norm < 0.3) | (norm > 1.5))
            if len(wrong):
                raise MotionFileError(
                    path, f"frame {wrong[0]}: the quaternion of {name!r} has length {norm[wrong[0]]:.3g}; valid: 1"
                )
            if np.abs(norm - 1).max() > 0.05:
                worst = int(np.argmax(np.abs(norm - 1)))
                notes.append(
                    f"the quaternion of {name!r} has length {norm[worst]:.2f} in frame {worst}, not 1: normalised"
                )
    loop = content.get("Loop", "none")
    if loop not in ("wrap", "none", True, False):
        raise MotionFileError(path, f"'Loop' is {str(loop)[:40]!r}; valid: 'wrap', 'none'")
    return frames, loop in ("wrap", True), notes


def _check_durations(path: Path, step_s: FloatArray, dt: float) -> None:
    """Refuse durations that would make many more frames than the file has."""
    spread = np.maximum(step_s / dt, dt / step_s)
    if spread.max() > DURATION_SPREAD:
        worst = int(np.argmax(spread))
        raise MotionFileError(
            path,
            f"frame {worst} has duration {step_s[worst]:g} s where the median is {dt:g} s; valid: up to "
            f"{DURATION_SPREAD:g} times longer or shorter",
        )
    if step_s.sum() > LONGER * len(step_s) * dt:
        raise MotionFileError(
            path,
            f"{len(step_s) + 1} frames last {step_s.sum():g} s, and half of them up to {dt:g} s: more than {LONGER} "
            "times as many at a constant rate",
        )


def _columns() -> list[tuple[str, int, int]]:
    out, column = [], 4
    for name, _, _, width in _JOINTS:
        out.append((name, column, width))
        column += width
    return out


def _local_rotations(frames: FloatArray) -> FloatArray:
    local = np.tile(np.eye(3), (len(frames), len(_JOINTS), 1, 1))
    for joint, (_, column, width) in enumerate(_columns()):
        if width == 4:
            local[:, joint] = Rotation.from_quat(frames[:, column : column + 4], scalar_first=True).as_matrix()
        elif width == 1:
            local[:, joint] = axis_rotation("z", frames[:, column])
    return local


def _uniform(frames: FloatArray, dt: float) -> FloatArray:
    """Frames at a constant step: linear in positions and angles, spherical in rotations."""
    times = np.concatenate([[0.0], np.cumsum(frames[:-1, 0])])
    wanted = np.arange(int(np.floor(times[-1] / dt + 1e-6)) + 1) * dt
    wanted = np.minimum(wanted, times[-1])
    out = np.stack([np.interp(wanted, times, column) for column in frames.T], axis=1)
    for _, column, width in _columns():
        if width == 4:
            slerp = Slerp(times, Rotation.from_quat(frames[:, column : column + 4], scalar_first=True))
            out[:, column : column + 4] = slerp(wanted).as_quat(scalar_first=True)
    out[:, 0] = dt
    return out


def _close_loop(frames: FloatArray, dt: float) -> tuple[FloatArray, float]:
    """Ease both ends so that the last frame is the first one, displaced on the floor; also the largest joint gap [rad].

    Each end takes half of the gap, fading inwards. The clips copy the last root height from the first frame; it is
    extrapolated from the frames before instead.
    """
    frames = frames.copy()
    n = len(frames)
    frames[-1, 2] = 2 * frames[-2, 2] - frames[-3, 2]
    window = max(2, min(round(SEAM_S / dt), (n - 1) // 3))
    u = np.clip(np.arange(n) / window, 0, 1)
    fade = 1 - u * u * (3 - 2 * u)
    weight = (fade - fade[::-1]) / 2
    frames[:, 2] += weight * (frames[-1, 2] - frames[0, 2])
    largest = 0.0
    for _, column, width in _columns():
        values = frames[:, column : column + width]
        if width == 1:
            gap = values[-1] - values[0]
            largest = max(largest, float(abs(gap[0])))
            frames[:, column : column + 1] += weight[:, None] * gap
        elif width == 4:
            rotation = Rotation.from_quat(values, scalar_first=True)
            gap_vector = (rotation[0].inv() * rotation[-1]).as_rotvec()
            largest = max(largest, float(np.linalg.norm(gap_vector)))
            turned = rotation * Rotation.from_rotvec(weight[:, None] * gap_vector)
            frames[:, column : column + 4] = turned.as_quat(scalar_first=True)
    return frames, largest


def _recognise(seen: Glimpse) -> str | None:
    text = seen.text.lstrip()
    return "DeepMimic clip (JSON text)" if text.startswith("{") and '"Frames"' in text else None


def _read_format(path: Path, options: ReadOptions) -> SourceClip:
    return read_deepmimic(path)


FORMAT = Format("deepmimic", "DeepMimic", (".txt", ".json"), _recognise, _read_format)
