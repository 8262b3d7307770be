"""Root of the blended motion: heading, tilt and position (paper, section 5.2, Eq. 3-5)."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, uniform_filter1d

from simprep.arrays import BoolArray, FloatArray
from simprep.motion.turns import turned
from simprep.preparation.blending import join_heading, split_heading


@dataclass(frozen=True)
class RootPath:
    """Heading and place of the root on the floor.

    Attributes:
        position: (T, 2) [m].
        heading: (T,) [rad], unwrapped.
        quat: (T, 4) root orientation, wxyz.
        lag: (T,) heading lost so far against the locomotion [rad].
        lost: (T, 2) travel lost so far against the locomotion [m].
    """

    position: FloatArray
    heading: FloatArray
    quat: FloatArray
    lag: FloatArray
    lost: FloatArray


def heading_trend(heading: FloatArray, fps: float, cycle: tuple[int, float] | None = None) -> FloatArray:
    """Heading (T,) [rad] without the turning of the pelvis to and fro at every step.

    Args:
        heading: (T,) unwrapped heading of the root [rad].
        fps: frames per second [1/s].
        cycle: length [frames] and turn [rad] of a repeated loop, for which the trend is exact; None: a moving average over
            about a stride, 1.2 s.
    """
    if cycle is not None and len(heading) >= cycle[0]:
        frames, turn = cycle
        line = turn * np.arange(len(heading)) / frames
        return np.asarray(line + (heading - line)[:frames].mean())
    return np.asarray(uniform_filter1d(heading, max(1, min(round(1.2 * fps), len(heading))), mode="nearest"))


def blend_root(
    locomotion: FloatArray,
    reference: FloatArray,
    weight: FloatArray,
    trend: FloatArray,
    start: tuple[float, FloatArray] = (0.0, np.zeros(2)),
) -> RootPath:
    """Blend the root's tilt and slow down its travel and turning; exactly the locomotion up to the first weight above 0.

    The tilt (roll and pitch in the heading's frame) is blended like any joint (Eq. 2). The displacement per frame on the
    floor is scaled by 1 - w (Eq. 3-4), and so is the turn per frame, which the paper does not say: a fully prepared
    character does not turn on its planted feet. A turning walk keeps its path: half the step, half the turn.

    Args:
        locomotion: (T, 7) root of the locomotion: position [m] and quaternion wxyz.
        reference: (7,) root of the reference posture, or (T, 7); its heading has no effect.
        weight: (T,) blending weight of the root.
        trend: (T,) `heading_trend` [rad].
        start: heading [rad] and travel (2,) [m] lost before the first frame, where this goes on from an earlier path.
    """
    heading, tilt = split_heading(locomotion[:, 3:7])
    heading = np.unwrap(heading)
    # of the same lap as the trend, which counts full turns on: else part of a full turn would be blended away
    heading = heading + 2 * np.pi * np.round(np.mean(trend - heading) / (2 * np.pi))
    _, reference_tilt = split_heading(reference[..., 3:7])
    between = (weight[1:] + weight[:-1]) / 2  # weight over the step from one frame to the next
    lag = start[0] + np.concatenate([[0.0], np.cumsum(-between * np.diff(trend))])
    step = np.diff(locomotion[:, :2], axis=0)
    turn = (lag[1:] + lag[:-1]) / 2
    gone = (1 - between)[:, None] * turned(step, turn)
    lost = start[1] + np.concatenate([np.zeros((1, 2)), np.cumsum(gone - step, axis=0)])
    blended_tilt = (1 - weight)[:, None] * tilt + weight[:, None] * reference_tilt
    blended_heading = heading + lag - weight * (heading - trend)
    quat = join_heading(blended_heading, blended_tilt)
    untouched = (weight == 0) & (lag == 0)
    quat = np.where(untouched[:, None], locomotion[:, 3:7], quat)
    return RootPath(locomotion[:, :2] + lost, blended_heading, quat, lag, lost)


def support_share(contacts: BoolArray, fps: float, smoothing: float = 0.05) -> FloatArray:
    """How much each foot decides the root height (T, 2): its contacts, smoothed in time; they add up to 1, halves in flight.

    Args:
        contacts: (T, 2).
        fps: frames per second [1/s].
        smoothing: standard deviation of the Gaussian [s].
    """
    share = gaussian_filter1d(contacts.astype(np.float64), smoothing * fps, axis=0, mode="nearest") + 1e-3
    return np.asarray(share / share.sum(axis=1, keepdims=True))
