"""Pose features, labelling from a few examples, the two rules, annotations; real pairs."""

from pathlib import Path

import numpy as np
import pytest
from duel_cases import bout, standing_pair

from simprep.cli.main import main
from simprep.duel.labels.annotations import read_annotations, save_annotations, segment_names
from simprep.duel.labels.cuts import save_cuts
from simprep.duel.labels.labelling import (
    MIRROR_ASPECTS,
    label_stream,
    mirror_features,
    propose,
    stream_features,
    train_labels,
)
from simprep.duel.labels.labels import LEARNED_ASPECTS, QUALIFIERS, decode
from simprep.duel.labels.pose_features import motion_features
from simprep.duel.labels.rules import FLIGHT, LEFT, RIGHT, move_rule, react_rule, stance_symbols
from simprep.duel.labels.scores import cross_validate, score
from simprep.duel.labels.segmentation import stream_kinematics
from simprep.duel.stream.store import save_stream
from simprep.errors import MotionFileError, SettingError
from simprep.motion.edit import mirror, move
from simprep.motion.kinematics import forward_kinematics

SEGMENTS = np.array([[0, 20], [20, 47], [47, 60]])


@pytest.fixture(scope="module")
def fight():
    stream, cuts, truth = bout(np.random.default_rng(1), 50)
    kinematics = stream_kinematics(stream)
    return stream, cuts, truth, kinematics, stream_features(cuts, kinematics)


def test_features_ignore_place_and_heading_and_mirror_with_the_motion(fight):
    motion = fight[0].part(0, 60).players[0]
    motion = move(motion, (0.4, 0.1), 0.3)

    def features(changed):
        return motion_features(forward_kinematics(changed.qpos, changed.character), SEGMENTS)

    before = features(motion)
    assert before.shape == (3, 10 * 54)
    assert np.abs(features(move(motion, (5.0, -3.0), 2.0)) - before).max() < 1e-9
    assert np.abs(features(mirror(motion)) - mirror_features(before, motion.character)).max() < 1e-9
    twice = mirror_features(mirror_features(before, motion.character), motion.character)
    assert np.abs(twice - before).max() == 0


def test_features_are_steps_turns_and_joints_in_the_roots_frame():
    motion = standing_pair().players[0]
    qpos = motion.qpos.copy()
    seconds = np.arange(len(qpos)) / motion.fps
    qpos[:, 3], qpos[:, 6] = np.cos(0.2 * seconds), np.sin(0.2 * seconds)  # turns at 0.4 rad/s
    qpos[:, 0] += np.sin(0.4 * seconds) / 0.4  # and walks along its heading at 1 m/s
    qpos[:, 1] += (1 - np.cos(0.4 * seconds)) / 0.4
    poses = motion_features(forward_kinematics(qpos, motion.character), np.array([[0, 28]]))[0].reshape(10, 54)
    step = 3 / motion.fps
    assert np.all(poses[0, :3] == 0)
    assert poses[1:, 2] == pytest.approx(0.4 * step)
    assert poses[1:, 0] == pytest.approx(np.sin(0.4 * step) / 0.4, abs=1e-4)
    assert poses[1:, 1] == pytest.approx((1 - np.cos(0.4 * step)) / 0.4, abs=1e-4)
    assert np.abs(poses[:, 3:] - poses[0, 3:]).max() < 1e-4
    assert poses[0, 3:6] == pytest.approx([0, 0, qpos[0, 2]])
    with pytest.raises(SettingError, match="outside the 90 frames"):
        motion_features(forward_kinematics(qpos, motion.character), np.array([[80, 95]]))


