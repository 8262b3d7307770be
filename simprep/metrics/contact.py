"""Contact: do the feet stay where they stand, and does the body stay above the floor."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.character import Character
from simprep.motion.contacts import stances
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion

SLIP_HZ = 60.0
CARRYING_HEIGHT_M = 0.005
SLIP_FLOOR_MM_PER_STANCE = 1.0
STANCE_EDGE_S = 1.0 / 60.0
"""Left out at both ends of a stance: half a frame of 30 Hz capture, better than which its contacts are not known."""

_GAP_S = 0.06


@dataclass(frozen=True)
class FootSlip:
    """Slip of the carrying foot points while their foot is in contact, both feet together.

    Attributes:
        travel_m: path length slipped [m].
        contact_s: time in contact that was measured, summed over feet [s].
        duration_s: length of the motion [s].
        stance_count: stances; contact gaps under 0.06 s do not end one.
        stance_travel_m: path length slipped in each of them, left foot's first [m].
    """

    travel_m: float
    contact_s: float
    duration_s: float
    stance_count: int
    stance_travel_m: tuple[float, ...] = ()

    @property
    def mm_per_stance(self) -> float:
        """Slip per stance [mm]; NaN without a stance."""
        return 1e3 * self.travel_m / self.stance_count if self.stance_count else float("nan")

    @property
    def contact_m_per_s(self) -> float:
        """Mean slip speed during contact [m/s]; NaN without contact."""
        return self.travel_m / self.contact_s if self.contact_s > 0 else float("nan")


def sphere_slip(
    centres: NDArray[np.float64], rotations: NDArray[np.float64], radius: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance that spheres on the floor slide between frames.

    When a sphere rolls, its lowest point travels while the material there rests. When a foot turns about its lowest
    point, that point rests while the material rubs on the spot. Neither is skating, so the smaller of both travels
    counts: that of the lowest point, and that of the material at it. The latter is the centre's step plus that of the
    arm from the centre to the floor under the rotation, forward and backward averaged, so that the direction of time
    does not matter. Hides rubbing on the spot, at most radius times angle turned.

    Args:
        centres: (n, ..., 3) sphere centres [m].
        rotations: (n, ..., 3, 3) orientations of the bodies that carry them.
        radius: (...) [m].

    Returns:
        (n - 1, ...) horizontal slip [m].
    """
    turn = rotations[1:] @ np.swapaxes(rotations[:-1], -1, -2)
    # arm = radius * (0, 0, -1): forward (turn - 1) arm, backward (1 - turn^T) arm
    arm_step = -0.5 * radius[..., None] * (turn[..., :, 2] - turn[..., 2, :])
    point = np.diff(centres, axis=0)[..., :2]
    material = point + arm_step[..., :2]
    return np.asarray(np.minimum(np.linalg.norm(point, axis=-1), np.linalg.norm(material, axis=-1)))


