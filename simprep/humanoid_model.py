"""Simprep's humanoid as a character: names, groups, mirror map, scaled models.

The model is `mjcf/humanoid.xml` (1.75 m, 75 kg), with the sources of its numbers. Other sizes are scaled copies:
lengths with height h, radii with sqrt(mass m / h), inertias with m h^2 (so de Leva's percentages hold), torque limits
with m h (Anderson et al. 2007 normalise by m g h), gains, damping and armature with m h^2.
"""

from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from simprep.character import SIDES, Character
from simprep.errors import SettingError

MODEL_NAME = "simprep_humanoid"
MODEL_VERSION = 1
DEFAULT_HEIGHT_M = 1.75
DEFAULT_MASS_KG = 75.0
GRAVITY = 9.81
"""Acceleration of free fall in the model [m/s^2]."""

BODIES = (
    "pelvis", "abdomen", "thorax", "neck", "head",
    "left_upper_arm", "left_forearm", "left_hand", "right_upper_arm", "right_forearm", "right_hand",
    "left_thigh", "left_shank", "left_foot", "right_thigh", "right_shank", "right_foot",
)  # fmt: skip
"""The 17 segments in model order, called by their roles. The origin of each frame is the joint of that name."""

TRUNK_JOINTS = (
    "lumbar_flexion", "lumbar_bending", "lumbar_rotation", "thorax_flexion", "thorax_bending", "thorax_rotation",
    "neck_flexion", "neck_bending", "neck_rotation", "head_flexion", "head_rotation",
)  # fmt: skip
ARM_JOINTS = (
    "shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion", "forearm_pronation",
    "wrist_flexion", "wrist_deviation",
)  # fmt: skip
LEG_JOINTS = (
    "hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "ankle_dorsiflexion", "ankle_inversion",
)  # fmt: skip

HINGES = (
    *TRUNK_JOINTS,
    *(f"{side}_{joint}" for side in SIDES for joint in ARM_JOINTS),
    *(f"{side}_{joint}" for side in SIDES for joint in LEG_JOINTS),
)
"""The 37 hinges in qpos order: hinge k is qpos[7 + k], qvel[6 + k] and actuator k."""

UPPER_BODY_HINGES = HINGES[: len(TRUNK_JOINTS) + 2 * len(ARM_JOINTS)]
LOWER_BODY_HINGES = HINGES[len(UPPER_BODY_HINGES) :]

FOOT_GEOMS = ("heel", "ball_medial", "ball_lateral", "toe")
"""Spheres under each foot, named side_part; their lowest points are the foot's support points."""

_MIRROR_NEGATED = tuple(name for name in TRUNK_JOINTS if name.endswith(("bending", "rotation")))


def _mirror() -> dict[str, tuple[str, float]]:
    swap = {"left": "right", "right": "left"}
    out = {}
    for name in HINGES:
        side, _, rest = name.partition("_")
        out[name] = (f"{swap[side]}_{rest}" if side in swap else name, -1.0 if name in _MIRROR_NEGATED else 1.0)
    return out


@lru_cache(maxsize=64)
def humanoid(height_m: float = DEFAULT_HEIGHT_M, mass_kg: float = DEFAULT_MASS_KG) -> Character:
    """Simprep's humanoid: 17 segments and 37 hinges, masses after de Leva (1996).

    Args:
        height_m: stature, 1.2 to 2.2 m.
        mass_kg: mass, 30 to 160 kg.

    Raises:
        SettingError: outside of these ranges.
    """
    if not 1.2 <= height_m <= 2.2:
        raise SettingError(f"height {height_m} m is outside 1.2 to 2.2 m")
    if not 30.0 <= mass_kg <= 160.0:
        raise SettingError(f"mass {mass_kg} kg is outside 30 to 160 kg")
    arms = {f"{side}_arm": tuple(f"{side}_{joint}" for joint in ARM_JOINTS) for side in SIDES}
    legs = {f"{side}_leg": tuple(f"{side}_{joint}" for joint in LEG_JOINTS) for side in SIDES}
    light = ("wrist_flexion", "wrist_deviation", "forearm_pronation")
    neck = TRUNK_JOINTS[6:]
    return Character(
        name=MODEL_NAME,
        build=partial(_spec, float(height_m), float(mass_kg)),
        roles={name: name for name in BODIES},
        soles=(tuple(f"left_{part}" for part in FOOT_GEOMS), tuple(f"right_{part}" for part in FOOT_GEOMS)),
        upper=UPPER_BODY_HINGES,
        lower=LOWER_BODY_HINGES,
        groups={"trunk": TRUNK_JOINTS, **arms, **legs},
        mirror=_mirror(),
        balancing=UPPER_BODY_HINGES,
        fused=(*neck, *(f"{side}_{joint}" for side in SIDES for joint in light)),
        fused_segments=("neck", "head"),
        height_m=float(height_m),
        mass_kg=float(mass_kg),
    )


def humanoid_of_leg(leg_m: float) -> Character:
    """The humanoid whose thigh plus shank has a given length; its mass grows with the square of stature (equal BMI).

    Args:
        leg_m: hip to ankle joint along the bones [m].

    Raises:
        SettingError: no valid stature has such legs.
    """
    own = humanoid()
    offsets = own.model.body_pos[[1 + own.segment("left_shank"), 1 + own.segment("left_foot")]]
    scale = leg_m / float(np.linalg.norm(offsets, axis=1).sum())
    return humanoid(DEFAULT_HEIGHT_M * scale, DEFAULT_MASS_KG * scale**2)


def mjcf_folder() -> Path:
    """Folder of the model files: inside the installed package, or beside it in a source checkout."""
    package = Path(__file__).resolve().parent
    installed = package / "mjcf"
    return installed if installed.is_dir() else package.parent / "mjcf"


def _spec(height_m: float, mass_kg: float) -> mujoco.MjSpec:
    """Editable model of the humanoid alone (no floor), scaled to a stature [m] and a mass [kg]."""
    spec = mujoco.MjSpec.from_file(str(mjcf_folder() / "humanoid.xml"))
    length = height_m / DEFAULT_HEIGHT_M
    mass = mass_kg / DEFAULT_MASS_KG
    if length == 1.0 and mass == 1.0:
        return spec
    radius = np.sqrt(mass / length)
    for part in spec.bodies[1:]:
        part.pos = part.pos * length
        part.mass = part.mass * mass
        part.ipos = part.ipos * length
        part.inertia = part.inertia * mass * length**2
    for geom in spec.geoms:
        _scale_geom(geom, length, radius)
    for site in spec.sites:
        site.pos = site.pos * length
    for joint in spec.joints:
        joint.armature = joint.armature * mass * length**2
        joint.damping = joint.damping * mass * length**2
    for servo in spec.actuators:
        servo.gainprm[0] *= mass * length**2
        servo.biasprm[1] *= mass * length**2
        servo.biasprm[2] *= mass * length**2
        servo.forcerange = servo.forcerange * mass * length
    return spec


def _scale_geom(geom: Any, length: float, radius: float) -> None:
    is_foot = geom.name.endswith(FOOT_GEOMS)
    if is_foot:  # the sole must stay on the floor at rest, so feet scale as a whole
        geom.size = geom.size * length
        geom.pos = geom.pos * length
        return
    geom.pos = geom.pos * length
    if np.isfinite(geom.fromto[0]):
        geom.fromto = geom.fromto * length
        geom.size = np.array([geom.size[0] * radius, *geom.size[1:]])
    else:
        geom.size = geom.size * length
