"""Small streams: of two with known actions, made by moving single hinges of the standing pose; of three who box."""

from dataclasses import replace

import numpy as np

from simprep.duel.labels.labels import LEARNED_ASPECTS, QUALIFIERS
from simprep.duel.labels.segmentation import Cuts
from simprep.duel.stream.stream import DuelStream
from simprep.humanoid_model import humanoid
from simprep.library.registry import library_motion
from simprep.motion.edit import cut, move
from simprep.motion.motion import Motion

FPS = 30.0
# phases of each movement: the learned aspect, its qualifiers, and the hinges with their largest angles [rad]
MOVEMENTS = {
    "right kick": ("right_kick", ("up", "down"), {"right_hip_flexion": 1.3, "right_knee_flexion": 0.5}),
    "left kick": ("left_kick", ("up", "down"), {"left_hip_flexion": 1.3, "left_knee_flexion": 0.5}),
    "right punch": ("right_punch", ("fwd", "bwd"), {"right_shoulder_flexion": 1.4, "thorax_rotation": 0.4}),
    "left punch": ("left_punch", ("fwd", "bwd"), {"left_shoulder_flexion": 1.4, "thorax_rotation": -0.4}),
    "sway": ("jump", ("others", "others"), {"lumbar_bending": 0.2}),
}


def standing_pair(frames=90, distance=1.2, fps=FPS):
    """A at the origin facing x, B before it facing back; nobody moves."""
    a = np.tile(humanoid().standing_qpos.copy(), (frames, 1))
    b = a.copy()
    b[:, 0] += distance
    b[:, 3:7] = [0.0, 0.0, 0.0, 1.0]
    contacts = np.ones((frames, 2), dtype=bool)
    return DuelStream((Motion(a, fps, contacts, name="a"), Motion(b, fps, contacts, name="b")))


def bout(rng, count=40):
    """A stream of random movements of both, with its true cuts and learned qualifiers (in the order of the table)."""
    length = 0
    tracks, cuts, qualifiers = [], [], []
    for _ in range(2):
        poses, starts, labels = [], [], []
        frame = 0
        for kind in rng.choice(list(MOVEMENTS), count):
            aspect, phases, hinges = MOVEMENTS[kind]
            size = rng.uniform(0.75, 1.2)
            for number, phase in enumerate(phases):
                frames = int(rng.integers(8, 16))
                share = 0.5 - 0.5 * np.cos(np.pi * np.arange(frames) / frames)
                share = size * (share if number == 0 else 1 - share)
                pose = np.tile(humanoid().standing_qpos.copy(), (frames, 1))
                for hinge, angle in hinges.items():
                    pose[:, 7 + humanoid().joint(hinge)] += angle * share
                pose[:, 7:] += rng.normal(0, 0.02, (frames, pose.shape[1] - 7))
                poses.append(pose)
                starts.append(frame)
                frame += frames
                row = {name: "others" for name in LEARNED_ASPECTS} | {aspect: phase}
                labels.append([QUALIFIERS[name].index(row[name]) for name in LEARNED_ASPECTS])
        tracks.append(np.concatenate(poses))
        cuts.append(np.array(starts))
        qualifiers.append(np.array(labels))
        length = frame if not length else min(length, frame)
    kept = [start[start < length - 1] for start in cuts]
    labels = np.concatenate([labels[: len(start)] for labels, start in zip(qualifiers, kept)])
    base = standing_pair(length)
    motions = []
    for motion, track in zip(base.players, tracks):
        qpos = track[:length].copy()
        qpos[:, :7] = motion.qpos[:, :7]
        motions.append(Motion(qpos, FPS, motion.contacts, name=motion.name))
    stream = DuelStream((motions[0], motions[1]))
    return stream, Cuts((kept[0][1:], kept[1][1:]), stream.bounds), labels


def three_boxers(frames=40, third=(0.45, 0.75)):
    """Two who jab at each other from 0.9 m, and a third who jabs beside them; places in metres from A."""
    jab = cut(library_motion("jab_left_head"), 40, 40 + frames)
    b, c = move(jab, (0.9, 0.02), np.pi), move(jab, third, -1.9)
    return DuelStream(
        tuple(replace(motion, name=name) for motion, name in zip((jab, b, c), ("left", "right", "third"))), name="three"
    )
