"""A clip as it is drawn: steps, planned actions, and the state of a fighter."""

from dataclasses import dataclass, field

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.synthetic.kinds import label_of

FPS = 60.0
"""Rate of frames here; all cuts are even, so that half of the frames are a stream at 30 per second."""
OFFSETS = {"left": np.array([[0.20, 0.11], [-0.20, -0.13]]), "right": np.array([[-0.20, 0.13], [0.20, -0.11]])}
"""Left and right foot from the middle of the stance, forward and left, by the foot in front [m]."""
TOES_OUT = {"left": np.radians([8.0, 32.0]), "right": np.radians([32.0, 8.0])}
"""How far the toes of the left and right foot point outward, by the foot in front [rad]."""


@dataclass(frozen=True)
class Step:
    """One foot is lifted and put down.

    Attributes:
        foot: 0 left, 1 right.
        lift: share of the action at which it leaves the floor; negative: it is in the air already.
        land: the same for touch-down; above 1: in the next action.
        place: (2,) where it is put down, world [m].
        toes: direction of the foot then, world [rad].
    """

    foot: int
    lift: float
    land: float
    place: FloatArray
    toes: float


@dataclass
class Planned:
    """One action of one fighter. Mutable while its end may still move.

    Attributes:
        player: 0 or 1.
        start: first frame, at 60 per second.
        end: frame at which the next begins.
        kind: of `kinds.KINDS`.
        first: foot on which it begins, L, R or F.
        last: foot on which it ends.
        react: qualifier of the label.
        answers: number of the opponent's action that was under way when this one began, -1 for none.
        role: of a neutral action: `guard`, `step`, `feint`, `block`, `dodge`, `retreat`, `hit`; otherwise the kind.
        steps: of the feet.
        heading: direction faced at the end [rad].
        flight: how long the body flies around the end [s].
        strength: depth of the force minimum at the end, in body weights.
        skips: the standing foot steps too before a kick, while the kicking one bears the weight.
        variant: of a punch or kick on its way: the built-in motion it is made from.
    """

    player: int
    start: int
    end: int
    kind: str
    first: str
    last: str
    react: str
    answers: int
    role: str
    steps: list[Step] = field(default_factory=list)
    heading: float = 0.0
    flight: float = 0.0
    strength: float = 0.35
    skips: bool = False
    variant: str = ""

    @property
    def code(self) -> int:
        """Label code."""
        return label_of(self.kind, self.react, f"{self.first}-{self.last}").code


class Fighter:
    """State of one fighter while the clip is drawn."""

    def __init__(self, player: int, lead: str, place: FloatArray, heading: float) -> None:
        self.player, self.lead, self.heading = player, lead, heading
        self.feet = place + turned(OFFSETS[lead], heading)
        self.initial_feet = self.feet.copy()
        self.initial_toes = heading + np.array([1.0, -1.0]) * TOES_OUT[lead]
        self.done: list[Planned] = []
        self.adapted = False
        self.before = place

    @property
    def centre(self) -> FloatArray:
        """Middle between the feet once the present action is over."""
        return np.asarray(self.feet.mean(axis=0))

    @property
    def now(self) -> Planned:
        """The present action."""
        return self.done[-1]

    def at(self, frame: int) -> int:
        """Number of the action under way in a frame: the present or the one before."""
        return len(self.done) - (1 if self.now.start <= frame or len(self.done) == 1 else 2)


def turned(vectors: FloatArray, angle: float) -> FloatArray:
    """Vectors on the floor (..., 2), turned [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(vectors @ np.array([[c, s], [-s, c]]))
