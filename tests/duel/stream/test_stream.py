"""Streams: what they refuse, seams, files, import in one frame."""

import json
from dataclasses import replace

import numpy as np
import pytest
from duel_cases import standing_pair, three_boxers

from simprep.cli.main import main
from simprep.duel.labels.cuts import read_cuts
from simprep.duel.labels.labelling import label_codes
from simprep.duel.labels.segmentation import Cuts, segment_stream
from simprep.duel.model.fight_model import FightModel
from simprep.duel.model.tracks import pair_tracks
from simprep.duel.stream.import_pair import import_pair
from simprep.duel.stream.store import read_stream, save_stream
from simprep.duel.stream.stream import (
    DuelStream,
    check_stream,
    concatenate_streams,
    facing_error,
    opponent_distance,
    player_name,
    root_distance,
)
from simprep.errors import MotionError, MotionFileError
from simprep.humanoid_model import humanoid
from simprep.motion.edit import cut, move, resample, yaw
from simprep.motion.load import read_source
from simprep.motion.store import save_motion


def test_distance_and_facing_do_not_depend_on_the_frame_of_reference():
    stream = standing_pair(distance=1.3)
    turned = [move(motion, translation=(0.3, -2.0), turn=2.4) for motion in stream.players]
    turned[1] = replace(turned[1], qpos=turned[1].qpos.copy())
    moved = DuelStream((turned[0], turned[1]))
    assert root_distance(moved) == pytest.approx(1.3)
    assert np.abs(facing_error(moved)).max() < 1e-9
    aside = DuelStream((moved.players[0], move(stream.players[1], translation=tuple(turned[1].qpos[0, :2] - [1.3, 0]))))
    assert np.abs(facing_error(aside)[:, 1]) == pytest.approx(2.4)
    report = check_stream(aside)
    assert report.facing_share == (1.0, 0.0)
    assert any("B faces A in 0 %" in warning for warning in report.warnings)
    assert any("only 3.0 s: too few actions" in warning for warning in report.warnings)


def test_streams_that_do_not_fit_are_refused():
    stream = standing_pair()
    a, b = stream.players
    with pytest.raises(MotionError, match="a has 90 frames and b 80"):
        DuelStream((a, cut(b, 0, 80)))
    with pytest.raises(MotionError, match="a has 30 frames per second and b 60"):
        DuelStream((a, replace(b, fps=60.0)))
    with pytest.raises(MotionError, match=r"12\.0 m apart at frame 0; valid: up to 10 m"):
        DuelStream((a, move(b, translation=(10.8, 0.0))))
    with pytest.raises(MotionError, match="1 people; a stream needs 2 or more"):
        DuelStream((a,))
    with pytest.raises(MotionError, match=r"player B .* is a loop"):
        DuelStream((a, replace(b, loop=True)))
    with pytest.raises(MotionError, match="valid: rising frames from 1 to 89"):
        replace(stream, seams=(90,), clips=("x", "y"))


def test_of_three_the_opponent_is_the_nearest_whoever_is_first(tmp_path):
    three = three_boxers()
    assert three.names == ("A", "B", "C")
    assert [player_name(number) for number in (2, 25, 26)] == ["C", "Z", "AA"]
    roots = np.stack([motion.qpos[:, :2] for motion in three.players], axis=1)
    apart = np.linalg.norm(roots[:, :, None] - roots[:, None], axis=-1) + 100 * np.eye(3)
    np.testing.assert_array_equal(opponent_distance(three), apart.min(axis=2))
    np.testing.assert_allclose(root_distance(three), apart.min(axis=2).mean(axis=1))
    way = np.take_along_axis(roots[:, None], apart.argmin(axis=2)[..., None, None], axis=2)[:, :, 0] - roots
    heading = np.stack([yaw(motion.qpos[:, 3:7]) for motion in three.players], axis=1)
    off = np.exp(1j * (facing_error(three) + heading)) - (way @ [1, 1j]) / np.linalg.norm(way, axis=2)
    assert np.abs(off).max() < 1e-12
    turned = replace(three, players=three.players[1:] + three.players[:1])
    np.testing.assert_array_equal(opponent_distance(turned), np.roll(opponent_distance(three), -1, axis=1))
    np.testing.assert_allclose(facing_error(turned), np.roll(facing_error(three), -1, axis=1), atol=1e-12)
    # a third far away leaves the two as they are alone, to the bit
    far, pair = three_boxers(third=(-5.0, 3.0)), DuelStream(three.players[:2])
    np.testing.assert_array_equal(facing_error(far)[:, :2], facing_error(pair))
    np.testing.assert_array_equal(opponent_distance(far)[:, :2], opponent_distance(pair))
    np.testing.assert_array_equal(root_distance(pair), opponent_distance(pair)[:, 0])
    assert check_stream(far).facing_share[:2] == check_stream(pair).facing_share == (1.0, 1.0)
    assert "C faces A or B in 0 % of the frames only" in check_stream(far).warnings
    # in a file they stay who they are
    back = read_stream(save_stream(replace(three, seams=(12,), clips=("one", "two")), tmp_path / "three"))
    assert (back.names, back.seams, [one.name for one in back.players]) == (
        three.names, (12,), ["left", "right", "third"]
    )  # fmt: skip
    for one, two in zip(back.players, three.players):
        np.testing.assert_array_equal(one.qpos, two.qpos)
        np.testing.assert_array_equal(one.contacts, two.contacts)
        assert (one.fps, one.character, one.events) == (two.fps, two.character, two.events)


