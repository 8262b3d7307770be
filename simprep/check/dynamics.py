"""Could the floor produce the motion: support, zero moment point, margin of stability; and does its time run true."""

from itertools import pairwise

import numpy as np

from simprep.arrays import FloatArray
from simprep.check.finding import INFO, PASS, WARN, Finding, graded
from simprep.check.subject import Subject
from simprep.humanoid_model import GRAVITY
from simprep.metrics.balance import extrapolated_com
from simprep.metrics.dynamics import residual_wrench
from simprep.motion.contacts import stances
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.rotations import rotation_matrix, unwrapped
from simprep.motion.support import signed_distance, support_points
from simprep.physics.whole_body import zero_moment_point

SUPPORT_WARN, SUPPORT_FAIL = 1.0, 2.0
"""Mean force that no floor contact could supply, in body weights: captured runs reach 0.8."""
NEAR_M = 0.03
"""Soles this near to the floor can bear load [m]."""
STRIDE = 4
"""Of the 60 Hz frames: contact problems are solved at 15 Hz."""
FALL_WARN, FALL_FAIL = 2.5, 3.2
LEAST_FALL, SLOW_FALL = 0.15, 0.5
"""Falling in flight, in g: the square of how much too fast time runs. Captured flights read 0.7 to 2.4, being short; a
body that does not fall at all floats."""
FLIGHT_M, FLIGHT_S, HOP_M = 0.02, 0.08, 0.03
SLOW_FLIGHT_S = 0.3
"""Flights are real if the body leaves the floor by `HOP_M`; slow ones, if they last besides."""
PULL_SHARE = 0.35
"""Largest share of time in which captured motions accelerate downwards faster than gravity, by noise."""
STORED_WARN, STORED_FAIL = 1.1, 1.5
"""Frame rate taken against the one that stored velocities fit: smoothed velocities read a few percent low."""
STEP_SHARE, FEWEST_STEPS, SHORTEST_STANCE_S = 0.2, 3, 0.05
MOST_TURN = np.radians(45.0)
"""A step that turns the pelvis farther does not walk on, it turns around. Captured walks turn it by 4 to 24 degrees a step."""
DOUBLE_M, DOUBLE_SHARE = 0.015, 0.18
"""Who walks has both soles this near to the floor for such a share of the time; who runs has not."""
USUAL_CADENCE = 0.6
CADENCE_WARN, CADENCE_FAIL = 0.8, 1.2
"""Steps per second times sqrt(height of the standing centre of mass / g): people walk at 0.5 to 0.7, racing walkers at 1."""


def support(subject: Subject) -> tuple[Finding, Finding, Finding]:
    """Force that no floor contact could supply, distance of the ZMP from the soles, and margin of stability.

    Points of the soles within 3 cm of the floor may push. While hands or knees bear load the numbers mean nothing; then
    they are not judged.
    """
    smooth, body = subject.smooth, subject.body
    model = subject.character.model
    weight = float(model.body_mass.sum()) * GRAVITY
    kinematics = subject.kinematics
    nearest = np.clip(np.round(smooth.time * subject.fps).astype(int), 0, len(subject.motion) - 1)
    points = kinematics.foot_points[nearest].reshape(len(nearest), -1, 3)
    mask = points[..., 2] < NEAR_M
    others = subject.clearance[nearest] < points[..., 2].min(axis=1) - 0.02
    rows = np.flatnonzero(smooth.interior)[::STRIDE]
    feet_only = others[rows].mean() < 0.1 if len(rows) else False
    force, _ = residual_wrench(body.com[rows], body.force[rows], body.torque[rows], points[rows], mask[rows])
    share = force / weight
    zmp = zero_moment_point(body.com, body.force, body.torque, weight)
    zmp[~smooth.interior] = np.nan
    floor, on_floor = support_points(
        kinematics.foot_points[nearest], (kinematics.foot_points[nearest][..., 2].min(axis=-1) < NEAR_M)
    )
    outside = -signed_distance(floor, on_floor, zmp)
    margin = signed_distance(floor, on_floor, extrapolated_com(body.com, body.com_velocity))
    known = outside[np.isfinite(outside)]
    margins = 1e3 * margin[np.isfinite(margin)]
    others_note = "" if feet_only else "; means nothing here, as more than the feet bears load"
    moment = Finding(
        "zero moment point", INFO, 1e3 * float(np.percentile(known, 75)) if len(known) else None, "mm",
        note=f"75th percentile outside the soles; inside {100 * (known <= 0).mean():.0f} % of the time"
        + others_note if len(known) else "no frame in which a foot bears load",
    )  # fmt: skip
    mos = Finding(
        "margin of stability", INFO, float(np.percentile(margins, 5)) if len(margins) else None, "mm",
        note="5th percentile of the extrapolated COM (Hof 2005) inside the soles",
    )  # fmt: skip
    if not feet_only:
        note = "not judged: more than the feet bears load"
        return Finding("support", PASS, None, "body weights", SUPPORT_WARN, SUPPORT_FAIL, note=note), moment, mos
    at = rows[int(np.argmax(share))] if len(rows) else 0
    supported = graded(
        "support", float(share.mean()) if len(share) else np.nan, "body weights", SUPPORT_WARN, SUPPORT_FAIL,
        subject.frame(nearest[at]), "", "mean force that no floor contact could supply",
    )  # fmt: skip
    return supported, moment, mos


