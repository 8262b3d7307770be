"""The runs nearest a limit: of each search the hardest disturbance survived, and the mildest that was not."""

from collections.abc import Hashable
from dataclasses import dataclass, field

from simprep.physics.run import DONE, Run


@dataclass
class LimitRuns:
    """Of each search the two runs at its limit, of the first seed that is added; everything else is let go.

    Attributes:
        survived: dose and run by search; missing where none was survived.
        failed: the same of the mildest dose that was not survived.
    """

    survived: dict[Hashable, tuple[float, Run]] = field(default_factory=dict)
    failed: dict[Hashable, tuple[float, Run]] = field(default_factory=dict)
    _seed: int | None = None

    def add(self, search: Hashable, seed: int, dose: float, run: Run, rising: bool = True) -> None:
        """Keep a run if it is nearer the limit than what is kept. Doses beyond a failure do not count, survived or not.

        Args:
            search: what is searched for, such as the direction of a push [degrees].
            seed: of the run.
            dose: how much of the disturbance.
            run: what came of it.
            rising: whether more of the dose is harder.
        """
        self._seed = seed if self._seed is None else self._seed
        if seed != self._seed:
            return
        sign = 1.0 if rising else -1.0
        failed, survived = self.failed.get(search), self.survived.get(search)
        milder = failed is None or sign * dose < sign * failed[0]
        if run.end != DONE and milder:
            self.failed[search] = dose, run
        elif run.end == DONE and milder and (survived is None or sign * dose > sign * survived[0]):
            self.survived[search] = dose, run
