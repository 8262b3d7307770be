"""Which contacts an attack intended: the limb that the action attacks with meets what such attacks aim at."""

from collections.abc import Sequence
from dataclasses import replace

from simprep.duel.fight import Fight, FightAction
from simprep.duel.labels import ATTACKING_QUALIFIERS, KICKS, Label
from simprep.humanoid import SIDES
from simprep.physics.pair_run import BLOCKED, HIT, NOBODY, UNINTENDED, FighterContact

GRACE_S = 0.1
"""An attack may land this much after its action has ended [s]: a simulated limb comes a little later than planned."""
PUNCH_PARTS = ("hand", "forearm")
KICK_PARTS = ("foot", "shank", "thigh")
"""Segments of the attacking limb that strike; the thigh because labels do not tell a knee strike from a kick."""
ARMS = tuple(f"{side}_{part}" for side in SIDES for part in ("upper_arm", "forearm", "hand"))
PUNCH_TARGETS = ("head", "neck", "thorax", "abdomen", "pelvis")
KICK_TARGETS = (*PUNCH_TARGETS, *(f"{side}_thigh" for side in SIDES))
"""What kicks aim at: as punches, and thighs, at which low kicks are directed."""


def striking_aspect(part: str) -> str:
    """Label aspect of the attacks that strike with a body part; empty if none does."""
    side, _, segment = part.partition("_")
    if segment in PUNCH_PARTS:
        return f"{side}_punch"
    return f"{side}_kick" if segment in KICK_PARTS else ""


def judge(contacts: Sequence[FighterContact], fight: Fight) -> tuple[FighterContact, ...]:
    """Say of every contact whose attack intended it, if any did.

    `hit`: the striking segment of a limb with which a fighter's present action attacks meets the head, neck, trunk or pelvis,
    or by a kick a thigh; `blocked`: it meets an arm; otherwise `unintended`. Where both attack with what touches, a hit counts
    before a block, and then the attack that began first.

    Args:
        contacts: between the fighters.
        fight: whose actions they performed, from the same time 0.

    Returns:
        The contacts with `verdict` and `attacker`.
    """
    return tuple(_judged(contact, fight) for contact in contacts)


def _judged(contact: FighterContact, fight: Fight) -> FighterContact:
    claims = []
    parts = (contact.part_a, contact.part_b)
    for player in (0, 1):
        aspect, target = striking_aspect(parts[player]), parts[1 - player]
        attack = _attack(fight, player, aspect, contact.start_s) if aspect else None
        if attack is None:
            continue
        if target in (KICK_TARGETS if aspect in KICKS else PUNCH_TARGETS):
            claims.append((0, attack.start, player, HIT))
        elif target in ARMS:
            claims.append((1, attack.start, player, BLOCKED))
    if not claims:
        return replace(contact, verdict=UNINTENDED, attacker=NOBODY)
    _, _, player, verdict = min(claims)
    return replace(contact, verdict=verdict, attacker=player)


def _attack(fight: Fight, player: int, aspect: str, time: float) -> FightAction | None:
    """The player's action that attacks in this aspect at this time; None if none does."""
    fps = fight.stream.fps
    for action in fight.of(player):
        if action.start <= time * fps < action.end + GRACE_S * fps:
            label = Label.from_code(action.label)
            if getattr(label, aspect) in ATTACKING_QUALIFIERS[aspect]:
                return action
    return None
