"""A transition model and its example motions in one folder: all that synthesis needs (2008 paper, section 5).

`model.npz` names the digest of its stream, so that it is never used with another one.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from simprep.archive import find_archive
from simprep.display import SelfShowing
from simprep.duel.labels.labels import Label
from simprep.duel.model.store import SCHEMA, learned_from, read_model, save_model
from simprep.duel.model.transition_model import DuelModel
from simprep.duel.stream.store import read_stream, save_stream
from simprep.duel.stream.stream import PLAYERS, DuelStream, check_stream
from simprep.errors import MotionFileError, SettingError

MODEL_FILE = "model.npz"
STREAM_FILE = "stream.npz"


@dataclass(frozen=True)
class FightModel(SelfShowing):
    """A transition model with its example motions.

    Attributes:
        model: which action follows, and B.
        stream: the frames that B's actions are made of.
        learned_until: frame from which on nothing was learned; None: learned from all of it.

    Raises:
        SettingError: a model of a longer stream, or of another frame rate.
        MotionError: a stream of more than two people.
    """

    model: DuelModel
    stream: DuelStream
    learned_until: int | None = None

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(fight_model)` and Jupyter show."""
        return f"fight model of {self.stream.name}", {
            "recorded [s]": round(self.stream.duration, 2),
            "learned until [s]": None if self.learned_until is None else round(self.learned_until / self.stream.fps, 2),
            "actions": len(self.model.parameters),
            "examples": ", ".join(f"{name}: {len(one.examples)}" for name, one in zip(PLAYERS, self.model.players)),
            "labels": ", ".join(f"{name}: {len(one.labels)}" for name, one in zip(PLAYERS, self.model.graph.graphs)),
        }

    def __post_init__(self) -> None:
        self.stream.check_pair()
        last = int(self.model.graph.actions.end.max())
        if self.model.fps != self.stream.fps or last > len(self.stream):
            raise SettingError(
                f"a model of {last} or more frames at {self.model.fps:g} per second does not belong to {self.stream.name!r}: "
                f"{len(self.stream)} frames at {self.stream.fps:g}"
            )


def model_doubts(fight_model: FightModel) -> tuple[str, ...]:
    """What makes fights of a model doubtful, a sentence each: its stream's warnings, and fighters who never attack."""
    silent = [
        f"{player} never attacks in {fight_model.stream.name}, which the model was learned from"
        for player, graph in zip(PLAYERS, fight_model.model.graph.graphs)
        if not any(Label.from_code(int(code)).attacks for code in graph.labels)
    ]
    return (*check_stream(fight_model.stream).warnings, *silent)


def stream_digest(stream: DuelStream) -> str:
    """SHA-256 of all frames, the frame rate, the seams and the bodies of a stream, hexadecimal."""
    digest = hashlib.sha256(repr((stream.fps, stream.seams)).encode())
    for motion in stream.players:
        digest.update(repr((motion.character.height_m, motion.character.mass_kg)).encode())
        digest.update(np.ascontiguousarray(motion.qpos, dtype="<f8").tobytes())
        digest.update(np.packbits(motion.contacts).tobytes())
    return digest.hexdigest()


def save_fight_model(model: DuelModel, stream: DuelStream, folder: str | Path) -> tuple[Path, Path]:
    """Write `model.npz` and all frames it was learned from, `stream.npz`, to a folder, and return both paths.

    Raises:
        MotionFileError: they cannot be written.
    """
    folder = Path(folder)
    # the stream first: a model without its stream is of no use
    motions = save_stream(stream, folder / STREAM_FILE)
    return save_model(model, folder / MODEL_FILE, stream_digest(stream)), motions


def read_fight_model(path: str | Path) -> FightModel:
    """Read a model and its example motions from a folder that `simprep duel analyse` wrote, or the `model.npz` in it.

    Raises:
        MotionFileError: a file is missing or damaged, or the stream is not the one that the model was learned from.
    """
    path = find_archive(path, "duel model, which `simprep duel analyse STREAM -o DIR` writes", SCHEMA, MODEL_FILE)
    model = read_model(path)
    beside = path.with_name(STREAM_FILE)
    if not beside.is_file():
        raise MotionFileError(
            path, f"its example motions are missing: no {STREAM_FILE} beside it; run `simprep duel analyse` again"
        )
    stream = read_stream(beside)
    if learned_from(path) != stream_digest(stream):
        raise MotionFileError(beside, f"not the stream that {path} was learned from; run `simprep duel analyse` again")
    return FightModel(model, stream)
