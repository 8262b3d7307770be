"""Labels all actions from a few annotated ones: an SVM for each learned aspect, rules for the other two.

Source: the 2008 paper, section 3.2 (LIBSVM, which scikit-learn's `SVC` wraps).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.character import Character
from simprep.duel.labels.labels import LEARNED_ASPECTS, OTHERS, QUALIFIERS, Label, encode
from simprep.duel.labels.pose_features import SAMPLES, motion_features
from simprep.duel.labels.rules import move_rule, react_rule
from simprep.duel.labels.segmentation import Cuts, stream_kinematics
from simprep.duel.stream.stream import DuelStream
from simprep.errors import SettingError
from simprep.motion.kinematics import Kinematics


@dataclass(frozen=True)
class LabelSettings:
    """The support vector machines.

    Attributes:
        penalty: C of the soft margin; larger values fit every annotated action, smaller ones smooth over.
        gamma: width of the Gaussian kernel exp(-gamma |x - y|^2) over standardised features; None: `WIDTH` / features.
        balanced: weigh qualifiers by their rarity, since `others` is by far the most frequent.
        mirrored: also learn from the mirror image of every annotated action, left and right exchanged.
    """

    penalty: float = 10.0
    gamma: float | None = None
    balanced: bool = True
    mirrored: bool = True

    def __post_init__(self) -> None:
        if not 0 < self.penalty < 1e6:
            raise SettingError(f"penalty {self.penalty}; valid: above 0, below 1e6")
        if self.gamma is not None and not 0 < self.gamma < 1e3:
            raise SettingError(f"gamma {self.gamma}; valid: above 0, below 1000")


DEFAULT_SETTINGS = LabelSettings()
WIDTH = 0.1
"""Default gamma times the number of features; poses of an action depend on each other, so a wide kernel is better."""
_SWAP = {"left": "right", "right": "left"}


def _mirrored(name: str) -> str:
    side, gap, rest = name.partition("_")
    return f"{_SWAP.get(side, side)}{gap}{rest}"


MIRROR_ASPECTS = np.array([LEARNED_ASPECTS.index(_mirrored(aspect)) for aspect in LEARNED_ASPECTS])
"""Source of each aspect in the mirror image."""


@dataclass(frozen=True)
class LabelClassifier:
    """Trained classifiers of the learned aspects.

    Attributes:
        machines: aspect to its classifier (a scikit-learn pipeline), or to the only qualifier index it has seen.
        warnings: what was missing in the annotated actions.
    """

    machines: Mapping[str, Any]
    warnings: tuple[str, ...] = ()

    def predict(self, features: FloatArray) -> tuple[IntArray, FloatArray]:
        """Label actions with features (S, F) as from `motion_features`.

        Returns:
            Qualifier indices (S, 5), and margins (S, 5): lead of the best qualifier over the second best; infinite
            where only one qualifier is known.
        """
        chosen = np.zeros((len(features), len(LEARNED_ASPECTS)), dtype=np.int64)
        margins = np.full(chosen.shape, np.inf)
        for column, aspect in enumerate(LEARNED_ASPECTS):
            machine = self.machines[aspect]
            if isinstance(machine, int):
                chosen[:, column] = machine
            elif len(features):
                chosen[:, column], margins[:, column] = decide(machine, features)
        return chosen, margins


def decide(machine: Any, features: FloatArray) -> tuple[IntArray, FloatArray]:
    """Classes (S,) of actions by one trained machine, and their lead (S,) over the second best."""
    score = machine.decision_function(features)
    if score.ndim == 1:  # two classes: one signed distance
        score = np.stack([-score, score], axis=1)
    order = np.sort(score, axis=1)
    return np.asarray(machine.classes_[np.argmax(score, axis=1)], dtype=np.int64), np.asarray(
        order[:, -1] - order[:, -2]
    )


def new_machine(settings: LabelSettings, features: int) -> Any:
    """An untrained classifier for so many features: standardised, Gaussian-kernel SVC, no randomness."""
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC

    machine = SVC(
        C=settings.penalty,
        kernel="rbf",
        gamma=WIDTH / features if settings.gamma is None else settings.gamma,
        class_weight="balanced" if settings.balanced else None,
        decision_function_shape="ovr",
    )
    return make_pipeline(StandardScaler(), machine)


def train_labels(
    features: FloatArray, qualifiers: IntArray, character: Character, settings: LabelSettings = DEFAULT_SETTINGS
) -> LabelClassifier:
    """Learn the five aspects from annotated actions.

    An aspect with only one annotated qualifier always gets that one, with a warning.

    Args:
        features: (N, F) of the annotated actions.
        qualifiers: (N, 5) their qualifier indices.
        character: whose actions they are; says what left and right are.
        settings: of the machines.

    Raises:
        SettingError: no annotated action.
    """
    if not len(features):
        raise SettingError("no annotated action; at least two different ones are needed to learn from")
    warnings = []
    attacks = [aspect for aspect in LEARNED_ASPECTS if aspect != "jump"]
    known = {aspect: np.unique(qualifiers[:, column]) for column, aspect in enumerate(LEARNED_ASPECTS)}
    if all(list(known[aspect]) == [QUALIFIERS[aspect].index(OTHERS)] for aspect in attacks):
        warnings.append("no annotated action is an attack: no action will be, nor a reaction to one")
    if settings.mirrored:
        features = np.concatenate([features, mirror_features(features, character)])
        qualifiers = np.concatenate([qualifiers, qualifiers[:, MIRROR_ASPECTS]])
    machines: dict[str, Any] = {}
    for column, aspect in enumerate(LEARNED_ASPECTS):
        classes = np.unique(qualifiers[:, column])
        if len(classes) == 1:
            machines[aspect] = int(classes[0])
            warnings.append(
                f"{aspect}: every annotated action is {QUALIFIERS[aspect][classes[0]]!r}, so every action will be"
            )
        else:
            machines[aspect] = new_machine(settings, features.shape[1]).fit(features, qualifiers[:, column])
    return LabelClassifier(machines, tuple(warnings))


def mirror_features(features: FloatArray, character: Character) -> FloatArray:
    """Features (S, N * (3 + 3 J)) of the mirror image, left and right exchanged, of a character with J segments."""
    swap = character.mirror_segments
    poses = features.reshape(len(features), -1, 3 + 3 * len(swap))
    root = poses[..., :3] * [1.0, -1.0, -1.0]
    joints = poses[..., 3:].reshape(*poses.shape[:2], len(swap), 3)[:, :, swap] * [1.0, -1.0, 1.0]
    return np.concatenate([root, joints.reshape(*poses.shape[:2], -1)], axis=-1).reshape(features.shape)


def stream_features(cuts: Cuts, kinematics: Sequence[Kinematics], samples: int = SAMPLES) -> FloatArray:
    """Features (S, F) of all actions in the order of `Cuts.table`.

    Raises:
        SettingError: two people with different segments, whose actions cannot be compared.
    """
    first, second = (one.xpos.shape[1] for one in kinematics)
    if first != second:
        raise SettingError(f"players of {first} and {second} segments; labels are learned from two with the same ones")
    parts = [motion_features(kinematics[player], cuts.segments(player), samples) for player in range(2)]
    return np.concatenate(parts)


def label_codes(stream: DuelStream, cuts: Cuts, qualifiers: IntArray) -> IntArray:
    """Complete labels (S,) as codes, in the order of `Cuts.table`: `react` and `move` by rule.

    `qualifiers` (S, 5) are indices of the learned aspects; the stream gives foot contacts.
    """
    first, second = stream.pair
    table = cuts.table()
    react = react_rule(table, qualifiers)
    move = move_rule(table, (first.contacts, second.contacts), cuts.bounds)
    return encode(np.column_stack([qualifiers, react, move]))


def propose(features: FloatArray, done: IntArray, margins: FloatArray | None, count: int) -> IntArray:
    """Which actions to annotate next: rows, most useful first.

    Without margins: actions that differ most from each other and from the annotated ones (farthest first). With
    margins: the most undecided first, by the smallest margin over the aspects.

    Args:
        features: (S, F) of all actions.
        done: (N,) rows that are annotated.
        margins: (S, 5) from `LabelClassifier.predict`, or None.
        count: how many; fewer come back where fewer are left.
    """
    left = np.setdiff1d(np.arange(len(features)), done)
    if margins is not None and np.isfinite(margins[left]).any():
        lead = margins[left].min(axis=1)
        return np.asarray(left[np.argsort(lead, kind="stable")][:count], dtype=np.int64)
    spread = features.std(axis=0)
    scaled = (features - features.mean(axis=0)) / np.where(spread > 1e-9, spread, 1.0)
    if len(done):
        gap = np.min([((scaled - scaled[row]) ** 2).sum(axis=1) for row in done], axis=0)
    else:  # begin with the most ordinary one
        first = int(np.argmin((scaled**2).sum(axis=1)))
        gap = ((scaled - scaled[first]) ** 2).sum(axis=1)
        gap[first] = np.inf
    chosen: list[int] = []
    gap[done] = -1.0
    for _ in range(min(count, len(left))):
        row = int(np.argmax(gap))
        chosen.append(row)
        gap = np.minimum(gap, ((scaled - scaled[row]) ** 2).sum(axis=1))
        gap[row] = -1.0
    return np.array(chosen, dtype=np.int64)


@dataclass(frozen=True)
class LabelResult:
    """All actions of a stream, labelled.

    Attributes:
        table: (S, 4) as from `Cuts.table`.
        codes: (S,) label codes.
        margins: (S, 5) lead of the chosen qualifier; infinite for annotated actions.
        warnings: what was missing in the annotations.
    """

    table: IntArray
    codes: IntArray
    margins: FloatArray
    warnings: tuple[str, ...]


def label_stream(
    stream: DuelStream,
    cuts: Cuts,
    rows: IntArray,
    qualifiers: IntArray,
    settings: LabelSettings = DEFAULT_SETTINGS,
    features: FloatArray | None = None,
) -> LabelResult:
    """Label every action of a stream from some annotated ones, which keep their labels.

    These are rows (N,) of `cuts.table()` with qualifier indices (N, 5). `features` (S, F) are of all actions, where
    already computed.

    Raises:
        MotionError: more than two people.
    """
    first, _ = stream.pair
    if features is None:
        features = stream_features(cuts, stream_kinematics(stream))
    classifier = train_labels(features[rows], qualifiers, first.character, settings)
    chosen, margins = classifier.predict(features)
    chosen[rows], margins[rows] = qualifiers, np.inf
    codes = label_codes(stream, cuts, chosen)
    warnings = list(classifier.warnings)
    if not any(Label.from_code(int(code)).attacks for code in np.unique(codes)):
        warnings.append("no action of the stream is labelled as an attack: there is no fight to learn from")
    return LabelResult(cuts.table(), codes, margins, tuple(warnings))