def test_a_third_of_the_annotations_labels_the_rest(fight):
    stream, cuts, truth, _, features = fight
    rows = np.sort(np.random.default_rng(0).permutation(len(truth))[: len(truth) // 3])
    result = label_stream(stream, cuts, rows, truth[rows], features=features)
    again = label_stream(stream, cuts, rows, truth[rows], features=features)
    assert np.array_equal(result.codes, again.codes)
    assert np.array_equal(result.margins, again.margins)
    left = np.setdiff1d(np.arange(len(truth)), rows)
    found = decode(result.codes)[:, : len(LEARNED_ASPECTS)]
    for column, aspect in enumerate(LEARNED_ASPECTS[:4]):
        held = score(truth[left, column], found[left, column], QUALIFIERS[aspect])
        assert held.accuracy > 0.95, aspect
        assert held.macro_f1 > 0.9, aspect
    assert np.array_equal(found[rows], truth[rows])
    assert any(warning.startswith("jump: every annotated action is 'others'") for warning in result.warnings)
    folds = cross_validate(features[rows], truth[rows], stream.players[0].character, np.random.default_rng(3))
    assert folds["right_kick"].accuracy > 0.9
    assert folds["right_kick"].confusion.sum() == len(rows)


def test_mirrored_examples_teach_the_other_side(fight):
    stream, _, truth, _, features = fight
    character = stream.players[0].character
    column = LEARNED_ASPECTS.index("left_kick")
    right_only = np.flatnonzero((truth[:, column] == 3) & (truth[:, LEARNED_ASPECTS.index("left_punch")] == 4))
    found, _ = train_labels(features[right_only], truth[right_only], character).predict(features)
    kicks = truth[:, column] != 3
    assert kicks.sum() > 10
    assert np.mean(found[kicks, column] == truth[kicks, column]) > 0.9
    assert [LEARNED_ASPECTS[index] for index in MIRROR_ASPECTS[:2]] == ["right_punch", "left_punch"]


def test_no_attack_annotated_is_said(fight):
    stream, cuts, truth, _, features = fight
    quiet = np.flatnonzero((truth == truth.max(axis=0)).all(axis=1))
    character = stream.players[0].character
    warnings = train_labels(features[quiet], truth[quiet], character).warnings
    assert any("no annotated action is an attack" in text for text in warnings)
    result = label_stream(stream, cuts, quiet, truth[quiet], features=features)
    assert "no action of the stream is labelled as an attack" in result.warnings[-1]
    with pytest.raises(SettingError, match="no annotated action"):
        train_labels(features[:0], truth[:0], character)


def test_the_most_uncertain_action_is_proposed_first():
    features = np.random.default_rng(0).normal(size=(30, 8))
    margins = np.linspace(1, 2, 30)[:, None] * np.ones(5)
    margins[[17, 4], [2, 0]] = [0.1, 0.2]
    assert propose(features, np.array([4]), margins, 2).tolist() == [17, 0]
    fresh = propose(features, np.zeros(0, dtype=int), None, 29)
    assert len(set(fresh)) == 29
    outlier = np.concatenate([features, np.full((1, 8), 40.0)])
    assert 30 in propose(outlier, np.zeros(0, dtype=int), None, 2)


def test_scores_count_rare_qualifiers_as_much_as_frequent_ones():
    result = score(np.array([0, 0, 0, 0, 1, 1]), np.array([0, 0, 0, 0, 0, 1]), ("a", "b", "c"))
    assert result.confusion.tolist() == [[4, 0, 0], [1, 1, 0], [0, 0, 0]]
    assert result.accuracy == pytest.approx(5 / 6)
    assert result.macro_f1 == pytest.approx((8 / 9 + 2 / 3) / 2)


def test_reactions_are_to_what_the_opponent_was_doing():
    #        A: one action, then another from 50; B changes at 20 and at 50
    table = np.array([[0, 0, 50, 0], [0, 50, 90, 0], [1, 0, 20, 0], [1, 20, 50, 0], [1, 50, 90, 0]])
    qualifiers = np.array([[4, 4, 3, 3, 2]] * 5)
    up, fwd = QUALIFIERS["right_kick"].index("up"), QUALIFIERS["left_punch"].index("fwd")
    qualifiers[3, 3] = up  # B kicks from 20 to 50
    qualifiers[1, 0] = fwd  # A punches from 50
    react = [QUALIFIERS["react"][index] for index in react_rule(table, qualifiers)]
    assert react == ["others", "kick", "others", "others", "others"]
    qualifiers[0, 1] = QUALIFIERS["right_punch"].index("bwd")  # drawing back a fist is no attack
    assert QUALIFIERS["react"][react_rule(table, qualifiers)[3]] == "others"
    qualifiers[0, 1] = QUALIFIERS["right_punch"].index("fwdbwd")
    react = [QUALIFIERS["react"][index] for index in react_rule(table, qualifiers)]
    assert react == ["others", "kick", "punch", "punch", "punch"]
    qualifiers[0, 2] = up
    assert QUALIFIERS["react"][react_rule(table, qualifiers)[3]] == "kick"


def test_double_stances_count_as_the_nearer_single_one():
    words = "LLDDDDDRRFFRDDDLL"
    contacts = np.array([[letter in "LD", letter in "RD"] for letter in words])
    bounds = np.array([[0, len(words)]])
    symbols = "".join("LRF"[symbol] for symbol in stance_symbols(contacts, bounds))
    assert symbols == "LLLLLRRRRFFRRRLLL"
    assert (LEFT, RIGHT, FLIGHT) == (0, 1, 2)
    two = np.array([[0, 5], [5, len(words)]])
    assert "".join("LRF"[symbol] for symbol in stance_symbols(contacts, two))[:7] == "LLLLLRR"
    table = np.array([[0, 0, 6, 0], [0, 6, 9, 0], [0, 9, 17, 0], [1, 0, 17, 0]])
    moves = [QUALIFIERS["move"][index] for index in move_rule(table, (contacts, np.ones_like(contacts)), bounds)]
    assert moves == ["L-R", "R-F", "F-L", "L-L"]


def test_annotations_round_trip_and_errors_name_the_line(fight, tmp_path):
    _, cuts, truth, _, _ = fight
    table = cuts.table()
    rows = np.array([3, 8, 60])
    path = save_annotations(tmp_path / "a.csv", table, rows, truth[rows])
    back = read_annotations(path, table)
    assert back.rows.tolist() == rows.tolist()
    assert np.array_equal(back.qualifiers, truth[rows])
    lines = path.read_text().splitlines()
    assert lines[2].startswith(f"{segment_names(table)[8]},0,A,{table[8, 1]},{table[8, 2]},")

    def refused(number, old, new, why):
        changed = list(lines)
        changed[number] = changed[number].replace(old, new, 1)
        path.write_text("\n".join(changed) + "\n")
        with pytest.raises(MotionFileError, match=why):
            read_annotations(path, table)

    start, end = table[8, 1:3]
    refused(
        2, f",{start},", f",{start + 1},", rf"line 3: player A has no action from frame {start + 1} to {end}; the near"
    )
    refused(2, "A8,", "A9,", "line 3: the action .* is A8, not A9")
    refused(1, ",others,", ",sideways,", "line 2: unknown qualifier of .* 'sideways'; valid: ")
    refused(1, ",others,", ",,", "line 2: unknown qualifier of .* ''; valid: ")
    refused(3, ",B,", ",C,", "line 4: unknown player 'C'; valid: A, B") if ",B," in lines[3] else None
    refused(0, "left_kick", "leftkick", "line 1: no column left_kick")
    refused(2, lines[2], lines[1], "line 3: action A3 is annotated twice")
    with pytest.raises(MotionFileError, match="no such file"):
        read_annotations(tmp_path / "none.csv", table)


def test_the_command_labels_a_stream_and_proposes(fight, tmp_path, monkeypatch, capsys):
    stream, cuts, truth, _, _ = fight
    monkeypatch.chdir(tmp_path)
    saved, cut_file = save_stream(stream, "fight.npz"), save_cuts(cuts, stream, "cuts.txt")
    assert main(["duel", "label", str(saved), "--cuts", str(cut_file), "--count", "5"]) == 0
    assert len(Path("proposals.csv").read_text().splitlines()) == 6
    rows = np.arange(0, len(truth), 3)
    save_annotations("done.csv", cuts.table(), rows, truth[rows])
    arguments = ["duel", "label", str(saved), "done.csv", "--cuts", str(cut_file), "-o", "labels.csv"]
    assert main(arguments) == 0
    assert len(Path("labels.csv").read_text().splitlines()) == len(truth) + 1
    labels = read_annotations("labels.csv", cuts.table())  # complete labels are valid annotations
    assert np.mean(labels.qualifiers == truth) > 0.95
    capsys.readouterr()
    Path("done.csv").write_text(Path("done.csv").read_text().replace(",up,", ",upwards,", 1))
    assert main(arguments) == 2
    assert "unknown qualifier of" in capsys.readouterr().err
