"""The synthesis itself, on arrays: locomotion, style and level of preparation per frame in, prepared poses out.

`simprep.preparation.prepare` runs it on a whole clip; the run-time controller on a window that moves along. The `Seam` of
one window is handed to the next, so that feet stay planted and the root goes on where it was.
"""

from dataclasses import dataclass, field

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.motion.contacts import stances
from simprep.motion.curves import smooth_step
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.support import support_centre, support_points
from simprep.preparation.blending import joint_weights
from simprep.preparation.dynamic_balance import DynamicBalance, pelvis_shift, shift_pelvis
from simprep.preparation.planting import plant_feet
from simprep.preparation.posture_optimisation import OptimisedPostures, optimise_postures
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings
from simprep.preparation.trajectory import blend_root, support_share

_RESTING_HEIGHT_M = 0.01
_RESTING_SPEED = 0.1  # m/s
_RESTING_TIME_S = 0.1


@dataclass(frozen=True)
class Style:
    """What the locomotion is blended towards: one posture, or one per frame.

    Attributes:
        qpos: (nq,) or (T, nq) posture; heading and place of its root do not matter.
        sole_height: (2,) or (T, 2) height of the left and right sole above the floor in it [m].
        contacts: (2,) or (T, 2) feet that support in it.
    """

    qpos: FloatArray
    sole_height: FloatArray
    contacts: BoolArray


@dataclass(frozen=True)
class Locomotion:
    """What the character does meanwhile, without preparation.

    Attributes:
        qpos: (T, nq).
        contacts: (T, 2) supporting feet.
        trend: (T,) heading without the turning of the pelvis to and fro at every step [rad].
        fps: frames per second [1/s].
        character: whose poses they are.
    """

    qpos: FloatArray
    contacts: BoolArray
    trend: FloatArray
    fps: float
    character: Character


@dataclass(frozen=True)
class Seam:
    """What the next window must know of the frame with which it begins.

    Attributes:
        lag: heading lost so far against the locomotion [rad].
        lost: (2,) travel lost so far [m].
        feet: (2, 4) corrections of the feet, shift [m] and turn [rad]; used for feet in stance.
    """

    lag: float = 0.0
    lost: FloatArray = field(default_factory=lambda: np.zeros(2))
    feet: FloatArray = field(default_factory=lambda: np.zeros((2, 4)))


@dataclass(frozen=True)
class Synthesis:
    """Prepared poses, and what happened in every frame.

    Attributes:
        qpos: (T, nq).
        contacts: (T, 2) those of the locomotion, and of feet that rest because the preparation has taken their swing away.
        kinematics: before the posture optimisation.
        root_weight: (T,) blending weight of the root.
        weights: (T, joints) of the hinges.
        support: (T, 2 N, 2) points that may support, on the floor [m], and which do (T, 2 N).
        centre: (T, 2) centre of the support polygon [m]; NaN in flight.
        optimised: result of the posture optimisation; None where it did not run.
        foot_error: (T, 2) distance of the ankle from where inverse kinematics should have put it [m].
        pelvis_drop: (T,) how far the pelvis was lowered for the legs to reach [m].
        lag, lost, feet: (T,), (T, 2), (T, 2, 4) see `Seam`.
    """

    qpos: FloatArray
    contacts: BoolArray
    kinematics: Kinematics
    root_weight: FloatArray
    weights: FloatArray
    support: tuple[FloatArray, BoolArray]
    centre: FloatArray
    optimised: OptimisedPostures | None
    foot_error: FloatArray
    pelvis_drop: FloatArray
    lag: FloatArray
    lost: FloatArray
    feet: FloatArray

    def seam(self, frame: int) -> Seam:
        """What a window that begins with this frame must know."""
        return Seam(float(self.lag[frame]), self.lost[frame], self.feet[frame])


