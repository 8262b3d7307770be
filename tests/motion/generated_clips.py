"""Forty seeded clips of poses that our humanoid can reach, written as BVH files of foreign skeletons.

The truth is exact: every limb of the foreign skeleton points where the same limb of our body points. Everything else is
foreign: joint names, number of spine joints, bone lengths, rest pose, rotation order, axes, unit, frame rate.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joint_names import FAMILIES, PARTS, RECOGNISED
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simprep.character import SIDES
from simprep.humanoid_model import humanoid
from simprep.motion.kinematics import body_clearance, forward_kinematics

LIMBS = {f"{side}_{part}": (f"{side}_{part}", f"{side}_{end}") for side in SIDES for part, end in
         (("upper_arm", "forearm"), ("forearm", "hand"), ("thigh", "shank"), ("shank", "foot"))}  # fmt: skip
"""Limb to the joints at its two ends."""
FINE_FPS = 240
"""Rate at which a movement is made before it is sampled at the file's [1/s]."""
MARGIN = np.radians(5.0)
"""Hinges stay this far inside their limits [rad]."""

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254}
TURNS = {"z": np.eye(3), "y": np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])}
"""File axes to ours; y up: the file's z is our x, its x our y."""
KINDS = ("random",) * 14 + tuple(
    kind
    for kind in ("overhead", "raise", "swing", "straight", "elbow", "kneel", "spin", "crouch", "kick")
    for _ in range(4 if kind in ("overhead", "raise", "swing", "kick") else 2)
)
ARCS = ("raise", "swing")
"""Kinds whose arms go the shortest way from one reachable pose to the next, out of our reach in between perhaps."""


@dataclass(frozen=True)
class GeneratedClip:
    """A clip with its truth.

    Attributes:
        name: number, kind and the main choices.
        text: the BVH file.
        qpos: (T, 44) our pose in every frame of the file, without the inserted first one.
        fps: frames per second of the file [1/s].
        family: of the joint names.
        up: vertical axis of the file.
        unit_m: metres per file unit.
        inserted: a rest pose stands before the first frame.
        directions: limb to (T, 3) unit vectors of the file, z up.
        reachable: our joints reach every frame: `qpos` has the directions, too.
    """

    name: str
    text: str
    qpos: NDArray[np.float64]
    fps: float
    family: str
    up: str
    unit_m: float
    inserted: bool
    directions: dict[str, NDArray[np.float64]]
    reachable: bool

    def write(self, folder: Path) -> Path:
        """Write the file into a folder."""
        path = folder / f"{self.name}.bvh"
        path.write_text(self.text)
        return path


def generate(number: int, seed: int = 9, seconds: float = 3.0) -> GeneratedClip:
    """One of the clips.

    Args:
        number: 0 to 39; decides the kind, and with the seed everything else.
        seed: of the numpy generator.
        seconds: length [s].
    """
    rng = np.random.default_rng([seed, number])
    kind = KINDS[number]
    fps = (24, 30, 60, 120)[number % 4]
    family = RECOGNISED[number % len(RECOGNISED)]
    # a crouch without a standing rest pose does not tell what is up
    rests = ("t", "a", "down", "t") if kind == "crouch" else ("t", "a", "down", "t", "x", "random")
    rest = rests[rng.integers(len(rests))] if family != "bandai" or kind == "crouch" else "x"
    up = ("y", "z")[int(rng.random() < 0.35)]
    unit = tuple(UNITS)[rng.integers(len(UNITS))]
    spine = int(rng.integers(1, 5))
    # a slow third, a middle third, a fast third
    tempo = (0.55, 0.75, 1.3)[rng.integers(3)] if kind == "random" else 0.8
    stride = FINE_FPS // fps
    qpos = movement(kind, rng, seconds, tempo)[::stride]
    turn = orientations(qpos)
    if kind in ARCS:
        _swing_arms(turn, rng, kind, np.arange(len(qpos)) / fps)
    inserted = rest in ("t", "a") and rng.random() < 0.3
    text = bvh_of(qpos, turn, rng, fps, family, rest, up, UNITS[unit], spine, inserted)
    model = humanoid().model
    directions = {}
    for limb, (_, end) in LIMBS.items():
        bone = model.body(end).pos
        directions[limb] = turn[limb].apply(bone / np.linalg.norm(bone))
    pace = {0.55: "fast", 0.75: "middle", 1.3: "slow"}.get(tempo, "")
    name = (
        f"{number:02d}_{kind}{pace}_{fps}hz_{family}_{rest}_{up}_{unit}_spine{spine}{'_inserted' if inserted else ''}"
    )
    return GeneratedClip(name, text, qpos, fps, family, up, UNITS[unit], inserted, directions, kind not in ARCS)


