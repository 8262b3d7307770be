"""The body and the floor, and the body and itself: penetration, float, skating, self-collision.

Thresholds are those by which holosoma judges a retargeting, so that numbers compare: penetration deeper than 1 cm,
sliding above 0.01 m/s in contact, contact within 2 cm.
"""

import mujoco
import numpy as np
from scipy.ndimage import minimum_filter1d

from simprep.character import SIDES
from simprep.check.finding import INFO, Finding, graded
from simprep.check.subject import Subject
from simprep.motion.contacts import stances
from simprep.motion.self_contact import collision_model
from simprep.motion.set_down import set_down

PENETRATION_WARN_MM, PENETRATION_FAIL_MM = 10.0, 20.0
FLOAT_WARN_MM, FLOAT_FAIL_MM = 30.0, 45.0
"""Contact is known within 2 cm and penetration within 1: what is farther apart does not touch."""
SKATE_WARN_MM, SKATE_FAIL_MM = 50.0, 100.0
"""Within half a second: 0.1 and 0.2 m/s. Feet of captured people slide up to 45 mm where they turn or shuffle."""
SKATE_WINDOW_S = 0.5
EDGE_S = 0.03
"""Both ends of a stance are left out: contacts are not known more closely [s]."""
SLIDING_MPS = 0.01
FOOTING_WARN_MPS, FOOTING_FAIL_MPS = 0.3, 0.6
"""Something under a body rests, or hardly moves: 0.22 m/s in the captured dance that turns most."""
FOOTING_NEAR_M = 0.02
SELF_WARN_MM, SELF_FAIL_MM = 50.0, 80.0
"""Limbs of captured people that brush each other are in each other for a moment on any model: what lasts is a fault."""
HELD_S = 0.2
"""Time that an overlap of the body with itself must last [s]."""


def collisions(subject: Subject) -> tuple[Finding, Finding]:
    """The deepest overlap of the body with the floor, and with itself, by MuJoCo's collision detection."""
    scene = collision_model(subject.character)
    model = scene.model
    data = mujoco.MjData(model)
    floor, own = np.zeros(len(subject.motion)), np.zeros(len(subject.motion))
    floor_part = ""
    parts: dict[int, tuple[int, int]] = {}
    for frame, pose in enumerate(subject.motion.qpos):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        within = set(scene.own_contacts(data))
        for contact, (first, second) in enumerate(data.contact.geom[: data.ncon].tolist()):
            depth = -float(data.contact.dist[contact])
            if scene.is_floor(first) or scene.is_floor(second):
                if depth > floor.max():
                    floor_part = _body_of(model, second if scene.is_floor(first) else first)
                floor[frame] = max(floor[frame], depth)
            elif contact in within and depth > own[frame]:
                own[frame], parts[frame] = depth, (first, second)
    held = minimum_filter1d(own, max(1, round(HELD_S * subject.fps)), mode="nearest")
    at = int(np.argmax(held))
    own_part = " and ".join(_body_of(model, geom) for geom in parts.get(at, ()))
    return (
        graded(
            "penetration", 1e3 * float(floor.max()), "mm", PENETRATION_WARN_MM, PENETRATION_FAIL_MM,
            subject.frame(np.argmax(floor)), floor_part,
            f"in {100 * (1e3 * floor > PENETRATION_WARN_MM).mean():.0f} % of the frames",
        ),
        graded(
            "self-collision", 1e3 * float(held[at]), "mm", SELF_WARN_MM, SELF_FAIL_MM, subject.frame(at), own_part,
            f"for {HELD_S:g} s; {1e3 * own.max():.0f} mm at the deepest moment" if own.any() else "",
        ),
    )  # fmt: skip


def _body_of(model: mujoco.MjModel, geom: int) -> str:
    return str(model.body(int(model.geom_bodyid[geom])).name)


def floating(subject: Subject) -> Finding:
    """How far the body is off the floor while it does not fall freely (`simprep.motion.set_down`)."""
    lowered = set_down(subject.motion.qpos, subject.fps, subject.character)
    frame = int(np.argmax(lowered))
    return graded(
        "float", 1e3 * float(lowered[frame]), "mm", FLOAT_WARN_MM, FLOAT_FAIL_MM, subject.frame(frame), "lowest point",
        f"in {100 * (1e3 * lowered > FLOAT_WARN_MM).mean():.0f} % of the frames",
    )  # fmt: skip


def skating(subject: Subject) -> tuple[Finding, Finding]:
    """How far a standing foot slides within half a second, and the share of contact that slides by holosoma's measure.

    The point of the sole that moves least counts, so neither rolling nor pivoting is sliding.
    """
    points = subject.kinematics.foot_points[..., :2]
    window, edge = max(1, round(SKATE_WINDOW_S * subject.fps)), max(1, round(EDGE_S * subject.fps))
    farthest, frame, part = 0.0, None, ""
    sliding = counted = 0
    for side, name in enumerate(SIDES):
        for first, after in stances(subject.standing[:, side]):
            stance = points[first + edge : after - edge, side]
            if len(stance) < 2:
                continue
            span = min(window, len(stance) - 1)
            way = np.linalg.norm(stance[span:] - stance[:-span], axis=-1).min(axis=-1)
            speed = np.linalg.norm(np.diff(stance, axis=0), axis=-1).min(axis=-1) * subject.fps
            sliding, counted = sliding + int((speed > SLIDING_MPS).sum()), counted + len(speed)
            if way.max() > farthest:
                farthest, frame, part = float(way.max()), subject.frame(first + edge + np.argmax(way)), f"{name} foot"
    share = sliding / counted if counted else None
    return (
        graded("skating", 1e3 * farthest, "mm", SKATE_WARN_MM, SKATE_FAIL_MM, frame, part, "within half a second of a stance"),
        Finding("sliding contact", INFO, share, "of the contact", note=f"faster than {SLIDING_MPS:g} m/s, as holosoma counts"),
    )  # fmt: skip


def footing(subject: Subject) -> Finding:
    """Median speed of the stillest point of both soles while one is on the floor: does the body stand on anything.

    What rolls, crawls or lies stands on something else, and is not judged then.
    """
    points = subject.kinematics.foot_points.reshape(len(subject.motion), -1, 3)
    speed = np.linalg.norm(np.diff(points[..., :2], axis=0), axis=-1) * subject.fps
    height = np.maximum(points[1:, :, 2], points[:-1, :, 2])
    near = height < np.maximum(height.min(axis=1), 0.0)[:, None] + FOOTING_NEAR_M
    on_floor = (np.abs(subject.clearance[1:]) < FOOTING_NEAR_M) & (height.min(axis=1) < FOOTING_NEAR_M)
    on_floor &= subject.clearance_of_others[1:] > FOOTING_NEAR_M
    stillest = np.where(near, speed, np.inf).min(axis=1)
    known = on_floor & np.isfinite(stillest)
    value = float(np.median(stillest[known])) if known.any() else float("nan")
    return graded(
        "footing", value, "m/s", FOOTING_WARN_MPS, FOOTING_FAIL_MPS,
        subject.frame(np.argmax(np.where(known, stillest, 0.0))), "soles", "median speed of the stillest point on the floor",
    )  # fmt: skip
