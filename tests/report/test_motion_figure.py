"""Pictures of motions and runs over time: what is drawn is what the values hold."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from metric_cases import run_of, swaying_motion

import simprep
from simprep.motion.edit import cut
from simprep.motion.motion import Motion

pytest.importorskip("matplotlib")


def panel(figure, title):
    (found,) = [axes for axes in figure.axes if axes.get_title(loc="left").startswith(title)]
    return found


def line(axes, label):
    (found,) = [one for one in axes.lines if one.get_label() == label]
    return found.get_xdata(), found.get_ydata()


def test_a_motion_is_drawn_as_it_is(tmp_path):
    motion = replace(swaying_motion(60.0), events={"launch": 60, "target": 60})
    figure = motion.plot(path=tmp_path / "deep" / "motion.png")
    assert [file.name for file in (tmp_path / "deep").iterdir()] == ["motion.png"]
    assert (tmp_path / "deep" / "motion.png").read_bytes().startswith(b"\x89PNG")
    height, contacts, *angles = figure.axes
    assert np.array_equal(height.lines[0].get_ydata(), motion.qpos[:, 2])
    assert [axes.get_title(loc="left") for axes in angles] == [
        f"{group} [°]" for group in ("left arm", "right arm", "left leg", "right leg", "trunk")
    ]
    drawn = {(axes.get_title(loc="left"), one.get_label()) for axes in angles for one in axes.lines[:-1]}
    assert len(drawn) == len(motion.character.joints)
    time, elbow = line(panel(figure, "right arm"), "elbow flexion")
    assert np.array_equal(time, motion.times)
    assert elbow == pytest.approx(np.degrees(motion.qpos[:, 7 + motion.character.joint("right_elbow_flexion")]))
    left, right = ([box.get_extents() for box in bars.get_paths()] for bars in contacts.collections)
    assert [(box.x0, box.x1) for box in left] == [pytest.approx((0, 121 / 60))]
    assert [box.x1 for box in right] == [pytest.approx(0.8), pytest.approx(121 / 60)]
    assert [text.get_text() for text in height.texts] == ["launch, target"]


def test_joints_are_chosen_by_name_or_group():
    motion = swaying_motion(60.0)
    for joints, titles in (
        ("left_arm", ["left arm"]),
        ("right_knee_flexion", ["right leg"]),
        (["lumbar_flexion", "right_leg"], ["right leg", "trunk"]),
    ):
        angles = motion.plot(joints).axes[2:]
        assert [axes.get_title(loc="left") for axes in angles] == [f"{title} [°]" for title in titles]
    assert len(motion.plot("right_knee_flexion").axes[2].lines) == 2  # it, and the event
    with pytest.raises(simprep.UnknownNameError, match=r"'left_amr'; valid: trunk, left_arm, .*right_ankle_inversion$"):
        motion.plot(["trunk", "left_amr"])


def test_joints_without_a_group_are_drawn_too_in_model_order():
    motion = swaying_motion(60.0)
    plain = replace(motion, character=replace(motion.character, groups={}))
    (angles,) = plain.plot(["right_elbow_flexion", "lumbar_flexion"]).axes[2:]
    assert angles.get_title(loc="left") == "other joints [°]"
    assert [one.get_label() for one in angles.lines[:2]] == ["lumbar flexion", "right elbow flexion"]


def test_a_run_is_drawn_beside_its_reference_up_to_its_fall():
    motion = swaying_motion(120.0)
    poses = motion.qpos[:97] + np.eye(motion.qpos.shape[1])[2] * 0.01
    lower = Motion(poses, 120.0, motion.contacts[:97])
    torque = np.zeros((96, len(motion.character.joints)))
    torque[50, motion.character.joint("left_knee_flexion")] = -80.0  # of the 100 N m that all have
    figure = run_of(lower, motion, end="fell", fallen=0, torque=torque).plot()
    assert "fell at 0.80 s, made up" in figure.get_suptitle()
    height = panel(figure, "height")
    assert np.array_equal(line(height, "reference")[1], motion.qpos[:, 2])
    assert np.array_equal(line(height, "simulated")[1], poses[:, 2])
    assert height.get_xlim() == (0, motion.duration)  # what should have come after the fall is in the picture
    assert "fell" in [text.get_text().strip() for text in height.texts]
    time, share = line(panel(figure, "largest servo torque"), "left leg")
    assert share.max() == pytest.approx(80)
    assert time[np.argmax(share)] == pytest.approx(50 / 120)
    assert not line(panel(figure, "largest servo torque"), "right leg")[1].any()
    done = run_of(motion, motion).plot("trunk")
    assert len(done.axes) == 4
    assert not [text for text in done.axes[0].texts if text.get_text().strip() != "launch"]


def test_a_body_of_several_is_drawn_and_all_together_are_refused():
    motion = swaying_motion(60.0)
    run = run_of(motion, motion)
    pair = replace(run, bodies=run.bodies * 2)
    assert len(pair.body(1).plot("trunk").axes) == 4
    with pytest.raises(AttributeError, match=r"use run\.body\(0\)"):
        pair.plot()


def test_without_matplotlib_the_message_names_the_extra():
    code = (
        "import sys; sys.modules['matplotlib'] = None\nimport simprep\n"
        "try: simprep.library_motion('stand').plot()\nexcept simprep.MissingExtraError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "plotting needs an optional dependency: pip install 'simprep[report]'\n"


def test_one_frame_and_a_short_run_are_drawn():
    motion = swaying_motion(60.0)
    assert cut(motion, 0, 1).plot("trunk").axes[0].get_xlim() == (0, 1 / 60)
    for frames, end in ((2, "done"), (1, "diverged")):  # no step, where the first one diverged
        assert run_of(cut(motion, 0, frames), motion, end=end).plot("trunk").axes
