"""A model that has not seen the end of its stream, for passive mode and comparisons with held-out data.

Source: the 2008 paper, section 6: one fighter's attacks and the reactions to them are kept out of the learning. B keeps
all actions, so that the held-out ones can still be performed.
"""

from dataclasses import replace

import numpy as np

from simprep.arrays import IntArray
from simprep.duel.model.action_features import action_features, fit_pose_basis
from simprep.duel.model.estimates import fit_label_model
from simprep.duel.model.fight_model import FightModel
from simprep.duel.model.structures import PLAYERS, Transitions
from simprep.duel.model.tracks import pair_tracks
from simprep.duel.model.transition_model import TrainingSettings, TransitionModel, label_triples
from simprep.errors import MotionError

SHARE = 1 / 3
"""Default share of the stream that is held out."""


def split_frame(whole: FightModel, share: float = SHARE) -> int:
    """The seam nearest to where the held-out share begins; of a stream without seams, that frame."""
    wanted = round((1 - share) * len(whole.stream))
    seams = np.array(whole.stream.seams, dtype=np.int64)
    return int(seams[np.argmin(np.abs(seams - wanted))]) if len(seams) else wanted


def learn_before(whole: FightModel, frame: int, settings: TrainingSettings | None = None) -> FightModel:
    """Learn labels, densities, pose basis and examples only from what ends before a frame (see `split_frame`).

    Cuts and labels are those of the whole model. Without settings its label model is taken, with the paper's densities.

    Raises:
        MotionError: too few actions before the frame.
    """
    settings = settings or TrainingSettings(
        label_model=whole.model.players[0].labels.kind, pose_components=len(whole.model.basis.components)
    )
    graph, tracks = whole.model.graph, pair_tracks(whole.stream)
    basis = fit_pose_basis(tracks.joints[:frame], settings.pose_components)
    features = action_features(tracks, graph.actions, basis, settings.goal_delay)
    learned = np.flatnonzero(graph.actions.end <= frame)
    players = []
    for player in PLAYERS:
        seen = [learned[graph.actions.player[learned] == who] for who in (player, 1 - player)]
        steps = _among(graph.actions.transitions(player), learned)
        samples = features.samples(steps)
        if not len(seen[0]) or not len(seen[1]) or len(steps) <= samples.shape[1] + 2:
            raise MotionError(
                f"{whole.stream.name}: {len(steps)} transitions of player {player} before frame {frame}; valid: more than "
                f"{samples.shape[1] + 2} (a longer stream)"
            )
        code = graph.actions.label
        candidates = np.unique(code[seen[0]])
        examples = seen[0][np.argsort(code[seen[0]], kind="stable")]
        goal = features.goal[steps.next]
        inside = np.isfinite(goal).all(axis=1)
        players.append(
            TransitionModel(
                player,
                fit_label_model(
                    label_triples(graph, steps), candidates, np.unique(code[seen[1]]), settings.label_model
                ),
                settings.covariance.fit(samples, code[steps.next]),
                settings.covariance.fit(np.column_stack([samples, goal])[inside], code[steps.next][inside])
                if inside.sum() > samples.shape[1] + 2
                else None,
                examples,
                np.searchsorted(candidates, code[examples]),
                features.parameters[examples],
            )
        )
    model = replace(
        whole.model, basis=basis, parameters=features.parameters, players=(players[0], players[1]),
        goal_delay=settings.goal_delay,
    )  # fmt: skip
    return FightModel(model, whole.stream, frame)


def held_out_actions(model: FightModel, player: int) -> IntArray:
    """Actions of player 0 or 1 that the model has not seen, in order of time.

    Raises:
        MotionError: the model has learned from all of the stream, or the player does nothing afterwards.
    """
    actions = model.model.graph.actions
    own = actions.of(player)
    found = own[actions.start[own] >= (len(model.stream) if model.learned_until is None else model.learned_until)]
    if not len(found):
        raise MotionError(f"{model.stream.name}: no action of player {player} is held out")
    return found


def _among(steps: Transitions, rows: IntArray) -> Transitions:
    """The transitions that have only these actions in them."""
    inside = [np.isin(actions, rows) for actions in (steps.current, steps.next, steps.opponent)]
    return steps.subset(np.flatnonzero(np.all(inside, axis=0)))
