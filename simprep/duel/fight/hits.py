"""Which contacts an attack intended: the limb that attacks meets an opponent."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

from simprep.character import SIDES, Character
from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.labels.labels import ATTACKING_QUALIFIERS, Label
from simprep.physics.contacts import BodyContact

HIT, BLOCKED, UNINTENDED = "hit", "blocked", "unintended"
NOBODY = -1
GRACE_S = 0.1
"""An attack may land this much after its action has ended, since a simulated limb comes late [s]."""
STRIKING = {"hand": "punch", "forearm": "punch", "foot": "kick", "shank": "kick"}
"""Parts that strike, and how; labels do not tell knee strikes from kicks, so thighs do not count."""
ARMS = tuple(f"{side}_{part}" for side in SIDES for part in ("upper_arm", "forearm", "hand"))


@dataclass(frozen=True)
class JudgedContact(BodyContact):
    """A contact between two fighters, and its verdict.

    Attributes:
        verdict: `hit`: an attack that met what it aims at; `blocked`: one that met an arm; `unintended`: anything else.
        attacker: whose attack it was, one of `bodies`; -1 for nobody's.
        attack: index of that action in the fight; -1 for none.
    """

    verdict: str = UNINTENDED
    attacker: int = NOBODY
    attack: int = NOBODY

    @property
    def struck(self) -> int:
        """Whom an attack met, one of `bodies`; -1 for nobody."""
        return NOBODY if self.attacker == NOBODY else sum(self.bodies) - self.attacker

    @property
    def intended(self) -> bool:
        """Whether an attack intended it, even if it was blocked."""
        return self.verdict in (HIT, BLOCKED)


def striking_aspect(part: str) -> str:
    """Label aspect of attacks that strike with a part (`Character.parts`); empty for none."""
    side, _, segment = part.partition("_")
    return f"{side}_{STRIKING[segment]}" if segment in STRIKING else ""


def judge(contacts: Sequence[BodyContact], fight: Fight) -> tuple[JudgedContact, ...]:
    """The contacts of a run of all fighters, each with its verdict.

    `hit`: the striking segment of a limb that attacks at this time in the fight meets head, trunk or a leg; `blocked`:
    it meets an arm; otherwise `unintended`. Where both who touch attack, a hit counts before a block, then the attack that began
    first. (`simprep.metrics.interaction.overlap` counts the same of poses, where nothing stops a limb.)
    """
    characters = [motion.character for motion in fight.stream.players]
    return judge_actions(contacts, fight.actions, characters, fight.stream.fps)


def judge_actions(
    contacts: Sequence[BodyContact], actions: Sequence[FightAction], characters: Sequence[Character], fps: float
) -> tuple[JudgedContact, ...]:
    """As `judge`, by the actions alone: of a fight that goes on, of any number of fighters."""
    return tuple(_judged(contact, actions, characters, fps) for contact in contacts)


def _judged(
    contact: BodyContact, actions: Sequence[FightAction], characters: Sequence[Character], fps: float
) -> JudgedContact:
    claims = []
    bodies = [characters[number] for number in contact.bodies]
    parts = [one.parts[one.segments.index(name)] for one, name in zip(bodies, contact.parts, strict=True)]
    whole = {one.name: getattr(contact, one.name) for one in fields(BodyContact)}
    for player, own, met in zip(contact.bodies, parts, reversed(parts)):
        aspect = striking_aspect(own)
        index = _attack(actions, fps, player, aspect, contact.start_s) if aspect else NOBODY
        if index != NOBODY:
            blocked = met in ARMS
            claims.append((blocked, actions[index].start, player, index))
    if not claims:
        return JudgedContact(**whole)
    blocked, _, player, index = min(claims)
    return JudgedContact(**whole, verdict=BLOCKED if blocked else HIT, attacker=player, attack=index)


def _attack(actions: Sequence[FightAction], fps: float, player: int, aspect: str, time: float) -> int:
    """Index of the player's attack in this aspect at this time; -1 for none."""
    for index, action in enumerate(actions):
        if action.player == player and action.start <= time * fps < action.end + GRACE_S * fps:
            label = Label.from_code(action.label)
            if getattr(label, aspect) in ATTACKING_QUALIFIERS[aspect]:
                return index
    return NOBODY
