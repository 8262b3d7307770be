"""Which contacts an attack intended: the limb that the action attacks with meets the opponent."""

from collections.abc import Sequence
from dataclasses import replace

from simprep.duel.fight.fight import Fight
from simprep.duel.labels.labels import ATTACKING_QUALIFIERS, Label
from simprep.humanoid import SIDES
from simprep.physics.pair_run import BLOCKED, HIT, NOBODY, UNINTENDED, FighterContact

GRACE_S = 0.1
"""An attack may land this much after its action has ended [s]: a simulated limb comes a little later than planned."""
STRIKING = {"hand": "punch", "forearm": "punch", "foot": "kick", "shank": "kick"}
"""Segments that strike, and what with; labels do not tell knee strikes from kicks, so thighs do not count."""
ARMS = tuple(f"{side}_{part}" for side in SIDES for part in ("upper_arm", "forearm", "hand"))


def striking_aspect(part: str) -> str:
    """Label aspect of the attacks that strike with a body part; empty if none does."""
    side, _, segment = part.partition("_")
    return f"{side}_{STRIKING[segment]}" if segment in STRIKING else ""


def judge(contacts: Sequence[FighterContact], fight: Fight) -> tuple[FighterContact, ...]:
    """Say of every contact whose attack intended it, if any did.

    `hit`: the striking segment of a limb with which a fighter's present action attacks meets head, trunk or a leg;
    `blocked`: it meets an arm; otherwise `unintended`. Where both attack with what touches, a hit counts before a block, and then
    the attack that began first. (`simprep.metrics.interaction.overlap` counts the same of poses, where nothing stops a limb.)

    Args:
        contacts: between the fighters.
        fight: whose actions they performed, from the same time 0.

    Returns:
        The contacts with `verdict`, `attacker` and `attack`.
    """
    return tuple(_judged(contact, fight) for contact in contacts)


def _judged(contact: FighterContact, fight: Fight) -> FighterContact:
    claims = []
    parts = (contact.part_a, contact.part_b)
    for player in (0, 1):
        aspect = striking_aspect(parts[player])
        index = _attack(fight, player, aspect, contact.start_s) if aspect else NOBODY
        if index != NOBODY:
            blocked = parts[1 - player] in ARMS
            claims.append((blocked, fight.actions[index].start, player, index))
    if not claims:
        return replace(contact, verdict=UNINTENDED, attacker=NOBODY, attack=NOBODY)
    blocked, _, player, index = min(claims)
    return replace(contact, verdict=BLOCKED if blocked else HIT, attacker=player, attack=index)


def _attack(fight: Fight, player: int, aspect: str, time: float) -> int:
    """Index of the player's action that attacks in this aspect at this time; -1 if none does."""
    fps = fight.stream.fps
    for index, action in enumerate(fight.actions):
        if action.player == player and action.start <= time * fps < action.end + GRACE_S * fps:
            label = Label.from_code(action.label)
            if getattr(label, aspect) in ATTACKING_QUALIFIERS[aspect]:
                return index
    return NOBODY
