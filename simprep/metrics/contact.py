"""Contact: do the feet stay where they stand, and does the body stay above the floor."""

from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.motion.contacts import stances
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion

SLIP_HZ = 60.0
CARRYING_HEIGHT_M = 0.005
SLIP_FLOOR_MM_PER_STANCE = 1.0
STANCE_EDGE_S = 1.0 / 60.0
"""Left out at both ends of a stance: half a frame of 30 Hz capture, as contacts are not known more closely."""

_GAP_S = 0.06


@dataclass(frozen=True)
class FootSlip:
    """Slip of both feet together: how far carrying foot points slide while their foot is in contact.

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


def sphere_slip(centres: FloatArray, rotations: FloatArray, radius: FloatArray) -> FloatArray:
    """Horizontal distance (n - 1, ...) that spheres on the floor slide between frames [m].

    The smaller of two travels counts: that of the sphere's lowest point, and that of the material at it. So neither
    rolling (the material rests) nor turning on the spot (the point rests) is slip. The material travels by the centre's
    step plus that of the arm from the centre to the floor, averaged over both directions of time. Hides rubbing on the
    spot, at most radius times angle turned.

    Args:
        centres: (n, ..., 3) sphere centres [m].
        rotations: (n, ..., 3, 3) orientations of the bodies that carry them.
        radius: (...) [m].
    """
    turn = rotations[1:] @ np.swapaxes(rotations[:-1], -1, -2)
    # arm = radius * (0, 0, -1): forward (turn - 1) arm, backward (1 - turn^T) arm
    arm_step = -0.5 * radius[..., None] * (turn[..., :, 2] - turn[..., 2, :])
    point = np.diff(centres, axis=0)[..., :2]
    material = point + arm_step[..., :2]
    return np.asarray(np.minimum(np.linalg.norm(point, axis=-1), np.linalg.norm(material, axis=-1)))


def foot_slip(motion: Motion) -> FootSlip:
    """How far feet in contact slide.

    Counts every interval with the foot in contact at both ends, except the first and last 1/60 s of a stance. Frames
    are taken at about 60 Hz, so that noise does not add up with the frame rate. Carrying points are the spheres at most
    5 mm above the foot's lowest one; their slip (`sphere_slip`) is averaged. Captures sliding and pivoting; rolling
    from heel to toe is not slip. Hides touch-down and lift-off, which rule set the contacts, and a foot that hovers.

    Args:
        motion: at least 2 frames, with its contacts (measured ones for a simulated motion).
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


def stance_drift(motion: Motion) -> FloatArray:
    """Horizontal distance (S,) that each stance slides from its first third to its last, left foot's first [m].

    In `foot_slip` measurement noise adds up to slip; here it averages out. The point of the sole that moves least
    counts, so neither rolling nor pivoting is drift. Hides sliding there and back. Stances under 3 frames are left out.
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
    """Slip of a simulated motion over its reference's, per second of motion; NaN without a duration or stance.

    Not per stance, as a foot that chatters makes many short ones. A reference counts as slipping at least 1 mm per
    stance: against feet that hardly move any simulation would look bad.

    Args:
        simulated: slip with the measured contacts.
        reference: slip of the reference over the same time, with its own contacts.
    """
    if simulated.duration_s <= 0 or reference.duration_s <= 0 or reference.stance_count == 0:
        return float("nan")
    least = 1e-3 * SLIP_FLOOR_MM_PER_STANCE * reference.stance_count
    return (simulated.travel_m / simulated.duration_s) / (max(reference.travel_m, least) / reference.duration_s)


def floor_penetration(motion: Motion) -> FloatArray:
    """Depth (T,) of the deepest point of any colliding geom below the floor z = 0, 0 or more [m].

    Exact for spheres and capsules, which our humanoid collides with. Hides self-penetration and obstacles.
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


def _foot_frames(qpos: FloatArray, character: Character) -> tuple[FloatArray, FloatArray]:
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


def _inner_stance(contact: BoolArray, gap: float, edge: int) -> BoolArray:
    """Stances without their edges. Shorter gaps are closed first; the ends of the motion are no edges."""
    closed = contact.copy()
    for first, after in stances(~contact):
        if first > 0 and after < len(contact) and after - first < gap:
            closed[first:after] = True
    inner = np.zeros_like(closed)
    for first, after in stances(closed):
        begin = first + edge if first > 0 else first
        inner[begin : after - edge if after < len(closed) else after] = True
    return inner
