"""Height of the centre of mass over actions, each with one peak of the contact force and a minimum at its ends.

The vertical acceleration runs in half cosine waves from the minimum at a cut to the peak and on to the next minimum.
Height and time of the peak follow from the wish that the body has a given height and no vertical speed at each cut.
This is the structure that the 2008 paper cuts at (section 3.1).
"""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.humanoid_model import GRAVITY

EARLIEST, LATEST = 0.28, 0.72
"""Where within an action its peak may be."""


@dataclass(frozen=True)
class Heave:
    """Vertical course of the centre of mass.

    Attributes:
        height: (T,) [m].
        acceleration: (T,) [m/s^2].
        peaks: (N,) frame of each action's force peak.
    """

    height: FloatArray
    acceleration: FloatArray
    peaks: IntArray


def heave(cuts: IntArray, minima: FloatArray, heights: FloatArray, flights: FloatArray, fps: float) -> Heave:
    """Height of the centre of mass through the cuts of a clip, over cuts[-1] - cuts[0] frames.

    Args:
        cuts: (N + 1,) first frame of every action and the frame after the last.
        minima: (N + 1,) acceleration at the cuts, negative [m/s^2].
        heights: (N + 1,) wanted heights there [m].
        flights: (N + 1,) how long the body flies around the cut [s]; 0: it does not.
        fps: frames per second [1/s].
    """
    total = int(cuts[-1] - cuts[0])
    acceleration = np.empty(total + 1)
    peaks = np.empty(len(cuts) - 1, dtype=np.int64)
    reached, speed = float(heights[0]), 0.0
    for number in range(len(cuts) - 1):
        first, after = int(cuts[number] - cuts[0]), int(cuts[number + 1] - cuts[0])
        times = np.arange(after - first + 1) / fps
        before, behind = 0.5 * flights[number], 0.5 * flights[number + 1]
        rise = heights[number + 1] - reached
        if behind > 0:
            rise = 0.5 * GRAVITY * behind**2 + heights[number] - reached
        wave, share = _wave(times, float(minima[number]), float(minima[number + 1]), before, behind, float(rise), speed)
        acceleration[first : after + 1] = wave
        peaks[number] = first + round(share * (after - first))
        velocity = _velocity(wave, speed, fps)
        reached += float(np.sum(0.5 * (velocity[1:] + velocity[:-1])) / fps)
        speed = float(velocity[-1])  # not quite 0; left alone it would add up
    return Heave(_integrated(acceleration[:-1], float(heights[0]), fps), acceleration[:-1], peaks + int(cuts[0]))


def _wave(
    times: FloatArray, start: float, end: float, before: float, behind: float, rise: float, speed: float
) -> tuple[FloatArray, float]:
    """Acceleration of an action that ends at rest, nearest to the wanted rise, and its peak's share of time."""
    length = float(times[-1])
    first, last = (-GRAVITY if before > 0 else start), (-GRAVITY if behind > 0 else end)
    best: tuple[float, FloatArray, float] | None = None
    earliest = 0.15 if before > 0 else EARLIEST
    for share in np.linspace(earliest, 0.85 if behind > 0 else LATEST, 45):
        middle = before + share * (length - before - behind)
        up, down = middle - before, length - behind - middle
        # at the end the speed is 0: the two half waves and the flights balance it
        peak = (2 * GRAVITY * (before + behind) - first * up - last * down - 2 * speed) / (up + down)
        rising = 0.5 * (first + peak) - 0.5 * (peak - first) * np.cos(np.pi * np.clip((times - before) / up, 0, 1))
        falling = 0.5 * (peak + last) + 0.5 * (peak - last) * np.cos(np.pi * np.clip((times - middle) / down, 0, 1))
        wave = np.where(times < middle, rising, falling)
        velocity = _velocity(wave, speed, 1 / (times[1] - times[0]))
        gained = float(np.sum(0.5 * (velocity[1:] + velocity[:-1])) * (times[1] - times[0]))
        if best is None or abs(gained - rise) < best[0]:
            best = abs(gained - rise), wave, middle / length
    assert best is not None
    return best[1], best[2]


def _velocity(acceleration: FloatArray, start: float, fps: float) -> FloatArray:
    """Speed (T,) by the trapezoidal rule."""
    return start + np.concatenate([[0.0], np.cumsum(0.5 * (acceleration[1:] + acceleration[:-1]))]) / fps


def _integrated(acceleration: FloatArray, height: float, fps: float) -> FloatArray:
    """Second sum whose second difference is the acceleration, beginning at rest."""
    steps = np.concatenate([[0.5 * acceleration[0]], acceleration[1:-1]]) / fps**2
    return height + np.concatenate([[0.0], np.cumsum(np.cumsum(steps))])
