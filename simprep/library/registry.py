"""Built-in motions by name: generated on first use, kept in memory."""

from collections.abc import Callable
from functools import cache

from simprep.errors import UnknownNameError
from simprep.library.crawl import crawl
from simprep.library.duck import duck
from simprep.library.jump import jump
from simprep.library.kick import front_kick_right
from simprep.library.punch import cross_left, cross_right
from simprep.library.stand import stand
from simprep.library.walk import walk
from simprep.motion.motion import Motion

_GENERATORS: dict[str, Callable[[], Motion]] = {
    "stand": stand,
    "walk": walk,
    "punch_left": cross_left,
    "punch_right": cross_right,
    "kick_front": front_kick_right,
    "crawl": crawl,
    "duck": duck,
    "jump": jump,
}


def library_names() -> tuple[str, ...]:
    """Names of the built-in motions."""
    return tuple(_GENERATORS)


@cache
def library_motion(name: str) -> Motion:
    """A built-in motion, bit-identical at every call.

    Locomotion is cyclic (`loop`); a target begins and ends in a standing posture and marks the first frame of its movement
    as event `target`; strikes mark `impact`.

    Args:
        name: one of `library_names()`.

    Raises:
        UnknownNameError: no such motion.
    """
    if name not in _GENERATORS:
        raise UnknownNameError("built-in motion", name, library_names())
    return _GENERATORS[name]()
