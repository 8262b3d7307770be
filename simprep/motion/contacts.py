"""Which foot supports the body, by the height and speed of the foot points, with hysteresis."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.humanoid_model import humanoid
from simprep.motion.kinematics import forward_kinematics


@dataclass(frozen=True)
class ContactSettings:
    """Thresholds of contact detection.

    Attributes:
        enter_height: a foot touches down when its lowest point is below this [m] and slower than `enter_speed`.
        leave_height: it lifts off when its lowest point is above this [m] or faster than `leave_speed`.
        enter_speed: horizontal and vertical speed of that point [m/s].
        leave_speed: the same for lift-off [m/s].
        smoothing: standard deviation of the Gaussian over positions before differencing [s].
        minimum: shorter stances and shorter flights are removed [s].
    """

    enter_height: float = 0.035
    leave_height: float = 0.05
    enter_speed: float = 0.45
    leave_speed: float = 0.8
    smoothing: float = 0.015
    minimum: float = 0.06


def detect_contacts(
    qpos: FloatArray,
    fps: float,
    character: Character = humanoid(),
    settings: ContactSettings | None = None,
    floor: float = 0.0,
) -> BoolArray:
    """Feet in contact (T, 2), left and right, of a pose sequence, at any frame rate.

    Args:
        qpos: (T, nq) poses.
        fps: frames per second [1/s].
        character: the body.
        settings: thresholds; None for the defaults.
        floor: height of the floor [m].
    """
    return contacts_of_points(forward_kinematics(qpos, character).foot_points - [0.0, 0.0, floor], fps, settings)


def contacts_of_points(points: FloatArray, fps: float, settings: ContactSettings | None = None) -> BoolArray:
    """Feet in contact (T, 2), left and right, by the points of the soles.

    Args:
        points: (T, 2, N, 3) points under the left and right foot, the floor at z = 0 [m].
        fps: frames per second [1/s].
        settings: thresholds; None for the defaults.
    """
    settings = settings or ContactSettings()
    smooth = gaussian_filter1d(points, settings.smoothing * fps, axis=0, mode="nearest")
    velocity = np.gradient(smooth, 1 / fps, axis=0) if len(points) > 1 else np.zeros_like(points)
    speed = np.linalg.norm(velocity, axis=-1)  # (T, 2, 4)
    height = points[..., 2]
    may_enter = ((height < settings.enter_height) & (speed < settings.enter_speed)).any(axis=-1)
    may_stay = ((height < settings.leave_height) & (speed < settings.leave_speed)).any(axis=-1)
    shortest = max(1, round(settings.minimum * fps))
    contacts = np.stack([_hysteresis(may_enter[:, side], may_stay[:, side]) for side in (0, 1)], axis=1)
    return without_brief(~without_brief(~contacts, shortest), shortest)


def stances(contact: BoolArray) -> list[tuple[int, int]]:
    """Stances of one foot, of contact flags (T,): the first frame of each and the frame after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], contact, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def without_brief(contacts: BoolArray, shortest: float) -> BoolArray:
    """Contact flags (T, 2) without stances of fewer than `shortest` frames, but for those at the ends of the motion."""
    out = contacts.copy()
    for side in (0, 1):
        for first, after in stances(contacts[:, side]):
            if after - first < shortest and first > 0 and after < len(out):
                out[first:after, side] = False
    return out


def _hysteresis(enter: BoolArray, stay: BoolArray) -> BoolArray:
    out = np.zeros(len(enter), dtype=bool)
    # a run of frames that may stay is a stance from the first one on that may enter
    for first, after in stances(stay | enter):
        entries = np.flatnonzero(enter[first:after])
        if len(entries):
            out[first + entries[0] : after] = True
    return out
