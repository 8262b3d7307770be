"""How well actions are labelled: scores of one aspect, and cross-validation."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.character import Character
from simprep.duel.labels.labelling import DEFAULT_SETTINGS, LabelSettings, train_labels
from simprep.duel.labels.labels import LEARNED_ASPECTS, QUALIFIERS
from simprep.errors import SettingError


@dataclass(frozen=True)
class AspectScore:
    """Agreement of labels with the truth in one aspect.

    Attributes:
        qualifiers: names of rows and columns.
        confusion: (Q, Q) how often truth (row) was labelled as column.
        accuracy: share of actions labelled right; hides rare qualifiers, since `others` dominates.
        macro_f1: mean F1 over the qualifiers that truth or labels contain, rare and frequent ones alike.
    """

    qualifiers: tuple[str, ...]
    confusion: IntArray
    accuracy: float
    macro_f1: float

    def as_dict(self) -> dict[str, Any]:
        """The scores in JSON's types."""
        numbers = {"accuracy": self.accuracy, "macro_f1": self.macro_f1}
        return {**numbers, "qualifiers": list(self.qualifiers), "confusion": self.confusion.tolist()}


def score(truth: IntArray, labels: IntArray, qualifiers: tuple[str, ...]) -> AspectScore:
    """Compare qualifier indices (N,) with the truth's.

    Raises:
        SettingError: nothing to compare, or unequal lengths.
    """
    if len(truth) != len(labels) or not len(truth):
        raise SettingError(f"{len(truth)} true and {len(labels)} given labels; valid: equally many, at least one")
    confusion = np.zeros((len(qualifiers), len(qualifiers)), dtype=np.int64)
    np.add.at(confusion, (truth, labels), 1)
    right = np.diag(confusion)
    total = confusion.sum(axis=0) + confusion.sum(axis=1)
    f1 = 2 * right[total > 0] / total[total > 0]
    return AspectScore(qualifiers, confusion, float(right.sum() / len(truth)), float(f1.mean()))


def cross_validate(
    features: FloatArray,
    qualifiers: IntArray,
    character: Character,
    rng: np.random.Generator,
    folds: int = 5,
    settings: LabelSettings = DEFAULT_SETTINGS,
) -> dict[str, AspectScore]:
    """Score of each learned aspect over annotated actions that were left out of training.

    Args:
        features: (N, F) of the annotated actions.
        qualifiers: (N, 5) their qualifier indices.
        character: whose actions they are.
        rng: decides the folds.
        folds: at most N.
        settings: of the machines.

    Raises:
        SettingError: too few actions for two folds.
    """
    if len(features) < 4 or folds < 2:
        raise SettingError(f"{len(features)} annotated actions in {folds} folds; valid: at least 4 in 2")
    fold = rng.permutation(np.arange(len(features)) % min(folds, len(features) // 2))
    guessed = np.empty_like(qualifiers)
    for number in np.unique(fold):
        held = fold == number
        classifier = train_labels(features[~held], qualifiers[~held], character, settings)
        guessed[held] = classifier.predict(features[held])[0]
    return {
        aspect: score(qualifiers[:, column], guessed[:, column], QUALIFIERS[aspect])
        for column, aspect in enumerate(LEARNED_ASPECTS)
    }