def frame_rate(subject: Subject) -> tuple[Finding, Finding]:
    """Whether time runs true: how fast the body falls in flight, and how fast it steps for its height.

    Only gravity knows the time. A motion that stands all the time and strikes shows a wrong frame rate in its joint
    velocities and torques alone.
    """
    return _fall(subject), _cadence(subject)


def stored_rate(fps: float, velocity_fps: float) -> Finding:
    """Whether stored joint velocities are those of the angles at the frame rate that the motion is taken at.

    Args:
        fps: frame rate taken [1/s].
        velocity_fps: the one that the velocities fit [1/s].
    """
    ratio = max(fps / velocity_fps, velocity_fps / fps)
    return graded(
        "frame rate: velocities", ratio, "times", STORED_WARN, STORED_FAIL,
        note=f"{fps:g} frames per second taken, the stored joint velocities fit {velocity_fps:.1f}",
    )  # fmt: skip


def _fall(subject: Subject) -> Finding:
    name, unit = "frame rate: fall", "g"
    rates, weights, frames = [], [], []
    for first, after in flights(subject):
        rates.append(-_acceleration(subject.kinematics.com[first:after, 2], subject.fps) / GRAVITY)
        weights.append((after - first) ** 2)  # a short arc tells little of its curvature
        frames.append(first)
    vertical = subject.body.force[subject.smooth.interior, 2]
    weight = float(subject.character.model.body_mass.sum()) * GRAVITY
    pulled = float((vertical < -0.1 * weight).mean()) if len(vertical) else 0.0
    fall = float(np.average(rates, weights=weights)) if rates else float("nan")
    said = f"{len(rates)} flights; pulled down {100 * pulled:.0f} % of the time"
    at = subject.frame(frames[0]) if frames else None
    if pulled > PULL_SHARE and not fall > FALL_WARN:
        return Finding(
            name, WARN, fall if rates else None, unit, FALL_WARN, FALL_FAIL, at, "whole body",
            f"{said}, which only the floor could do: the true frame rate may be lower",
        )  # fmt: skip
    longest = max((after - first for first, after in flights(subject)), default=0) / subject.fps
    if LEAST_FALL < fall < SLOW_FALL and longest > SLOW_FLIGHT_S:
        true = subject.fps / np.sqrt(fall)
        return Finding(
            name, WARN, fall, unit, FALL_WARN, FALL_FAIL, at, "flights",
            f"{said}; falls too slowly: the true frame rate may be {true:.0f}",
        )  # fmt: skip
    note = f"{said}; the true frame rate may be {subject.fps / np.sqrt(fall):.0f}" if fall > FALL_WARN else said
    return graded(name, fall, unit, FALL_WARN, FALL_FAIL, at, "flights", note)


def flights(subject: Subject) -> list[tuple[int, int]]:
    """First frame and frame after the last of every time in the air that is long enough to be measured."""
    return [
        (first, after)
        for first, after in stances(subject.clearance > FLIGHT_M)
        if after - first >= max(4, FLIGHT_S * subject.fps)
        and first > 0
        and after < len(subject.clearance)
        and subject.clearance[first:after].max() > HOP_M
    ]


def _acceleration(height: FloatArray, fps: float) -> float:
    return float(2 * np.polyfit(np.arange(len(height)) / fps, height, 2)[0])


def _cadence(subject: Subject) -> Finding:
    """Median rate of alternating footfalls that carry the body on, made dimensionless by the pendulum of the body's height."""
    name, unit = "frame rate: steps", "of the pendulum"
    height = pendulum_height(subject)
    com = subject.kinematics.com[:, :2]
    ahead = rotation_matrix(subject.motion.qpos[:, 3:7])[:, :2, 0]
    yaw = unwrapped(np.arctan2(ahead[:, 1], ahead[:, 0]))
    falls = sorted(
        (first, side)
        for side in (0, 1)
        for first, after in stances(subject.standing[:, side])
        if first > 0 and after - first >= SHORTEST_STANCE_S * subject.fps
    )
    gaps = [
        (later - earlier) / subject.fps
        for (earlier, one), (later, other) in pairwise(falls)
        if one != other
        and np.linalg.norm(com[later] - com[earlier]) > STEP_SHARE * height
        and abs(yaw[later] - yaw[earlier]) < MOST_TURN
    ]
    low = subject.kinematics.foot_points[..., 2].min(axis=-1).max(axis=1) < DOUBLE_M
    if len(gaps) < FEWEST_STEPS or low.mean() < DOUBLE_SHARE or flights(subject):
        return Finding(name, PASS, None, unit, CADENCE_WARN, CADENCE_FAIL, note="no walk: too few steps, or a run")
    cadence = 1 / float(np.median(gaps))
    value = cadence * np.sqrt(height / GRAVITY)
    note = f"{cadence:.1f} steps/s, centre of mass {height:.2f} m high"
    if value > CADENCE_WARN:
        note += f": the true frame rate may be {subject.fps * USUAL_CADENCE / value:.0f}"
    return graded(name, value, unit, CADENCE_WARN, CADENCE_FAIL, subject.frame(falls[0][0]), "feet", note)


def pendulum_height(subject: Subject) -> float:
    """Height of the centre of mass of the standing character over its soles [m]."""
    standing = forward_kinematics(subject.character.standing_qpos[None], subject.character)
    return float(standing.com[0, 2] - standing.foot_points[..., 2].min())
