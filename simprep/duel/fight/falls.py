"""Falls of fighters, and what came before: a blow, another collision with an opponent, or nothing of the kind.

A blow is what an attack meant. But a kick that meets the other's leg throws over who kicks as well, and an arm that nobody
swung can hit a head: such collisions are told apart from falls without any.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.fight.hits import JudgedContact
from simprep.physics.contacts import BodyContact

KNOCK_DOWN_NS, KNOCK_DOWN_S = 15.0, 1.0
"""A fall is a knock-down if it comes within this time of a blow of this impulse [s, N s]. Who stands and keeps the feet in
place bears at most 14 N s to the back, 28 forward and 31 to the side: extrapolated COM at the edge of the support of a
body of 75 kg (Hof et al. 2005)."""
COLLISION_S, LEANING_S, SOON_S = 0.1, 0.25, 0.2
"""Contacts that begin within the first time are one collision. One that lasts longer than the second is leaning, not a
collision. One that begins less than the third before a fall is none of its reasons: to fall 0.35 m takes 0.27 s [s]."""
BLOW_NS = 5.0
"""A blow of less is no reason to react [N s]."""


@dataclass(frozen=True)
class Blow:
    """All contacts of one attack with one opponent, as far as the attack meant them.

    Attributes:
        player: who was struck.
        attack: index of the action in the fight.
        start_s: first touch [s].
        end_s: last touch [s].
        impulse: (3,) on who was struck, world frame [N s].
        blocked: it met arms alone.
    """

    player: int
    attack: int
    start_s: float
    end_s: float
    impulse: FloatArray
    blocked: bool

    @property
    def impulse_ns(self) -> float:
        """Size of the impulse [N s]."""
        return float(np.linalg.norm(self.impulse))


@dataclass(frozen=True)
class Fall:
    """A fighter went down.

    Attributes:
        player: who.
        time_s: when the rule for falls applied [s].
        reason: that rule, in words.
        blow_ns: largest blow within 1 s before; 0 without any [N s].
        collision_ns: largest collision with opponents in that time, blow or not (`collision_before`) [N s].
        up_s: when the fighter stood again [s]; None: not in this fight.
        tries: attempts to roll over and to get up.
        lay: how the fighter came to rest: `prone`, `supine`, `side`; empty where that was not seen.
    """

    player: int
    time_s: float
    reason: str
    blow_ns: float = 0.0
    collision_ns: float = 0.0
    up_s: float | None = None
    tries: int = 0
    lay: str = ""

    @property
    def knock_down(self) -> bool:
        """Whether a blow is the reason."""
        return self.blow_ns >= KNOCK_DOWN_NS

    @property
    def after_collision(self) -> bool:
        """Whether a collision as hard as that is the reason, and no blow."""
        return not self.knock_down and self.collision_ns >= KNOCK_DOWN_NS

    @property
    def words(self) -> str:
        """What happened, in words."""
        why = f"not struck; {self.reason}"
        if self.knock_down:
            why = f"knocked down by {self.blow_ns:.0f} N s"
        elif self.after_collision:
            why = f"collided with {self.collision_ns:.0f} N s; {self.reason}"
        lay = f", lies {self.lay}" if self.lay else ""
        if self.up_s is not None:
            return f"{why}{lay}, up at {self.up_s:.2f} s"
        tried = f" after {self.tries} tries" if self.tries else ""
        return f"{why}{lay}, stays down{tried}"


def blows(contacts: Sequence[JudgedContact]) -> tuple[Blow, ...]:
    """The blows among judged contacts, by time of the first touch."""
    by_attack: dict[tuple[int, int], list[JudgedContact]] = {}
    for one in contacts:
        if one.intended:
            by_attack.setdefault((one.attack, one.struck), []).append(one)
    found = []
    for (attack, struck), parts in by_attack.items():
        # contacts hold the impulse of their first body on their second
        on = [np.array(one.impulse) * (1.0 if struck == one.bodies[1] else -1.0) for one in parts]
        found.append(
            Blow(
                struck,
                attack,
                min(one.start_s for one in parts),
                max(one.start_s + one.duration_s for one in parts),
                np.sum(on, axis=0),
                all(one.verdict != "hit" for one in parts),
            )
        )
    return tuple(sorted(found, key=lambda one: (one.start_s, one.attack, one.player)))


def blow_before(found: Sequence[Blow], player: int, time_s: float) -> float:
    """Impulse of the largest blow to a player in the second before a time; 0 without any [N s]."""
    near = [
        one.impulse_ns
        for one in found
        if one.player == player and one.start_s <= time_s and one.end_s >= time_s - KNOCK_DOWN_S
    ]
    return max(near, default=0.0)


def collision_before(contacts: Sequence[BodyContact], player: int, time_s: float) -> float:
    """Impulse on a player of the hardest collision that may be the reason of a fall at a time; 0 without any [N s]."""
    first, last = time_s - KNOCK_DOWN_S, time_s - SOON_S
    near = [
        (one.start_s, np.array(one.impulse) * (1.0 if player == one.bodies[1] else -1.0))
        for one in contacts
        if player in one.bodies and first <= one.start_s <= last and one.duration_s <= LEANING_S
    ]
    sums = [
        np.sum([impulse for start, impulse in near if begin <= start <= begin + COLLISION_S], axis=0)
        for begin, _ in near
    ]
    return max((float(np.linalg.norm(one)) for one in sums), default=0.0)
