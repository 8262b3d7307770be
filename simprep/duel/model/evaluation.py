"""How well the transition model explains transitions it has not seen: the 2008 paper's cross-validations.

Source: section 6, Tables 2 and 3, Fig. 11. Each split divides a player's transitions at random, two for learning to one
held out; labels and pose basis come from the whole stream, as in the paper. Scores are means over both players [nats].
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.duel.model.action_features import ActionFeatures, PairTracks, action_features, fit_pose_basis
from simprep.duel.model.estimates import LABEL_MODELS, fit_label_model
from simprep.duel.model.label_model import LabelModel, total_variation
from simprep.duel.model.semi_tied import PRIOR_COUNT, CovarianceModel, DiagonalCovariance, FullCovariance, SemiTied
from simprep.duel.model.structures import PLAYERS, CoupledGraph, Transitions
from simprep.duel.model.transition_model import label_triples
from simprep.errors import SettingError

SCHEMA = "simprep.duel_evaluation/1"


@dataclass(frozen=True)
class EvaluationSettings:
    """How to evaluate.

    Attributes:
        splits: random divisions into two thirds and one third.
        components: numbers of principal components of the local pose for the curve; the first split only.
        pose_components: their number for the tables.
        prior_counts: strengths of the prior on covariances at which the three kinds are compared; the first gives the
            headline numbers (see `simprep.duel.model.semi_tied`).
    """

    splits: int = 5
    components: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 7, 8)
    pose_components: int = 3
    prior_counts: tuple[float, ...] = (PRIOR_COUNT, 1.0, 100.0)

    def __post_init__(self) -> None:
        if self.splits < 1 or not self.prior_counts:
            raise SettingError("an evaluation needs at least one split and one prior count")


def covariance_models(prior_count: float) -> dict[str, CovarianceModel]:
    """The three kinds that the paper compares, with the same prior."""
    return {
        "semi_tied": SemiTied(prior_count),
        "full": FullCovariance(prior_count),
        "diagonal": DiagonalCovariance(prior_count),
    }


def split_transitions(count: int, rng: np.random.Generator) -> tuple[IntArray, IntArray]:
    """Rows to learn from (two thirds) and rows held out, at random.

    Raises:
        SettingError: fewer than three transitions.
    """
    if count < 3:
        raise SettingError(f"{count} transitions cannot be split two to one; valid: 3 or more")
    order = rng.permutation(count)
    cut = round(count * 2 / 3)
    return np.sort(order[:cut]), np.sort(order[cut:])


def evaluate(
    graph: CoupledGraph,
    tracks: PairTracks,
    rng: np.random.Generator,
    settings: EvaluationSettings | None = None,
    truth: Sequence[LabelModel] | None = None,
) -> dict[str, Any]:
    """All tables of the evaluation, ready for JSON.

    Args:
        graph: of the stream.
        tracks: the stream.
        rng: makes the splits.
        settings: None: the paper's.
        truth: each player's label model that generated the stream, if it is synthetic.

    Returns:
        | key | meaning |
        | --- | --- |
        | `transitions` | numbers of training and held-out transitions, both players |
        | `label_logprob` | mean held-out log P(next label) by model, and of the truth |
        | `label_logprob_train` | the same on the training transitions |
        | `label_logprob_splits` | held-out means, one for each split |
        | `label_total_variation` | mean distance to the truth in held-out situations; absent without a truth |
        | `label_unseen_share` | share of held-out transitions whose next label was not in training |
        | `density_logprob` and `..._train`, `..._splits` | the same for the densities of semi-tied, full, diagonal |
        | `density_logprob_seen` | held out, only where the next label was in training |
        | `density_by_prior` | held-out densities at every prior count |
        | `components_curve` | per number of components: see `components_curve` |

    Raises:
        MotionError: too few transitions for the densities.
    """
    settings = settings or EvaluationSettings()
    basis = fit_pose_basis(tracks.joints, settings.pose_components)
    features = action_features(tracks, graph.actions, basis)
    transitions = [graph.actions.transitions(player) for player in PLAYERS]
    splits = [[split_transitions(len(step), rng) for step in transitions] for _ in range(settings.splits)]

    labels = [_label_scores(graph, transitions, split, truth) for split in splits]
    densities = {
        prior: [_density_scores(graph, features, transitions, split, covariance_models(prior)) for split in splits]
        for prior in settings.prior_counts
    }
    headline = densities[settings.prior_counts[0]]
    result: dict[str, Any] = {
        "schema": SCHEMA,
        "transitions": {
            "train": sum(len(train) for train, _ in splits[0]),
            "held_out": sum(len(held_out) for _, held_out in splits[0]),
        },
        "splits": settings.splits,
        "label_logprob": _mean(labels, "held_out"),
        "label_logprob_train": _mean(labels, "train"),
        "label_logprob_splits": _list(labels, "held_out"),
        "label_unseen_share": float(np.mean([one["unseen"]["share"] for one in headline])),
        "density_logprob": _mean(headline, "held_out"),
        "density_logprob_train": _mean(headline, "train"),
        "density_logprob_splits": _list(headline, "held_out"),
        "density_logprob_seen": _mean(headline, "seen"),
        "density_by_prior": [
            {"prior_count": prior, **_mean(scores, "held_out")} for prior, scores in densities.items()
        ],
        "components_curve": components_curve(
            graph, tracks, transitions, splits[0], settings.components, settings.prior_counts[0]
        ),
    }
    if truth is not None:
        result["label_total_variation"] = _mean(labels, "total_variation")
    return result


def evaluate_labels(
    graph: CoupledGraph, rng: np.random.Generator, splits: int = 5, truth: Sequence[LabelModel] | None = None
) -> dict[str, Any]:
    """The tables of `evaluate` about labels alone, without `label_unseen_share`."""
    transitions = [graph.actions.transitions(player) for player in PLAYERS]
    scores = [
        _label_scores(graph, transitions, [split_transitions(len(step), rng) for step in transitions], truth)
        for _ in range(splits)
    ]
    result: dict[str, Any] = {
        "label_logprob": _mean(scores, "held_out"),
        "label_logprob_train": _mean(scores, "train"),
        "label_logprob_splits": _list(scores, "held_out"),
    }
    if truth is not None:
        result["label_total_variation"] = _mean(scores, "total_variation")
    return result


def components_curve(
    graph: CoupledGraph,
    tracks: PairTracks,
    transitions: Sequence[Transitions],
    split: Sequence[tuple[IntArray, IntArray]],
    components: Sequence[int],
    prior_count: float,
) -> list[dict[str, float]]:
    """Fig. 11: semi-tied log density against the number of principal components.

    The level of a density depends on its number of dimensions. The gain over one Gaussian for all labels does not: it
    is what the next label says about the geometry. `split` holds each player's training and held-out rows.

    Returns:
        For each number: `components`, `explained` (share of the pose variance), `train`, `held_out` (mean log density)
        and `train_gain`, `held_out_gain` (over one Gaussian).
    """
    curve = []
    for number in components:
        basis = fit_pose_basis(tracks.joints, number)
        features = action_features(tracks, graph.actions, basis)
        score = _density_scores(graph, features, transitions, split, {"semi_tied": SemiTied(prior_count)})
        one = _density_scores(graph, features, transitions, split, {"one": FullCovariance(0.0, 0.0)}, one_class=True)
        train, held_out = score["train"]["semi_tied"], score["held_out"]["semi_tied"]
        curve.append(
            {
                "components": number,
                "explained": float(basis.explained.sum()),
                "train": train,
                "held_out": held_out,
                "train_gain": train - one["train"]["one"],
                "held_out_gain": held_out - one["held_out"]["one"],
            }
        )
    return curve


def _label_scores(
    graph: CoupledGraph,
    transitions: Sequence[Transitions],
    split: Sequence[tuple[IntArray, IntArray]],
    truth: Sequence[LabelModel] | None,
) -> dict[str, dict[str, float]]:
    """Mean scores of the label models over both players."""
    found: dict[str, dict[str, list[FloatArray]]] = {"train": {}, "held_out": {}, "total_variation": {}}
    for player, (train, held_out) in zip(PLAYERS, split, strict=True):
        triples = label_triples(graph, transitions[player])
        own, opponent = graph.graphs[player].labels, graph.graphs[1 - player].labels
        models: dict[str, LabelModel] = {
            kind: fit_label_model(triples.subset(train), own, opponent, kind) for kind in LABEL_MODELS
        }
        if truth is not None:
            models["truth"] = truth[player]
        for kind, model in models.items():
            for part, rows in (("train", train), ("held_out", held_out)):
                some = triples.subset(rows)
                found[part].setdefault(kind, []).append(model.log_prob(some.own, some.opponent, some.next))
            if truth is not None and kind != "truth":
                distance = total_variation(model, truth[player], triples.own[held_out], triples.opponent[held_out])
                found["total_variation"].setdefault(kind, []).append(distance)
    return _means(found)


def _density_scores(
    graph: CoupledGraph,
    features: ActionFeatures,
    transitions: Sequence[Transitions],
    split: Sequence[tuple[IntArray, IntArray]],
    models: dict[str, CovarianceModel],
    one_class: bool = False,
) -> dict[str, dict[str, float]]:
    """Mean log densities over both players."""
    found: dict[str, dict[str, list[FloatArray]]] = {"train": {}, "held_out": {}, "seen": {}, "unseen": {}}
    for player, (train, held_out) in zip(PLAYERS, split, strict=True):
        samples = features.samples(transitions[player])
        label = graph.actions.label[transitions[player].next] * (0 if one_class else 1)
        seen = np.isin(label[held_out], label[train])
        found["unseen"].setdefault("share", []).append((~seen).astype(np.float64))
        for kind, model in models.items():
            fitted = model.fit(samples[train], label[train])
            found["train"].setdefault(kind, []).append(fitted.log_density(samples[train], label[train]))
            density = fitted.log_density(samples[held_out], label[held_out])
            found["held_out"].setdefault(kind, []).append(density)
            found["seen"].setdefault(kind, []).append(density[seen])
    return _means(found)


def _means(found: dict[str, dict[str, list[FloatArray]]]) -> dict[str, dict[str, float]]:
    return {
        part: {kind: float(np.concatenate(scores).mean()) for kind, scores in kinds.items()}
        for part, kinds in found.items()
    }


def _mean(scores: Sequence[dict[str, dict[str, float]]], part: str) -> dict[str, float]:
    return {kind: float(np.mean([score[part][kind] for score in scores])) for kind in scores[0][part]}


def _list(scores: Sequence[dict[str, dict[str, float]]], part: str) -> dict[str, list[float]]:
    return {kind: [score[part][kind] for score in scores] for kind in scores[0][part]}
