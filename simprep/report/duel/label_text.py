"""Labels of actions in pictures: a few letters and a colour each."""

from collections.abc import Mapping
from types import MappingProxyType

from simprep.duel.labels.labels import KICKS, OTHERS, PUNCHES, Label

COLOUR_OF: Mapping[str, str] = MappingProxyType(
    {
        "left punch": "#e8a33d", "right punch": "#d1603d", "left kick": "#4c8fd0", "right kick": "#2f5fa8",
        "jump": "#4f9e5a", "neutral": "#d8dbdf",
    }
)  # fmt: skip
"""Kinds of action and their colours; limbs on their way back have the same, paler."""
PALE = 0.45
"""Opacity of actions that are no attacks."""


def kind_of(label: Label) -> str:
    """The kind in `COLOUR_OF` that an action is drawn as: of two limbs the one that attacks, kicks before punches."""
    moved = [aspect for aspect in (*KICKS, *PUNCHES) if getattr(label, aspect) != OTHERS]
    if not moved:
        return "neutral" if label.jump == OTHERS else "jump"
    attacking = [aspect for aspect in moved if Label(move=label.move, **{aspect: getattr(label, aspect)}).attacks]
    return (attacking or moved)[0].replace("_", " ")


def short_text(label: Label) -> str:
    """An action in a few letters: `LP fwd` (left punch), `RK up` (right kick), `J up` (jump); neutral: empty."""
    words = []
    for aspect in (*PUNCHES, *KICKS):
        qualifier = getattr(label, aspect)
        if qualifier != OTHERS:
            words.append(f"{aspect[0].upper()}{'P' if aspect in PUNCHES else 'K'} {qualifier}")
    if label.jump != OTHERS:
        words.append(f"J {label.jump}")
    return ", ".join(words)


def full_text(label: Label) -> str:
    """`short_text` with what is reacted to and the supporting feet: `LP fwd | kick | L-R`."""
    react = "" if label.react == OTHERS else f" | {label.react}"
    return f"{short_text(label) or 'neutral'}{react} | {label.move}"
