"""A body in viser's scene: segments of the simulated and the reference pose, support polygon, COM and ground force."""

from typing import Any, Protocol

import mujoco
import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.motion.edit import sample
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.support import polygons, support_points
from simprep.report.replay.actor import Actor
from simprep.report.replay.meshes import segment_meshes

GHOST = (150, 155, 165)
GHOST_OPACITY = 0.3
SUPPORT, COM, FORCE = (58, 138, 77), (194, 69, 45), (184, 134, 11)
METRES_PER_NEWTON = 1e-3
"""The force of the floor is drawn as a line: 1 m for 1000 N."""
LIFT_M = 0.006
"""What lies on the floor is drawn so much above it."""
LABEL_M = 1.9
"""Height of a label [m]."""


class Part(Protocol):
    """Something that changes from frame to frame."""

    def show(self, frame: int) -> None:
        """Set it as it is in that frame of the recording."""


def rgb(colour: str) -> tuple[int, int, int]:
    """`#rrggbb` as three numbers, 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


class ShownActor:
    """An actor, at the frames of a recording.

    Args:
        scene: viser's scene.
        name: its place in the scene's tree.
        actor: the actor.
        times: (T,) of the recording's frames [s].
    """

    def __init__(self, scene: Any, name: str, actor: Actor, times: FloatArray) -> None:
        motion = actor.motion
        scene.add_frame(name, show_axes=False, position=(*actor.place, 0.0))
        self._parts: list[Part] = [_Tree(scene, f"{name}/simulated", motion, times, rgb(actor.colour))]
        if actor.reference is not None:
            self._parts.append(_Tree(scene, f"{name}/reference", actor.reference, times, GHOST, GHOST_OPACITY))
        com = forward_kinematics(sample(motion, times), motion.character).com
        self._parts.append(_Support(scene, f"{name}/support", motion, times))
        self._parts.append(_Com(scene, f"{name}/com", com, actor, times))
        if actor.ground_force is not None and actor.centre_of_pressure is not None and len(actor.ground_force):
            self._parts.append(_Force(scene, f"{name}/force", actor, times))

    def show(self, frame: int) -> None:
        """Set it as it is in that frame of the recording."""
        for part in self._parts:
            part.show(frame)


def local_poses(poses: FloatArray, character: Character) -> tuple[FloatArray, FloatArray]:
    """Position (T, segments, 3) [m] and quaternion (T, segments, 4) of each segment relative to its parent's.

    Rounded for packing: most positions then stay as they are from frame to frame.
    """
    model = character.model
    kinematics = forward_kinematics(poses, character)
    position, rotation = kinematics.xpos, kinematics.xquat
    local_position, local_rotation = position.copy(), rotation.copy()
    for segment in range(1, model.nbody - 1):
        parent = int(model.body_parentid[segment + 1]) - 1
        if parent < 0:
            continue
        for frame in range(len(poses)):
            inverse = np.empty(4)
            mujoco.mju_negQuat(inverse, rotation[frame, parent])
            mujoco.mju_rotVecQuat(
                local_position[frame, segment], position[frame, segment] - position[frame, parent], inverse
            )
            mujoco.mju_mulQuat(local_rotation[frame, segment], inverse, rotation[frame, segment])
    # adding 0 makes -0.0 and 0.0 the same
    return np.round(local_position * 4096) / 4096 + 0.0, np.round(local_rotation * 16384) / 16384 + 0.0


class _Tree:
    """The segments of a body as a tree of frames with a mesh each."""

    def __init__(
        self,
        scene: Any,
        name: str,
        motion: Motion,
        times: FloatArray,
        colour: tuple[int, int, int],
        opacity: float | None = None,
    ) -> None:
        character = motion.character
        self._position, self._rotation = local_poses(sample(motion, times), character)
        scene.add_frame(name, show_axes=False)
        names: list[str] = []
        self._handles = []
        for number, (segment, mesh) in enumerate(zip(character.segments, segment_meshes(character))):
            parent = int(character.model.body_parentid[number + 1]) - 1
            names.append(f"{names[parent] if parent >= 0 else name}/{segment.replace('/', ' ')}")
            self._handles.append(scene.add_frame(names[-1], show_axes=False))
            if len(mesh[0]):
                ghost = opacity is not None
                scene.add_mesh_simple(
                    f"{names[-1]}/shape", *mesh, color=colour, opacity=opacity, cast_shadow=not ghost,
                    receive_shadow=not ghost,
                )  # fmt: skip
        self._moved, self._turned = _changed(self._position), _changed(self._rotation)

    def show(self, frame: int) -> None:
        for number in np.flatnonzero(self._moved[frame]):
            self._handles[number].position = self._position[frame, number]
        for number in np.flatnonzero(self._turned[frame]):
            self._handles[number].wxyz = self._rotation[frame, number]


def _changed(values: FloatArray) -> BoolArray:
    """Whether (T, segments) a segment's values (T, segments, n) differ from those of the frame before; the first do."""
    changed = np.ones(values.shape[:2], dtype=bool)
    changed[1:] = (values[1:] != values[:-1]).any(axis=2)
    return changed


