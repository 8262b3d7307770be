"""Contact force, its minima, and cuts as an editable file."""

from dataclasses import replace

import numpy as np
import pytest
from duel_cases import standing_pair

from simprep import library_motion
from simprep.duel.labels.cuts import read_cuts, save_cuts
from simprep.duel.labels.segmentation import (
    Cuts,
    SegmentationSettings,
    contact_force,
    force_minima,
    segment_stream,
    stream_kinematics,
)
from simprep.duel.stream.stream import DuelStream, concatenate_streams
from simprep.errors import MotionError, MotionFileError, SettingError
from simprep.humanoid_model import GRAVITY
from simprep.motion.edit import move
from simprep.report.duel.figures import plot_cuts

FPS = 60.0
WHOLE = SegmentationSettings(shortest_s=0.1)


def sway(frames=300, hertz=1.5, height=0.02):
    com = np.zeros((frames, 3))
    com[:, 2] = 0.9 + height * np.cos(2 * np.pi * hertz * np.arange(frames) / FPS)
    return com


def bounds_of(*edges):
    return np.array([edges[:-1], edges[1:]], dtype=np.int64).T


def test_force_of_a_swaying_mass_is_that_of_the_smoothed_path():
    omega, sigma = 2 * np.pi * 1.5, WHOLE.smoothing_s
    force = contact_force(sway(), FPS, bounds_of(0, 300), WHOLE)
    gain = np.exp(-((omega * sigma) ** 2) / 2)
    exact = 1 - gain * 0.02 * omega**2 / GRAVITY * np.cos(omega * np.arange(300) / FPS)
    assert np.abs(force - exact)[20:-20].max() < 2e-3
    minima, prominence = force_minima(force, FPS, bounds_of(0, 300), WHOLE)
    assert list(minima) == [40, 80, 120, 160, 200, 240, 280]
    # the end of the clip cuts off the last one's far side
    assert prominence[:-1] == pytest.approx(2 * gain * 0.02 * omega**2 / GRAVITY, rel=0.01)


def test_force_does_not_see_uniform_motion_nor_the_heading():
    com = sway()
    moving = com + np.outer(np.arange(300) / FPS, [1.5, -0.7, 0.0])
    assert (
        np.abs(contact_force(moving, FPS, bounds_of(0, 300)) - contact_force(com, FPS, bounds_of(0, 300))).max() < 1e-9
    )
    pushed = com.copy()
    pushed[:, 0] += 0.05 * np.sin(2 * np.pi * np.arange(300) / FPS)
    turned = pushed @ np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1.0]])
    assert np.allclose(contact_force(pushed, FPS, bounds_of(0, 300)), contact_force(turned, FPS, bounds_of(0, 300)))
    vertical = SegmentationSettings(component="vertical")
    assert np.allclose(
        contact_force(pushed, FPS, bounds_of(0, 300), vertical), contact_force(com, FPS, bounds_of(0, 300), vertical)
    )


def test_clips_are_cut_each_by_itself():
    com = np.concatenate([sway(), sway()[7:] + np.array([3.0, 1.0, 0.2])])
    bounds = bounds_of(0, 300, len(com))
    force = contact_force(com, FPS, bounds)
    assert np.array_equal(force[:300], contact_force(com[:300], FPS, bounds_of(0, 300)))
    minima, _ = force_minima(force, FPS, bounds)
    assert list(minima) == [40, 80, 120, 160, 200, 240, 280, *(300 - 7 + np.arange(40, 281, 40))]


def test_a_flight_is_cut_once_in_its_middle():
    jump = library_motion("jump")
    stream = DuelStream((replace(jump, loop=False), move(replace(jump, loop=False), (1.5, 0.0), np.pi)))
    segmentation = segment_stream(stream)
    take_off, landing = jump.events["take_off"], jump.events["landing"]
    inside = [frame for frame in segmentation.cuts.frames[0] if take_off <= frame <= landing]
    assert len(inside) == 1
    assert abs(inside[0] - (take_off + landing) / 2) <= 0.05 * jump.fps
    assert np.abs(segmentation.force[0] - segmentation.force[1]).max() < 1e-6  # the same seen from elsewhere


def test_actions_follow_each_other_without_gaps():
    frames = (np.array([20, 50, 110]), np.array([70]))
    cuts = Cuts(frames, bounds_of(0, 90, 150))
    assert cuts.segments(0).tolist() == [[0, 20, 0], [20, 50, 0], [50, 90, 0], [90, 110, 1], [110, 150, 1]]
    table = cuts.table()
    assert table[:, 0].tolist() == [0] * 5 + [1] * 3
    with pytest.raises(MotionError, match="cut of player B at frame 90; valid: inside a clip"):
        Cuts((frames[0], np.array([90])), bounds_of(0, 90, 150))
    with pytest.raises(MotionError, match="cuts of player A do not rise"):
        Cuts((np.array([30, 30]), frames[1]), bounds_of(0, 90, 150))
    with pytest.raises(SettingError, match="component 'sideways'; valid: norm, vertical"):
        SegmentationSettings(component="sideways")


def test_standing_still_is_one_doubtful_action():
    segmentation = segment_stream(standing_pair(200))
    assert [len(frames) for frames in segmentation.cuts.frames] == [0, 0]
    assert [reason for _, _, reason in segmentation.suspicious] == ["6.7 s without a cut"] * 2


def test_cuts_can_be_edited_and_errors_name_the_line(tmp_path):
    stream = concatenate_streams([standing_pair(90), standing_pair(60)])
    cuts = Cuts((np.array([20, 50, 110]), np.array([70])), stream.bounds)
    path = save_cuts(cuts, stream, tmp_path / "cuts.txt")
    assert all(np.array_equal(a, b) for a, b in zip(read_cuts(path, stream).frames, cuts.frames))
    text = path.read_text()
    path.write_text(text.replace("A 50", "# A 50") + "B 33   # added\n")
    assert [frames.tolist() for frames in read_cuts(path, stream).frames] == [[20, 110], [33, 70]]
    last = len(text.splitlines()) + 1
    for line, why in {
        "C 40": "'C 40' is no cut; valid: A or B, then a frame number",
        "A -4": "'A -4' is no cut",
        "A 149": "frame 149; valid: 1 to 148",
        "B 90": "frame 90 begins a clip",
        "B 70": "player B is cut at frame 70 already in line 7",
    }.items():
        path.write_text(text + line + "\n")
        with pytest.raises(MotionFileError, match=f"line {last}: {why}"):
            read_cuts(path, stream)
    with pytest.raises(MotionFileError, match="no such file"):
        read_cuts(tmp_path / "none.txt", stream)


def test_force_and_cuts_are_drawn(tmp_path):
    stream = standing_pair(120)
    segmentation = segment_stream(stream, kinematics=stream_kinematics(stream))
    path = plot_cuts(
        stream, segmentation.force, Cuts((np.array([30]), np.array([60])), stream.bounds), tmp_path / "f.png"
    )
    assert path.stat().st_size > 10_000
    with pytest.raises(SettingError, match="frames 200 to 120"):
        plot_cuts(stream, segmentation.force, segmentation.cuts, tmp_path / "g.png", first=200)
