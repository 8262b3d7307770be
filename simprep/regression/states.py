"""States of a run after its first steps, as numbers: what a short physics golden compares."""

from collections.abc import Mapping

import numpy as np

from simprep.errors import SettingError
from simprep.physics.run import BodyRun, Run
from simprep.regression.measured import Case

STEPS = 50
"""How many steps are compared: enough for contact and torque limits to matter, too few for chaos."""
MOST_STEPS = 100
INSTANTS = 5
"""At how many of the steps, evenly spaced, states are kept."""
_ROOT = ("x", "y", "z", "qw", "qx", "qy", "qz")
_ROOT_SPEED = ("vx", "vy", "vz", "wx", "wy", "wz")


def states_of(run: Run, steps: int = STEPS) -> dict[str, Case]:
    """States after some of the first steps of a run, a case each: qpos, qvel and torque by joint.

    Args:
        run: of one body or several.
        steps: how many of its steps, 1 to `MOST_STEPS`.

    Raises:
        SettingError: steps out of range, or a run that is shorter.
    """
    if not 1 <= steps <= MOST_STEPS:
        raise SettingError(f"a golden of {steps} steps; valid: 1 to {MOST_STEPS}, later states differ by chaos alone")
    if run.steps < steps:
        raise SettingError(f"a golden of {steps} steps of a run that has {run.steps} ({run.end_reason})")
    instants = np.unique(np.linspace(0, steps, min(INSTANTS, steps) + 1).round().astype(int)[1:])
    return {f"step {step}": _at(run, int(step)) for step in instants}


def _at(run: Run, step: int) -> Case:
    many = len(run.bodies) > 1
    found: dict[str, tuple[float | None, ...]] = {}
    for number, body in enumerate(run.bodies):
        found |= {f"{number} {name}" if many else name: (value,) for name, value in _state(body, step).items()}
    return Case((run.seed,), found)


def _state(body: BodyRun, step: int) -> Mapping[str, float | None]:
    joints = body.reference.character.joints
    named = (
        ("qpos", (*_ROOT, *joints), body.qpos[step]),
        ("qvel", (*_ROOT_SPEED, *joints), body.qvel[step]),
        ("torque", joints, body.torque[step - 1]),
    )
    return {
        f"{array} {name}": float(value) if np.isfinite(value) else None
        for array, names, values in named
        for name, value in zip(names, values, strict=True)
    }
