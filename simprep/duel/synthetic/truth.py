"""What is known about a synthetic stream: true cuts and labels, the models that drew them, who answers whom."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from simprep.archive import open_archive, write_archive
from simprep.arrays import BoolArray, IntArray
from simprep.duel.labels.labels import LEARNED_ASPECTS, QUALIFIERS, decode
from simprep.duel.labels.segmentation import Cuts
from simprep.duel.stream.stream import DuelStream
from simprep.duel.synthetic.generating_model import GeneratingModel
from simprep.errors import MotionFileError

SCHEMA = "simprep.duel-truth/1"
SUFFIX = ".truth.npz"
_COLUMNS = ("table", "codes", "answers", "peaks")


@dataclass(frozen=True)
class Truth:
    """The truth of a synthetic stream; rows are actions, sorted by player and time.

    Attributes:
        stream: name of the stream.
        frames: its length.
        preset: which of the presets.
        seed: that made it.
        table: (S, 4) player, first frame, frame at which the next begins, clip.
        codes: (S,) label codes.
        answers: (S,) row of the opponent's attack that was under way when the action began; -1 for none.
        peaks: (S,) frame of the peak of the contact force.
        variants: built-in motion that an action was made of, or what a neutral action is for.
        generators: of A and B.
    """

    stream: str
    frames: int
    preset: str
    seed: int
    table: IntArray
    codes: IntArray
    answers: IntArray
    peaks: IntArray
    variants: tuple[str, ...]
    generators: tuple[GeneratingModel, GeneratingModel]

    @property
    def qualifiers(self) -> IntArray:
        """(S, 5) indices of the learned aspects."""
        return decode(self.codes)[:, : len(LEARNED_ASPECTS)]

    def cuts(self) -> Cuts:
        """The true cuts, without the beginnings of clips."""
        ends = [self.table[self.table[:, 3] == clip][:, 1:3] for clip in np.unique(self.table[:, 3])]
        bounds = np.array([[part[:, 0].min(), part[:, 1].max()] for part in ends])
        first, second = (np.setdiff1d(self.table[self.table[:, 0] == player, 1], bounds[:, 0]) for player in range(2))
        return Cuts((first, second), bounds)

    def fitting(self) -> BoolArray:
        """(S,) whether an action is a fitting reaction: it answers an attack by a defence or an attack of its own."""
        from simprep.duel.synthetic.kinds import KIND_OF, attacks

        kinds = [KIND_OF[tuple(int(index) for index in row)] for row in self.qualifiers]
        return np.array([a >= 0 and (kind == "neutral" or attacks(kind)) for a, kind in zip(self.answers, kinds)])


def truth_path(stream: str | Path) -> Path:
    """Where the truth of a stream file lies: beside it."""
    path = Path(stream)
    return path.with_name(path.stem + SUFFIX)


def save_truth(truth: Truth, path: str | Path) -> Path:
    """Write a truth to .npz, atomically, and return the path.

    Raises:
        MotionFileError: it cannot be written.
    """
    header = {
        "schema": SCHEMA,
        "stream": truth.stream,
        "frames": truth.frames,
        "preset": truth.preset,
        "seed": truth.seed,
        "qualifiers": {aspect: list(names) for aspect, names in QUALIFIERS.items()},
        "variants": list(truth.variants),
        "policies": [generator.as_dict() for generator in truth.generators],
    }
    try:
        return write_archive(path, header, {name: getattr(truth, name) for name in _COLUMNS})
    except OSError as error:
        raise MotionFileError(path, f"cannot be written ({error.strerror})") from None


def read_truth(path: str | Path, stream: DuelStream | None = None) -> Truth:
    """Read a truth written by `save_truth`, and check that it is that of a stream, where given.

    Raises:
        MotionFileError: missing, no truth, another schema version or other labels, or of another stream.
    """
    with open_archive(path, "truth", SCHEMA) as (header, archive):
        if header["qualifiers"] != {aspect: list(names) for aspect, names in QUALIFIERS.items()}:
            raise MotionFileError(path, "labels with other qualifiers than this version's")
        arrays = {name: archive[name].astype(np.int64) for name in _COLUMNS}
        first, second = (GeneratingModel.from_dict(content) for content in header["policies"])
        truth = Truth(
            header["stream"], int(header["frames"]), header["preset"], int(header["seed"]), **arrays,
            variants=tuple(header["variants"]), generators=(first, second),
        )  # fmt: skip
        _check(path, truth, stream)
        return truth


def _check(path: str | Path, truth: Truth, stream: DuelStream | None) -> None:
    count = len(truth.table)
    columns: Sequence[Any] = (truth.codes, truth.answers, truth.peaks, truth.variants)
    if truth.table.shape != (count, 4) or any(len(column) != count for column in columns):
        raise MotionFileError(path, "tables of unequal length")
    decode(truth.codes)
    if stream is not None and (truth.stream, truth.frames) != (stream.name, len(stream)):
        raise MotionFileError(
            path,
            f"is the truth of {truth.stream!r} with {truth.frames} frames, not of {stream.name!r} with {len(stream)}",
        )
