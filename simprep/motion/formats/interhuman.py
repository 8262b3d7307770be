"""InterHuman's pickles: SMPL parameters of two people, `person1` and `person2`, in one frame (Liang et al. 2024)."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from simprep.errors import MotionFileError
from simprep.motion.formats.format import Format, Glimpse, ReadOptions
from simprep.motion.formats.safe_pickle import read_pickle
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.formats.smpl import RATES, smpl_clip

PEOPLE = ("person1", "person2")


def read_interhuman(path: Path, options: ReadOptions) -> tuple[SourceClip, SourceClip]:
    """Clips of the two people.

    Raises:
        MotionFileError: no such pickle, one that would run code, or malformed parameters.
    """
    content = read_pickle(path)
    if not isinstance(content, Mapping) or any(not isinstance(content.get(key), Mapping) for key in PEOPLE):
        raise MotionFileError(path, f"no {' and '.join(PEOPLE)} with SMPL parameters; valid: a pickle of InterHuman")
    name = next((key for key in RATES if key in content), None)
    try:
        rate = None if name is None else float(np.ravel(content[name])[0])
    except (TypeError, ValueError, IndexError):
        raise MotionFileError(path, f"{name!r} is no frame rate") from None
    one, two = (
        smpl_clip(path, {str(key): value for key, value in content[person].items()}, options, rate) for person in PEOPLE
    )
    return one, two


def is_interhuman(seen: Glimpse) -> bool:
    """Whether a file begins like a pickle of InterHuman."""
    return seen.raw[:1] == b"\x80" and PEOPLE[0].encode() in seen.raw


def _recognise(seen: Glimpse) -> str | None:
    return "InterHuman, SMPL parameters of two people" if is_interhuman(seen) else None


def _read(path: Path, options: ReadOptions) -> SourceClip:
    raise MotionFileError(path, "two people (person1, person2), which `simprep duel import` reads; valid: one person")


FORMAT = Format("interhuman", "InterHuman", (".pkl",), _recognise, _read)
