"""Targets that begin near the floor: entered by their own way up, backwards; all others as they are."""

import numpy as np
import pytest

from simprep.humanoid_model import GRAVITY
from simprep.library import library_motion, library_names
from simprep.motion.edit import cut
from simprep.motion.kinematics import forward_kinematics
from simprep.preparation.letting_down import let_down
from simprep.preparation.reference_posture import reference_posture
from simprep.preparation.scenario import build_scenario
from simprep.preparation.transition import DEFAULT_WINDOW_S

WALK, GET_UP = library_motion("walk"), library_motion("get_up_prone")


@pytest.mark.parametrize(("level", "arm"), [(0.0, "none"), (0.5, "optimised")])
def test_nobody_dives_to_the_floor(level: float, arm: str) -> None:
    made = build_scenario(WALK, GET_UP, level, arm)
    motion, launch = made.motion, made.launch
    height = forward_kinematics(motion.qpos, motion.character).com[:, 2]
    acceleration = np.gradient(np.gradient(height) * motion.fps) * motion.fps
    assert acceleration[launch:].min() > -GRAVITY
    assert motion.events["target"] > launch + 2 * motion.fps  # he lets himself down first
    lowest = launch + int(height[launch:].argmin())
    assert height[lowest] < 0.2 < 0.8 < height[-1]
    assert lowest == pytest.approx(motion.events["target"], abs=0.75 * motion.fps)


def test_a_target_that_a_body_can_reach_is_entered_as_it_is() -> None:
    entries = {name: library_motion(name) for name in library_names() if "target" in library_motion(name).events}
    changed = []
    for name, target in entries.items():
        entry = reference_posture(target).frame
        found, frame = let_down(target, entry, WALK.qpos[0], DEFAULT_WINDOW_S)
        if found is not target or frame != entry:
            changed.append(name)
    assert changed == ["get_up_prone"]


def test_who_never_gets_up_is_left_as_he_is() -> None:
    lying = cut(GET_UP, 0, 20)
    assert let_down(lying, 5, WALK.qpos[0], DEFAULT_WINDOW_S) == (lying, 5)


def test_the_way_down_is_the_way_up_backwards() -> None:
    found, frame = let_down(GET_UP, 3, WALK.qpos[0], DEFAULT_WINDOW_S)
    assert frame == 0
    begin = len(found) - (len(GET_UP) - 3)
    np.testing.assert_array_equal(found.qpos[begin:], GET_UP.qpos[3:])
    np.testing.assert_array_equal(found.qpos[: begin + 1], GET_UP.qpos[3 : 4 + begin][::-1])
    np.testing.assert_array_equal(found.contacts[: begin + 1], GET_UP.contacts[3 : 4 + begin][::-1])
    assert found.events == {name: at - 3 + begin for name, at in GET_UP.events.items() if at >= 3}
