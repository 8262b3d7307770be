"""How far the limbs of an imported motion point from those of its file, by readers that are not simprep's.

BVH files are read by bvhio, Acclaim files by a small forward kinematics of its own; only DeepMimic clips come from our
reader, which eases the seam of their cycle.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from generated_clips import LIMBS, TURNS
from joint_names import FAMILIES
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from simprep.character import SIDES
from simprep.humanoid_model import humanoid
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion

EXTRA_FAMILIES = {
    "deepmimic": {f"{side}_{part}": f"{side}_{name}" for side in SIDES for part, name in
                  (("thigh", "hip"), ("shank", "knee"), ("foot", "ankle"), ("upper_arm", "shoulder"),
                   ("forearm", "elbow"), ("hand", "wrist"))} | {"hips": "root", "neck": "neck"},
    "acclaim": {f"{side}_{part}": f"{side[0]}{name}" for side in SIDES for part, name in
                (("thigh", "femur"), ("shank", "tibia"), ("foot", "foot"), ("upper_arm", "humerus"),
                 ("forearm", "radius"), ("hand", "wrist"))} | {"hips": "root", "neck": "lowerneck"},
}  # fmt: skip
CHAINS = {
    # chain: body it hangs from, its two limbs
    **{f"{side}_arm": ("thorax", (f"{side}_upper_arm", f"{side}_forearm")) for side in SIDES},
    **{f"{side}_leg": ("pelvis", (f"{side}_thigh", f"{side}_shank")) for side in SIDES},
}
NEEDED = ("hips", "neck", *(f"{side}_{part}" for side in SIDES for part in
          ("thigh", "shank", "foot", "upper_arm", "forearm", "hand")))  # fmt: skip
BAR_P95_DEG, BAR_WORST_DEG = 5.0, 15.0
TRUNK_OFF_DEG = 10.0


@dataclass(frozen=True)
class Source:
    """Joints of a file in the world, z up, in any unit.

    Attributes:
        at: role to (T, 3) positions.
        fps: frames per second [1/s].
    """

    at: dict[str, NDArray[np.float64]]
    fps: float


def read(path: Path, up: str | None = None, inserted: bool | None = None) -> Source:
    """Read a file without simprep's readers (DeepMimic: with).

    Args:
        path: .bvh, .amc or DeepMimic .txt.
        up: vertical axis; None: the one along which the neck is farthest above the feet.
        inserted: the first frame is a rest pose and left out; None: if the joints jump after it.

    Raises:
        ValueError: joint names of no known family.
    """
    suffix = path.suffix.lower()
    names, positions, fps = {".bvh": _bvh, ".amc": _acclaim, ".txt": _deepmimic}[suffix](path)
    index = {name: number for number, name in enumerate(names)}
    family = next((f for f in (FAMILIES | EXTRA_FAMILIES).values() if all(f[role] in index for role in NEEDED)), None)
    if family is None:
        raise ValueError(f"{path.name}: joint names of no known family")
    at = {role: positions[:, index[family[role]]] for role in NEEDED}
    if suffix == ".txt":
        turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    else:
        rise = np.median(at["neck"] - (at["left_foot"] + at["right_foot"]) / 2, axis=0)
        turn = TURNS[up or "xyz"[int(np.argmax(rise))]]
    at = {role: value @ turn.T for role, value in at.items()}
    if inserted is None and len(positions) > 8 and suffix == ".bvh":
        pose = np.stack([at[role] - at["hips"] for role in NEEDED], axis=1)
        jump = np.linalg.norm(np.diff(pose[:60], axis=0), axis=-1).mean(axis=1)
        leg = np.linalg.norm(pose[0, NEEDED.index("left_thigh")] - pose[0, NEEDED.index("left_foot")])
        inserted = bool(jump[0] > 3 * jump[1:].max() and jump[0] > 0.05 * leg)
    if inserted:
        at = {role: value[1:] for role, value in at.items()}
    return Source(at, fps)


def _bvh(path: Path) -> tuple[list[str], NDArray[np.float64], float]:
    import bvhio

    root = bvhio.readAsHierarchy(str(path))
    frame_time = bvhio.readAsBvh(str(path)).FrameTime
    joints = [joint for joint, _, _ in root.layout()]
    positions = np.empty((len(root.Keyframes), len(joints), 3))
    for frame in range(len(positions)):
        root.loadPose(frame)
        positions[frame] = [tuple(joint.PositionWorld) for joint in joints]
    return [joint.Name for joint in joints], positions, 1 / frame_time


def _deepmimic(path: Path) -> tuple[list[str], NDArray[np.float64], float]:
    from simprep.motion.formats.deepmimic import read_deepmimic

    clip = read_deepmimic(path)
    return list(clip.names), clip.positions, clip.fps


def _acclaim(path: Path) -> tuple[list[str], NDArray[np.float64], float]:
    """CMU's Acclaim: degrees, root order TX TY TZ RX RY RZ; a bone's rotation is C M C^-1 in its parent's frame."""
    skeleton = next(path.parent.glob(f"{path.stem.split('_')[0]}.asf")).read_text()
    bones: dict[str, dict[str, list[str]]] = {"root": {"dof": ["rx", "ry", "rz"]}}
    for block in skeleton.split(":bonedata")[1].split(":hierarchy")[0].split("begin")[1:]:
        fields = {line.split()[0]: line.split()[1:] for line in block.splitlines() if line.split()}
        bones[fields["name"][0]] = fields
    parents = {}
    for line in skeleton.split(":hierarchy")[1].splitlines():
        words = line.split()
        if len(words) > 1:
            parents.update({child: words[0] for child in words[1:]})
    frames: list[dict[str, list[float]]] = []
    for line in path.read_text().splitlines():
        words = line.split()
        if len(words) == 1 and words[0].isdigit():
            frames.append({})
        elif frames:
            frames[-1][words[0]] = [float(word) for word in words[1:]]
    count = len(frames)
    root = np.array([frame["root"] for frame in frames])
    world = {"root": Rotation.from_euler("xyz", root[:, 3:], degrees=True)}
    start, end = {"root": root[:, :3]}, {"root": root[:, :3]}
    for name in (name for name in parents if name != "root"):
        bone, parent = bones[name], parents[name]
        axis = Rotation.from_euler("xyz", [float(word) for word in bone["axis"][:3]], degrees=True)
        angles = np.zeros((count, 3))
        for column, dof in enumerate(bone.get("dof", [])):
            angles[:, "xyz".index(dof[1])] = [frame[name][column] for frame in frames]
        world[name] = world[parent] * axis * Rotation.from_euler("xyz", angles, degrees=True) * axis.inv()
        start[name] = end[parent]
        direction = np.array([float(word) for word in bone["direction"]])
        end[name] = start[name] + world[name].apply(direction / np.linalg.norm(direction) * float(bone["length"][0]))
    return list(start), np.stack(list(start.values()), axis=1), 120.0


