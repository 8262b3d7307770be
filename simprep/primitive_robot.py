"""A robot of primitive shapes as a character, with other joints than the humanoid, in another order.

The model is `mjcf/primitive_robot.xml`: 29 hinges, 1.26 m, 35 kg, one waist; no abdomen, neck or head. CONTRIBUTING,
"How to add a character", tells how to add your own.
"""

from functools import lru_cache

import mujoco

from simprep.character import SIDES, Character
from simprep.humanoid_model import mjcf_folder

ROBOT_NAME = "simprep_primitive_robot"
ROBOT_VERSION = 1

_LEG = {
    "hip_flexion": "hip_pitch", "hip_abduction": "hip_roll", "hip_rotation": "hip_yaw", "knee_flexion": "knee",
    "ankle_dorsiflexion": "ankle_pitch", "ankle_inversion": "ankle_roll",
}  # fmt: skip
_ARM = {
    "shoulder_flexion": "shoulder_pitch", "shoulder_abduction": "shoulder_roll", "shoulder_rotation": "shoulder_yaw",
    "elbow_flexion": "elbow", "forearm_pronation": "wrist_yaw", "wrist_flexion": "wrist_roll",
    "wrist_deviation": "wrist_pitch",
}  # fmt: skip
_WAIST = {"lumbar_rotation": "waist_yaw", "lumbar_bending": "waist_roll", "lumbar_flexion": "waist_pitch"}
_SOLE = ("heel_inner", "heel_outer", "toe_inner", "toe_outer")
_OTHER = {"left": "right", "right": "left"}


@lru_cache(maxsize=1)
def primitive_robot() -> Character:
    """A robot of boxes, capsules and spheres."""
    limbs = {"leg": _LEG, "arm": _ARM}
    groups = {
        f"{side}_{limb}": tuple(f"{side}_{name}" for name in names.values())
        for limb, names in limbs.items()
        for side in SIDES
    }
    trunk = tuple(_WAIST.values())
    lower = groups["left_leg"] + groups["right_leg"]
    upper = trunk + groups["left_arm"] + groups["right_arm"]
    parts = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
    turned = ("roll", "yaw")  # mirrored, rotations about x and z change their sign
    mirror = {name: (name, -1.0 if name.endswith(turned) else 1.0) for name in trunk}
    for side in SIDES:
        for name in (*_LEG.values(), *_ARM.values()):
            mirror[f"{side}_{name}"] = (f"{_OTHER[side]}_{name}", -1.0 if name.endswith(turned) else 1.0)
    return Character(
        name=ROBOT_NAME,
        build=_spec,
        roles={
            "pelvis": "pelvis", "thorax": "torso",
            **{f"{side}_{part}": f"{side}_{part}" for side in SIDES for part in parts},
        },
        soles=(tuple(f"left_{part}" for part in _SOLE), tuple(f"right_{part}" for part in _SOLE)),
        upper=upper,
        lower=lower,
        groups={"trunk": trunk, **groups},
        mirror=mirror,
        anatomy={
            **_WAIST,
            **{f"{side}_{movement}": f"{side}_{name}" for side in SIDES for movement, name in (_LEG | _ARM).items()},
        },
        balancing=upper,
        fused=tuple(f"{side}_{name}" for side in SIDES for name in ("wrist_roll", "wrist_pitch", "wrist_yaw")),
        height_m=1.26,
        mass_kg=float(_spec().compile().body_mass.sum()),
    )  # fmt: skip


def _spec() -> mujoco.MjSpec:
    return mujoco.MjSpec.from_file(str(mjcf_folder() / "primitive_robot.xml"))
