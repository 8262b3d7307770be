"""Recordings and annotations that no model should be made from, through the commands that a user would give them to."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simprep.character import SIDES
from simprep.cli.main import main
from simprep.duel.labels.annotations import save_annotations
from simprep.duel.labels.cuts import save_cuts
from simprep.duel.labels.labels import LEARNED_ASPECTS, QUALIFIERS
from simprep.duel.labels.segmentation import Cuts
from simprep.duel.stream.store import save_stream
from simprep.duel.stream.stream import DuelStream
from simprep.humanoid_model import humanoid
from simprep.motion.edit import cut, resample
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion

FPS = 30.0
OTHERS = [QUALIFIERS[aspect].index("others") for aspect in LEARNED_ASPECTS]
JOINTS = {
    "thigh": "hip",
    "shank": "knee",
    "foot": "ankle",
    "upper_arm": "shoulder",
    "forearm": "elbow",
    "hand": "wrist",
}
NAMES = [f"{side}_{joint}" for side in SIDES for joint in JOINTS.values()]


def swaying(frames):
    """Two who face each other and sway, cut every ten frames: nobody attacks."""
    rng = np.random.default_rng(0)
    tracks = []
    for number in range(2):
        qpos = np.tile(humanoid().standing_qpos.copy(), (frames, 1))
        time = np.arange(frames) / FPS
        qpos[:, :2] += 0.02 * np.stack([np.sin((3 + number) * time), np.cos(2 * time)], axis=1)
        qpos[:, 7:] += 0.05 * np.sin(2 * np.pi * time[:, None] + rng.uniform(0, 6, qpos.shape[1] - 7))
        if number:
            qpos[:, 0] += 1.2
            qpos[:, 3:7] = [0.0, 0.0, 0.0, 1.0]
        tracks.append(Motion(qpos, FPS, np.ones((frames, 2), bool), name="ab"[number]))
    stream = DuelStream((tracks[0], tracks[1]))
    marks = np.arange(10, frames - 5, 10)
    return stream, Cuts((marks, marks), stream.bounds)


def swapped(stream):
    """The two exchange names in the middle."""
    half = len(stream) // 2
    a, b = (motion.qpos for motion in stream.players)
    changed = [np.concatenate([a[:half], b[half:]]), np.concatenate([b[:half], a[half:]])]
    return replace(stream, players=tuple(replace(m, qpos=q) for m, q in zip(stream.players, changed)))


def with_nan(source, target, key, frames):
    with np.load(source) as archive:
        parts = dict(archive)
    parts[key] = parts[key].copy()
    parts[key][frames, 5] = np.nan
    np.savez(target, **parts)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bad")
    stream, cuts = swaying(630)
    five, five_cuts = swaying(150)
    mixed = swapped(stream)
    for name, motion in (
        ("a", stream.players[0]), ("b", stream.players[1]), ("b_short", cut(stream.players[1], 0, 600)),
        ("five_a", five.players[0]), ("five_b", five.players[1]),
        ("mixed_a", mixed.players[0]), ("mixed_b", mixed.players[1]),
    ):  # fmt: skip
        save_motion(motion, folder / name)
    save_stream(stream, folder / "stream")
    save_stream(five, folder / "five")
    save_stream(mixed, folder / "mixed")
    first, second = (resample(motion, 60.0) for motion in stream.players)
    save_stream(replace(stream, players=(first, second)), folder / "faster")
    save_stream(
        replace(stream, players=(stream.players[0], replace(stream.players[1], character=humanoid(1.6)))),
        folder / "other",
    )
    with_nan(folder / "a.npz", folder / "nan.npz", "qpos", slice(40, 60))
    with_nan(folder / "stream.npz", folder / "nan_stream.npz", "qpos_B", slice(40, 60))

    places = [humanoid().segment(f"{side}_{part}") for side in SIDES for part in JOINTS]
    points = np.stack([forward_kinematics(m.qpos, m.character).xpos[:, places] for m in five.players], axis=1)
    gap = points.copy()
    gap[30:45, 1, 2] = np.nan
    for name, positions in (
        ("gap", gap), ("one", points[:, 0]), ("points_a", points[:, 0]), ("points_b", points[:100, 1]),
    ):  # fmt: skip
        np.savez(folder / name, positions=positions, joint_names=np.array(NAMES), fps=FPS)

    for name, used, pair in (("cuts", cuts, stream), ("five_cuts", five_cuts, five)):
        save_cuts(used, pair, folder / f"{name}.txt")
    table = cuts.table()
    quiet = save_annotations(folder / "quiet.csv", table, np.arange(20), np.tile(OTHERS, (20, 1)))
    few = five_cuts.table()
    save_annotations(folder / "five.csv", few, np.arange(len(few)), np.tile(OTHERS, (len(few), 1)))
    lines = quiet.read_text().splitlines(keepends=True)
    (folder / "unknown.csv").write_text("".join([lines[0], lines[1].replace("others", "sideways", 1), *lines[2:]]))
    (folder / "missing.csv").write_text("".join([*lines[:2], lines[2].replace(",10,20,", ",11,20,"), *lines[3:]]))
    return folder


REFUSED = {
    "unequal length": ("import IN/a.npz IN/b_short.npz", "b_short.npz: 600 frames where a.npz gives 630"),
    "unequal length, positions": (
        "import IN/points_a.npz IN/points_b.npz", "points_b.npz: 100 frames where points_a.npz has 150",
    ),
    "one person": ("import IN/a.npz", "a.npz: a motion of one person; give the other one's file too"),
    "one person, positions": ("import IN/one.npz", "one.npz: holds 1 person; an import takes 2"),
    "one person to join": ("join IN/stream.npz IN/a.npz", "a.npz: schema 'simprep.motion/1': one person"),
    "one person to analyse": ("analyze IN/a.npz", "a.npz: schema 'simprep.motion/1': one person"),
    "gap in poses": ("import IN/nan.npz IN/b.npz", "nan.npz: a: frame 40 of 630 holds NaN"),
    "gap in a stream": ("analyze IN/nan_stream.npz", "nan_stream.npz: b: frame 40 of 630 holds NaN"),
    "gap in positions": (
        "import IN/gap.npz", "gap.npz: person 2, frame 30: joint 'left_ankle' is not seen for 15 frames (0.50 s); gaps up",
    ),
    "rates to join": ("join IN/stream.npz IN/faster.npz", "stream.npz has 30 frames per second and"),
    "bodies to join": ("join IN/stream.npz IN/other.npz", "player B has another body in"),
    "nothing to join": ("join -o joined.npz", "no streams to join; valid: one or more files"),
    "no annotations": ("analyze IN/stream.npz", "stream.npz: no annotations, and no truth"),
    "unknown qualifier": (
        "label IN/stream.npz IN/unknown.csv --cuts IN/cuts.txt",
        "unknown.csv, line 2: unknown qualifier of left_punch 'sideways'; valid: fwd, bwd, bwdfwd, fwdbwd, others",
    ),
    "unknown qualifier to analyse": (
        "analyze IN/stream.npz --annotations IN/unknown.csv --cuts IN/cuts.txt", "unknown.csv, line 2: unknown qualifier",
    ),
    "missing action": (
        "label IN/stream.npz IN/missing.csv --cuts IN/cuts.txt",
        "missing.csv, line 3: player A has no action from frame 11 to 20; the nearest is 10 to 20",
    ),
    "missing action to analyse": (
        "analyze IN/stream.npz --annotations IN/missing.csv --cuts IN/cuts.txt", "missing.csv, line 3: player A has no action",
    ),
    # cuts that would be written where there are none: only once everything could be read
    "missing action of new cuts": ("label IN/stream.npz IN/missing.csv --cuts new.txt", "missing.csv, line 2: player A has no"),
    "both kinds of annotation": ("analyze IN/stream.npz --proposed --no-proposed", "both --proposed and --no-proposed"),
    "folder without a model": ("fight --model IN", "a directory without a duel model, which `simprep duel analyse STREAM -o DIR` writes; in it: a.npz, "),
    "stream as a model": ("fight --model IN/stream.npz", "stream.npz: schema 'simprep.duel-stream/1'; this version reads"),
}  # fmt: skip


def run(capsys, files, command):
    arguments = [word.replace("IN", str(files), 1) if word.startswith("IN") else word for word in command.split()]
    code = main(arguments if arguments[0] == "fight" else ["duel", *arguments])
    return code, *capsys.readouterr()


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_used_is_refused_in_one_line_and_nothing_is_written(files, tmp_path, monkeypatch, capsys, case):
    monkeypatch.chdir(tmp_path)
    command, said = REFUSED[case]
    code, out, err = run(capsys, files, command)
    assert code == 2, err
    assert err.startswith("simprep: ")
    assert err.count("\n") == 1
    assert said in err
    assert not out
    assert not list(tmp_path.iterdir())


def test_five_seconds_come_in_with_a_warning_and_give_no_model(files, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, files, "import IN/five_a.npz IN/five_b.npz -o pair.npz")
    assert code == 0
    assert err == "warning: only 5.0 s: too few actions for a model (at least 20 s)\n"
    Path("pair.npz").unlink()
    code, out, err = run(
        capsys, files, "analyze IN/five.npz --annotations IN/five.csv --cuts IN/five_cuts.txt --splits 1 --components 1"
    )
    assert code == 2
    *warnings, last = err.splitlines()
    assert warnings == ["warning: only 5.0 s: too few actions for a model (at least 20 s)"]
    assert "five.npz: player A changes its action 14 times; a model needs more than 36" in last
    assert not out
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "command",
    [
        "import IN/mixed_a.npz IN/mixed_b.npz -o out.npz",
        "import IN/mixed_a.npz IN/mixed_b.npz --fps 50 -o out.npz",
        "join IN/mixed.npz -o out.npz",
        "label IN/mixed.npz --cuts IN/cuts.txt",
    ],
)
def test_people_who_exchange_names_halfway_are_warned_of_once(files, tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, files, command)
    assert code == 0
    assert err.count("A and B seem to exchange names at frame") == 1
    assert "(10.5" in err


def test_saved_motions_and_streams_keep_bodies_and_rate_and_that_is_said(files, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    _, _, err = run(capsys, files, "import IN/a.npz IN/b.npz --like IN/other.npz -o out.npz")
    assert "keeps its bodies" in err
    _, _, err = run(capsys, files, "import IN/stream.npz --fps 60 -o out.npz")
    assert err == "warning: a saved stream keeps its 30 frames per second; not 60\n"


def test_no_attack_at_all_is_said(files, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, files, "label IN/stream.npz IN/quiet.csv --cuts IN/cuts.txt --json")
    assert code == 0
    assert "warning: no annotated action is an attack: no action will be, nor a reaction to one" in err
    assert "warning: no action of the stream is labelled as an attack: there is no fight to learn from" in err
    assert len(json.loads(out)["warnings"]) == 7
