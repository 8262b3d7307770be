"""Examples shown more slowly where a foot is faster than feet are.

Kicks of the built-in streams come back much faster than legs do: from 1 m above the floor down to it within 0.1 s, at 15
to 20 m/s. A body that tries to follow is thrown over. The whole body slows down there, so that the leg keeps its path.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from simprep.arrays import FloatArray
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.motion.kinematics import forward_kinematics

AROUND, SMOOTH = 2, 1.5
"""It is slow from so many frames before to so many after, and changes its pace so smoothly (Gaussian) [frames]."""


@dataclass(frozen=True)
class PaceSettings:
    """How fast feet may go against the pelvis.

    Attributes:
        strike: in actions that attack [m/s]; feet of taekwon-do masters reach 12.4 in a roundhouse kick (J Mens Health
            18:138).
        back: in all others [m/s]; kicks of the motion library come back with 3.3 to 5.7.
    """

    strike: float = 12.4
    back: float = 6.0


@dataclass(frozen=True, eq=False)
class Pace:
    """When each frame of an example is shown.

    Attributes:
        shown: (F,) frames of the slower action, rising, from 0; None: everything as fast as it was recorded.
    """

    shown: FloatArray | None = None

    def at(self, frame: float) -> float:
        """When a frame of the example is shown [frames]."""
        return frame if self.shown is None else float(np.interp(frame, np.arange(len(self.shown)), self.shown))

    def source(self, frames: FloatArray) -> FloatArray:
        """Frames of the example shown at frames of the slower action, beyond its end as fast as recorded."""
        if self.shown is None:
            return frames
        recorded = np.arange(len(self.shown), dtype=np.float64)
        return np.asarray(np.interp(frames, self.shown, recorded) + np.maximum(frames - self.shown[-1], 0.0))


AS_RECORDED = Pace()


def pace_of(examples: ExampleMotions, index: int, settings: PaceSettings | None) -> Pace:
    """The pace of an example. In flight nothing is slowed, as nothing slows a body there.

    Args:
        examples: the recordings.
        index: of the action.
        settings: limits; None: as recorded.
    """
    if settings is None:
        return AS_RECORDED
    frames = int(examples.actions.end[index] - examples.actions.start[index])
    found = examples.excerpt(index, np.arange(frames + 1, dtype=np.float64))
    body = examples.bodies[int(examples.actions.player[index])]
    place = forward_kinematics(found.qpos, body).xpos
    way = place[:, body.feet] - place[:, [body.segment("pelvis")]]
    speed = np.linalg.norm(np.gradient(way, 1 / examples.fps, axis=0), axis=-1).max(axis=1)
    most = settings.strike if examples.attacks[index] else settings.back
    longer = np.where(found.contacts.any(axis=1), np.maximum(speed / most, 1.0), 1.0)
    if longer.max() <= 1.0:
        return AS_RECORDED
    longer = gaussian_filter1d(maximum_filter1d(longer, 2 * AROUND + 1), SMOOTH)
    return Pace(np.concatenate([[0.0], np.cumsum(0.5 * (longer[1:] + longer[:-1]))]))