def test_three_who_do_not_fit_are_refused_and_those_who_exchange_names_named():
    three = three_boxers()
    a, b, c = three.players
    with pytest.raises(MotionError, match="left has 40 frames and third 30; people of a stream"):
        replace(three, players=(a, b, cut(c, 0, 30)))
    with pytest.raises(MotionError, match=r"the people are 1[12]\.\d m apart"):
        replace(three, players=(move(a, (-5.5, 0.0)), b, move(c, (5.5, 0.0))))  # neither is so far from B
    with pytest.raises(MotionError, match="3 people in three and 2 in stream; valid: the same ones in all"):
        concatenate_streams([three, DuelStream((a, b))])
    assert concatenate_streams([three, three]).seams == (40,)
    one, other = (motion.qpos.copy() for motion in (a, c))
    one[25:], other[25:] = other[25:].copy(), one[25:].copy()
    swapped = replace(three, players=(replace(a, qpos=one), b, replace(c, qpos=other)))
    assert [one for one in check_stream(swapped).warnings if "exchange" in one] == [
        f"A and C seem to exchange names at frame 25 ({25 / a.fps:.2f} s)"
    ]


@pytest.mark.parametrize(
    "use",
    [
        lambda three, _: segment_stream(three),
        lambda three, folder: read_cuts(folder / "none.txt", three),
        lambda three, _: label_codes(three, Cuts((np.array([], int), np.array([], int)), three.bounds), np.zeros((2, 5), int)),
        lambda three, _: pair_tracks(three),
        lambda three, _: FightModel(None, three),
        lambda three, folder: import_pair(save_stream(three, folder / "three")),
    ],
    ids=["segmentation", "cuts", "labels", "tracks", "model", "import"],
)  # fmt: skip
def test_what_is_of_pairs_says_so_of_three(use, tmp_path):
    with pytest.raises((MotionError, MotionFileError), match=r"3 people; (valid here: 2|an import takes 2)"):
        use(three_boxers(), tmp_path)


def test_people_who_exchange_names_are_noticed_but_not_at_a_seam():
    stream = standing_pair()
    a, b = (motion.qpos.copy() for motion in stream.players)
    a[50:], b[50:] = b[50:].copy(), a[50:].copy()
    swapped = replace(stream, players=tuple(replace(m, qpos=q) for m, q in zip(stream.players, (a, b))))
    assert "exchange names at frame 50 (1.67 s)" in check_stream(swapped).warnings[0]
    apart = replace(swapped, seams=(50,), clips=("one", "two"))
    assert not any("exchange" in warning for warning in check_stream(apart).warnings)


def test_concatenated_clips_keep_their_seams_and_survive_a_file(tmp_path):
    one, two = standing_pair(40), replace(standing_pair(30), clips=("second",))
    both = concatenate_streams([one, two, one], "bout")
    assert both.seams == (40, 70)
    assert both.clips == ("clip", "second", "clip")
    assert both.duration == pytest.approx((39 + 29 + 39) / 30)
    part = both.part(35, 75)
    assert part.seams == (5, 35)
    assert part.clips == both.clips
    back = read_stream(save_stream(both, tmp_path / "bout"))
    assert (back.seams, back.clips, back.name) == (both.seams, both.clips, both.name)
    assert all(np.array_equal(x.qpos, y.qpos) for x, y in zip(back.players, both.players))
    assert back.players[0].character == both.players[0].character
    foreign = replace(two.players[1], character=replace(humanoid(), balancing=()))
    with pytest.raises(
        MotionFileError, match=r"player B is <Character simprep_humanoid.*made for simprep_humanoid as it is"
    ):
        save_stream(replace(two, players=(two.players[0], foreign)), tmp_path / "foreign")
    assert not list(tmp_path.glob("foreign*"))
    other = replace(two, players=(two.players[0], replace(two.players[1], character=humanoid(1.6, 60.0))))
    with pytest.raises(MotionError, match="player B has another body"):
        concatenate_streams([one, other])
    with pytest.raises(MotionError, match="30 frames per second and stream 60"):
        concatenate_streams([one, DuelStream(tuple(resample(motion, 60.0) for motion in two.players))])


