"""Arms come out of the body, smoothly, and nothing else moves."""

import numpy as np

from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.self_contact import arms_apart


def test_an_arm_in_the_trunk_is_moved_out_and_the_rest_stays() -> None:
    body = humanoid()
    qpos = np.repeat(library_motion("stand").qpos[:1], 60, axis=0)
    bump = np.zeros(60)
    bump[15:45] = np.sin(np.linspace(0, np.pi, 30)) ** 2
    elbow, shoulder = (body.anatomical(f"left_{name}") for name in ("elbow_flexion", "shoulder_rotation"))
    assert elbow is not None
    assert shoulder is not None
    qpos[:, 7 + elbow] += 1.5 * bump  # the forearm turns inward, across the belly
    qpos[:, 7 + shoulder] += 1.2 * bump
    out, before, after = arms_apart(qpos, 60.0, body)
    assert before.max() > 0.02
    assert after.max() < 0.004
    moved = np.flatnonzero(np.abs(out - qpos).max(axis=0) > 0)
    assert {body.joints[index - 7].split("_")[0] for index in moved} == {"left"}
    assert np.abs(np.diff(out - qpos, axis=0)).max() < 0.15
    np.testing.assert_array_equal(out[:5], qpos[:5])


def test_what_touches_nothing_stays_to_the_bit() -> None:
    walk = library_motion("walk")
    out, before, after = arms_apart(walk.qpos, walk.fps, walk.character, cyclic=True)
    np.testing.assert_array_equal(out, walk.qpos)
    assert before.max() == after.max() == 0.0
