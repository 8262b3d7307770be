"""Several bodies in one scene: whose parts are whose, and overlap against capsule geometry worked out by hand."""

import mujoco
import numpy as np
import pytest

from simprep.character import Character
from simprep.errors import MotionError, SettingError
from simprep.humanoid_model import humanoid
from simprep.motion.kinematics import forward_kinematics
from simprep.physics.bodies import WORLD, geom_owners, scene_bodies
from simprep.physics.overlap import overlap_of_poses
from simprep.scene import SceneSettings, build_scene

BOTH = (humanoid(), humanoid(1.85, 90.0))


@pytest.mark.parametrize("people", [(humanoid(),), BOTH, (*BOTH, humanoid())])
def test_layout_names_every_part_of_every_body(people: tuple[Character, ...]) -> None:
    model = build_scene(SceneSettings(people))
    if len(people) > 1:
        assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE  # sparse ones do not converge in some contacts
    bodies = scene_bodies(model, people)
    owner, segment = geom_owners(model, bodies)
    prefixes = ("",) if len(people) == 1 else ("a_", "b_", "c_")
    assert len(bodies) == len(people)
    for number, (character, prefix) in enumerate(zip(bodies, prefixes)):
        assert (character.number, character.segment_names, character.joint_names) == (
            number,
            humanoid().segments,
            humanoid().joints,
        )
        assert [model.body(i).name for i in range(model.nbody)][character.segments] == [
            prefix + n for n in humanoid().segments
        ]
        assert [model.actuator(i).name for i in range(model.nu)][character.controls] == [
            prefix + n for n in humanoid().joints
        ]
        root = model.joint(f"{prefix}root")
        assert (root.qposadr[0], root.dofadr[0]) == (character.qpos.start, character.qvel.start)
        for name, at, speed in zip(humanoid().joints, character.joint_qpos, character.joint_qvel):
            joint = model.joint(prefix + name)
            assert (joint.qposadr[0], joint.dofadr[0]) == (character.qpos.start + at, character.qvel.start + speed)
        for geom in np.flatnonzero(owner == number):
            assert model.body(model.geom_bodyid[geom]).name == f"{prefix}{humanoid().segments[segment[geom]]}"
    assert (bodies[-1].qpos.stop, bodies[-1].qvel.stop, bodies[-1].controls.stop) == (model.nq, model.nv, model.nu)
    assert [model.geom(i).name for i in np.flatnonzero(owner == WORLD)] == ["floor"]
    with pytest.raises(SettingError, match="body 0 has no segment 'tail'; its own: pelvis, "):
        bodies[0].segment("tail")


def capsules(pose: np.ndarray, character: Character) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends and radii of the colliding geoms, from the model of one humanoid alone."""

    model = character.model
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_kinematics(model, data)
    solid = np.flatnonzero(model.geom_contype)
    axis = data.geom_xmat[solid].reshape(-1, 3, 3)[:, :, 2] * model.geom_size[solid, 1:2]
    axis[model.geom_type[solid] == mujoco.mjtGeom.mjGEOM_SPHERE] = 0
    return data.geom_xpos[solid] - axis, data.geom_xpos[solid] + axis, model.geom_size[solid, 0]


def test_depth_is_radii_less_distance_of_axes() -> None:
    rng = np.random.default_rng(4)
    poses = [np.repeat(character.standing_qpos.copy()[None], 12, axis=0) for character in BOTH]
    for pose in poses:
        pose[:, 7:] += rng.uniform(-0.4, 0.4, (12, len(humanoid().joints)))
    poses[1][:, 0] += np.linspace(0.25, 0.9, 12)
    depth = overlap_of_poses(poses, BOTH)
    share = np.linspace(0, 1, 201)[:, None]
    for frame in range(12):
        (a0, a1, ra), (b0, b1, rb) = (capsules(pose[frame], character) for pose, character in zip(poses, BOTH))
        points = (a0[:, None] + share * (a1 - a0)[:, None])[:, :, None]  # on the axes of A
        axis = b1 - b0
        along = np.einsum("abci,ci->abc", points - b0, axis) / np.maximum(np.einsum("ci,ci->c", axis, axis), 1e-12)
        nearest = b0 + np.clip(along, 0, 1)[..., None] * axis
        gap = np.linalg.norm(points - nearest, axis=-1) - ra[:, None, None] - rb
        assert depth[frame] == pytest.approx(max(0.0, -gap.min()), abs=1e-3)
    assert depth[0] > 0.01
    assert depth[-1] == 0.0


def test_overlap_does_not_depend_on_who_is_who_or_where_they_stand() -> None:
    near = forward_kinematics(humanoid().standing_qpos.copy()[None]).com[0, 0] + 0.2
    a, b = BOTH[0].standing_qpos.copy()[None], BOTH[1].standing_qpos.copy()[None].copy()
    b[0, 0] = near
    depth = overlap_of_poses((a, b), BOTH)
    assert overlap_of_poses((b, a), BOTH[::-1]) == pytest.approx(depth)
    moved = [pose + np.eye(44)[:3].T @ [5.0, -3.0, 0.0] for pose in (a, b)]
    assert overlap_of_poses(moved, BOTH) == pytest.approx(depth)
    with pytest.raises(MotionError, match=r"shapes \(1, 44\), \(2, 44\); valid: \(T, 44\), \(T, 44\)"):
        overlap_of_poses((a, np.repeat(b, 2, axis=0)), BOTH)
    assert overlap_of_poses((a,), BOTH[:1]) == 0.0
    far = b + np.eye(44)[1] * 5.0
    third = humanoid(), *BOTH
    assert overlap_of_poses((far, a, b), third) == pytest.approx(depth)  # of any two
