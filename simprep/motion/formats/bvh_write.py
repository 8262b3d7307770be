"""BVH of a character's motion as other programs expect it: y up, facing z, centimetres; and that file read exactly.

The joints are called by the character's segments. A joint of three hinges has their angles as channels, in their order.
"""

import warnings
from io import StringIO
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.motion.formats.segments import hinges, parents, rest_frames, tips, turns_of_poses
from simprep.motion.motion import Motion

CM = 100.0
TO_FILE = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""From our axes (x forward, y left, z up) to the file's (z forward, x left, y up)."""


def write_bvh(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write a motion as BVH; returns what is lost.

    Raises:
        MotionError: the character has joints that BVH cannot hold.
    """
    character = motion.character
    columns, head = _hierarchy(character, motion.qpos)
    with path.open("w", encoding="ascii", newline="\n") as stream:
        stream.write(head)
        stream.write(f"MOTION\nFrames: {len(motion)}\nFrame Time: {1 / motion.fps:.9f}\n")
        text = StringIO()
        np.savetxt(text, columns, fmt="%.8f")
        stream.write(text.getvalue())
    return lost(motion)


def lost(motion: Motion) -> tuple[str, ...]:
    """What a format of joints alone cannot keep of a motion: contacts are found anew, the rest is gone."""
    out = []
    if motion.events:
        out.append(f"the events are not kept: {', '.join(motion.events)}")
    if motion.loop:
        out.append("that the motion is a loop is not kept")
    return tuple(out)


def _hierarchy(character: Character, qpos: FloatArray) -> tuple[FloatArray, str]:
    """Channel values (T, C) and the text of the hierarchy."""
    place, _ = rest_frames(character)
    above = parents(character)
    ends = tips(character)
    turns = TO_FILE @ turns_of_poses(qpos, character) @ TO_FILE.T
    angles = qpos[:, 7:] - character.model.qpos0[7:]
    columns = [qpos[:, :3] @ TO_FILE.T * CM]
    lines = ["HIERARCHY"]

    def add(segment: int, depth: int) -> None:
        pad = "\t" * depth
        offset = place[segment] - place[above[segment]] if segment else np.zeros(3)
        order, values = _channels(*hinges(character)[segment], angles, turns[:, segment], segment == 0)
        columns.append(np.degrees(values))
        root = "6 Xposition Yposition Zposition" if segment == 0 else "3"
        lines.extend(
            [
                f"{pad}{'JOINT' if depth else 'ROOT'} {character.segments[segment]}",
                f"{pad}{{",
                f"{pad}\tOFFSET {_numbers(offset)}",
                f"{pad}\tCHANNELS {root} {' '.join(f'{axis}rotation' for axis in order)}",
            ]
        )
        for child in range(len(above)):
            if above[child] == segment:
                add(child, depth + 1)
        if segment in ends:
            lines.extend([f"{pad}\tEnd Site", f"{pad}\t{{", f"{pad}\t\tOFFSET {_numbers(ends[segment])}", f"{pad}\t}}"])
        lines.append(f"{pad}}}")

    add(0, 0)
    return np.concatenate(columns, axis=1), "\n".join(lines) + "\n"


def _numbers(vector: FloatArray) -> str:
    return " ".join(f"{value:.8f}" for value in TO_FILE @ vector * CM)


def _channels(
    joints: tuple[int, ...], axes: FloatArray, angles: FloatArray, turn: FloatArray, root: bool
) -> tuple[str, FloatArray]:
    """Axes of three rotation channels and their angles (T, 3) [rad]: the hinges' own where these are along the axes."""
    turned = axes @ TO_FILE.T
    along = np.abs(turned).argmax(axis=1) if len(turned) else np.zeros(0, dtype=int)
    if root or (len(turned) and np.abs(np.abs(turned).max(axis=1) - 1).max() > 1e-9):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a body that lies face down: two angles for one turn, any of them is right
            return "YXZ", Rotation.from_matrix(turn).as_euler("YXZ")
    order = [*along, *(axis for axis in range(3) if axis not in along)]
    values = np.zeros((len(angles), 3))
    for column, (joint, axis) in enumerate(zip(joints, along)):
        values[:, column] = angles[:, joint] * np.sign(turned[column, axis])
    return "".join("XYZ"[axis] for axis in order), values
