"""The 4 core nodes: cyclic locomotion that the controller chooses among."""

from dataclasses import replace
from functools import cache

from simprep.controller.settings import ControllerSettings
from simprep.errors import MotionError, UnknownNameError
from simprep.library import library_motion, library_names
from simprep.library.walking.walk import WalkStyle, walk
from simprep.motion.edit import mirror
from simprep.motion.motion import Motion

TURN = WalkStyle(
    frames=64, step_length=0.04, step_width=0.18, stance_share=0.68, com_height=0.965, com_bounce=0.004, arm_swing_deg=4.0,
    foot_roll=0.2, turn_deg=60.0,
)  # fmt: skip
"""Steps round on a circle of 8 cm radius, 56 deg/s. A curved walk needs 1.6 m: it would circle round nearer goals."""
OWN = ("step_round_left", "step_round_right")
"""Core nodes made here; all others are motions of the library."""


def core_motions(settings: ControllerSettings) -> tuple[Motion, ...]:
    """The core nodes of a controller; UnknownNameError for an unknown name, MotionError if a motion is no loop."""
    return tuple(core_motion(name) for name in settings.cores)


def core_motion(name: str) -> Motion:
    """A core node by name: `step_round_left`, `step_round_right`, or a library loop; errors as of `core_motions`."""
    if name in OWN and name not in library_names():
        return _turning(name)
    if name not in library_names():
        raise UnknownNameError("core node", name, (*OWN, *library_names()))
    motion = library_motion(name)
    if not motion.loop:
        raise MotionError(f"{name} is not a loop; core nodes are cyclic locomotion")
    return motion


@cache
def _turning(name: str) -> Motion:
    left = walk(TURN, "step_round_left")
    return left if name == "step_round_left" else replace(mirror(left), name=name, source=f"simprep core node: {name}")