def foot_slip(motion: Motion) -> FootSlip:
    """How far feet in contact slide.

    Every interval with the foot in contact at both ends counts, but for the first and last 1/60 s of a stance, sampled
    at about 60 Hz (every k-th frame, so that noise does not add up with the frame rate). The carrying points are those
    of the spheres under a foot at most 5 mm above the foot's lowest; their slip (`sphere_slip`) is averaged. Rolling
    from heel over ball to toe is not slip. It captures sliding and pivoting; it hides the very moments of touch-down
    and lift-off, which contact rule set the flags, and a foot that hovers.

    Args:
        motion: a motion of at least 2 frames, with its contact flags (measured ones for a simulated motion).

    Returns:
        FootSlip.
    """
    model = motion.character.model
    feet = motion.character.sole_geoms
    stride = max(1, round(motion.fps / SLIP_HZ))
    centres, rotations = _foot_frames(motion.qpos[::stride], motion.character)
    radius = model.geom_size[feet, 0]
    slip = sphere_slip(centres, rotations, radius)  # (n - 1, 2, N)
    bottom = centres[..., 2] - radius
    height = (bottom[1:] + bottom[:-1]) / 2
    carrying = height <= height.min(axis=2, keepdims=True) + CARRYING_HEIGHT_M
    travel = (slip * carrying).sum(axis=2) / carrying.sum(axis=2)
    edge = int(np.ceil(STANCE_EDGE_S * motion.fps - 0.5 - 1e-9))
    inner = np.stack([_inner_stance(motion.contacts[:, side], _GAP_S * motion.fps, edge) for side in (0, 1)], axis=1)
    counts = (inner & motion.contacts)[::stride]
    stands = counts[1:] & counts[:-1]
    interval = stride / motion.fps
    per_stance: list[float] = []
    for side in (0, 1):
        counted = np.where(stands[:, side], travel[:, side], 0.0)
        # an interval counts from its first frame on, which lies in the stance, as its last one does
        edges = [-(-np.array(one) // stride) for one in stances(inner[:, side])]
        per_stance += [float(counted[first:after].sum()) for first, after in edges]
    return FootSlip(
        travel_m=float(travel[stands].sum()),
        contact_s=float(stands.sum()) * interval,
        duration_s=len(stands) * interval,
        stance_count=len(per_stance),
        stance_travel_m=tuple(per_stance),
    )


def stance_drift(motion: Motion) -> NDArray[np.float64]:
    """How far each stance slides from its first third to its last: the net way of the foot's stillest point.

    `foot_slip` adds up every millimetre of a path, so measurement noise of a few millimetres per frame (a third of
    a degree in every joint) looks like decimetres of skating; here it averages out. The point of a sole that moves
    least counts, so neither rolling from heel to toe nor pivoting is drift. Hides sliding there and back within a
    stance.

    Args:
        motion: a motion with its contact flags.

    Returns:
        (S,) horizontal way of every stance, left foot's first [m]; stances under 3 frames are left out.
    """
    points = forward_kinematics(motion.qpos, motion.character).foot_points[..., :2]
    out = []
    for side in (0, 1):
        for first, after in stances(motion.contacts[:, side]):
            third = (after - first) // 3
            if third:
                begin = np.median(points[first : first + third, side], axis=0)
                end = np.median(points[after - third : after, side], axis=0)
                out.append(float(np.linalg.norm(end - begin, axis=-1).min()))
    return np.array(out)


def slip_ratio(simulated: FootSlip, reference: FootSlip) -> float:
    """Slip of a simulated motion over its reference's, per second of motion.

    Per second of motion and not per stance, as a foot that chatters makes many short stances. References whose feet
    hardly move would make any simulation look bad, so a reference counts as slipping at least 1 mm per stance.

    Args:
        simulated: slip with the measured contacts.
        reference: slip of the reference over the same time, with its own contacts.

    Returns:
        The ratio; NaN where either has no duration or the reference no stance.
    """
    if simulated.duration_s <= 0 or reference.duration_s <= 0 or reference.stance_count == 0:
        return float("nan")
    least = 1e-3 * SLIP_FLOOR_MM_PER_STANCE * reference.stance_count
    return (simulated.travel_m / simulated.duration_s) / (max(reference.travel_m, least) / reference.duration_s)


def floor_penetration(motion: Motion) -> NDArray[np.float64]:
    """Deepest point of any colliding geom below the floor z = 0, per frame.

    Exact for spheres and capsules, which our humanoid collides with. Hides self-penetration and obstacles.

    Returns:
        (T,) depth [m], 0 or more.
    """
    model = motion.character.model
    data = mujoco.MjData(model)
    geoms = np.flatnonzero(model.geom_contype > 0)
    capsule = model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_CAPSULE
    radius = model.geom_size[geoms, 0]
    half = np.where(capsule, model.geom_size[geoms, 1], 0.0)
    depth = np.empty(len(motion))
    for frame in range(len(motion)):
        data.qpos[:] = motion.qpos[frame]
        mujoco.mj_kinematics(model, data)
        lowest = data.geom_xpos[geoms, 2] - half * np.abs(data.geom_xmat[geoms, 8]) - radius
        depth[frame] = max(0.0, -lowest.min())
    return depth


def _foot_frames(qpos: NDArray[np.float64], character: Character) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    model = character.model
    data = mujoco.MjData(model)
    feet = character.sole_geoms
    bodies = model.geom_bodyid[feet]
    centres, rotations = np.empty((len(qpos), *feet.shape, 3)), np.empty((len(qpos), *feet.shape, 3, 3))
    for frame in range(len(qpos)):
        data.qpos[:] = qpos[frame]
        mujoco.mj_kinematics(model, data)
        centres[frame] = data.geom_xpos[feet]
        rotations[frame] = data.xmat[bodies].reshape(*feet.shape, 3, 3)
    return centres, rotations


def _inner_stance(contact: NDArray[np.bool_], gap: float, edge: int) -> NDArray[np.bool_]:
    """Stances without their edges; shorter gaps are closed first, and the ends of the motion are no edges."""
    closed = contact.copy()
    for first, after in stances(~contact):
        if first > 0 and after < len(contact) and after - first < gap:
            closed[first:after] = True
    inner = np.zeros_like(closed)
    for first, after in stances(closed):
        begin = first + edge if first > 0 else first
        inner[begin : after - edge if after < len(closed) else after] = True
    return inner