def movement(kind: str, rng: np.random.Generator, seconds: float, tempo: float) -> NDArray[np.float64]:
    """A movement of a kind at `FINE_FPS`; `tempo` is the mean time of one arm movement [s]."""
    times = np.arange(round(seconds * FINE_FPS)) / FINE_FPS
    low, high = (np.degrees(limit) for limit in humanoid().model.jnt_range[1:].T)
    span: dict[str, tuple[float, float, float]] = {}  # hinge: lowest, highest [deg], time of one movement [s]
    for name, least, most in zip(humanoid().joints, low, high):
        middle, half = (least + most) / 2, (most - least) / 2 - np.degrees(MARGIN)
        share = 0.6 if name.startswith(("lumbar", "thorax", "neck", "head")) else 1.0
        span[name] = (middle - share * half, middle + share * half, tempo * (1.6 if share < 1 else 1.0))
    for side in SIDES:
        span |= {f"{side}_hip_flexion": (-18, 65, 1.8 * tempo), f"{side}_hip_abduction": (-10, 32, 1.8 * tempo),
                 f"{side}_hip_rotation": (-25, 25, 1.8 * tempo), f"{side}_knee_flexion": (3, 90, 1.6 * tempo)}  # fmt: skip
    span |= {"yaw": (-60, 60, 2.0), "pitch": (-8, 15, 2.0), "roll": (-8, 8, 2.0)}

    def arms(**spans: tuple[float, float, float]) -> None:
        span.update({f"{side}_{name}": value for side in SIDES for name, value in spans.items()})

    if (
        kind == "overhead"
    ):  # in a V: flexion near 180 with abduction beyond is reached by one branch of the shoulder only
        arms(shoulder_flexion=(150, 176, 0.7), shoulder_abduction=(15, 45, 0.7), elbow_flexion=(4, 25, 0.7))
    elif kind == "elbow":
        arms(shoulder_rotation=(-95, 72, 0.7), elbow_flexion=(2, 145, 0.5), shoulder_flexion=(-30, 120, 1.0))
    elif kind == "straight":
        arms(elbow_flexion=(0, 3, 1.0), knee_flexion=(0, 3, 1.0), hip_flexion=(-15, 40, 1.0))
    elif kind == "kneel":
        arms(hip_flexion=(5, 75, 1.5), hip_abduction=(0, 25, 1.5), knee_flexion=(95, 143, 1.5))
    elif kind == "crouch":
        arms(hip_flexion=(95, 123, 1.5), hip_abduction=(0, 35, 1.5), knee_flexion=(110, 145, 1.5))
    elif kind == "kick":
        side = SIDES[int(rng.integers(2))]
        span |= {f"{side}_hip_flexion": (20, 120, 0.45), f"{side}_hip_abduction": (-5, 55, 0.5),
                 f"{side}_hip_rotation": (-40, 40, 0.6), f"{side}_knee_flexion": (3, 130, 0.35)}  # fmt: skip
        other = SIDES[side == "left"]
        span |= {f"{other}_hip_flexion": (-10, 15, 1.5), f"{other}_knee_flexion": (5, 25, 1.5)}
    curve = {name: np.radians(_wander(rng, times, *value)) for name, value in span.items()}
    if kind == "spin":
        curve["yaw"] = 4 * np.pi * times * rng.choice((-1.0, 1.0))
    qpos = np.tile(humanoid().standing_qpos.copy(), (len(times), 1))
    heading = rng.uniform(-np.pi, np.pi)
    turn = Rotation.from_euler("ZYX", np.stack([curve["yaw"] + heading, curve["pitch"], curve["roll"]], axis=1))
    qpos[:, 3:7] = turn.as_quat(scalar_first=True)
    for name in humanoid().joints:
        qpos[:, 7 + humanoid().joint(name)] = curve[name]
    if kind != "kneel":
        _level_soles(qpos)
    return _stand(qpos, walk=kind != "spin")


