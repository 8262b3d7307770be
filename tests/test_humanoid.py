"""The body against de Leva 1996 (table 4, men), typed here independently of the model file."""

import mujoco
import numpy as np
import pytest

from simprep.character import Character
from simprep.errors import SettingError
from simprep.humanoid_model import humanoid
from simprep.motion.kinematics import forward_kinematics
from simprep.scene import SceneSettings, build_scene

# segment: mass share, length at 1.741 m, COM share from the first endpoint, gyration radii about x, y, z of our frames
DE_LEVA = {
    "pelvis": (0.1117, 0.1457, 0.6115, (0.615, 0.551, 0.587)),
    "abdomen": (0.1633, 0.2155, 0.4502, (0.482, 0.383, 0.468)),
    "thorax": (0.1596, 0.1707, 0.2999, (0.716, 0.454, 0.659)),
    "left_upper_arm": (0.0271, 0.2817, 0.5772, (0.285, 0.269, 0.158)),
    "right_forearm": (0.0162, 0.2689, 0.4574, (0.276, 0.265, 0.121)),
    "left_hand": (0.0061, 0.0862, 0.7900, (0.628, 0.513, 0.401)),
    "right_thigh": (0.1416, 0.4222, 0.4095, (0.329, 0.329, 0.149)),
    "left_shank": (0.0433, 0.4403, 0.4395, (0.251, 0.246, 0.102)),
    "right_foot": (0.0137, 0.2581, 0.4415, (0.124, 0.245, 0.257)),
}
UPWARD = ("pelvis", "abdomen", "thorax")  # de Leva measures these from the upper endpoint; our frame is at the lower


@pytest.mark.parametrize("character", [humanoid(), humanoid(1.62, 58.0), humanoid(1.95, 110.0)])
def test_segments_are_de_leva_scaled(character: Character) -> None:
    model = character.model
    assert model.body_mass.sum() == pytest.approx(character.mass_kg, rel=1e-4)
    for name, (share, length, com, radii) in DE_LEVA.items():
        segment = model.body(name)
        scaled = length / 1.741 * character.height_m
        assert segment.mass[0] == pytest.approx(share * character.mass_kg, rel=1e-3), name
        expected = share * character.mass_kg * (np.array(radii) * scaled) ** 2
        np.testing.assert_allclose(segment.inertia, expected, rtol=2e-3, err_msg=name)
        if name.endswith("foot"):
            continue
        distance = (1 - com) * scaled if name in UPWARD else com * scaled
        assert abs(segment.ipos[2]) == pytest.approx(distance, rel=2e-3), name


def test_head_and_neck_together_are_de_levas_head() -> None:
    model = humanoid().model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    parts = [model.body(name) for name in ("neck", "head")]
    mass = sum(part.mass[0] for part in parts)
    com = sum(part.mass[0] * data.body(part.id).xipos for part in parts) / mass
    length = 0.2429 / 1.741 * 1.75
    assert mass == pytest.approx(0.0694 * 75, rel=1e-3)
    assert 1.75 - com[2] == pytest.approx(0.5002 * length, rel=5e-3)
    about_x = sum(p.inertia[0] + p.mass[0] * (data.body(p.id).xipos[2] - com[2]) ** 2 for p in parts)
    assert about_x == pytest.approx(0.0694 * 75 * (0.303 * length) ** 2, rel=5e-3)


@pytest.mark.parametrize("character", [humanoid(), humanoid(1.5, 45.0), humanoid(2.0, 120.0)])
def test_stands_on_the_floor_at_its_height(character: Character) -> None:
    kinematics = forward_kinematics(character.standing_qpos.copy()[None], character)
    np.testing.assert_allclose(kinematics.foot_points[0, ..., 2], 0.0, atol=1e-6)
    model = character.model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    head = model.geom("head").id
    top = data.geom_xpos[head, 2] + abs(data.geom_xmat[head, 8]) * model.geom_size[head, 1] + model.geom_size[head, 0]
    assert top == pytest.approx(character.height_m, abs=0.012 * character.height_m)
    assert kinematics.com[0, 2] / character.height_m == pytest.approx(0.567, abs=0.01)  # textbook 0.55 to 0.57
    assert abs(kinematics.com[0, 1]) < 1e-6


