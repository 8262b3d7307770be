"""Where the joints of our body should be: the source's bone directions with our bone lengths, root aligned.

The residual of an import is measured against these targets, so they do not depend on what our joints can do.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import BoolArray, FloatArray
from simprep.character import ROLES, SIDES, Character
from simprep.motion.joint_map import JointMap
from simprep.motion.normalise import Normalised

HEAD, LEFT_HAND, RIGHT_HAND, LEFT_FOOT, RIGHT_FOOT = (
    ROLES.index(name) for name in ("head", "left_hand", "right_hand", "left_foot", "right_foot")
)
ORIENTED = (HEAD, LEFT_HAND, RIGHT_HAND, LEFT_FOOT, RIGHT_FOOT)
"""Roles whose orientation the joint positions leave open."""

SHORTEST_FOOT = 0.04
"""A toe less than this ahead of its ankle, in plan, tells no direction [m]."""
UPRIGHT = 0.45
"""A leg stands if its shank rises by at least this share of its length; else it kneels or lies."""
STILL_SPEED = 0.25
"""An ankle slower than this, and low, stands on a flat foot [m/s]."""


@dataclass(frozen=True)
class Targets:
    """Targets of the retargeting, in the world, z up.

    Attributes:
        positions: (T, 17, 3) targets of the segments' origins, in the order of `simprep.character.ROLES` [m].
        orientations: (T, 5, 3, 3) targets of the roles in `ORIENTED`.
        oriented: (5,) which of these the source tells.
        fps: frames per second [1/s].
        step: (3,) displacement over one cycle [m], or None.
        warnings: what could not be told.
        travel_kept: whether the path over the floor is the recorded one, which must not be moved.
        stride: frames per frame of the result.
    """

    positions: FloatArray
    orientations: FloatArray
    oriented: BoolArray
    fps: float
    step: FloatArray | None
    warnings: tuple[str, ...] = ()
    travel_kept: bool = False
    stride: int = 1

    def output(self) -> "Targets":
        """The targets at the frame rate of the result."""
        every = slice(None, None, self.stride)
        return replace(
            self,
            positions=self.positions[every],
            orientations=self.orientations[every],
            fps=self.fps / self.stride,
            stride=1,
        )


def unit(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) divided by their lengths; zero vectors stay zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


def frame_from(left: FloatArray, up: FloatArray) -> FloatArray:
    """Orientations (..., 3, 3) with y along `left` and z as near to `up` as possible, both (..., 3)."""
    y = unit(left)
    x = unit(np.cross(y, up))
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def build_targets(source: Normalised, joints: JointMap, character: Character, keep_travel: bool = False) -> Targets:
    """Give the source's bones our lengths.

    Travel and pelvis height are scaled by the ratio of the leg lengths. Our two spine joints lie at their share of the
    arc length from the source's hips to its neck. The shoulders keep their movement against the trunk, about our
    resting place.

    Args:
        source: the clip in metres, z up.
        joints: its joint map.
        character: the body.
        keep_travel: keep the recorded path over the floor, and so the distances between several people; strides then
            fit the legs less well.
    """
    clip = source.clip
    offset = rest_offsets(character)
    length = {name: float(np.linalg.norm(value)) for name, value in offset.items()}
    at = {role: clip.positions[:, index] for role, index in joints.joints.items()}

    hips = (at["left_thigh"] + at["right_thigh"]) / 2
    legs = [
        float(np.median(np.linalg.norm(at[f"{side}_{a}"] - at[f"{side}_{b}"], axis=-1)))
        for side in SIDES
        for a, b in (("thigh", "shank"), ("shank", "foot"))
    ]
    ratio = (length["left_shank"] + length["left_foot"]) / (sum(legs) / 2)

    lower, upper = length["abdomen"], length["thorax"]
    whole = lower + upper + length["neck"]
    first, second = _along_trunk(hips, clip.positions[:, joints.trunk[1:]], (lower / whole, (lower + upper) / whole))
    neck = at["neck"]
    pelvis_frame = _pelvis(source, joints, frame_from(at["left_thigh"] - at["right_thigh"], neck - hips))
    thorax_frame = frame_from(at["left_upper_arm"] - at["right_upper_arm"], neck - second)

    out = np.empty((len(hips), len(ROLES), 3))
    place = {name: number for number, name in enumerate(ROLES)}

    def put(name: str, value: FloatArray) -> None:
        out[:, place[name]] = value

    def extend(name: str, parent: str, direction: FloatArray) -> None:
        put(name, out[:, place[parent]] + length[name] * unit(direction))

    travel = np.array([1.0, 1.0, ratio] if keep_travel else [ratio] * 3)
    put("pelvis", hips * travel)
    extend("abdomen", "pelvis", pelvis_frame[:, :, 2])
    extend("thorax", "abdomen", second - first)
    extend("neck", "thorax", neck - second)
    for side in SIDES:
        put(f"{side}_thigh", out[:, place["pelvis"]] + pelvis_frame @ offset[f"{side}_thigh"])
        extend(f"{side}_shank", f"{side}_thigh", at[f"{side}_shank"] - at[f"{side}_thigh"])
        extend(f"{side}_foot", f"{side}_shank", at[f"{side}_foot"] - at[f"{side}_shank"])
        shoulder = np.einsum("tji,tj->ti", thorax_frame, at[f"{side}_upper_arm"] - second) * ratio
        shoulder = offset[f"{side}_upper_arm"] + shoulder - shoulder.mean(axis=0)
        put(f"{side}_upper_arm", out[:, place["thorax"]] + np.einsum("tij,tj->ti", thorax_frame, shoulder))
        extend(f"{side}_forearm", f"{side}_upper_arm", at[f"{side}_forearm"] - at[f"{side}_upper_arm"])
        extend(f"{side}_hand", f"{side}_forearm", at[f"{side}_hand"] - at[f"{side}_forearm"])

    warnings: list[str] = []
    orientations = np.tile(np.eye(3), (len(hips), len(ORIENTED), 1, 1))
    oriented = np.zeros(len(ORIENTED), dtype=bool)
    orientations[:, 0], oriented[0] = _head(source, joints, thorax_frame), character.has("head")
    if "head" in joints.joints and joints.joints["head"] != joints.joints["neck"]:
        extend("head", "neck", at["head"] - neck)
    else:
        extend("head", "neck", orientations[:, 0, :, 2])
    for number, side in enumerate(SIDES):
        hand = _hand(source, joints, side)
        if hand is not None and character.has(f"{side}_hand"):
            orientations[:, 1 + number], oriented[1 + number] = hand, True
        foot = _foot(source, joints, side)
        if foot is None:
            warnings.append(f"the {side} foot's direction is not told by the file: the ankle stays neutral")
            knee, ankle = out[:, place[f"{side}_shank"]], out[:, place[f"{side}_foot"]]
            orientations[:, 3 + number] = frame_from(pelvis_frame[:, :, 1], knee - ankle)
        else:
            orientations[:, 3 + number], oriented[3 + number] = foot, True
    step = None if clip.step is None else clip.step * travel
    return Targets(out, orientations, oriented, clip.fps, step, tuple(warnings), keep_travel, source.stride)


def rest_offsets(character: Character) -> dict[str, FloatArray]:
    """From each role to the next in the reference pose (3,) [m]; guessed for lacking parts of the trunk.

    Without an abdomen, a joint is added two fifths of the way from pelvis to thorax. Without a neck, it begins between
    the shoulders. Without a head, it is 0.1 m above the neck.

    Raises:
        SettingError: the character lacks an arm, a leg or the thorax.
    """
    offset = {role: character.rest_offset(role) for role in ROLES if character.has(role)}
    for role in ROLES[5:]:
        character.segment(role)  # raises an error that names what is missing
    if not character.has("abdomen"):
        offset["abdomen"], offset["thorax"] = 0.4 * offset["thorax"], 0.6 * offset["thorax"]
    if not character.has("neck"):
        offset["neck"] = (offset["left_upper_arm"] + offset["right_upper_arm"]) / 2
    if not character.has("head"):
        offset["head"] = np.array([0.0, 0.0, 0.1])
    return offset


def _along_trunk(hips: FloatArray, trunk: FloatArray, shares: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Two points at shares of the arc length from the hips along the trunk's joints (T, K, 3)."""
    points = np.concatenate([hips[:, None], trunk], axis=1)
    segments = np.median(np.linalg.norm(np.diff(points, axis=1), axis=-1), axis=0)
    arc = np.concatenate([[0.0], np.cumsum(segments)])
    out = []
    for share in shares:
        place = share * arc[-1]
        low = int(np.clip(np.searchsorted(arc, place, side="right") - 1, 0, len(arc) - 2))
        weight = (place - arc[low]) / max(arc[low + 1] - arc[low], 1e-12)
        out.append((1 - weight) * points[:, low] + weight * points[:, low + 1])
    return out[0], out[1]


