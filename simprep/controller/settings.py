"""Every constant of the behaviour controller; the paper's value is named where ours differs."""

from dataclasses import dataclass, field

import numpy as np

from simprep.arrays import BoolArray
from simprep.controller.spaces import CORE_NODES
from simprep.errors import SettingError
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings


@dataclass(frozen=True)
class RewardSettings:
    """Constants of the reward (paper, Eq. 14-18).

    Attributes:
        facing: weight of f_theta, how much the character faces the goal (paper: 0.1).
        approach: weight of f_d, how much nearer to the goal it came (paper: 0.3).
        steadiness: weight of f_alpha, how little the level of preparation changed (paper: 0.6).
        distance_norm: d_norm of f_d [m] (paper: 1).
        power: C_alpha of f_alpha = 1 - |change|^C_alpha (paper: 2). Above 1, many small changes cost less than one
            large one, as the paper wants; reading Eq. 16 as (1 - |change|)^C_alpha would make them cost more.
        discount: gamma. The paper's 0.3 looks about one and a half actions ahead. Standing still then earns more than
            going to the goal; at 0.9 the best policy reaches the goal from everywhere.
        arrival: return credited on reaching the goal, as a multiple of 1 / (1 - discount). At 1 it is as if the full
            reward went on for ever. At 0, as Eq. 18 reads literally, arriving ends the rewards, and the best policy
            never does.

    Raises:
        SettingError: a value outside its range.
    """

    facing: float = 0.1
    approach: float = 0.3
    steadiness: float = 0.6
    distance_norm: float = 1.0
    power: float = 2.0
    discount: float = 0.9
    arrival: float = 1.0

    def __post_init__(self) -> None:
        for name in ("facing", "approach", "steadiness", "arrival"):
            if not getattr(self, name) >= 0:
                raise SettingError(f"{name} {getattr(self, name)}; valid: 0 or more")
        for name in ("distance_norm", "power"):
            if not getattr(self, name) > 0:
                raise SettingError(f"{name} {getattr(self, name)}; valid: above 0")
        if not 0 <= self.discount < 1:
            raise SettingError(f"discount {self.discount}; valid: 0 up to but not including 1")

    @property
    def arrival_value(self) -> float:
        """Return credited on reaching the goal."""
        return self.arrival / (1 - self.discount)


@dataclass(frozen=True)
class ControllerSettings:
    """What a policy depends on, besides how it is learned.

    Attributes:
        cores: names of the 4 core nodes, cyclic motions. Default: walking, stepping round to either side, standing.
            With steps sideways instead of round, a goal behind could never be faced.
        barred: pairs of core nodes of which the second may not follow the first; Next(m) of Eq. 11 are all others.
            Default: turning one way is not followed at once by turning the other way.
        action_s: duration of an action [s]. Default: the time of one step of `walk`, 32 frames at 60 frames/s.
        smoothing: standard deviation of the Gaussian over alpha at run time [s]. It is cut off at 3 standard deviations
            and delayed by as much, so it needs no future and settles within 0.48 s, less than an action.
        safety_m: distance beyond reach of the source of influence within which the level of preparation must be high
            enough (`model.allowed_moves`) [m].
        rewards: constants of the reward.
        preparation: constants of the synthesis; of these, only the root's blending curve decides the displacement.

    Raises:
        SettingError: not 4 core nodes, or a time that is not positive.
    """

    cores: tuple[str, ...] = ("walk", "step_round_left", "step_round_right", "stand")
    barred: tuple[tuple[str, str], ...] = (
        ("step_round_left", "step_round_right"),
        ("step_round_right", "step_round_left"),
    )
    action_s: float = 32 / 60
    smoothing: float = 0.08
    safety_m: float = 0.03
    rewards: RewardSettings = RewardSettings()
    preparation: PreparationSettings = field(default=DEFAULT_SETTINGS)

    def __post_init__(self) -> None:
        if len(self.cores) != CORE_NODES or len(set(self.cores)) != CORE_NODES:
            raise SettingError(f"core nodes {', '.join(self.cores)}; valid: {CORE_NODES} different motions")
        for pair in self.barred:
            if len(pair) != 2:
                raise SettingError(f"barred {pair!r}; valid: pairs of core nodes")
        if not 0.1 <= self.action_s <= 5:
            raise SettingError(f"action_s {self.action_s}; valid: 0.1 to 5 s")
        if not 0 < 6 * self.smoothing <= self.action_s:
            raise SettingError(f"smoothing {self.smoothing} s; valid: above 0, at most a sixth of action_s")
        if not self.safety_m >= 0:
            raise SettingError(f"safety_m {self.safety_m}; valid: 0 or more")

    def successors(self) -> BoolArray:
        """(4, 4) whether the second core node may follow the first."""
        barred = {tuple(pair) for pair in self.barred}
        return np.array([[(first, second) not in barred for second in self.cores] for first in self.cores])


@dataclass(frozen=True)
class LearningSettings:
    """How SARSA runs (paper, sections 6.3 and 6.4).

    Attributes:
        steps: most training steps (paper: about 20 million). While the values are noisy, standing still for ever can
            look best in a few states. By 20 million steps that has ended (results/controller/learning.md); the rest is
            a margin.
        seed: of the random numbers.
        rate: learning rate of the first update of an action value (paper: 0.7, for every update).
        rate_decay: number of updates after which the rate has halved: rate / (1 + updates / rate_decay). 0 for the
            paper's constant rate, which never settles where an action leads to one of several cells, as here.
        explore: epsilon, the share of random actions (paper: 0.1).
        confidence: an episode begins in a random state with an action never tried there (the paper's exploring starts),
            else with that of largest Q + confidence / (1 - discount) / sqrt(updates), an upper confidence bound (as in
            UCB1, Auer et al. 2002). 0 begins with the best known action, large values with the one tried least often.
        longest: actions after which an episode is given up. The shorter, the more evenly the states are visited.
        tolerance: change of a state's value that counts as an update for the stop rule, as a share of the largest
            return.
        stop_share: training stops when fewer than this share of the states had a value updated in a round of a million
            steps (paper: 2 % in an episode; ours visit only a handful of states). 0 never stops early.

    Raises:
        SettingError: a value outside its range.
    """

    steps: int = 30_000_000
    seed: int = 0
    rate: float = 0.7
    rate_decay: float = 20.0
    explore: float = 0.1
    confidence: float = 0.1
    longest: int = 10
    tolerance: float = 0.001
    stop_share: float = 0.02

    def __post_init__(self) -> None:
        for name in ("steps", "longest"):
            if getattr(self, name) < 1:
                raise SettingError(f"{name} {getattr(self, name)}; valid: 1 or more")
        if self.seed < 0:
            raise SettingError(f"seed {self.seed}; valid: 0 or more")
        if not 0 < self.rate <= 1:
            raise SettingError(f"rate {self.rate}; valid: above 0, at most 1")
        for name in ("rate_decay", "confidence", "tolerance"):
            if not getattr(self, name) >= 0:
                raise SettingError(f"{name} {getattr(self, name)}; valid: 0 or more")
        for name in ("explore", "stop_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise SettingError(f"{name} {getattr(self, name)}; valid: 0 to 1")