def angles_deg(source: Source, motion: Motion) -> dict[str, NDArray[np.float64]]:
    """Angle between the file's and our direction of every limb, and of the hip line, frame by frame [deg].

    Args:
        source: the file; interpolated linearly at the motion's frame times, as an import at a lower rate is.
        motion: as imported, in the same world.
    """
    ours = forward_kinematics(motion.qpos, motion.character).xpos
    wanted = at_times(source, motion.times)
    lines = LIMBS | {"hip_line": ("right_thigh", "left_thigh")}
    return {name: _angle(wanted[end] - wanted[start], ours[:, humanoid().segments.index(end)] - ours[:, humanoid().segments.index(start)])
            for name, (start, end) in lines.items()}  # fmt: skip


def at_times(source: Source, times: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Role to positions (T, 3) at times [s]."""
    place = np.clip(times * source.fps, 0, len(source.at["hips"]) - 1)
    place = np.where(np.abs(place - np.round(place)) < 0.02, np.round(place), place)
    low = np.minimum(place.astype(int), len(source.at["hips"]) - 1)
    high = np.minimum(low + 1, len(source.at["hips"]) - 1)
    weight = (place - low)[:, None]
    return {role: (1 - weight) * value[low] + weight * value[high] for role, value in source.at.items()}


def _angle(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)))


@dataclass(frozen=True)
class LimbError:
    """Angle of one limb to the source, over a clip, and over the frames in which its pose is reachable.

    Attributes:
        median_deg: [deg].
        p95_deg: 95th percentile.
        max_deg: largest.
        worst_frame: where.
        reachable_share: share of the frames that our joints can bring within the bar from the imported trunk.
        reachable_p95_deg: 95th percentile over those frames.
        reachable_max_deg: largest over those.
    """

    median_deg: float
    p95_deg: float
    max_deg: float
    worst_frame: int
    reachable_share: float
    reachable_p95_deg: float
    reachable_max_deg: float

    @property
    def beyond(self) -> bool:
        """Beyond the bar where the pose is reachable."""
        return self.reachable_p95_deg > BAR_P95_DEG or self.reachable_max_deg > BAR_WORST_DEG


def limb_errors(
    source: Source, motion: Motion, samples: int = 40, starts: int = 8, seed: int = 0
) -> dict[str, LimbError]:
    """The measure of an import.

    A frame that the import itself brings within `BAR_P95_DEG` is reachable; of the others, up to `samples` per limb pair,
    evenly spread, are solved alone by `optimum_deg`, and stand for the rest by their weight. The limbs hang from the
    imported trunk, and where that is itself off by more than `TRUNK_OFF_DEG`, from the source's as well.

    Args:
        source: the file.
        motion: as imported.
        samples: largest number of frames solved per chain.
        starts: random starts of each solution.
        seed: of the starts.

    Returns:
        Limb to its errors.
    """
    angles = angles_deg(source, motion)
    wanted = at_times(source, motion.times)
    kinematics = forward_kinematics(motion.qpos, motion.character)
    rng = np.random.default_rng(seed)
    out = {}
    for chain, (trunk, limbs) in CHAINS.items():
        bad = np.flatnonzero(np.maximum(angles[limbs[0]], angles[limbs[1]]) > BAR_P95_DEG)
        solved = bad[np.unique(np.linspace(0, len(bad) - 1, min(samples, len(bad))).astype(int))] if len(bad) else bad
        # the worst frames are among the solved ones
        worst = [int(np.argmax(angles[limb])) for limb in limbs]
        solved = np.unique(np.concatenate([solved, [frame for frame in worst if frame in bad]])).astype(int)
        turn = Rotation.from_quat(kinematics.xquat[:, humanoid().segments.index(trunk)], scalar_first=True)
        ends = [f"{side}_{'upper_arm' if trunk == 'thorax' else 'thigh'}" for side in SIDES]
        theirs = _trunk(wanted[ends[0]] - wanted[ends[1]], wanted)
        frames = (turn, theirs)
        at = [humanoid().segments.index(name) for name in ends]
        ours = _trunk(kinematics.xpos[:, at[0]] - kinematics.xpos[:, at[1]],
                      {role: kinematics.xpos[:, humanoid().segments.index(role)] for role in wanted if role in humanoid().segments})  # fmt: skip
        off = np.degrees((ours.inv() * theirs).magnitude()) > TRUNK_OFF_DEG
        weight = np.ones(len(motion))
        weight[bad] = 0.0
        for frame in solved:
            pair = np.stack([wanted[LIMBS[limb][1]][frame] - wanted[LIMBS[limb][0]][frame] for limb in limbs])
            for hung in frames[: 1 + int(off[frame])]:
                upper, lower = hung[frame].inv().apply(pair)
                if optimum_deg(chain, upper, lower, rng, starts) <= BAR_P95_DEG:
                    weight[frame] = len(bad) / len(solved)
                    break
        for limb in limbs:
            value = angles[limb]
            seen = weight > 0
            p95 = _percentile(value[seen], weight[seen], 0.95) if seen.any() else 0.0
            out[limb] = LimbError(
                float(np.median(value)), float(np.percentile(value, 95)), float(value.max()), int(np.argmax(value)),
                float(weight.sum() / len(value)), p95, float(value[seen].max()) if seen.any() else 0.0,
            )  # fmt: skip
    return {limb: out[limb] for limb in LIMBS}


def _trunk(left: NDArray[np.float64], at: dict[str, NDArray[np.float64]]) -> Rotation:
    """Frames with y to the left and z as near as that allows to the way from the hips to the neck."""
    y = left / np.linalg.norm(left, axis=1, keepdims=True)
    x = np.cross(y, at["neck"] - (at["left_thigh"] + at["right_thigh"]) / 2)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return Rotation.from_matrix(np.stack([x, y, np.cross(x, y)], axis=-1))


def _percentile(values: NDArray[np.float64], weights: NDArray[np.float64], share: float) -> float:
    order = np.argsort(values)
    passed = (np.cumsum(weights[order]) - weights[order] / 2) / weights.sum()
    return float(np.interp(share, passed, values[order]))


def optimum_deg(
    chain: str, upper: NDArray[np.float64], lower: NDArray[np.float64], rng: np.random.Generator, starts: int = 8
) -> float:
    """The larger of a limb pair's two angles to the source that its hinges can reach, by bounded least squares.

    Args:
        chain: see `CHAINS`.
        upper: (3,) wanted direction of the upper limb, in the frame of the body it hangs from.
        lower: (3,) of the lower one.
        rng: of the starts.
        starts: from how many random poses; the search ends early when one is within 1 deg.

    Returns:
        [deg].
    """
    model = humanoid().model
    limbs = CHAINS[chain][1]
    parts = [
        (model.body(limb).jntadr[0] + k, number)
        for number, limb in enumerate(limbs)
        for k in range(model.body(limb).jntnum[0])
    ]
    joints = [joint for joint, number in parts if number == 0] + [next(joint for joint, number in parts if number == 1)]
    axes, (low, high) = model.jnt_axis[joints], model.jnt_range[joints].T
    bones = [model.body(LIMBS[limb][1]).pos / np.linalg.norm(model.body(LIMBS[limb][1]).pos) for limb in limbs]
    wanted = [upper / np.linalg.norm(upper), lower / np.linalg.norm(lower)]

    def directions(q: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        turns = [_matrix(axis, angle) for axis, angle in zip(axes, q)]
        first = turns[0] @ turns[1] @ turns[2]
        return [first @ bones[0], first @ turns[3] @ bones[1]]

    best = 180.0
    for _ in range(starts):
        q = least_squares(lambda q: np.concatenate(directions(q)) - np.concatenate(wanted), rng.uniform(low, high),
                          bounds=(low, high), xtol=1e-6, ftol=1e-6, max_nfev=60).x  # fmt: skip
        best = min(best, max(float(_angle(a, b)) for a, b in zip(wanted, directions(q))))
        if best < 1.0:
            break
    return best


def _matrix(axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Rotation about an axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