def test_files_that_hold_no_pair_are_refused(tmp_path):
    single = save_motion(standing_pair().players[0], tmp_path / "single")
    with pytest.raises(MotionFileError, match="one person; `simprep duel import A B` joins two"):
        read_stream(single)
    with pytest.raises(MotionFileError, match="a motion of one person; give the other one's file too"):
        import_pair(single)
    with pytest.raises(MotionFileError, match="no such file"):
        read_stream(tmp_path / "none.npz")
    shorter = save_motion(cut(standing_pair().players[1], 0, 60), tmp_path / "short")
    with pytest.raises(MotionFileError, match=r"60 frames where single.npz gives 90"):
        import_pair(single, shorter)
    (tmp_path / "broken.npz").write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(MotionFileError, match="not a readable stream of people"):
        read_stream(tmp_path / "broken.npz")


def test_saved_motions_are_joined_as_they_are(tmp_path):
    stream = standing_pair()
    a, b = (save_motion(motion, tmp_path / motion.name) for motion in stream.players)
    joined = import_pair(a, b).stream
    assert all(np.array_equal(x.qpos, y.qpos) for x, y in zip(joined.players, stream.players))


def test_the_handshake_pair_comes_in_one_frame(data_dir):
    files = [data_dir / "pairs" / name for name in ("18_01.bvh", "19_01.bvh")]
    if not all(file.is_file() for file in files):
        pytest.skip(f"no {files[0]}")
    pair = import_pair(*files)
    # what the files say: the joint "Hips", and the middle between the hip joints, which is our root
    scale = pair.imports[0].scale
    assert pair.imports[1].scale == scale
    roots, hips, carried = [], [], []
    for file, motion in zip(files, pair.stream.players):
        clip = read_source(file)
        kept = clip.positions[1::2] * scale  # without the inserted pose, every second frame
        middle = kept[:, [clip.names.index("LeftUpLeg"), clip.names.index("RightUpLeg")]].mean(axis=1)
        roots.append(kept[:, 0, [2, 0]])
        hips.append(middle[:, [2, 0]])
        # the file's root as a point of our pelvis: its mean place in the pelvis' heading frame
        heading = yaw(motion.qpos[:, 3:7])
        c, s = np.cos(heading)[:, None], np.sin(heading)[:, None]
        away = roots[-1] - hips[-1]
        local = np.column_stack([c * away[:, :1] + s * away[:, 1:], c * away[:, 1:] - s * away[:, :1]]).mean(axis=0)
        carried.append(motion.qpos[:, :2] + np.column_stack([c * local[0] - s * local[1], s * local[0] + c * local[1]]))

    def distances(points):
        gap = np.linalg.norm(points[0] - points[1], axis=1)
        return np.array([gap[0], gap.min(), gap[-1]])

    assert distances(roots) == pytest.approx([1.98, 0.74, 1.80], abs=0.005)
    assert distances(carried) == pytest.approx([1.98, 0.74, 1.80], abs=0.05)
    ours = root_distance(pair.stream)
    assert np.array([ours[0], ours.min(), ours[-1]]) == pytest.approx(distances(hips), abs=0.02)
    assert np.abs(ours - np.linalg.norm(hips[0] - hips[1], axis=1)).max() < 0.03
    # bodies of another size keep the distance too
    given = import_pair(*files, bodies=(humanoid(), humanoid(1.6, 60.0)))
    assert given.stream.players[1].character == humanoid(1.6, 60.0)
    assert np.abs(root_distance(given.stream) - ours).max() < 0.05
    # both walk up to each other
    assert check_stream(pair.stream).facing_share[1] > 0.9


def test_takes_that_were_not_recorded_together_are_refused(data_dir):
    bvh = data_dir / "pairs" / "18_01.bvh"
    kick = data_dir / "deepmimic" / "humanoid3d_kick.txt"
    with pytest.raises(MotionFileError, match=r"30 frames per second where 18_01\.bvh has 120"):
        import_pair(bvh, kick)
    with pytest.raises(MotionFileError, match="holds one person; give the other one's file too"):
        import_pair(bvh)


def test_commands_import_and_join(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    stream = standing_pair(700)
    for motion in stream.players:
        save_motion(motion, motion.name)
    assert main(["duel", "import", "a.npz", "b.npz", "-o", "one.npz", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["distance_m"] == pytest.approx([1.2] * 3)
    assert result["warnings"] == []
    assert main(["duel", "join", "one.npz", "one.npz", "-o", "two.npz"]) == 0
    assert read_stream("two.npz").seams == (700,)
    capsys.readouterr()
    assert main(["duel", "import", "a.npz"]) == 2
    assert "a motion of one person; give the other one's file too" in capsys.readouterr().err
    assert main(["duel", "join", "one.npz", "-o", "one.npz"]) == 2
    assert "is a stream to join" in capsys.readouterr().err