def _mean_rotation(rotations: FloatArray) -> FloatArray:
    return np.asarray(Rotation.from_matrix(rotations).mean().as_matrix())


def _snap(rotation: FloatArray) -> FloatArray:
    """The nearest rotation between coordinate axes, if within 30 degrees; else the rotation itself."""
    cube = Rotation.create_group("O")
    angles = np.asarray((cube.inv() * Rotation.from_matrix(rotation)).magnitude())
    best = int(np.argmin(angles))
    return np.asarray(cube[best].as_matrix()) if angles[best] < np.radians(30) else rotation


def _pelvis(source: Normalised, joints: JointMap, trunk: FloatArray) -> FloatArray:
    """Orientation of the pelvis: that of the joint that carries the thighs, upright when the person is.

    The lowest bone of the spine does not tell it: skeletons put its joints centimetres before or behind the hips.
    `trunk` (T, 3, 3) are the frames of the hip line and the line from the hips to the neck.
    """
    joint = joints.trunk[0]
    rotations = source.clip.rotations[:, joint]
    if source.reference is not None:
        offset = source.reference[1][joint].T @ _reference_heading(source, joints)
    else:  # on average in line with the trunk
        offset = _mean_rotation(np.swapaxes(rotations, -1, -2) @ trunk)
    # keep the hip line exactly: pelvis joints with several children can differ from it
    return frame_from(trunk[:, :, 1], (rotations @ offset)[:, :, 2])


