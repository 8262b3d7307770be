"""Where a strike meets the opponent in the examples, and how to bend a new one so that it meets there again.

Of an example that attacks: which hand or foot comes nearest to which part of the opponent, when, and from where. In a
fight the same hand or foot should be at the same place beside the same part of where the opponent will be.
"""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.character import Character
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.duel.fight.hits import ARMS, STRIKING, striking_aspect
from simprep.duel.fight.placement import Aim, Placement
from simprep.duel.labels.labels import ATTACKING_QUALIFIERS, Label
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.turns import turned

ENDS = ("hand", "foot")
"""Parts that a strike is aimed with."""
FARTHEST_M = 0.5
"""An attack of the examples that stays farther than this from the opponent is no strike [m]."""

BACK_M = 0.1
"""Who is too near for a strike goes back by no more than this for it [m]."""


@dataclass(frozen=True)
class Strike:
    """The moment at which an example's strike is nearest to what it strikes.

    Attributes:
        frame: of the recording, counted from the action's first.
        segment: of the attacker, which strikes.
        target: segment of the opponent that it is nearest to.
        offset: (2,) from the target's centre to the striking segment's, on the floor of the recording [m].
        way: (2,) from the attacker's root to the striking segment, the same [m].
    """

    frame: int
    segment: int
    target: int
    offset: FloatArray
    way: FloatArray


def striking_segments(character: Character, label: int, parts: tuple[str, ...] = tuple(STRIKING)) -> IntArray:
    """Segments with which an action of this label strikes, of the given kinds of parts (`hits.STRIKING`)."""
    found = Label.from_code(label)
    rows = []
    for index, part in enumerate(character.parts):
        aspect = striking_aspect(part)
        if aspect and part.partition("_")[2] in parts and getattr(found, aspect) in ATTACKING_QUALIFIERS[aspect]:
            rows.append(index)
    return np.array(rows, dtype=np.int64)


def struck_segments(character: Character) -> IntArray:
    """Segments that strikes are meant for: head, trunk and legs."""
    return np.array([index for index, part in enumerate(character.parts) if part not in ARMS], dtype=np.int64)


def strike_of(examples: ExampleMotions, index: int) -> Strike | None:
    """The strike of an example; None where it does not strike.

    Args:
        examples: the recordings.
        index: of the action.
    """
    actions = examples.actions
    player = int(actions.player[index])
    own, other = examples.bodies[player], examples.bodies[1 - player]
    limbs = striking_segments(own, int(actions.label[index]), ENDS)
    if not len(limbs):
        return None
    frames = slice(int(actions.start[index]), int(actions.end[index]))
    mine = forward_kinematics(examples.qpos[player, frames], own).xipos[:, limbs]
    aims = struck_segments(other)
    theirs = forward_kinematics(examples.qpos[1 - player, frames], other).xipos[:, aims]
    gaps = np.linalg.norm(mine[:, :, None] - theirs[:, None], axis=-1)
    frame, limb, aim = (int(one) for one in np.unravel_index(int(np.argmin(gaps)), gaps.shape))
    if gaps[frame, limb, aim] > FARTHEST_M:
        return None
    root = examples.qpos[player, frames][frame, :2]
    offset = mine[frame, limb, :2] - theirs[frame, aim, :2]
    return Strike(frame, int(limbs[limb]), int(aims[aim]), offset, mine[frame, limb, :2] - root)


def bent(
    strike: Strike, placement: Placement, frame: int, opponent: FloatArray, character: Character, farthest: float
) -> Aim:
    """Where the attacker's root should be when the strike arrives, for it to meet its target.

    Args:
        strike: of the example.
        placement: of the action so far.
        frame: of the action, at which the strike arrives.
        opponent: (nq,) where the opponent will be then.
        character: the opponent's body.
        farthest: how far the root may be moved from where the placement has it [m].
    """
    turn = float(placement.turn[frame])
    target = forward_kinematics(opponent[None], character).xipos[0, strike.target, :2]
    reached = placement.position[frame] + turned(strike.way, turn)
    miss = target + turned(strike.offset, turn) - reached
    ahead = target - placement.position[frame]
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-9)
    miss = miss + max(0.0, -BACK_M - float(miss @ ahead)) * ahead
    size = float(np.linalg.norm(miss))
    return Aim(placement.position[frame] + miss * min(1.0, farthest / max(size, 1e-9)), max(frame, 1))
