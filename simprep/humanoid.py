"""The body: names, groups, mirror map, scaled models and scenes. Every other module takes them from here.

The model itself, with the sources of its numbers, is `mjcf/humanoid.xml` (1.75 m, 75 kg). Other statures and masses
are scaled copies: lengths with height, masses with mass, radii with the square root of mass per height, inertias with
mass times height squared (de Leva's percentages hold exactly), torque limits with mass times height (Anderson et al. 2007
normalise by m g h), gains and armature with mass times height squared.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.errors import SettingError

MODEL_NAME = "simprep_humanoid"
MODEL_VERSION = 1
DEFAULT_HEIGHT_M = 1.75
DEFAULT_MASS_KG = 75.0
GRAVITY = 9.81
"""Acceleration of free fall in the model [m/s^2]."""

SIDES = ("left", "right")

BODIES = (
    "pelvis", "abdomen", "thorax", "neck", "head",
    "left_upper_arm", "left_forearm", "left_hand", "right_upper_arm", "right_forearm", "right_hand",
    "left_thigh", "left_shank", "left_foot", "right_thigh", "right_shank", "right_foot",
)  # fmt: skip
"""The 17 bodies in model order (model body ids 1..17); each one's frame origin is the joint of that name."""
FEET = (BODIES.index("left_foot"), BODIES.index("right_foot"))
"""Left and right foot as indices into `BODIES`."""

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

N_QPOS = 7 + len(HINGES)
N_QVEL = 6 + len(HINGES)

_MIRROR_NEGATED = tuple(name for name in TRUNK_JOINTS if name.endswith(("bending", "rotation")))


def hinge_index(name: str) -> int:
    """Index of a hinge in `HINGES`; qpos index is 7 more, qvel index 6 more.

    Raises:
        UnknownNameError: no such hinge.
    """
    if name not in _HINGE_INDEX:
        from simprep.errors import UnknownNameError

        raise UnknownNameError("hinge", name, HINGES)
    return _HINGE_INDEX[name]


_HINGE_INDEX = {name: index for index, name in enumerate(HINGES)}


def mirror_map() -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """How hinges mirror in the sagittal plane: mirrored[k] = sign[k] * hinge[index[k]].

    Returns:
        index: (37,) source hinge of each mirrored hinge.
        sign: (37,) +1 or -1 (trunk bending and rotation change sign).
    """
    swap = {"left": "right", "right": "left"}
    index = []
    for name in HINGES:
        side, _, rest = name.partition("_")
        index.append(_HINGE_INDEX[f"{swap[side]}_{rest}" if side in swap else name])
    sign = np.array([-1.0 if name in _MIRROR_NEGATED else 1.0 for name in HINGES])
    return np.array(index, dtype=np.intp), sign


@dataclass(frozen=True)
class Body:
    """A person: stature [m] and mass [kg] (valid: 1.2 to 2.2 m, 30 to 160 kg)."""

    height_m: float = DEFAULT_HEIGHT_M
    mass_kg: float = DEFAULT_MASS_KG

    def __post_init__(self) -> None:
        if not 1.2 <= self.height_m <= 2.2:
            raise SettingError(f"height {self.height_m} m is outside 1.2 to 2.2 m")
        if not 30.0 <= self.mass_kg <= 160.0:
            raise SettingError(f"mass {self.mass_kg} kg is outside 30 to 160 kg")


DEFAULT_BODY = Body()


def body_of_leg(leg_m: float) -> Body:
    """The body whose thigh plus shank has a given length; its mass goes with the square of stature (equal BMI).

    Args:
        leg_m: hip to ankle joint along the bones [m].

    Raises:
        SettingError: no valid stature has such legs.
    """
    offsets = humanoid_model().body_pos[[1 + BODIES.index("left_shank"), 1 + BODIES.index("left_foot")]]
    scale = leg_m / float(np.linalg.norm(offsets, axis=1).sum())
    return Body(DEFAULT_HEIGHT_M * scale, DEFAULT_MASS_KG * scale**2)


def mjcf_folder() -> Path:
    """Folder with the model files: inside the installed package, or beside it in a source checkout."""
    package = Path(__file__).resolve().parent
    installed = package / "mjcf"
    return installed if installed.is_dir() else package.parent / "mjcf"


def humanoid_spec(body: Body = DEFAULT_BODY) -> Any:
    """Editable `mujoco.MjSpec` of the humanoid alone (no floor), scaled to a body.

    Args:
        body: stature and mass.
    """
    spec = mujoco.MjSpec.from_file(str(mjcf_folder() / "humanoid.xml"))
    length = body.height_m / DEFAULT_HEIGHT_M
    mass = body.mass_kg / DEFAULT_MASS_KG
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


@lru_cache(maxsize=16)
def humanoid_model(body: Body = DEFAULT_BODY) -> Any:
    """Compiled `mujoco.MjModel` of the humanoid alone, for kinematics; shared, so do not write to it.

    Args:
        body: stature and mass.
    """
    return humanoid_spec(body).compile()


def standing_qpos(body: Body = DEFAULT_BODY) -> NDArray[np.float64]:
    """Upright zero pose on the floor at the origin, facing x.

    Returns:
        (44,) qpos.
    """
    return np.array(humanoid_model(body).qpos0)