def _reference_heading(source: Normalised, joints: JointMap) -> FloatArray:
    assert source.reference is not None
    positions = source.reference[0]
    left = positions[joints.joints["left_thigh"]] - positions[joints.joints["right_thigh"]]
    left[2] = 0.0
    return frame_from(left, np.array([0.0, 0.0, 1.0]))


def _head(source: Normalised, joints: JointMap, thorax: FloatArray) -> FloatArray:
    joint = joints.joints.get("head", joints.joints["neck"])
    rotations = source.clip.rotations[:, joint]
    if source.reference is not None:
        offset = source.reference[1][joint].T @ _reference_heading(source, joints)
    else:
        # without a pose to calibrate with, the head looks on average where the chest faces
        offset = _snap(_mean_rotation(np.swapaxes(rotations, -1, -2) @ thorax))
    return np.asarray(rotations @ offset)


def _hand(source: Normalised, joints: JointMap, side: str) -> FloatArray | None:
    if source.reference is None or f"{side}_hand_tip" not in joints.joints:
        return None
    joint, forearm = joints.joints[f"{side}_hand"], joints.joints[f"{side}_forearm"]
    positions, rotations = source.reference
    along = unit(positions[joint] - positions[forearm])
    forward = _reference_heading(source, joints)[:, 0]
    # with a straight arm, raised sideways or hanging, the thumb points forward
    x = unit(forward - along * (forward @ along))
    frame = np.stack([x, np.cross(-along, x), -along], axis=-1)
    return np.asarray(source.clip.rotations[:, joint] @ (rotations[joint].T @ frame))


def _foot(source: Normalised, joints: JointMap, side: str) -> FloatArray | None:
    """Orientation of the foot, calibrated so that the sole is flat while the foot stands; None if nothing tells it.

    A toe straight below its ankle, or nearly, tells no direction.
    """
    clip = source.clip
    ankle = joints.joints[f"{side}_foot"]
    toe = joints.joints.get(f"{side}_toe")
    if toe is not None and np.median(np.linalg.norm(clip.positions[:, toe] - clip.positions[:, ankle], axis=-1)) < 0.02:
        toe = None  # the joint exists by name only
    rotations = clip.rotations[:, ankle]
    knee = joints.joints[f"{side}_shank"]
    standing = _standing_frames(clip.positions[:, ankle], clip.positions[:, knee], clip.fps)
    vertical = np.array([0.0, 0.0, 1.0])
    if toe is None:
        if source.reference is None:
            return None
        offset = source.reference[1][ankle].T @ _reference_heading(source, joints)
    elif source.reference is not None:
        positions, reference = source.reference
        heading = positions[toe] - positions[ankle]
        if np.hypot(*heading[:2]) < SHORTEST_FOOT:
            return None
        offset = reference[ankle].T @ frame_from(np.cross(vertical, heading), vertical)
    elif standing.any():
        pointing = clip.positions[standing, toe] - clip.positions[standing, ankle]
        if np.median(np.hypot(pointing[:, 0], pointing[:, 1])) < SHORTEST_FOOT:
            return None
        flat = frame_from(np.cross(vertical, pointing), vertical)
        offset = _mean_rotation(np.swapaxes(rotations[standing], -1, -2) @ flat)
    else:
        return None
    if standing.sum() >= 0.15 * clip.fps:
        # the sole is level while the foot stands: remove the mean tilt if it is small enough to come from markers
        up = unit(np.median((np.swapaxes(rotations[standing] @ offset, -1, -2) @ vertical), axis=0))
        axis = np.cross(vertical, up)
        angle = float(np.arctan2(np.linalg.norm(axis), up[2]))
        if angle < np.radians(20):
            offset = offset @ Rotation.from_rotvec(unit(axis) * angle).as_matrix()
    return np.asarray(rotations @ offset)


def _standing_frames(ankle: FloatArray, knee: FloatArray, fps: float) -> BoolArray:
    """Frames in which a foot stands under its shank: its ankle low and still, or at its slowest (runners)."""
    shank = knee - ankle
    upright = shank[:, 2] > UPRIGHT * np.linalg.norm(shank, axis=-1)
    if len(ankle) < 3:
        return np.asarray(upright)
    # without the vertical speed: where a file has lost the hips' height, they carry it into every joint
    speed = np.linalg.norm(np.gradient(ankle[:, :2], 1 / fps, axis=0), axis=-1)
    standing = (speed < STILL_SPEED) & (ankle[:, 2] < np.percentile(ankle[:, 2], 5) + 0.02) & upright
    if standing.sum() < 3:
        standing = (speed <= np.percentile(speed, 8)) & upright
    return np.asarray(standing)
