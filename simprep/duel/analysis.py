"""From a stream to a model: segmentation, labels, structures, transition model and its evaluation.

The truth of a synthetic stream, where known, annotates a tenth of the actions, as a person would who follows the
proposals, and every stage is compared with it.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.character import Character
from simprep.duel.labels.annotations import Annotations
from simprep.duel.labels.labelling import LabelResult, label_stream, propose, stream_features, train_labels
from simprep.duel.labels.labels import ASPECTS, LEARNED_ASPECTS, QUALIFIERS, decode
from simprep.duel.labels.rules import move_rule, react_rule
from simprep.duel.labels.scores import cross_validate, score
from simprep.duel.labels.segmentation import Cuts, Segmentation, segment_stream, stream_kinematics
from simprep.duel.model.evaluation import EvaluationSettings, evaluate, evaluate_labels
from simprep.duel.model.structures import CoupledGraph, couple, link_actions
from simprep.duel.model.tracks import pair_tracks
from simprep.duel.model.transition_model import DuelModel, TrainingSettings, train
from simprep.duel.stream.stream import DuelStream
from simprep.duel.synthetic.truth import Truth
from simprep.errors import SettingError
from simprep.motion.contacts import detect_contacts
from simprep.threads import one_thread

SCHEMA = "simprep.duel_analysis/1"
TOLERANCE_S = 0.05
"""Farthest that a found cut lies from a true one: three frames at 60 per second [s]."""
ROUNDS = 10
"""In how many rounds proposed actions are annotated."""
STAGES = ("kinematics", "segmentation", "labels", "structures", "model", "evaluation")


@dataclass(frozen=True)
class AnalysisSettings:
    """How to analyse.

    Attributes:
        annotated: share of the actions that are annotated from the truth, where there is one.
        proposed: annotate what `simprep duel label` would propose, in rounds, instead of a random sample.
        evaluation: splits, components and priors.
        training: of the model that is saved.
    """

    annotated: float = 0.1
    proposed: bool = True
    evaluation: EvaluationSettings = field(default_factory=EvaluationSettings)
    training: TrainingSettings = field(default_factory=TrainingSettings)

    def __post_init__(self) -> None:
        if not 0 < self.annotated < 1:
            raise SettingError(f"share of annotated actions {self.annotated}; valid: above 0, below 1")


@dataclass(frozen=True)
class Analysis:
    """What came out.

    Attributes:
        segmentation: forces, doubts, and the cuts found.
        cuts: that were used.
        labels: of all actions.
        annotated: (N,) rows of the action table that were annotated.
        graph: the structures.
        model: the transition model.
        tables: everything else, ready for JSON.
    """

    segmentation: Segmentation
    cuts: Cuts
    labels: LabelResult
    annotated: IntArray
    graph: CoupledGraph
    model: DuelModel
    tables: dict[str, Any]


@one_thread
def analyse(
    stream: DuelStream,
    rng: np.random.Generator,
    annotate: Callable[[IntArray], Annotations] | None = None,
    truth: Truth | None = None,
    cuts: Cuts | None = None,
    settings: AnalysisSettings | None = None,
    progress: Callable[[str], None] | None = None,
) -> Analysis:
    """Analyse a stream.

    Args:
        stream: two people.
        rng: chooses what is annotated from the truth, folds and splits.
        annotate: gives a person's annotations of the table of actions; None: the truth annotates.
        truth: of a synthetic stream; every stage is then compared with it.
        cuts: that a person has edited; None: those found.
        settings: None for the defaults.
        progress: called with the name of each stage (`STAGES`) as it begins.

    Raises:
        SettingError: neither annotations nor a truth.
        MotionError: too little to learn from.
    """
    settings = settings or AnalysisSettings()
    if annotate is None and truth is None:
        raise SettingError("no annotations, and no truth that could annotate; annotate with `simprep duel label`")
    clock = _Clock(progress)
    clock.begin("kinematics")
    kinematics = stream_kinematics(stream)
    clock.begin("segmentation")
    segmentation = segment_stream(stream, kinematics=kinematics)
    used = cuts or segmentation.cuts
    table = used.table()
    clock.begin("labels")
    features = stream_features(used, kinematics)
    match = None if truth is None else match_actions(table, truth.table, TOLERANCE_S * stream.fps)
    if annotate is not None:
        annotations = annotate(table)
    else:
        assert truth is not None
        assert match is not None
        share = settings.annotated
        if settings.proposed:
            annotations = annotate_as_proposed(truth, match, share, features, stream.players[0].character)
        else:
            annotations = annotate_from_truth(truth, match, share, rng)
    rows = annotations.rows
    labels = label_stream(stream, used, rows, annotations.qualifiers, features=features)
    scores = {}
    if len(rows) >= 4:
        scores = cross_validate(features[rows], annotations.qualifiers, stream.players[0].character, rng)
    clock.begin("structures")
    player, start, end, clip = table.T
    graph = couple(link_actions(player, start, end, labels.codes, clip))
    tracks = pair_tracks(stream, kinematics)
    clock.begin("model")
    model = train(graph, tracks, settings.training)
    clock.begin("evaluation")
    evaluation = evaluate(graph, tracks, rng, settings.evaluation)
    tables: dict[str, Any] = {
        "schema": SCHEMA,
        "stream": stream.name,
        "source": stream.players[0].source,
        "segments": len(table),
        "groups": sum(len(one) for one in graph.graphs),
        "groups_per_player": [len(one) for one in graph.graphs],
        "annotated": len(rows),
        "suspicious": len(segmentation.suspicious),
        "label_counts": _counts(labels.codes),
        "label_cross_validation": {aspect: one.as_dict() for aspect, one in scores.items()},
        **{key: value for key, value in evaluation.items() if key != "schema"},
    }
    if truth is not None:
        assert match is not None
        tables |= compare_with_truth(stream, truth, used, labels, rows, match, rng, settings.evaluation.splits)
    tables["stages_s"] = clock.done()
    tables["warnings"] = list(labels.warnings)
    return Analysis(segmentation, used, labels, rows, graph, model, tables)


def compare_with_truth(
    stream: DuelStream,
    truth: Truth,
    cuts: Cuts,
    labels: LabelResult,
    annotated: IntArray,
    match: IntArray,
    rng: np.random.Generator,
    splits: int,
) -> dict[str, Any]:
    """All comparisons of found cuts and given labels with the truth.

    Args:
        stream: two people.
        truth: of it.
        cuts: found.
        labels: given.
        annotated: rows that were annotated; they are not counted.
        match: (S,) row of the truth for each action, or -1.
        rng: makes the splits.
        splits: how many.

    Returns:
        | key | meaning |
        | --- | --- |
        | `cut_f1`, `cut_precision`, `cut_recall` | cuts found within 50 ms of a true one |
        | `cut_error_frames` | mean absolute distance of those |
        | `matched_share` | share of the true actions both of whose ends were found |
        | `label_accuracy`, `label_macro_f1` | by aspect, over matched actions that were not annotated |
        | `label_confusion` | the same as matrices, truth by row |
        | `rules_on_true_cuts` | share of right `react` and `move` given true cuts and learned aspects; `move` with the
          stream's contacts, and `move_detected` with contacts detected in the poses |
        | `label_logprob` | held out, on true cuts and labels: eq7, eq8, eq9, ... and truth, on the same transitions |
        | `label_logprob_recognised` | the same models on the cuts and labels found, where the truth has no say |
        | `label_relative_to_truth` | how far each model is below the truth, as a share of the truth's |
        | `label_total_variation` | mean distance of P(l'|l1,l2) to the truth's |
    """
    found, precision, recall, error = cut_scores(cuts, truth.cuts(), TOLERANCE_S * stream.fps)
    known = np.setdiff1d(np.flatnonzero(match >= 0), annotated)
    given, right = decode(labels.codes)[known], decode(truth.codes)[match[known]]
    scores = {
        aspect: score(right[:, column], given[:, column], QUALIFIERS[aspect]) for column, aspect in enumerate(ASPECTS)
    }
    player, start, end, clip = truth.table.T
    graph = couple(link_actions(player, start, end, truth.codes, clip))
    tables = evaluate_labels(graph, rng, splits, truth.generators)
    ceiling = tables["label_logprob"]["truth"]
    return {
        "cut_f1": found,
        "cut_precision": precision,
        "cut_recall": recall,
        "cut_error_frames": error,
        "matched_share": float((match >= 0).sum() / len(truth.table)),
        "label_accuracy": {aspect: one.accuracy for aspect, one in scores.items()},
        "label_macro_f1": {aspect: one.macro_f1 for aspect, one in scores.items()},
        "label_confusion": {aspect: one.as_dict() for aspect, one in scores.items()},
        "rules_on_true_cuts": _rules(stream, truth),
        **tables,
        "label_relative_to_truth": {
            kind: (ceiling - value) / abs(ceiling) for kind, value in tables["label_logprob"].items() if kind != "truth"
        },
        "true_segments": len(truth.table),
        "true_groups": sum(len(one) for one in graph.graphs),
    }


def cut_scores(found: Cuts, truth: Cuts, tolerance: float) -> tuple[float, float, float, float]:
    """F1, precision, recall and mean absolute error [frames] of cuts within a tolerance [frames], each matched once."""
    hits, errors, counts = 0, 0.0, [0, 0]
    for ours, true in zip(found.frames, truth.frames):
        pairs = match_frames(ours, true, tolerance)
        hits += len(pairs)
        errors += float(np.abs(ours[pairs[:, 0]] - true[pairs[:, 1]]).sum())
        counts[0] += len(ours)
        counts[1] += len(true)
    precision, recall = hits / max(counts[0], 1), hits / max(counts[1], 1)
    return 2 * hits / max(sum(counts), 1), precision, recall, errors / max(hits, 1)


def match_frames(ours: IntArray, true: IntArray, tolerance: float) -> IntArray:
    """(M, 2) pairs of indices of frames that lie within a tolerance, nearest first, each used once."""
    if not len(ours) or not len(true):
        return np.zeros((0, 2), dtype=np.int64)
    low = np.searchsorted(true, ours)
    candidates = np.stack([np.maximum(low - 1, 0), np.minimum(low, len(true) - 1)], axis=1)
    gaps = np.abs(true[candidates] - ours[:, None])
    pairs, used_ours, used_true = [], set(), set()
    for flat in np.argsort(gaps, axis=None, kind="stable"):
        row, column = divmod(int(flat), 2)
        other = int(candidates[row, column])
        if gaps[row, column] <= tolerance and row not in used_ours and other not in used_true:
            used_ours.add(row)
            used_true.add(other)
            pairs.append((row, other))
    return np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)


def match_actions(table: IntArray, truth: IntArray, tolerance: float) -> IntArray:
    """(S,) row of the true action (R, 4) for each found (S, 4), both ends within a tolerance [frames]; or -1."""
    out = np.full(len(table), -1, dtype=np.int64)
    for player in range(2):
        ours, true = np.flatnonzero(table[:, 0] == player), np.flatnonzero(truth[:, 0] == player)
        for row, other in match_frames(table[ours, 1], truth[true, 1], tolerance):
            if abs(table[ours[row], 2] - truth[true[other], 2]) <= tolerance:
                out[ours[row]] = true[other]
    return out


def annotate_from_truth(truth: Truth, match: IntArray, share: float, rng: np.random.Generator) -> Annotations:
    """A random share of all actions, annotated; `match` (S,) is each one's row of the truth, -1 where wrongly cut.

    Raises:
        SettingError: fewer actions are rightly cut than should be annotated.
    """
    right = np.flatnonzero(match >= 0)
    count = max(2, round(share * len(match)))
    if len(right) < count:
        raise SettingError(f"{len(right)} of {len(match)} actions are cut as in the truth; {count} should be annotated")
    rows = np.sort(rng.choice(right, count, replace=False))
    return Annotations(rows, truth.qualifiers[match[rows]])


def annotate_as_proposed(
    truth: Truth, match: IntArray, share: float, features: FloatArray, character: Character
) -> Annotations:
    """Annotations of a person who follows the proposals (`labelling.propose`), a tenth of the share at a time.

    Arguments as of `annotate_from_truth`; `features` (S, F) are of all actions.
    """
    wrong = np.flatnonzero(match < 0)
    count = max(2, round(share * len(match)))
    rows = np.zeros(0, dtype=np.int64)
    while len(rows) < min(count, len(match) - len(wrong)):
        margins = None
        if len(rows):
            margins = train_labels(features[rows], truth.qualifiers[match[rows]], character).predict(features)[1]
        wanted = min(max(2, count // ROUNDS), count - len(rows))
        rows = np.concatenate([rows, propose(features, np.concatenate([rows, wrong]), margins, wanted)])
    rows = np.sort(rows)
    return Annotations(rows, truth.qualifiers[match[rows]])


def _rules(stream: DuelStream, truth: Truth) -> dict[str, float]:
    """Share of right answers of the rules for `react` and `move` on true cuts."""
    codes = decode(truth.codes)
    bounds = truth.cuts().bounds
    contacts = (stream.players[0].contacts, stream.players[1].contacts)
    detected = [
        np.concatenate([detect_contacts(m.qpos[a:b], m.fps, m.character) for a, b in bounds]) for m in stream.players
    ]
    react, move = (codes[:, ASPECTS.index(name)] for name in ("react", "move"))
    return {
        "react": float((react_rule(truth.table, codes[:, : len(LEARNED_ASPECTS)]) == react).mean()),
        "move": float((move_rule(truth.table, contacts, bounds) == move).mean()),
        "move_detected": float((move_rule(truth.table, (detected[0], detected[1]), bounds) == move).mean()),
    }


def _counts(codes: IntArray) -> dict[str, dict[str, int]]:
    parts = decode(codes)
    return {
        aspect: {name: int((parts[:, column] == index).sum()) for index, name in enumerate(QUALIFIERS[aspect])}
        for column, aspect in enumerate(ASPECTS)
    }


class _Clock:
    """Wall time of each stage."""

    def __init__(self, progress: Callable[[str], None] | None) -> None:
        self._progress, self._times = progress, {}  # type: ignore[var-annotated]
        self._name, self._since = "", 0.0

    def begin(self, name: str) -> None:
        self.done()
        if self._progress is not None:
            self._progress(name)
        self._name, self._since = name, time.perf_counter()

    def done(self) -> dict[str, float]:
        if self._name:
            self._times[self._name] = round(time.perf_counter() - self._since, 3)
            self._name = ""
        return dict(self._times)