class _Support:
    """The support polygon of the feet that bear load, as lines on the floor."""

    def __init__(self, scene: Any, name: str, motion: Motion, times: FloatArray) -> None:
        frames = np.minimum(np.round(times * motion.fps).astype(int), len(motion) - 1)
        foot_points = forward_kinematics(motion.qpos[frames], motion.character).foot_points
        corners = polygons(*support_points(foot_points, motion.contacts[frames]))
        self._lines = [_outline(one) for one in corners]
        self._handle = scene.add_line_segments(name, np.zeros((1, 2, 3)), SUPPORT, thickness=0.012)
        self._visible = True

    def show(self, frame: int) -> None:
        lines = self._lines[frame]
        if len(lines):
            self._handle.points = lines
        if bool(len(lines)) != self._visible:
            self._visible = bool(len(lines))
            self._handle.visible = self._visible


class _Com:
    """The centre of mass above the floor, with the actor's label over it."""

    def __init__(self, scene: Any, name: str, com: FloatArray, actor: Actor, times: FloatArray) -> None:
        self._com = np.round(com, 3)
        self._handle = scene.add_frame(name, show_axes=False)
        scene.add_icosphere(f"{name}/on_floor", radius=0.025, color=COM)
        self._label = scene.add_label(f"{name}/label", "", position=(0.0, 0.0, LABEL_M))
        self._end, self._times = actor.motion.duration, times
        self._text, self._at_end = actor.label, f"{actor.label}: {actor.end_note}" if actor.end_note else actor.label

    def show(self, frame: int) -> None:
        x, y, _ = self._com[frame]
        self._handle.position = (float(x), float(y), LIFT_M)
        step_s = self._times[1] if len(self._times) > 1 else 0.0
        text = self._at_end if self._times[frame] > self._end - step_s else self._text
        if self._label.text != text:  # in the first frame too, as a replay begins anew after its end
            self._label.text = text


class _Force:
    """The force of the floor, a line from the centre of pressure."""

    def __init__(self, scene: Any, name: str, actor: Actor, times: FloatArray) -> None:
        assert actor.ground_force is not None
        assert actor.centre_of_pressure is not None
        steps = np.round(times * actor.motion.fps).astype(int)
        inside = np.minimum(steps, len(actor.ground_force) - 1)
        self._foot = np.pad(actor.centre_of_pressure[inside], ((0, 0), (0, 1)), constant_values=LIFT_M)
        self._force = actor.ground_force[inside] * METRES_PER_NEWTON
        self._shown = np.isfinite(self._foot).all(axis=1) & (steps <= len(actor.ground_force))
        self._handle = scene.add_line_segments(name, np.zeros((1, 2, 3)), FORCE, thickness=0.015)
        self._visible = True

    def show(self, frame: int) -> None:
        if self._shown[frame]:
            ends = np.stack([self._foot[frame], self._foot[frame] + self._force[frame]])
            self._handle.points = np.round(ends, 3)[None].astype(np.float32)
        if bool(self._shown[frame]) != self._visible:
            self._visible = bool(self._shown[frame])
            self._handle.visible = self._visible


def _outline(corners: FloatArray) -> FloatArray:
    """Edges (k, 2, 3) of a polygon on the floor; none of a point."""
    if len(corners) < 2:
        return np.zeros((0, 2, 3), dtype=np.float32)
    points = np.pad(np.round(corners, 3), ((0, 0), (0, 1)), constant_values=LIFT_M)
    return np.stack([points, np.roll(points, -1, axis=0)], axis=1).astype(np.float32)
