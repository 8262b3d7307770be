"""A bout of two stick figures whose generating policy is known: labels by a table, geometry by shared Gaussians."""

from dataclasses import dataclass

import numpy as np

from simprep.duel.labels.labels import Label
from simprep.duel.model.action_features import PairTracks
from simprep.duel.model.label_model import Tabulated
from simprep.duel.model.structures import ActionList, CoupledGraph, couple, link_actions

FPS = 60.0
JOINTS = 16
LABELS = np.sort(
    [
        label.code
        for move in ("L-L", "L-R", "R-L", "R-R")
        for label in (
            Label(move=move),
            Label(left_punch="fwd", move=move),
            Label(left_punch="bwd", move=move),
            Label(right_kick="up", move=move),
            Label(right_kick="down", react="kick", move=move),
        )
    ]
)


@dataclass(frozen=True)
class Bout:
    graph: CoupledGraph
    tracks: PairTracks
    truth: Tabulated

    @property
    def actions(self) -> ActionList:
        return self.graph.actions


def policy(rng: np.random.Generator, sharpness: float = 1.5) -> Tabulated:
    """A random product of two first-order tables: what Eq. 9 can express exactly."""
    k = len(LABELS)
    own, opponent = sharpness * rng.normal(size=(2, k, k))
    weight = np.exp(own[:, None] + opponent[None])
    return Tabulated(LABELS, LABELS, weight / weight.sum(axis=-1, keepdims=True))


def bout(rng: np.random.Generator, minutes: float, clips: int = 1, truth: Tabulated | None = None) -> Bout:
    """Both players act at their own pace; whoever ends an action draws the next from the policy."""
    truth = truth or policy(rng)
    length = int(minutes * 60 * FPS / clips)
    rows = []
    for clip in range(clips):
        begin, label = [0, 0], [int(rng.choice(LABELS)), int(rng.choice(LABELS))]
        end = [int(rng.integers(20, 60)), int(rng.integers(20, 60))]
        while True:
            who = int(np.argmin(end))
            if end[who] >= length:
                break
            rows.append((who, begin[who], end[who], label[who], clip))
            begin[who], end[who] = end[who], end[who] + int(rng.integers(20, 60))
            label[who] = int(rng.choice(LABELS, p=truth.distribution(label[who], label[1 - who])))
        rows += [(who, begin[who], length, label[who], clip) for who in (0, 1) if length - begin[who] > 1]
    player, start, end, label, clip = np.array(rows).T
    actions = link_actions(player, start + clip * length, end + clip * length, label, clip)
    return Bout(couple(actions), tracks(rng, actions, length * clips), truth)


def tracks(rng: np.random.Generator, actions: ActionList, length: int) -> PairTracks:
    """Each action holds its label's mean placement and pose and drifts at its label's rates, with correlated spread."""
    latent, rates = 6, 6
    mean = dict(zip(LABELS, rng.normal(size=(len(LABELS), latent + rates)), strict=True))
    spread = dict(zip(LABELS, np.exp(0.5 * rng.normal(size=(len(LABELS), latent + rates))), strict=True))
    mixing = np.linalg.qr(rng.normal(size=(latent + rates, latent + rates)))[0]
    poses = rng.normal(size=(8, JOINTS, 3)) * np.array([1, 0.8, 0.6, 0.3, 0.2, 0.15, 0.1, 0.1])[:, None, None]
    root, heading = np.zeros((length, 2, 3)), np.zeros((length, 2))
    joints = rng.normal(size=(length, 2, JOINTS, 3)) * 0.01
    root[..., 2] = 1.0
    for a in range(len(actions)):
        code, who = int(actions.label[a]), int(actions.player[a])
        span = np.arange(actions.start[a], actions.end[a])
        time = (span - span[0])[:, None] / FPS
        drawn = mean[code] + mixing @ (spread[code] * rng.normal(size=latent + rates))
        state = 0.1 * drawn[:latent] + 0.1 * drawn[latent:] * time
        side = -1.0 if who == 0 else 1.0
        root[span, who, 0] = side * (0.8 + state[:, 0])
        root[span, who, 1] = state[:, 1]
        heading[span, who] = (np.pi if who else 0.0) + state[:, 2]
        joints[span, who] += np.tensordot(state[:, 3:], poses[:3], 1)
        joints[span, who] += 0.05 * np.tensordot(rng.normal(size=5), poses[3:], 1)
    return PairTracks(FPS, root, heading, joints, root + np.array([0, 0, 0.05]))
