"""What happens to a fighter who has fallen: comes to rest, gets up if it can, or stays down."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simprep.character import Character
from simprep.duel.fight.falls import Fall
from simprep.duel.fight.getting_up import PRONE, held, lying, roll_over, way_up
from simprep.motion.motion import Motion
from simprep.physics.tracker_state import TrackerState

FALLING_S, REST_S, STANDING_S = 1.0, 0.8, 0.6
"""How long the controller may fight a fall; how long a body then keeps its pose, to come to rest; and how long it has to
stand after getting up [s]."""
LOST_S = 1.0
"""Who is off the way up for so long begins again [s]."""
UP_M = 0.75
"""Who stands has the pelvis higher than this [m]."""


@dataclass
class _Down:
    """One fighter on the floor; `then` is when the next thing happens, `lost` since when the way up is missed [s]."""

    row: int
    phase: str
    then: float
    lost: float | None = None


class Recovery:
    """Who is down, and what they do about it.

    Args:
        bodies: the fighters.
        fps: frame rate of motions [1/s].
        tries: attempts, rolls included, before a fighter stays down.
    """

    def __init__(self, bodies: Sequence[Character], fps: float, tries: int) -> None:
        self._bodies, self._fps, self._tries = tuple(bodies), fps, tries
        self._falls: list[Fall] = []
        self._down: dict[int, _Down] = {}

    @property
    def falls(self) -> tuple[Fall, ...]:
        """In order of time."""
        return tuple(self._falls)

    @property
    def anybody_down(self) -> bool:
        """Whether the fight waits for somebody."""
        return bool(self._down)

    def is_down(self, player: int) -> bool:
        """Whether a fighter is on the floor or on the way up."""
        return player in self._down

    def fell(self, fall: Fall) -> None:
        """A fighter has fallen."""
        self._falls.append(fall)
        self._down[fall.player] = _Down(len(self._falls) - 1, "falling", fall.time_s + FALLING_S)

    def next_motion(self, player: int, time_s: float, state: TrackerState) -> Motion | None:
        """What a fighter is to follow from now on; None: what it follows already.

        Args:
            player: who.
            time_s: now [s].
            state: of the bodies.
        """
        down = self._down.get(player)
        if down is None or not self._due(down, time_s, player in state.fallen):
            return None
        qpos, body, fall = state.bodies_qpos[player], self._bodies[player], self._falls[down.row]
        if down.phase == "falling":
            down.phase, down.then = "resting", time_s + REST_S
            return held(qpos, self._fps, body, REST_S)
        if down.phase == "rising" and player not in state.fallen and qpos[2] > UP_M:
            self._falls[down.row] = replace(fall, up_s=time_s)
            del self._down[player]
            return None
        if down.phase == "rising":
            down.phase, down.then = "resting", time_s + REST_S
            return held(qpos, self._fps, body, REST_S)
        how = lying(qpos, body)
        self._falls[down.row] = fall = replace(fall, lay=fall.lay or how)
        motion = None
        if fall.tries < self._tries:
            others = np.mean([one[:2] for number, one in enumerate(state.bodies_qpos) if number != player], axis=0)
            motion = way_up(qpos, body) if how == PRONE else roll_over(qpos, body, others)
        if motion is None:
            down.phase, down.then = "stays down", np.inf
            return None
        self._falls[down.row] = replace(fall, tries=fall.tries + 1)
        if how == PRONE:
            down.phase, down.then, down.lost = "rising", time_s + motion.duration + STANDING_S, None
        else:
            down.then = time_s + motion.duration
        return motion

    @staticmethod
    def _due(down: _Down, time_s: float, fallen: bool) -> bool:
        """Whether the next thing happens now: its time has come, or who gets up has missed the way for too long."""
        if down.phase != "rising" or not fallen:
            down.lost = None
        elif down.lost is None:
            down.lost = time_s
        return time_s >= down.then or (down.lost is not None and time_s - down.lost > LOST_S)
