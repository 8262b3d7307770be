"""What `balance` works out of a reference in advance, and its settings."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.errors import SettingError
from simprep.motion.rotations import rotation_matrix
from simprep.physics.balance_preview import ComPlan, com_plan
from simprep.physics.bodies import SceneBody
from simprep.physics.inverse_dynamics import contact_candidates
from simprep.physics.reference import Reference


@dataclass(frozen=True)
class BalanceSettings:
    """Configuration of `balance`. Stiffness is of the acceleration, in 1/s²; damping is critical (twice its root).

    Attributes:
        rate: how often it decides [1/s], rounded to whole steps.
        smoothing: standard deviation of the Gaussian over velocities before their derivative is taken [s].
        joint: stiffness of the joints towards the reference.
        orientation: of the root's orientation.
        com: of the root's horizontal place.
        height: of the COM's height.
        foot: of a swinging foot's place.
        landing: of the points that should touch the floor already, towards it.
        slip: damping of the contact points, which should rest [1/s].
        joint_weight: price of squared errors of each joint's acceleration.
        root_weight: of the root's linear acceleration.
        orientation_weight: of its angular one.
        com_weight: of the COM's.
        contact_weight: of the contact points', four times, shared by all.
        landing_weight: of the late points', shared by all.
        foot_weight: of a swinging foot's.
        margin: the centre of pressure is planned this far within the corners of the support polygon [m].
        place_price: what the COM's distance from the reference costs, as a share of that of the centre of pressure from its place
            (`simprep.physics.balance_preview`).
        step_share: share of the error of the extrapolated COM by which a swinging foot is put elsewhere.
        longest_step: largest such change [m].
        step_height: feet that the reference lifts higher than this swing freely [m]; step_band: the height below it over which
            the price falls to 0 [m].
        extra_lacking: a foot makes a step that the reference does not have, if the extrapolated COM is out of the feet's reach by
            this [m]; extra_s: how long it takes [s]; extra_height: how high it goes [m]; extra_soon: none is made where the reference
            lifts a foot within this time [s].
        reach: points up to this height above the floor can bear load [m].
        planned: if the reference has them up to this height [m].
        late: points that the reference has up to this height should touch the floor [m].
        friction: coefficient of the pyramid in which contact forces are planned.
        regularisation: price of squared contact forces (`simprep.physics.contact_forces.best_motion`).

    Raises:
        SettingError: a number that is not positive; shares, weights and prices may be 0.
    """

    rate: float = 96.0
    smoothing: float = 0.03
    joint: float = 400.0
    orientation: float = 100.0
    com: float = 40.0
    height: float = 100.0
    foot: float = 400.0
    landing: float = 900.0
    slip: float = 20.0
    joint_weight: float = 2.0
    root_weight: float = 1.0
    orientation_weight: float = 50.0
    com_weight: float = 100.0
    contact_weight: float = 30.0
    landing_weight: float = 50.0
    foot_weight: float = 50.0
    margin: float = 0.05
    place_price: float = 0.1
    step_share: float = 1.0
    longest_step: float = 0.6
    step_height: float = 0.15
    step_band: float = 0.05
    extra_lacking: float = 0.03
    extra_s: float = 0.3
    extra_height: float = 0.06
    extra_soon: float = 0.2
    reach: float = 0.005
    planned: float = 0.01
    late: float = 0.004
    friction: float = 0.9
    regularisation: float = 0.002

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            may_be_0 = name.endswith("weight") or name in (
                "step_share",
                "longest_step",
                "smoothing",
                "regularisation",
                "margin",
                "place_price",
            )
            if not (0 <= value < np.inf if may_be_0 else 0 < value < np.inf):
                raise SettingError(f"balance: {name} {value}; valid: {'0 or more' if may_be_0 else 'above 0'}")


@dataclass(frozen=True)
class BalanceReference:
    """A reference with what `balance` needs at every step.

    Attributes:
        reference: the reference, N + 1 steps.
        qacc: (N + 1, nv) its accelerations.
        com_velocity: (N + 1, 3) of the whole body [m/s].
        com_acceleration: (N + 1, 3) [m/s²].
        foot_velocity: (N + 1, 2, 3) of the left and right foot's segment [m/s].
        foot_acceleration: (N + 1, 2, 3) [m/s²].
        segment: (points,) whose points may touch the floor, as index in the body's segments.
        place: (points, 3) in the segment's frame [m].
        radius: (points,) of a ball about it [m].
        height: (N + 1, points) of the balls' lowest points in the reference [m].
        plan: where the COM should go.
        lifted_in: (N + 1, 2) time until the left and right foot bear nothing [s]; 0 if they bear nothing now.
    """

    reference: Reference
    qacc: FloatArray
    com_velocity: FloatArray
    com_acceleration: FloatArray
    foot_velocity: FloatArray
    foot_acceleration: FloatArray
    segment: IndexArray
    place: FloatArray
    radius: FloatArray
    height: FloatArray
    plan: ComPlan
    lifted_in: FloatArray


def balance_reference(reference: Reference, body: SceneBody, settings: BalanceSettings) -> BalanceReference:
    """Work out what `balance` needs of a reference.

    Args:
        reference: what the body tracks.
        body: who.
        settings: smoothing, and which points count as planned contacts.
    """
    model, fps, kinematics = body.character.model, reference.motion.fps, reference.kinematics
    sigma = settings.smoothing * fps
    candidates = contact_candidates(model)
    segment, radius = candidates.body - 1, candidates.radius
    turns = rotation_matrix(model.geom_quat[candidates.geom])
    place = model.geom_pos[candidates.geom] + np.einsum("nij,nj->ni", turns, candidates.centre)
    upward = rotation_matrix(kinematics.xquat)[:, :, 2]
    height = np.einsum("tni,ni->tn", upward[:, segment], place) + kinematics.xpos[:, segment, 2] - radius
    used = np.flatnonzero(height.min(axis=0) < settings.planned)
    turned = rotation_matrix(kinematics.xquat)[:, segment[used]]
    points = np.einsum("tnij,nj->tni", turned, place[used]) + kinematics.xpos[:, segment[used]]
    bears = height[:, used] < settings.planned
    qacc = np.gradient(_smooth(reference.qvel, sigma), 1 / fps, axis=0)
    com_velocity, com_acceleration = _derivatives(kinematics.com, fps, sigma)
    foot_velocity, foot_acceleration = _derivatives(kinematics.xpos[:, list(body.feet)], fps, sigma)
    return BalanceReference(
        reference=reference,
        qacc=qacc,
        com_velocity=com_velocity,
        com_acceleration=com_acceleration,
        foot_velocity=foot_velocity,
        foot_acceleration=foot_acceleration,
        segment=segment[used],
        place=place[used],
        radius=radius[used],
        height=np.ascontiguousarray(height[:, used]),
        plan=com_plan(reference, qacc, points[..., :2], bears, settings.margin, settings.place_price),
        lifted_in=np.stack(
            [_time_until(~bears[:, segment[used] == foot].any(axis=1), fps) for foot in body.feet], axis=1
        ),
    )


def _smooth(values: FloatArray, sigma: float) -> FloatArray:
    return np.asarray(gaussian_filter1d(values, sigma, axis=0, mode="nearest") if sigma > 0 else values)


def _derivatives(path: FloatArray, fps: float, sigma: float) -> tuple[FloatArray, FloatArray]:
    """Velocity as it is, and acceleration of the smoothed velocity."""
    velocity = np.gradient(path, 1 / fps, axis=0)
    return velocity, np.gradient(_smooth(velocity, sigma), 1 / fps, axis=0)


def _time_until(happens: BoolArray, fps: float) -> FloatArray:
    """Time (N + 1,) until something happens next, or until the end [s]."""
    frames = np.arange(len(happens))
    following = np.where(happens, frames, len(happens) - 1)
    return np.asarray((np.minimum.accumulate(following[::-1])[::-1] - frames) / fps)
