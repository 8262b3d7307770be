"""Film strips, plots and the choice of a GL library."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from simprep.errors import SettingError
from simprep.humanoid_model import humanoid
from simprep.motion.motion import Motion
from simprep.report.figures import plot_blending_curves, plot_com_and_support, plot_margins, support_margin
from simprep.report.film_strip import HEADER_PX, Row, Stage, StripSettings, film_strip, save_film_strip
from simprep.report.gl import NoGlError, find_backend

SMALL = StripSettings(columns=3, width_px=60, height_px=72)


@pytest.fixture(scope="module")
def can_draw():
    try:
        find_backend()
    except NoGlError as problem:
        pytest.skip(str(problem))


@pytest.fixture
def stand():
    return Motion(
        np.repeat(humanoid().standing_qpos.copy()[None], 31, axis=0), 30.0, np.ones((31, 2), bool), name="stand"
    )


def with_arm_raised(motion):
    qpos = motion.qpos.copy()
    qpos[:, 7 + humanoid().joint("right_shoulder_flexion")] = np.linspace(0, 1.5, len(qpos))
    return replace(motion, qpos=qpos)


def pictures(strip, settings, row):
    top = HEADER_PX + row * (HEADER_PX + settings.height_px)
    part = strip[top : top + settings.height_px]
    return [part[:, k * settings.width_px : (k + 1) * settings.width_px].astype(int) for k in range(settings.columns)]


def test_a_strip_shows_what_moves_and_what_does_not(can_draw, stand):
    strip = film_strip([Row("still", stand), Row("raised", with_arm_raised(stand))], SMALL)
    assert strip.shape == (2 * (HEADER_PX + 72) + HEADER_PX, 180, 3)
    still, raised = pictures(strip, SMALL, 0), pictures(strip, SMALL, 1)
    assert np.abs(still[0] - still[2]).max() == 0
    assert np.abs(raised[0] - still[0]).max() == 0
    assert (np.abs(raised[2] - raised[0]).max(axis=2) > 40).sum() > 20  # the arm's pixels


def test_the_camera_follows_the_body_but_the_floor_moves(can_draw, stand):
    qpos = stand.qpos.copy()
    qpos[:, 0] = np.linspace(0, 1.25, 31)
    start, _, end = pictures(film_strip([Row("slides", replace(stand, qpos=qpos))], SMALL), SMALL, 0)
    character = slice(10, 45), slice(27, 34)
    assert np.abs(start[character] - end[character]).mean() < 12
    assert (np.abs(start[60:] - end[60:]).max(axis=2) > 5).any()


def test_a_row_that_ends_early_is_greyed(can_draw, stand):
    short = replace(stand, qpos=stand.qpos[:11], contacts=stand.contacts[:11])
    first, _, last = pictures(film_strip([Row("short", short), Row("long", stand)], SMALL), SMALL, 0)
    inside = slice(25, 70), slice(5, 55)  # below the note
    assert np.ptp(last[inside], axis=2).max() < 3
    assert np.ptp(first[inside], axis=2).max() > 30


def test_others_are_drawn_tinted_and_the_picture_widens_to_hold_them(can_draw, stand):
    far = replace(stand, qpos=stand.qpos + np.eye(stand.qpos.shape[1])[0] * 3.0)
    settings = replace(SMALL, note="two of them")
    strip = film_strip([Row("alone", stand), Row("two", stand, others=(far,))], settings)
    assert strip.shape == (2 * (HEADER_PX + 72) + 2 * HEADER_PX, 180, 3)
    alone, both = pictures(strip, settings, 0)[0], pictures(strip, settings, 1)[0]

    def columns(picture):  # where something redder than the floor is
        return np.flatnonzero((picture[..., 0] - picture[..., 2] > 35).any(axis=0))

    assert len(columns(alone))
    assert columns(alone).min() > 15
    assert columns(alone).max() < 45
    assert columns(both).min() < 20
    assert 40 < columns(both).max() < 58  # inside the picture of 60


def test_different_bodies_share_a_strip_and_strips_share_a_stage(can_draw, stand):
    character = humanoid(1.4, 45.0)
    small = Motion(
        np.repeat(character.standing_qpos.copy()[None], 31, axis=0), 30.0, stand.contacts, character=character
    )
    rows = [Row("one", stand), Row("small", small), Row("one", stand), Row("small", small)]
    with Stage(SMALL) as stage:
        strip, again = film_strip(rows, SMALL, stage), film_strip(rows[:1], SMALL, stage)
    one, two, three, four = (pictures(strip, SMALL, row)[0] for row in range(4))
    assert np.array_equal(one, three)
    assert np.array_equal(two, four)
    assert (np.abs(one - two).max(axis=2) > 40).sum() > 20  # smaller by a head
    assert np.array_equal(pictures(again, SMALL, 0)[0], one)


def test_a_strip_is_saved_small_and_bad_layouts_are_refused(can_draw, stand, tmp_path):
    path = save_film_strip([Row("stand", stand)], tmp_path / "deep" / "strip.png", SMALL)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert path.stat().st_size < 40_000
    assert [file.name for file in path.parent.iterdir()] == ["strip.png"]
    with pytest.raises(SettingError, match="no rows"):
        film_strip([], SMALL)
    with pytest.raises(SettingError, match="1 columns"):
        film_strip([Row("stand", stand)], replace(SMALL, columns=1))


def test_no_gl_library_is_a_message_that_names_the_package():
    code = (
        "from simprep.report.gl import find_backend, NoGlError\n"
        "try: find_backend()\nexcept NoGlError as problem: print('MESSAGE', problem)"
    )
    for wish, words in (("nonexistent", ("libegl1", "libosmesa6", "nonexistent: ")), ("disable", ("turned off",))):
        environment = {**os.environ, "SIMPREP_GL": wish, "MUJOCO_GL": "disable"}
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        assert done.stdout.startswith("MESSAGE ")
        assert all(word in done.stdout for word in words)


def test_support_margin_of_standing(stand):
    time, margin = support_margin(stand)
    assert time[-1] == pytest.approx(1.0)
    assert (margin > 0.02).all()  # a person stands inside his feet
    lifted = replace(stand, contacts=np.zeros((31, 2), bool))
    assert np.isnan(support_margin(lifted)[1]).all()
    back_bent = stand.qpos.copy()
    back_bent[:, 7 + humanoid().joint("lumbar_flexion")] = -0.4
    assert (support_margin(replace(stand, qpos=back_bent))[1] < margin).all()


def test_plots_are_written(stand, tmp_path):
    motions = {"without": stand, "with": with_arm_raised(stand)}
    lines = {label: support_margin(motion) for label, motion in motions.items()}
    files = [
        plot_com_and_support(motions, [0, 10, 30], tmp_path / "com.png", "title"),
        plot_margins({"a": lines, "b": lines}, tmp_path / "margin.png", "title", launch_s=0.5),
        plot_blending_curves({"straight": lambda a, c: a}, {"legs": 1.0}, tmp_path / "curves.png"),
    ]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in files)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["com.png", "curves.png", "margin.png"]
