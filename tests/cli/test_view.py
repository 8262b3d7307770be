"""`simprep view` and `simprep render`: from a name, a file or a folder to something to look at."""

import json

import numpy as np
import pytest

from simprep import library_motion, track
from simprep.cli import view as view_module
from simprep.cli.main import main
from simprep.cli.shown import read_shown
from simprep.duel.stream.store import save_stream
from simprep.duel.stream.stream import DuelStream
from simprep.errors import MissingExtraError, MotionFileError
from simprep.motion.edit import move
from simprep.report import film
from simprep.report.gl import NoGlError, find_backend


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A result's folder without a page: a run and its metrics."""
    made = tmp_path_factory.mktemp("results") / "stand_pd"
    track(library_motion("stand")[:12], "pd").save(made / "run.npz")
    (made / "metrics.json").write_text('{"schema": "simprep.track/1"}')
    return made


def view(capsys, *arguments):
    assert main(["view", *map(str, arguments), "--no-open", "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_folder_its_metrics_and_its_run_are_the_same_run(folder, tmp_path, capsys):
    runs = [read_shown(str(path), print).run for path in (folder, folder / "metrics.json", folder / "run.npz")]
    assert runs[0] is not None
    assert runs[0] == runs[1] == runs[2]
    told = view(capsys, folder, "-o", tmp_path / "page.html")
    assert (told["kind"], told["opened"]) == ("run", False)
    assert "is followed to its end" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_a_page_that_is_there_is_opened_and_not_made_again(tmp_path, capsys, monkeypatch):
    (tmp_path / "report.html").write_text("<p>made before</p>")
    opened = []
    monkeypatch.setattr(view_module, "_has_screen", lambda: True)
    monkeypatch.setattr(view_module.webbrowser, "open", lambda url: not opened.append(url))
    assert main(["view", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["opened"]
    assert opened == [(tmp_path / "report.html").resolve().as_uri()]


def test_a_motion_of_the_library_and_several_people_are_shown(tmp_path, capsys):
    told = view(capsys, "punch_right", "-o", tmp_path / "punch.html")
    assert told["kind"] == "motion"
    stand = library_motion("stand")[:10]
    people = (stand, move(stand, (1.0, 0.0), np.pi), move(stand, (0.0, 1.0), 0.0))
    for count in (2, 3):
        path = save_stream(DuelStream(people[:count]), tmp_path / "people.npz")
        told = view(capsys, path, "-o", tmp_path / "people.html")
        assert told["kind"] == "stream"
        assert f"{count} people" in (tmp_path / "people.html").read_text(encoding="utf-8")


def test_what_cannot_be_shown_is_refused(tmp_path, capsys):
    from simprep.archive import write_archive

    policy = write_archive(tmp_path / "policy.npz", {"schema": "simprep.policy/1"}, {})
    with pytest.raises(MotionFileError, match=r"simprep\.policy/1; valid: a run"):
        read_shown(str(policy), print)
    for arguments in (["view", str(policy)], ["view", str(tmp_path / "missing.npz")]):
        assert main(arguments) == 2
    capsys.readouterr()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "walk.avi"], "valid endings: .mp4, .gif, .png"),
        (["-o", "walk.mp4", "--size", "64"], "valid: WIDTHxHEIGHT"),
        (["-o", "walk.mp4", "--size", "64x33"], "valid: even numbers"),
        (["-o", "walk.gif", "--fps", "0"], "valid: 1 to 60"),
        (["-o", "walk.png", "--columns", "1"], "valid: 2 to 60"),
    ],
)
def test_a_wrong_wish_is_one_line(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["render", "walk", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_package_to_install_is_named(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(film, "_mp4_writer", lambda: (_ for _ in ()).throw(MissingExtraError("an MP4", "video")))
    assert main(["render", str(folder), "-o", str(tmp_path / "a.mp4")]) == 2
    assert "simprep[video]" in capsys.readouterr().err

    class NoStage:
        def __init__(self, settings):
            raise NoGlError("apt install libegl1")

    monkeypatch.setattr(film, "Stage", NoStage)
    assert main(["render", str(folder), "-o", str(tmp_path / "a.gif")]) == 2
    assert "apt install libegl1" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())  # whole or not at all


def test_films_hold_the_pictures_of_the_whole_motion(folder, tmp_path, capsys):
    try:
        find_backend()
    except NoGlError as problem:
        pytest.skip(str(problem))
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    from PIL import Image

    motion = library_motion("punch_right")
    common = ["--size", "64x48", "--fps", "10", "--quiet"]
    for name in ("a.mp4", "a.gif"):
        assert main(["render", "punch_right", "-o", str(tmp_path / name), *common]) == 0
    pictures = round(motion.duration * 10) + 1
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))[0] == pictures
    shades, lasting_ms = [], 0
    with Image.open(tmp_path / "a.gif") as image:
        assert image.size == (64, 48)
        for number in range(image.n_frames):  # equal pictures that follow each other are one that lasts longer
            image.seek(number)
            lasting_ms += image.info["duration"]
            shades.append(np.asarray(image.convert("L"), dtype=float))
    assert lasting_ms == 100 * pictures
    assert np.ptp(shades, axis=0).max() > 20  # an arm is somewhere else
    assert main(["render", str(folder), "-o", str(tmp_path / "run.png"), "--columns", "2"]) == 0
    assert str(tmp_path / "run.png") in capsys.readouterr().out
