"""Built-in motions by name: generated on first use, kept in memory and in the user's cache folder."""

from functools import cache
from itertools import chain

from simprep.errors import UnknownNameError
from simprep.library import crawl, duck, get_up, hands_and_knees, jump, stand
from simprep.library.boxing import block, dodge, guard, hook, jab_and_cross, punch, uppercut
from simprep.library.cache import cached_motion
from simprep.library.entry import Entry
from simprep.library.kicks import front, knee, roundhouse, side
from simprep.library.walking import directions, steps, transitions, walk
from simprep.motion.motion import Motion

_MODULES = (
    stand,
    walk,
    directions,
    transitions,
    steps,
    punch,
    jab_and_cross,
    hook,
    uppercut,
    block,
    dodge,
    front,
    roundhouse,
    side,
    knee,
    guard,
    crawl,
    hands_and_knees,
    duck,
    jump,
    get_up,
)
_ENTRIES: dict[str, Entry] = {entry.name: entry for entry in chain.from_iterable(m.ENTRIES for m in _MODULES)}


def library_entries() -> tuple[Entry, ...]:
    """All built-in motions, family by family, without generating them."""
    return tuple(_ENTRIES.values())


def library_names() -> tuple[str, ...]:
    """Names of the built-in motions."""
    return tuple(_ENTRIES)


@cache
def library_motion(name: str) -> Motion:
    """A built-in motion, bit-identical at every call.

    Locomotion is cyclic (`loop`). A target begins and ends in a standing posture, but getting up begins lying; event `target` marks the first frame
    of its movement, event `impact` the contact of a strike.

    Args:
        name: one of `library_names()`.

    Raises:
        UnknownNameError: no such motion.
    """
    if name not in _ENTRIES:
        raise UnknownNameError("built-in motion", name, library_names())
    return cached_motion(name, _ENTRIES[name].generate)
