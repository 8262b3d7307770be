"""Entries of the library: name, family, parameters, and how to make the motion."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from simprep.motion.edit import mirror
from simprep.motion.motion import Motion

FAMILIES = ("locomotion", "guard", "punch", "kick", "block", "dodge", "crawl", "duck", "jump", "get_up")
FPS = 60.0
"""Frame rate of every built-in motion [1/s]."""


@dataclass(frozen=True)
class Entry:
    """One motion of the library.

    Attributes:
        name: unique, lower case.
        family: one of `FAMILIES`.
        summary: what a person does in it, in a few words.
        generate: makes the motion; deterministic.
        parameters: what distinguishes it within its family (side, height, speed, ...), units in the keys.
        terms: of use for a recording; empty for generated motions.
    """

    name: str
    family: str
    summary: str
    generate: Callable[[], Motion]
    parameters: Mapping[str, float | str] = field(default_factory=dict)
    terms: str = ""


def is_name(text: str) -> bool:
    """Whether a motion may be called this: letters, digits, `_` and `-`, so that no name looks like a file."""
    return re.fullmatch(r"[A-Za-z0-9_-]+", text) is not None


def mirrored(entry: Entry, name: str, summary: str, parameters: Mapping[str, float | str] | None = None) -> Entry:
    """The entry whose motion is the mirror image of another's, left for right.

    Args:
        entry: the other.
        name: of the new one.
        summary: of the new one.
        parameters: of the new one; None: the other's, with left and right exchanged.
    """
    sides: dict[float | str, float | str] = {"left": "right", "right": "left"}
    if parameters is None:
        parameters = {key: sides.get(value, value) for key, value in entry.parameters.items()}

    def generate() -> Motion:
        return replace(mirror(entry.generate()), name=name, source=f"simprep library: {name}")

    return Entry(name, entry.family, summary, generate, parameters)