def synthesise(
    locomotion: Locomotion,
    style: Style,
    level: FloatArray,
    settings: PreparationSettings = DEFAULT_SETTINGS,
    optimise: bool = True,
    start: Seam | None = None,
    measure: bool = True,
    share: FloatArray | float = 1.0,
) -> Synthesis:
    """Blend, bring the root on its way, plant the feet, optimise the posture (paper, section 5).

    Args:
        locomotion: T frames.
        style: what is prepared for.
        level: (T,) level of preparation, 0 to 1.
        settings: every constant.
        optimise: whether to run the posture optimisation; without effect where the character has no `balancing` joints.
        start: state at the first frame, where this goes on from an earlier window.
        measure: whether to give the costs of the optimisation.
        share: () or (T,) factor on every blending weight, 0 to 1: the probability that there will be a target at all (see
            `simprep.controller.influence`).
    """
    start = start or Seam()
    source, fps, character = locomotion.qpos, locomotion.fps, locomotion.character
    root_weight, weights = joint_weights(level, character, settings)
    if np.any(np.asarray(share) != 1.0):
        root_weight, weights = root_weight * share, weights * np.reshape(share, (-1, 1))
    kinematics = forward_kinematics(source, character)
    qpos = source.copy()
    qpos[:, 7:] = (1 - weights) * source[:, 7:] + weights * style.qpos[..., 7:]  # Eq. 2
    path = blend_root(source[:, :7], style.qpos[..., :7], root_weight, locomotion.trend, (start.lag, start.lost))
    qpos[:, :2], qpos[:, 3:7] = path.position, path.quat
    touched = (root_weight > 0) | (weights > 0).any(axis=1)
    contacts = locomotion.contacts
    foot_error, drop, feet = np.zeros((len(qpos), 2)), np.zeros(len(qpos)), np.zeros((len(qpos), 2, 4))
    if touched.any() or np.any(start.feet):
        blended = forward_kinematics(qpos, character)  # at the locomotion's root height
        if settings.root_height == "mean":  # Eq. 5
            heights = np.s_[:, character.feet, 2]
            before, after = kinematics.xpos[heights] - source[:, 2:3], blended.xpos[heights] - source[:, 2:3]
            height = source[:, 2] - (after - before).mean(axis=1)
        else:  # the lowest point of each sole, and the supporting foot, instead of the mean of both feet
            sole = kinematics.foot_points[..., 2].min(axis=2)
            sole_goal = (1 - root_weight)[:, None] * sole + root_weight[:, None] * style.sole_height
            soles_after = blended.foot_points[..., 2].min(axis=2) - source[:, 2:3]
            height = (support_share(contacts, fps) * (sole_goal - soles_after)).sum(axis=1)
        qpos[:, 2] = np.where(touched, height, source[:, 2])
        planted = plant_feet(
            qpos, kinematics, contacts, root_weight, style.sole_height, fps, character, settings, start.feet
        )
        qpos, kinematics = planted.qpos, planted.kinematics
        foot_error, drop, feet = planted.foot_error, planted.pelvis_drop, planted.corrections
        contacts = contacts | resting_feet(kinematics.foot_points, root_weight, style, fps)
    elif start.lag or np.any(start.lost):
        kinematics = forward_kinematics(qpos, character)
    support = support_points(kinematics.foot_points, contacts)
    optimised, centre = None, np.full((len(qpos), 2), np.nan)
    if optimise and character.balancing and (level >= settings.threshold).any():
        centre = support_centre(*support)
        share = change_share(level, fps, settings)
        goals, posed = None, kinematics
        if settings.optimiser == "dynamic":
            displacement = DynamicBalance(kinematics.com, centre, fps, settings).solve()
            goals = kinematics.com[:, :2] + displacement
            shift = pelvis_shift(displacement, share, fps, settings.pelvis_reach)
            qpos, posed, _ = shift_pelvis(qpos, kinematics, shift, fps, character)
        optimised = optimise_postures(qpos, posed, centre, share, fps, character, settings, measure, goals)
        qpos = optimised.qpos
    elif measure:
        centre = support_centre(*support)
    return Synthesis(
        qpos, contacts, kinematics, root_weight, weights, support, centre, optimised, foot_error, drop,
        path.lag, path.lost, feet,
    )  # fmt: skip


def change_share(alpha: FloatArray, fps: float, settings: PreparationSettings = DEFAULT_SETTINGS) -> FloatArray:
    """Share (T,) of the posture change that is used at (T,) levels of preparation: 0 below the threshold, eased in time above."""
    share = np.zeros(len(alpha))
    ramp = settings.threshold_ramp * fps
    for first, after in stances(np.asarray(alpha >= settings.threshold)):
        frames = np.arange(first, after)
        since = np.inf if first == 0 else frames - first + 1.0
        until = np.inf if after == len(alpha) else after - frames + 0.0
        x = np.minimum(np.minimum(since, until) / (ramp + 1), 1.0)
        share[first:after] = smooth_step(x)
    return share


def resting_feet(foot_points: FloatArray, weight: FloatArray, style: Style, fps: float) -> BoolArray:
    """Feet (T, 2) that rest on the floor where the locomotion has them in the air, as blending has taken their swing away.

    A foot rests where it supports in the reference posture too, and its lowest point is within 1 cm of the height it has
    there and slower than 0.1 m/s, for at least 0.1 s.

    Args:
        foot_points: (T, 2, N, 3) of the blended motion [m].
        weight: (T,) blending weight of the root.
        style: what is prepared for.
        fps: frames per second [1/s].
    """
    resting = np.zeros(foot_points.shape[:2], dtype=bool)
    if len(foot_points) < 2:
        return resting
    speed = np.linalg.norm(np.gradient(foot_points, 1 / fps, axis=0), axis=-1)  # (T, 2, N)
    height = foot_points[..., 2] - weight[:, None, None] * style.sole_height[..., :, None]
    still = ((height < _RESTING_HEIGHT_M) & (speed < _RESTING_SPEED)).any(axis=2)
    still &= (weight > 0)[:, None] & style.contacts
    for side in (0, 1):
        for first, after in stances(still[:, side]):
            resting[first:after, side] = after - first >= _RESTING_TIME_S * fps
    return resting
