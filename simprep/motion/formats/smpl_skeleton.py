"""The skeleton that SMPL, SMPL-H and SMPL-X share, as a table of a mean body; and of a person, from a model of the user's.

The table is no part of any model: joint offsets of the mean body as open-source simulators of it publish them
(`smpl_humanoid.xml` of PHC, Luo et al. 2023, and of ProtoMotions), made symmetric and rounded to 5 mm. The rounding turns
bones by up to 2 degrees against the model's.
"""

from pathlib import Path

import numpy as np

from simprep.archive import open_arrays
from simprep.arrays import FloatArray, IndexArray
from simprep.errors import MotionFileError

JOINTS: tuple[tuple[str, int, tuple[float, float, float]], ...] = (
    # name, parent, offset from it in the T-pose (x left, y up, z forward) [m]; in the models' order
    ("pelvis", -1, (0.0, 0.0, 0.0)),
    ("left_hip", 0, (0.07, -0.09, -0.005)),
    ("right_hip", 0, (-0.07, -0.09, -0.005)),
    ("spine1", 0, (0.0, 0.11, -0.025)),
    ("left_knee", 1, (0.035, -0.38, -0.005)),
    ("right_knee", 2, (-0.035, -0.38, -0.005)),
    ("spine2", 3, (0.0, 0.135, 0.0)),
    ("left_ankle", 4, (-0.015, -0.4, -0.045)),
    ("right_ankle", 5, (0.015, -0.4, -0.045)),
    ("spine3", 6, (0.0, 0.055, 0.025)),
    ("left_foot", 7, (0.025, -0.055, 0.12)),
    ("right_foot", 8, (-0.025, -0.055, 0.12)),
    ("neck", 9, (0.0, 0.215, -0.045)),
    ("left_collar", 9, (0.08, 0.12, -0.035)),
    ("right_collar", 9, (-0.08, 0.12, -0.035)),
    ("head", 12, (0.0, 0.065, 0.05)),
    ("left_shoulder", 13, (0.09, 0.03, -0.01)),
    ("right_shoulder", 14, (-0.09, 0.03, -0.01)),
    ("left_elbow", 16, (0.26, -0.015, -0.025)),
    ("right_elbow", 17, (-0.26, -0.015, -0.025)),
    ("left_wrist", 18, (0.25, 0.01, 0.0)),
    ("right_wrist", 19, (-0.25, 0.01, 0.0)),
    # the palms move with the wrists: fingers, and SMPL's hand joints, drive nothing here
    ("left_palm", 20, (0.085, -0.01, -0.015)),
    ("right_palm", 21, (-0.085, -0.01, -0.015)),
)
BODY = 22
"""Joints that every variant has, the pelvis among them; they come first."""
NAMES = tuple(name for name, _, _ in JOINTS)
PARENTS: IndexArray = np.array([parent for _, parent, _ in JOINTS], dtype=np.intp)
MEAN_OFFSETS: FloatArray = np.array([offset for _, _, offset in JOINTS])
LARGEST_MODEL = 2_000_000_000
"""A model file with all its blend shapes may be this large [bytes, unpacked]."""


def offsets_of_model(path: Path, betas: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Offsets (24, 3) and the place of the pelvis (3,) of a person, from a model file of the user's [m].

    Args:
        path: a model as .npz with `J_regressor`, `v_template` and `shapedirs` (SMPL-H and SMPL-X are published so; SMPL's
            pickles are not read).
        betas: shape of the person.

    Raises:
        MotionFileError: not such a file.
    """
    with open_arrays(path, "SMPL body model (.npz)", LARGEST_MODEL) as archive:
        missing = [name for name in ("J_regressor", "v_template", "shapedirs") if name not in archive]
        if missing:
            raise MotionFileError(path, f"no {', '.join(missing)}; valid: a SMPL, SMPL-H or SMPL-X model as .npz")
        regressor, template, shapes = (
            np.asarray(archive[name], dtype=np.float64) for name in ("J_regressor", "v_template", "shapedirs")
        )
        if regressor.ndim != 2 or template.shape != (regressor.shape[1], 3) or shapes.shape[:2] != template.shape:
            raise MotionFileError(path, "J_regressor, v_template and shapedirs do not fit each other")
        if len(regressor) < BODY:
            raise MotionFileError(path, f"{len(regressor)} joints; valid: {BODY} or more")
        count = min(len(betas), shapes.shape[2])
        places = regressor[:BODY] @ (template + shapes[..., :count] @ betas[:count])
    offsets = MEAN_OFFSETS.copy()
    offsets[1:BODY] = places[1:] - places[PARENTS[1:BODY]]
    return offsets, places[0]
