"""What the character prepares for: several sources of influence and uncertain targets (the 2013 paper has one of each).

Each source counts by its time to contact, each of its targets by its probability; W_k is their product, adding up to 1.
The posture prepared is the one with the least expected distance to the reference postures, joint by joint:

    q* = argmin_q  sum_k W_k sum_joints |q_joint - q_joint,k|^p

p = 2 (default) gives the weighted mean: the square is the effort of correcting a wrong guess in a given time. p = 1
gives the weighted median, which commits to the likelier target. With the probability that nothing happens the
locomotion is one more posture; for p = 2 that scales every blending weight by the probability that something happens
(`share`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import FloatArray
from simprep.errors import SettingError
from simprep.motion.motion import Motion
from simprep.preparation.blending import join_heading, split_heading
from simprep.preparation.reference_posture import reference_posture
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings
from simprep.preparation.synthesis import Style

LEAST_SPEED = 0.2
"""Least closing speed that counts, so that a source left behind still has a time to contact [m/s]."""
LEAST_TIME_S = 0.05
_TILT, _PAIR = 2, 2
"""Numbers at the ends of a style vector: first the tilt; last one for each foot, twice (heights, contacts)."""


@dataclass(frozen=True)
class Influence:
    """A source of influence on the floor: a ball, an obstacle, an opponent.

    Attributes:
        position: (x, y) at time 0 [m].
        targets: probability of each target motion by name; they add up to 1, or to less where maybe nothing happens.
        velocity: (x, y) of a moving source [m/s].
        stops_s: time at which it stops moving [s].

    Raises:
        SettingError: no target, a probability outside 0 to 1, or probabilities that add up to more than 1.
    """

    position: tuple[float, float]
    targets: Mapping[str, float] = field(default_factory=dict)
    velocity: tuple[float, float] = (0.0, 0.0)
    stops_s: float = np.inf

    def __post_init__(self) -> None:
        if not self.targets:
            raise SettingError(f"the source of influence at {self.position} has no target motion; valid: at least one")
        for name, probability in self.targets.items():
            if not 0 < probability <= 1:
                raise SettingError(f"probability {probability:g} of {name}; valid: above 0, at most 1")
        if self.probability > 1 + 1e-9:
            raise SettingError(
                f"the probabilities at {self.position} add up to {self.probability:g}; valid: at most 1 for one source"
            )

    @property
    def probability(self) -> float:
        """That any of the targets happens."""
        return float(sum(self.targets.values()))

    def at(self, time: ArrayLike) -> FloatArray:
        """Where it is, (..., 2) [m], at times (...) [s]."""
        moved: FloatArray = np.minimum(np.asarray(time, dtype=np.float64), self.stops_s)[..., None]
        return np.asarray(self.position, dtype=np.float64) + moved * np.asarray(self.velocity, dtype=np.float64)


def time_to_contact(offset: FloatArray, closing: FloatArray, reach: float) -> FloatArray:
    """Time (N,) until the character is within reach of each source if both go on as now, at least `LEAST_TIME_S` [s].

    Args:
        offset: (N, 2) from the character to the sources [m].
        closing: (N, 2) velocity of the character relative to each source [m/s].
        reach: distance at which it is reached [m].
    """
    distance = np.linalg.norm(offset, axis=1)
    speed = (offset * closing).sum(axis=1) / np.maximum(distance, 1e-9)
    return np.asarray(np.maximum((distance - reach) / np.maximum(speed, LEAST_SPEED), LEAST_TIME_S))


def contact_weights(times: ArrayLike, power: float = 2.0) -> FloatArray:
    """Weights (N,) of sources of influence: inversely proportional to a power of the time to contact, adding up to 1.

    Args:
        times: (N,) [s].
        power: 0 counts all alike; the larger, the more the soonest counts.
    """
    soonest = np.asarray(times, dtype=np.float64)
    weights = (soonest.min() / soonest) ** power
    return np.asarray(weights / weights.sum())


def expected_posture(postures: FloatArray, weights: ArrayLike, power: float = 2.0) -> FloatArray:
    """The joint values (D,) with the least expected distance to given ones.

    Args:
        postures: (K, D) joint values [rad].
        weights: (K,) at least one above 0; scaled to add up to 1.
        power: p of the distance |difference|^p, 1 or more: 2 gives the mean, 1 the median (the middle of the two
            nearest where the halves balance).

    Raises:
        SettingError: a power below 1.
    """
    if not power >= 1:
        raise SettingError(f"power {power} of the expected distance; valid: 1 or more")
    values = np.asarray(postures, dtype=np.float64)
    share = np.asarray(weights, dtype=np.float64) / np.sum(weights)
    if power == 2:
        return np.asarray(share @ values)
    if power == 1:
        return _weighted_median(values, share)
    low, high = values.min(axis=0), values.max(axis=0)
    for _ in range(60):  # the derivative rises with q: halve the bracket
        middle = (low + high) / 2
        difference = middle - values
        slope = share @ (np.sign(difference) * np.abs(difference) ** (power - 1))
        low, high = np.where(slope < 0, middle, low), np.where(slope < 0, high, middle)
    return np.asarray((low + high) / 2)


def style_of(target: Motion, settings: PreparationSettings = DEFAULT_SETTINGS) -> Style:
    """The style of a target motion, its reference posture; MotionError if its target movement is not marked."""
    reference = reference_posture(target, settings)
    return Style(reference.qpos, reference.sole_height, reference.contacts)


def mixed_style(styles: Sequence[Style], weights: ArrayLike, power: float = 2.0) -> Style:
    """The style with the least expected distance (see the module).

    Args:
        styles: single postures.
        weights: one each.
        power: see `expected_posture`; for the hinges and the root's tilt. Heights of the soles are averaged, and a foot
            supports where it does in more than half, by weight.
    """
    if len(styles) == 1:
        return styles[0]
    share = np.asarray(weights, dtype=np.float64) / np.sum(weights)
    vectors = np.stack([style_vector(style) for style in styles])
    mean = share @ vectors
    angles = vectors.shape[1] - 2 * _PAIR
    mean[:angles] = expected_posture(vectors[:, :angles], share, power)
    return style_from_vectors(mean)


def style_vector(style: Style) -> FloatArray:
    """A single style as numbers that can be averaged: root tilt (2), hinges, sole heights (2), contacts (2)."""
    _, tilt = split_heading(style.qpos[3:7])
    return np.concatenate([tilt, style.qpos[7:], style.sole_height, style.contacts.astype(np.float64)])


def style_from_vectors(vectors: FloatArray) -> Style:
    """Inverse of `style_vector`, for one (D,) or many (T, D)."""
    tilt, hinges, soles, contacts = np.split(vectors, [_TILT, -2 * _PAIR, -_PAIR], axis=-1)
    quat = join_heading(np.zeros(tilt.shape[:-1]), tilt)
    qpos = np.concatenate([np.zeros((*tilt.shape[:-1], 3)), quat, hinges], axis=-1)
    return Style(qpos, soles, contacts > 0.5)


def _weighted_median(values: FloatArray, share: FloatArray) -> FloatArray:
    order = np.argsort(values, axis=0, kind="stable")
    ranked = np.take_along_axis(values, order, axis=0)
    below = np.cumsum(share[order], axis=0)
    columns = np.arange(values.shape[1])
    low = ranked[(below >= 0.5 - 1e-12).argmax(axis=0), columns]
    high = ranked[(below > 0.5 + 1e-12).argmax(axis=0), columns]
    return np.asarray((low + high) / 2)
