"""Two fighters in one scene: whose parts are whose, and overlap against capsule geometry worked out by hand."""

import mujoco
import numpy as np
import pytest

from simprep.errors import MotionError
from simprep.humanoid import BODIES, DEFAULT_BODY, HINGES, Body, standing_qpos
from simprep.motion.kinematics import forward_kinematics
from simprep.physics.fighters import WORLD, fighter_of_scene, geom_owners
from simprep.physics.pair_penetration import fighter_penetration
from simprep.scene import SceneSettings, build_scene

BOTH = (DEFAULT_BODY, Body(1.85, 90.0))


def test_layout_names_every_part_of_both_fighters() -> None:
    model = build_scene(SceneSettings(BOTH))
    assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE  # sparse ones do not converge in some contacts
    owner, segment = geom_owners(model)
    for number, prefix in enumerate("ab"):
        fighter = fighter_of_scene(number)
        assert [model.body(i).name for i in range(model.nbody)][fighter.bodies] == [f"{prefix}_{n}" for n in BODIES]
        assert [model.actuator(i).name for i in range(model.nu)][fighter.controls] == [f"{prefix}_{n}" for n in HINGES]
        root = model.joint(f"{prefix}_root")
        assert (root.qposadr[0], root.dofadr[0]) == (fighter.qpos.start, fighter.qvel.start)
        for geom in np.flatnonzero(owner == number):
            assert model.body(model.geom_bodyid[geom]).name == f"{prefix}_{BODIES[segment[geom]]}"
    assert [model.geom(i).name for i in np.flatnonzero(owner == WORLD)] == ["floor"]


def capsules(pose: np.ndarray, body: Body) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends and radii of the colliding geoms, from the model of one humanoid alone."""
    from simprep.humanoid import humanoid_model

    model = humanoid_model(body)
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_kinematics(model, data)
    solid = np.flatnonzero(model.geom_contype)
    axis = data.geom_xmat[solid].reshape(-1, 3, 3)[:, :, 2] * model.geom_size[solid, 1:2]
    axis[model.geom_type[solid] == mujoco.mjtGeom.mjGEOM_SPHERE] = 0
    return data.geom_xpos[solid] - axis, data.geom_xpos[solid] + axis, model.geom_size[solid, 0]


def test_depth_is_radii_less_distance_of_axes() -> None:
    rng = np.random.default_rng(4)
    poses = [np.repeat(standing_qpos(body)[None], 12, axis=0) for body in BOTH]
    for pose in poses:
        pose[:, 7:] += rng.uniform(-0.4, 0.4, (12, len(HINGES)))
    poses[1][:, 0] += np.linspace(0.25, 0.9, 12)
    depth = fighter_penetration(poses[0], poses[1], BOTH)
    share = np.linspace(0, 1, 201)[:, None]
    for frame in range(12):
        (a0, a1, ra), (b0, b1, rb) = (capsules(pose[frame], body) for pose, body in zip(poses, BOTH))
        points = (a0[:, None] + share * (a1 - a0)[:, None])[:, :, None]  # on the axes of A
        axis = b1 - b0
        along = np.einsum("abci,ci->abc", points - b0, axis) / np.maximum(np.einsum("ci,ci->c", axis, axis), 1e-12)
        nearest = b0 + np.clip(along, 0, 1)[..., None] * axis
        gap = np.linalg.norm(points - nearest, axis=-1) - ra[:, None, None] - rb
        assert depth[frame] == pytest.approx(max(0.0, -gap.min()), abs=1e-3)
    assert depth[0] > 0.01
    assert depth[-1] == 0.0


def test_overlap_does_not_depend_on_who_is_who_or_where_they_stand() -> None:
    near = forward_kinematics(standing_qpos()[None]).com[0, 0] + 0.2
    a, b = standing_qpos(BOTH[0])[None], standing_qpos(BOTH[1])[None].copy()
    b[0, 0] = near
    depth = fighter_penetration(a, b, BOTH)
    assert fighter_penetration(b, a, (BOTH[1], BOTH[0])) == pytest.approx(depth)
    moved = [pose + np.eye(44)[:3].T @ [5.0, -3.0, 0.0] for pose in (a, b)]
    assert fighter_penetration(moved[0], moved[1], BOTH) == pytest.approx(depth)
    with pytest.raises(MotionError, match=r"must both be \(T, 44\); these are \(1, 44\) and \(2, 44\)"):
        fighter_penetration(a, np.repeat(b, 2, axis=0), BOTH)
