"""Motion: a sequence of poses of a character. A pose is a MuJoCo qpos."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import DTypeLike, NDArray

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.display import SelfShowing, data_frame
from simprep.errors import MotionError
from simprep.humanoid_model import humanoid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_FPS = 1000.0
MIN_FPS = 1.0
_PLAIN = ("fps", "events", "name", "source", "loop", "character")


@dataclass(frozen=True, eq=False, repr=False)
class Motion(SelfShowing):
    """Poses of one character over time, with foot contacts and named frames.

    Attributes:
        qpos: (T, nq) root position [m] (world, z up), root quaternion (wxyz), hinge angles [rad] in the order of
            `Character.joints`. Read-only.
        fps: frames per second [1/s], 1 to 1000.
        contacts: (T, 2) whether the left and right foot support the body. Read-only.
        events: named frame indices, such as `target` (first frame of the target movement) or `impact`.
        name: short name for tables and files.
        source: where the motion came from (file, generator), for reports.
        loop: the motion is one cycle: the frame after the last is the first, moved by the root displacement.
        character: whose poses these are.

    Raises:
        MotionError: no frames, wrong shapes, NaN, a zero quaternion, a bad frame rate or an event outside the frames.
    """

    qpos: FloatArray
    fps: float
    contacts: BoolArray
    events: Mapping[str, int] = field(default_factory=dict)
    name: str = "motion"
    source: str = ""
    loop: bool = False
    character: Character = humanoid()

    def __post_init__(self) -> None:
        qpos = np.array(self.qpos, dtype=np.float64)
        contacts = np.array(self.contacts, dtype=bool)
        if qpos.ndim != 2 or qpos.shape[1] != self.character.nq:
            raise MotionError(
                f"{self.name}: qpos has shape {qpos.shape}; valid: (frames, {self.character.nq}) of {self.character.name}"
            )
        if len(qpos) == 0:
            raise MotionError(f"{self.name}: no frames")
        bad = np.flatnonzero(~np.isfinite(qpos).all(axis=1))
        if len(bad):
            raise MotionError(f"{self.name}: frame {bad[0]} of {len(qpos)} holds NaN or infinity")
        if contacts.shape != (len(qpos), 2):
            raise MotionError(f"{self.name}: contacts has shape {contacts.shape}; valid: ({len(qpos)}, 2)")
        if not (np.isfinite(self.fps) and MIN_FPS <= self.fps <= MAX_FPS):
            raise MotionError(f"{self.name}: frame rate {self.fps} 1/s; valid: {MIN_FPS:g} to {MAX_FPS:g}")
        norm = np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
        if (norm < 1e-6).any():
            raise MotionError(f"{self.name}: frame {int(np.argmin(norm))} has a zero root quaternion")
        if np.abs(norm - 1).max() > 1e-12:
            qpos[:, 3:7] /= norm
        for event, frame in self.events.items():
            if not 0 <= frame < len(qpos):
                raise MotionError(f"{self.name}: event {event!r} at frame {frame}; valid: 0 to {len(qpos) - 1}")
        qpos.setflags(write=False)
        contacts.setflags(write=False)
        object.__setattr__(self, "qpos", qpos)
        object.__setattr__(self, "contacts", contacts)
        object.__setattr__(self, "fps", float(self.fps))
        object.__setattr__(self, "events", MappingProxyType(dict(self.events)))

    def __len__(self) -> int:
        return len(self.qpos)

    def __repr__(self) -> str:
        loop = ", loop" if self.loop else ""
        return f"<Motion {self.name!r}: {len(self)} frames at {self.fps:g}/s, {self.duration:.2f} s{loop}, {self.character.name}>"

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """The poses, so that `np.asarray(motion)` is `motion.qpos` and `np.allclose(one, other)` compares poses."""
        if copy or (dtype is not None and np.dtype(dtype) != self.qpos.dtype):
            return np.array(self.qpos, dtype=dtype)
        return self.qpos

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(motion)` and Jupyter show."""
        root = self.qpos[:, :3]
        return self.name, {
            "body": self.character.name,
            "duration [s]": round(self.duration, 3),
            "frames": f"{len(self)} at {self.fps:g}/s" + (", a loop" if self.loop else ""),
            "events": ", ".join(f"{name} {frame / self.fps:.2f} s" for name, frame in self.events.items()) or None,
            "root goes [m]": " ".join(f"{value:+.2f}" for value in root[-1] - root[0]),
            "source": self.source or None,
        }

    def to_dataframe(self) -> Any:
        """Poses and contacts as a pandas DataFrame, one row a frame, indexed by `time_s`.

        Columns: `root_x_m` ... `root_qz`, an angle `JOINT_rad` for each joint, `left_contact`, `right_contact`.

        Raises:
            MissingExtraError: pandas is not installed.
        """
        columns = pose_columns(self.qpos, self.character)
        columns |= {f"{side}_contact": self.contacts[:, number] for number, side in enumerate(("left", "right"))}
        return data_frame(columns, self.times, "time_s")

    def __eq__(self, other: object) -> bool:
        """Whether all bits are the same."""
        if not isinstance(other, Motion):
            return NotImplemented
        arrays = all(np.array_equal(getattr(self, name), getattr(other, name)) for name in ("qpos", "contacts"))
        return arrays and all(getattr(self, name) == getattr(other, name) for name in _PLAIN)

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[object, ...]:
        plain = (self.name, self.source, self.loop, self.character)
        return Motion, (self.qpos, self.fps, self.contacts, dict(self.events), *plain)

    def __getitem__(self, frames: slice) -> "Motion":
        """Frames `motion[10:50]`, no longer a loop; events outside are dropped.

        Raises:
            MotionError: a step other than 1, or no frame left.
        """
        from simprep.motion.edit import cut

        if not isinstance(frames, slice) or frames.step not in (None, 1):
            raise MotionError(f"{self.name}: {frames!r}; valid: frames a:b")
        first, after, _ = frames.indices(len(self))
        return cut(self, first, after)

    def seconds(self, begin: float, end: float) -> "Motion":
        """Part of the motion by time.

        Args:
            begin: its first frame is the first at or after this [s].
            end: its last frame is the last at or before this [s].

        Raises:
            MotionError: no frame between them.
        """
        return self[max(0, math.ceil(begin * self.fps - 1e-9)) : max(0, math.floor(end * self.fps + 1e-9) + 1)]

    def resample(self, fps: float) -> "Motion":
        """The same motion at another frame rate [1/s]; see `simprep.motion.edit.resample`."""
        from simprep.motion.edit import resample

        return resample(self, fps)

    def save(self, path: str | Path) -> Path:
        """Write the motion to .npz (appended if missing) for `simprep.read_motion`; returns the path."""
        from simprep.motion.store import save_motion

        return save_motion(self, path)

    def plot(self, joints: str | Sequence[str] | None = None, path: str | Path | None = None) -> "Figure":
        """Draw root height, contacts and joint angles over time; see `simprep.report.motion_figure.plot_motion`.

        Args:
            joints: names of joints or of groups of joints of the character (`left_arm`), one or several; None for all.
            path: PNG file to write as well; None to write none.

        Raises:
            UnknownNameError: no such joint or group.
            MissingExtraError: matplotlib is not installed.
        """
        from simprep.report.motion_figure import plot_motion

        return plot_motion(self, joints, path)

    @property
    def duration(self) -> float:
        """Time from the first frame to the last; of a loop, to the first frame of the next cycle [s]."""
        return (len(self) if self.loop else len(self) - 1) / self.fps

    @property
    def times(self) -> FloatArray:
        """(T,) time of each frame [s], from 0."""
        return np.arange(len(self)) / self.fps

    def velocities(self) -> FloatArray:
        """Generalised velocities (T, nv) by central differences (`mj_differentiatePos`).

        Root linear velocity (world) [m/s], root angular velocity (body frame) [rad/s], hinges [rad/s].
        """
        return differentiate(self.qpos, self.fps, self.character)


def pose_columns(qpos: FloatArray, character: Character) -> dict[str, NDArray[Any]]:
    """Columns of poses (T, nq) by name, with units."""
    root = (*(f"root_{axis}_m" for axis in "xyz"), *(f"root_q{part}" for part in "wxyz"))
    names = (*root, *(f"{joint}_rad" for joint in character.joints))
    return {name: qpos[:, number] for number, name in enumerate(names)}


def differentiate(qpos: FloatArray, fps: float, character: Character = humanoid()) -> FloatArray:
    """Generalised velocities (T, nv) as `Motion.velocities`: one-sided differences at the ends; 0 for one frame.

    Args:
        qpos: (T, nq) poses.
        fps: frames per second [1/s].
        character: the body.
    """
    model = character.model
    n = len(qpos)
    qvel = np.zeros((n, model.nv))
    for frame in range(n):
        before, after = max(frame - 1, 0), min(frame + 1, n - 1)
        if after > before:
            mujoco.mj_differentiatePos(model, qvel[frame], (after - before) / fps, qpos[before], qpos[after])
    # mj_differentiatePos gives the rotation in the frame of the earlier pose. A rotation about a fixed axis has the
    # same components in the frame of `frame`, and over so short a step the axis is fixed.
    return qvel
