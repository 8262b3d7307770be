"""Is a fighter in balance? The extrapolated centre of mass over the standing feet, against that of the reference.

Source: Hof, Gazendam and Sinke 2005, J Biomech 38:1: COM + velocity / sqrt(g / h) must stay over the feet of who keeps them in place.
"""

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.humanoid_model import GRAVITY
from simprep.motion.kinematics import forward_kinematics


class BalanceWatch:
    """How far one fighter's balance is from what is wanted, frame by frame.

    Args:
        character: the body.
        fps: how often it is looked at [1/s].
    """

    def __init__(self, character: Character, fps: float) -> None:
        self._character, self._fps = character, fps
        self._com: FloatArray | None = None

    def error_m(self, body: FloatArray, reference: FloatArray, standing: BoolArray) -> float:
        """How far the extrapolated COM is from the reference's [m]: over the standing feet and in the world, the lesser of both.

        Feet of the reference that stand count, both where none does. A foot that lands late is off by the first, a body that
        stands elsewhere by the second; neither has lost its balance. 0 at the first look.

        Args:
            body: (nq,) pose.
            reference: (nq,) pose that it should have.
            standing: (2,) feet of the reference that stand.
        """
        found = forward_kinematics(np.stack([body, reference]), self._character)
        before, self._com = self._com, found.com
        if before is None:
            return 0.0
        time = np.sqrt(max(float(found.com[1, 2]), 0.1) / GRAVITY)
        ahead = found.com[:, :2] + time * self._fps * (found.com - before)[:, :2]
        feet = found.xpos[:, self._character.feet, :2]
        over = ahead - (feet[:, standing] if standing.any() else feet).mean(axis=1)
        return float(min(np.linalg.norm(over[0] - over[1]), np.linalg.norm(ahead[0] - ahead[1])))