def test_names_and_order_are_the_models() -> None:
    body, model = humanoid(), humanoid().model
    assert [model.body(i + 1).name for i in range(17)] == list(body.roles)
    assert tuple(model.actuator(i).name for i in range(37)) == body.joints
    assert body.upper + body.lower == body.joints
    assert (
        sum((body.group(name) for name in ("trunk", "left_arm", "right_arm", "left_leg", "right_leg")), ())
        == body.joints
    )


def test_mirrored_pose_is_the_mirrored_body() -> None:
    rng = np.random.default_rng(0)
    qpos = humanoid().standing_qpos.copy()
    low, high = humanoid().model.jnt_range[1:].T
    qpos[7:] = rng.uniform(low, high)
    index, sign = humanoid().mirror_map
    mirrored = qpos.copy()
    mirrored[7:] = sign * qpos[7:][index]
    a, b = (forward_kinematics(q[None]).xipos[0] for q in (qpos, mirrored))
    swap = humanoid().mirror_segments
    np.testing.assert_allclose(b, a[swap] * [1, -1, 1], atol=1e-6)


def test_flexion_signs_are_anatomical() -> None:
    def moved(hinge: str, character: str) -> np.ndarray:
        qpos = humanoid().standing_qpos.copy()
        qpos[7 + humanoid().joint(hinge)] = 0.3
        a, b = (
            forward_kinematics(q[None]).xipos[0, humanoid().segment(character)]
            for q in (humanoid().standing_qpos.copy(), qpos)
        )
        return b - a

    for side, outward in (("left", 1), ("right", -1)):
        assert moved(f"{side}_hip_flexion", f"{side}_shank")[0] > 0.1
        assert moved(f"{side}_knee_flexion", f"{side}_shank")[0] < -0.03
        assert moved(f"{side}_hip_abduction", f"{side}_shank")[1] * outward > 0.1
        assert moved(f"{side}_shoulder_flexion", f"{side}_forearm")[0] > 0.05
        assert moved(f"{side}_shoulder_abduction", f"{side}_forearm")[1] * outward > 0.05
        assert moved(f"{side}_elbow_flexion", f"{side}_hand")[0] > 0.03
        assert moved(f"{side}_ankle_dorsiflexion", f"{side}_foot")[2] > 0.01
    assert moved("lumbar_flexion", "head")[0] > 0.1
    assert moved("lumbar_bending", "head")[1] > 0.1


def test_servos_settle_without_chatter_at_the_planners_step() -> None:
    # a saturated servo has no implicit damping: with kd too large for the inertia it flips between its limits for ever
    model = build_scene(SceneSettings(timestep=1 / 120))
    model.opt.gravity[:] = 0
    for hinge in range(37):
        data = mujoco.MjData(model)
        data.qpos[2] += 1.0
        sign = 1 if model.jnt_range[1 + hinge, 1] > 0.3 else -1
        data.qpos[7 + hinge] = 0.3 * sign
        saturated = 0
        for step in range(60):
            mujoco.mj_step(model, data)
            saturated += step >= 18 and bool((np.abs(data.actuator_force) >= model.actuator_forcerange[:, 1]).any())
        assert saturated == 0, humanoid().joints[hinge]
        assert np.abs(data.qvel[6:]).max() < 0.5, humanoid().joints[hinge]


def test_body_outside_human_range_is_refused() -> None:
    with pytest.raises(SettingError, match=r"height 0\.9 m is outside 1\.2 to 2\.2 m"):
        humanoid(0.9)
