"""Real pairs: the SBU Kinect interactions, to check features and interaction measures on people.

Source: Yun et al. 2012, "Two-person interaction detection using body-pose features and multiple instance learning".
The recordings are for research and are not part of simprep: the path of the file is given. Its joint positions are
noisy (limb lengths vary by 13 %), so that nothing here asks for poses, only for who acts, distances and times.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sbu.strikes import PairTrack, Strike, find_strike, pair_track, trunk_heading
from simprep.archive import open_arrays, texts
from simprep.duel.labels.labelling import LabelSettings, new_machine
from simprep.duel.labels.pose_features import pose_features
from simprep.duel.labels.scores import AspectScore, score
from simprep.errors import MotionFileError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
JOINTS = (
    "head", "neck", "torso", "l_shoulder", "l_elbow", "l_hand", "r_shoulder", "r_elbow", "r_hand",
    "l_hip", "l_knee", "l_foot", "r_hip", "r_knee", "r_foot",
)  # fmt: skip
ENDS = tuple(JOINTS.index(name) for name in ("l_hand", "r_hand", "l_foot", "r_foot"))
MIRRORED = np.array([JOINTS.index({"l_": "r_", "r_": "l_"}.get(name[:2], name[:2]) + name[2:]) for name in JOINTS])
"""Source of each joint in the mirror image."""
ATTACKS = ("kick", "punch", "push")
CLASSES = (*ATTACKS, "other")


@dataclass(frozen=True)
class SbuPairs:
    """Short clips of two people.

    Attributes:
        positions: (clips, T, 2, 15, 3) joint positions in one frame, z up [m]; NaN after a clip's end.
        lengths: (clips,) frames of each.
        labels: what happens in each clip.
        folds: (clips,) number of the test fold of each.
        fps: frames per second [1/s].
    """

    positions: FloatArray
    lengths: IntArray
    labels: tuple[str, ...]
    folds: IntArray
    fps: float

    def track(self, clip: int) -> PairTrack:
        """One clip as a track: root halfway between the hips, facing square to hips and shoulders."""
        joints = self.positions[clip, : self.lengths[clip]]
        hips, shoulders = ([JOINTS.index(f"{side}_{name}") for side in "lr"] for name in ("hip", "shoulder"))
        heading = trunk_heading(joints[:, :, hips], joints[:, :, shoulders])
        return pair_track(joints, joints[:, :, hips].mean(axis=2), heading, ENDS, self.fps)


def read_sbu(path: str | Path) -> SbuPairs:
    """Read the collected clips.

    Args:
        path: .npz with positions, length, label, label_names, joint_names, fold and fps.

    Raises:
        MotionFileError: missing, unreadable, or other joints.
    """
    path = Path(path)
    with open_arrays(path, "file of pairs") as archive:
        names = texts(archive["joint_names"])
        if names != JOINTS:
            raise MotionFileError(path, f"joints {', '.join(names)}; valid: {', '.join(JOINTS)}")
        kinds = texts(archive["label_names"])
        return SbuPairs(
            np.asarray(archive["positions"], dtype=np.float64),
            np.asarray(archive["length"], dtype=np.int64),
            tuple(kinds[number] for number in archive["label"]),
            np.asarray(archive["fold"], dtype=np.int64),
            float(archive["fps"]),
        )


def strikes(pairs: SbuPairs) -> list[Strike]:
    """The strike of every clip (of clips without attack: when a limb gets nearest to the other person)."""
    return [find_strike(pairs.track(clip)) for clip in range(len(pairs.lengths))]


def acting_found(pairs: SbuPairs, acting: Mapping[int, str]) -> dict[str, tuple[int, int]]:
    """How often the attacker is found.

    Args:
        pairs: the clips.
        acting: clip to `A`, `B` or `?` (cannot be told by eye; counts as not found).

    Returns:
        Kind of clip to (found, all).
    """
    found: dict[str, tuple[int, int]] = {}
    for clip, who in acting.items():
        right, total = found.get(pairs.labels[clip], (0, 0))
        hit = who != "?" and find_strike(pairs.track(clip)).actor == "AB".index(who)
        found[pairs.labels[clip]] = (right + hit, total + 1)
    return found


def classify_acting(
    pairs: SbuPairs, window_s: float | None = 0.5, settings: LabelSettings | None = None
) -> tuple[AspectScore, FloatArray]:
    """Tell kick, punch, push and other from the acting person's pose features, each fold by a machine that did not see it.

    Who acts is found by `find_strike` in training and test alike; nothing that a person has marked is used.

    Args:
        pairs: the clips.
        window_s: the action is what lies within this time of the strike [s]; None: the whole clip.
        settings: of the machine; where not given those of labelling, but a kernel of width 1 over the number of features:
            depth cameras are noisy.

    Returns:
        The score over all held-out clips, and the accuracy of each fold.
    """
    truth = np.array([CLASSES.index(label if label in ATTACKS else "other") for label in pairs.labels], dtype=np.int64)
    features = [_features(pairs, clip, window_s) for clip in range(len(truth))]
    plain = np.stack([pair[0] for pair in features])
    mirrored = np.stack([pair[1] for pair in features])
    settings = settings or LabelSettings(gamma=1.0 / plain.shape[1])
    guessed = np.empty_like(truth)
    for fold in np.unique(pairs.folds):
        held = pairs.folds == fold
        known, labels = plain[~held], truth[~held]
        if settings.mirrored:
            known, labels = np.concatenate([known, mirrored[~held]]), np.concatenate([labels, labels])
        guessed[held] = new_machine(settings, plain.shape[1]).fit(known, labels).predict(plain[held])
    right = guessed == truth
    folds = np.array([right[pairs.folds == fold].mean() for fold in np.unique(pairs.folds)])
    return score(truth, guessed, CLASSES), folds


def _features(pairs: SbuPairs, clip: int, window_s: float | None) -> tuple[FloatArray, FloatArray]:
    track = pairs.track(clip)
    strike = find_strike(track)
    first, after = 0, len(track.joints)
    if window_s is not None:
        width = round(window_s * pairs.fps)
        first, after = max(0, strike.frame - width), min(after, strike.frame + width + 1)
    joints, root, heading = (values[:, strike.actor] for values in (track.joints, track.root, track.heading))
    segment = np.array([[first, after]], dtype=np.int64)
    mirror = np.array([1.0, -1.0, 1.0])
    return (
        pose_features(joints, root, heading, segment)[0],
        pose_features(joints[:, MIRRORED] * mirror, root * mirror, -heading, segment)[0],
    )
