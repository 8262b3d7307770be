"""What the fighters of a synthetic stream can do: kinds of action, and what they mean to the opponent."""

from collections.abc import Mapping
from types import MappingProxyType

from simprep.duel.labels.labels import LEARNED_ASPECTS, OTHERS, QUALIFIERS, Label

SIDES = ("left", "right")


def _kinds() -> dict[str, dict[str, str]]:
    kinds: dict[str, dict[str, str]] = {"neutral": {}}
    for side, other in (SIDES, SIDES[::-1]):
        kinds |= {f"{side}_{phase}": {f"{side}_punch": phase} for phase in ("fwd", "bwd", "bwdfwd", "fwdbwd")}
        kinds[f"{side}_to_{other}"] = {f"{side}_punch": "bwd", f"{other}_punch": "fwd"}
        kinds |= {f"{side}_{phase}": {f"{side}_kick": phase} for phase in ("up", "down", "downup")}
        kinds |= {f"{side}_jump_{phase}": {f"{side}_kick": phase, "jump": phase} for phase in ("up", "down")}
    return kinds | {f"jump_{phase}": {"jump": phase} for phase in ("up", "down")}


KINDS: Mapping[str, Mapping[str, str]] = MappingProxyType(_kinds())
"""Kinds of action: the qualifiers of the learned aspects that are not `others`."""
KIND_NAMES: tuple[str, ...] = tuple(KINDS)
CONTEXTS = ("kick", "punch", "recovering", "neutral")
"""What an opponent's action means: a kick or punch on its way, a limb or body on its way back, or none of these."""


def kind_indices(kind: str) -> tuple[int, ...]:
    """Indices of the five learned qualifiers of a kind."""
    return tuple(QUALIFIERS[aspect].index(KINDS[kind].get(aspect, OTHERS)) for aspect in LEARNED_ASPECTS)


KIND_OF: Mapping[tuple[int, ...], str] = MappingProxyType({kind_indices(kind): kind for kind in KINDS})
"""Kind by the five learned qualifiers' indices."""


def label_of(kind: str, react: str, move: str) -> Label:
    """The complete label of a kind."""
    return Label(**{**KINDS[kind], "react": react, "move": move})


def context_of(kind: str) -> str:
    """What a kind of action means to the opponent; `kick` and `punch` are what the rule for `react` finds."""
    if kind.endswith(("_up", "_downup")) and kind != "jump_up":
        return "kick"
    if kind.endswith(("fwd", "fwdbwd")) or "_to_" in kind:
        return "punch"
    return "neutral" if kind in ("neutral", "jump_up") else "recovering"


def attacks(kind: str) -> bool:
    """Whether a fist or foot goes to the opponent."""
    return context_of(kind) in ("kick", "punch")
