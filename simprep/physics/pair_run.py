"""What a simulation of two fighters returns: a run of each, and every contact between them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simprep.physics.run import Run

HIT, BLOCKED, UNINTENDED, UNJUDGED = "hit", "blocked", "unintended", "unjudged"
VERDICTS = (HIT, BLOCKED, UNINTENDED, UNJUDGED)
"""What a contact was: an attack that met what it aims at, one that met an arm, anything else; not compared with a fight."""
NOBODY = -1


@dataclass(frozen=True)
class FighterContact:
    """One body part of A touching one of B, from the first step of contact to the last.

    Attributes:
        start_s: time of the first touch [s].
        duration_s: until the last step of contact [s]; breaks shorter than the tolerance do not end it.
        part_a: body part of A, one of `simprep.humanoid.BODIES`.
        part_b: body part of B.
        impulse: (x, y, z) of the contact force of A on B over the contact, world frame [N s].
        peak_force_n: largest contact force [N].
        closing_speed: of the surfaces along the contact normal at the first touch [m/s]; negative when they part.
        position: (x, y, z) where they touch, at the peak, world frame [m].
        depth: deepest overlap [m].
        verdict: one of `VERDICTS`.
        attacker: 0 or 1, whose attack it was; -1 for nobody's.
        attack: which of the fight's actions that was; -1 for none.
    """

    start_s: float
    duration_s: float
    part_a: str
    part_b: str
    impulse: tuple[float, float, float]
    peak_force_n: float
    closing_speed: float
    position: tuple[float, float, float]
    depth: float
    verdict: str = UNJUDGED
    attacker: int = NOBODY
    attack: int = NOBODY

    @property
    def impulse_ns(self) -> float:
        """Magnitude of the impulse [N s]."""
        return float(np.linalg.norm(self.impulse))

    @property
    def intended(self) -> bool:
        """Whether an attack intended it, even if an arm was in its way."""
        return self.verdict in (HIT, BLOCKED)


@dataclass(frozen=True)
class PairRun:
    """Two tracked motions in one world: N simulation steps, N + 1 states.

    Attributes:
        runs: of A and B, as of single people; both end when the first falls, and only the one that fell has a
            `fell_at_s`. Their computing time and controller are common.
        contacts: between the fighters, by time.
        penetration: (N,) deepest overlap between the fighters at each step [m], 0 or more.
        reference_penetration: (N,) the same of the two references.
        unconverged_steps: steps in which the contact solver ran out of iterations; their forces are not to be trusted.
    """

    runs: tuple[Run, Run]
    contacts: tuple[FighterContact, ...]
    penetration: NDArray[np.float64]
    reference_penetration: NDArray[np.float64]
    unconverged_steps: int = 0

    @property
    def end(self) -> str:
        """`done`, `fell` or `diverged`."""
        return self.runs[0].end

    @property
    def end_s(self) -> float:
        """Time of the last state [s]."""
        return self.runs[0].end_s

    @property
    def fallen(self) -> int | None:
        """Who fell, 0 or 1; None if nobody did."""
        return next((number for number, run in enumerate(self.runs) if run.fell_at_s is not None), None)