def orientations(qpos: NDArray[np.float64]) -> dict[str, Rotation]:
    xquat = forward_kinematics(qpos).xquat
    return {body: Rotation.from_quat(xquat[:, k], scalar_first=True) for k, body in enumerate(humanoid().segments)}


def _swing_arms(turn: dict[str, Rotation], rng: np.random.Generator, kind: str, times: NDArray[np.float64]) -> None:
    """Arms from one reachable pose to another by the shortest rotation, with rests, in place.

    `raise`: from hanging to overhead in a V and back, sideways; `swing`: anywhere.
    """
    low, high = humanoid().model.jnt_range[1:].T
    for side, sign in zip(SIDES, (1.0, -1.0)):
        span = {name: (low[humanoid().joint(f"{side}_{name}")] + MARGIN, high[humanoid().joint(f"{side}_{name}")] - MARGIN)
                for name in ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")}  # fmt: skip
        poses, at = [], [0.0]
        while at[-1] < times[-1]:
            if kind == "swing":
                pose = [rng.uniform(*span[name]) for name in span]
            elif len(poses) % 2:
                pose = [
                    *np.radians([rng.uniform(160, 176), rng.uniform(20, 42), rng.uniform(-90, 60)]),
                    rng.uniform(0.05, 0.7),
                ]
            else:
                pose = [
                    *np.radians([rng.uniform(-10, 20), rng.uniform(3, 25), rng.uniform(-60, 30)]),
                    rng.uniform(0.05, 0.7),
                ]
            poses.append(pose)
            at.append(at[-1] + rng.uniform(0.6, 1.0))
        angles = np.array(poses)
        shoulder = Rotation.from_euler("YXZ", angles[:, :3] * [-1.0, sign, -sign])  # flexion, abduction, rotation
        step = np.clip(np.searchsorted(at, times, side="right") - 1, 0, len(poses) - 2)
        # the last 0.3 s before each knot at rest
        u = np.clip((times - np.array(at)[step]) / (np.diff(at)[step] - 0.3), 0, 1)
        u = u**3 * (10 - 15 * u + 6 * u * u)
        way = (shoulder[step].inv() * shoulder[step + 1]).as_rotvec()
        elbow = angles[step, 3] + u * (angles[step + 1, 3] - angles[step, 3])
        upper = turn["thorax"] * shoulder[step] * Rotation.from_rotvec(u[:, None] * way)
        hand = turn[f"{side}_forearm"].inv() * turn[f"{side}_hand"]
        turn[f"{side}_upper_arm"] = upper
        turn[f"{side}_forearm"] = upper * Rotation.from_euler("Y", -elbow[:, None])
        turn[f"{side}_hand"] = turn[f"{side}_forearm"] * hand


def _wander(
    rng: np.random.Generator, times: NDArray[np.float64], low: float, high: float, period: float
) -> NDArray[np.float64]:
    """From value to value between two limits, each way with minimum jerk (Flash and Hogan 1985)."""
    knots = [-rng.uniform(0, period)]
    while knots[-1] < times[-1]:
        knots.append(knots[-1] + period * rng.uniform(0.7, 1.4))
    values = rng.uniform(low, high, len(knots))
    place = np.searchsorted(knots, times, side="right") - 1
    place = np.clip(place, 0, len(knots) - 2)
    at = np.array(knots)
    u = np.clip((times - at[place]) / (at[place + 1] - at[place]), 0, 1)
    return np.asarray(values[place] + (values[place + 1] - values[place]) * u**3 * (10 - 15 * u + 6 * u * u))


def _level_soles(qpos: NDArray[np.float64]) -> None:
    """Turn the ankles so that the soles are level, as far as their limits allow."""
    model, kinematics = humanoid().model, forward_kinematics(qpos)
    for side, sign in zip(SIDES, (-1.0, 1.0)):
        shank = Rotation.from_quat(kinematics.xquat[:, humanoid().segments.index(f"{side}_shank")], scalar_first=True)
        up = shank.inv().apply([0.0, 0.0, 1.0])
        about_x = -np.arcsin(np.clip(up[:, 1], -1, 1))
        # beyond a quarter turn the foot hangs: no sole to level
        for name, angle in (
            ("ankle_dorsiflexion", np.arctan2(-up[:, 0], np.abs(up[:, 2]))),
            ("ankle_inversion", sign * about_x),
        ):
            index = humanoid().joint(f"{side}_{name}")
            low, high = model.jnt_range[1 + index]
            qpos[:, 7 + index] = np.clip(angle, low + MARGIN, high - MARGIN)


def _stand(qpos: NDArray[np.float64], walk: bool) -> NDArray[np.float64]:
    """The lowest point of the body on the floor; the lower foot does not slide."""
    qpos = qpos.copy()
    qpos[:, 2] -= body_clearance(qpos).min(axis=1)
    if walk:
        points = forward_kinematics(qpos).foot_points
        sole = points.mean(axis=2)  # (T, 2, 3)
        low = points[..., 2].min(axis=2)
        weight = np.exp(-(low - low.min(axis=1, keepdims=True)) / 0.01)
        weight /= weight.sum(axis=1, keepdims=True)
        step = (weight[1:, :, None] * np.diff(sole[..., :2], axis=0)).sum(axis=1)
        qpos[1:, :2] -= np.cumsum(step, axis=0)
    return qpos


def bvh_of(
    qpos: NDArray[np.float64],
    turn: dict[str, Rotation],
    rng: np.random.Generator,
    fps: int,
    family: str,
    rest: str,
    up: str,
    unit_m: float,
    spine: int,
    inserted: bool,
) -> str:
    """A BVH file of a foreign skeleton that moves as ours does.

    Args:
        qpos: (T, 44) poses; their roots are used.
        turn: body to its T orientations in the world.
        rng: for bone lengths, rotation order and rest orientations.
        fps: frames per second [1/s].
        family: of the names, see `FAMILIES`.
        rest: pose with all channels zero: `t`, `a`, `down`, `x` (all bones along x) or `random`.
        up: vertical axis.
        unit_m: metres per file unit.
        spine: number of spine joints.
        inserted: begin with the rest pose.
    """
    names = FAMILIES[family]
    model = humanoid().model
    rest_qpos = humanoid().standing_qpos.copy()
    for side in SIDES:
        rest_qpos[7 + humanoid().joint(f"{side}_shoulder_abduction")] = {"t": np.pi / 2, "a": np.pi / 4}.get(rest, 0.0)
    rest_turn = Rotation.from_quat(forward_kinematics(rest_qpos[None]).xquat[0], scalar_first=True)
    local = {body: np.array(model.body_pos[1 + k]) for k, body in enumerate(humanoid().segments)}
    size = rng.uniform(0.9, 1.1)
    longer = {part: size * rng.uniform(0.95, 1.05) for part in (*PARTS, "spine", "neck", "head")}
    # node: role, parent, world rotation, name of the body whose rest orientation it has, offset in the parent's frame
    nodes: list[tuple[str, str, Rotation, str, NDArray[np.float64]]] = [
        ("hips", "", turn["pelvis"], "pelvis", np.zeros(3))
    ]
    share = np.linspace(0, 1, spine) if spine > 1 else np.ones(1)
    bend = _between(turn["abdomen"], turn["thorax"], share)
    rise = local["thorax"] / (spine - 1 if spine > 1 else 1)
    last = "hips"
    for number in range(spine):
        offset = local["abdomen"] if number == 0 else rise
        nodes.append((f"spine{number}", last, bend[number], "thorax", offset * longer["spine"]))
        last = f"spine{number}"
    below = rise * longer["spine"] if spine == 1 else np.zeros(3)  # one joint carries what two bones are long
    nodes.append(("neck", last, turn["neck"], "neck", below + local["neck"] * longer["neck"]))
    nodes.append(("head", "neck", turn["head"], "head", local["head"] * longer["head"]))
    for side in SIDES:
        shoulder = local[f"{side}_upper_arm"] * longer["collar"]
        inner = shoulder * [1.0, 0.3, 0.9]
        nodes.append((f"{side}_collar", last, turn["thorax"], "thorax", below + inner))
        chain = [(f"{side}_upper_arm", f"{side}_collar", shoulder - inner)]
        chain += [(f"{side}_{b}", f"{side}_{a}", local[f"{side}_{b}"] * longer[a])
                  for a, b in (("upper_arm", "forearm"), ("forearm", "hand"))]  # fmt: skip
        chain.append((f"{side}_thigh", "hips", local[f"{side}_thigh"] * size))
        chain += [(f"{side}_{b}", f"{side}_{a}", local[f"{side}_{b}"] * longer[a])
                  for a, b in (("thigh", "shank"), ("shank", "foot"))]  # fmt: skip
        nodes += [(role, parent, turn[role], role, offset) for role, parent, offset in chain]
        nodes.append(
            (f"{side}_toe", f"{side}_foot", turn[f"{side}_foot"], f"{side}_foot", size * np.array([0.12, 0, -0.055]))
        )
    ends = {"head": np.array([0, 0, 0.15])} | {
        f"{side}_{part}": np.array(value)
        for side in SIDES for part, value in (("hand", [0, 0, -0.16]), ("toe", [0.06, 0, -0.005]))
    }  # fmt: skip

    # U^T W Z^T U: the file's axes, and no rotation in the rest pose
    to_file = Rotation.from_matrix(TURNS[up].T)
    at_rest = {}
    for role, _, _, body, _ in nodes:
        following = next((offset for _, parent, _, _, offset in nodes if parent == role), ends.get(role))
        if rest == "random":
            at_rest[role] = Rotation.random(random_state=rng)
        elif rest == "x":
            at_rest[role] = Rotation.align_vectors([[1.0, 0, 0], [0, 1.0, 0]], [following, [0, 1.0, 0]])[0]
        else:
            at_rest[role] = rest_turn[humanoid().segments.index(body)]
    everything = {role: to_file * world * at_rest[role].inv() * to_file.inv() for role, _, world, _, _ in nodes}
    order = "".join(rng.permutation(list("XYZ")))
    parent_of = {role: parent for role, parent, *_ in nodes}
    offset_of = {role: to_file.apply(at_rest[parent].apply(offset) if parent else offset) / unit_m
                 for role, parent, _, _, offset in nodes}  # fmt: skip
    six = family == "bandai"
    place = to_file.apply(qpos[:, :3] * size) / unit_m
    lines, columns = ["HIERARCHY"], []

    def joint(role: str, depth: int) -> None:
        pad = "\t" * depth
        lines.extend([f"{pad}{'JOINT' if depth else 'ROOT'} {names[role]}", pad + "{"])
        lines.append(f"{pad}\tOFFSET " + " ".join(f"{value:.6f}" for value in offset_of[role]))
        turns = " ".join(f"{axis}rotation" for axis in order)
        moves = "Xposition Yposition Zposition "
        lines.append(f"{pad}\tCHANNELS {'6 ' + moves if six or not depth else '3 '}{turns}")
        if not depth:
            columns.append(place)
        elif six:
            columns.append(np.tile(offset_of[role], (len(qpos), 1)))
        parent = parent_of[role]
        relative = everything[parent].inv() * everything[role] if parent else everything[role]
        columns.append(relative.as_euler(order, degrees=True))
        for child in [child for child, above in parent_of.items() if above == role]:
            joint(child, depth + 1)
        if role in ends:
            tip = to_file.apply(at_rest[role].apply(ends[role])) / unit_m
            text = " ".join(f"{value:.6f}" for value in tip)
            lines.extend([f"{pad}\tEnd Site", f"{pad}\t{{", f"{pad}\t\tOFFSET {text}", f"{pad}\t}}"])
        lines.append(pad + "}")

    joint("hips", 0)
    rows = np.concatenate(columns, axis=1)
    if inserted:
        first = np.zeros((1, rows.shape[1]))
        first[0, :3] = rows[0, :3]
        rows = np.concatenate([first, rows])
    lines += ["MOTION", f"Frames: {len(rows)}", f"Frame Time: {1 / fps:.7f}"]
    lines += [" ".join(f"{value:.6f}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def _between(first: Rotation, second: Rotation, shares: NDArray[np.float64]) -> list[Rotation]:
    """Rotations at shares of the way from one to another, frame by frame."""
    way = (first.inv() * second).as_rotvec()
    return [first * Rotation.from_rotvec(share * way) for share in shares]
