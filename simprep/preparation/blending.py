"""Level of preparation to joint weights, and postures blended with them (paper, Eq. 1-2)."""

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.errors import UnknownNameError
from simprep.motion.rotations import multiply_quat, wrap_angle
from simprep.motion.turns import about_vertical
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings


def blending_weight(alpha: FloatArray | float, curvature: FloatArray | float, curve: str = "described") -> FloatArray:
    """Weight, 0 to 1, of the reference posture at a level of preparation (paper, Eq. 1); exactly 0 at alpha 0 and 1 at alpha 1.

    As printed, w = (1 - (1 - a)^C)^(1/C) with C = 0.5 makes the arms lag behind the legs (w(0.5) = 0.09), while the paper's
    text and its Fig. 5 and 6 say that they lead. `described` is the mirror image of that curve in the point (1/2, 1/2),
    w = 1 - (1 - a^C)^(1/C), which leads (w(0.5) = 0.91). Both are straight lines at C = 1.

    Args:
        alpha: level of preparation, 0 to 1; any shape.
        curvature: C, above 0; broadcasts against alpha.
        curve: `described`, `printed`, or `linear` (w = alpha whatever C).
    """
    a = np.asarray(alpha, dtype=np.float64)
    c = np.asarray(curvature, dtype=np.float64)
    if curve == "linear":
        return np.broadcast_to(a, np.broadcast_shapes(a.shape, c.shape)).copy()
    weight = (1 - (1 - a) ** c) ** (1 / c) if curve == "printed" else 1 - (1 - a**c) ** (1 / c)
    straight = np.broadcast_to(a, weight.shape)
    return np.asarray(np.where(c == 1.0, straight, weight))  # bit-exact line: no rounding by 1 - (1 - a)


def joint_weights(
    alpha: FloatArray, character: Character, settings: PreparationSettings = DEFAULT_SETTINGS
) -> tuple[FloatArray, FloatArray]:
    """Blending weights of the root (T,) and of every hinge (T, joints) at (T,) levels of preparation.

    Raises:
        UnknownNameError: a curvature is set for a joint that the character lacks.
    """
    c = np.full(len(character.joints), settings.curvature_lower)
    c[character.upper_joints] = settings.curvature_upper
    c_root = settings.curvature_lower
    for name, value in settings.curvature.items():
        if name == "root":
            c_root = value
        elif name in character.joints:
            c[character.joint(name)] = value
        else:
            raise UnknownNameError("joint", name, ("root", *character.joints))
    return (
        blending_weight(alpha, c_root, settings.curve),
        blending_weight(np.asarray(alpha)[:, None], c, settings.curve),
    )


def split_heading(quat: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Split root rotations (..., 4) wxyz into heading (...) and tilt (..., 2) [rad]: the tilt first, then the heading about z.

    The tilt is the rotation vector of the remaining turn, about the heading's x and y axes: roll and pitch where the body
    tilts about one axis, but regular up to upside down (Euler angles are singular at 90 deg of pitch, as in a crawl).
    """
    w, x, y, z = np.moveaxis(np.asarray(quat, dtype=np.float64), -1, 0)
    norm = np.hypot(w, z)
    safe = norm > 1e-9  # upside down the heading is undefined; zero then
    heading = np.where(safe, 2 * np.arctan2(np.where(safe, z, 0.0), np.where(safe, w, 1.0)), 0.0)
    c, s = np.cos(heading / 2), np.sin(heading / 2)
    sx, sy = c * x + s * y, c * y - s * x  # heading^-1 * quat
    sine = np.hypot(sx, sy)
    angle = 2 * np.arctan2(sine, norm)
    scale = np.where(sine > 1e-12, angle / np.where(sine > 1e-12, sine, 1.0), 2.0)
    return wrap_angle(heading), np.stack([scale * sx, scale * sy], axis=-1)


def join_heading(heading: FloatArray, tilt: FloatArray) -> FloatArray:
    """Inverse of `split_heading`: heading (...) and tilt (..., 2) [rad] to a quaternion (..., 4) wxyz."""
    heading = np.asarray(heading)
    vector = np.concatenate([tilt, np.zeros((*heading.shape, 1))], axis=-1)
    swing = Rotation.from_rotvec(vector.reshape(-1, 3)).as_quat(scalar_first=True).reshape(*heading.shape, 4)
    return multiply_quat(about_vertical(heading), swing)
