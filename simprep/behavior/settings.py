"""Every constant of the behaviour controller in one place; the paper's value is named where ours differs."""

from dataclasses import dataclass, field

from simprep.behavior.spaces import CORE_NODES
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
        power: C_alpha of f_alpha = 1 - |change|^C_alpha (paper: 2). Above 1, many small changes cost less than one large one.
        discount: gamma. The paper's 0.3 looks about one and a half actions ahead, and the best policy under it does not go to
            its goal: standing still earns 0.75 to 0.85 per action, and what turning round or lowering alpha costs now weighs more
            than what it brings in three actions. At 0.9 the best policy reaches the goal from everywhere (tests show both).
        arrival: return credited on reaching the goal, as a multiple of 1 / (1 - discount). At 1 it is as if the full reward
            went on for ever. With 0, as Eq. 18 reads literally, arriving ends a stream of rewards, and the best is never to.

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
            The observation is relative to the heading, so with turning every direction becomes forward; with stepping sideways
            instead, a goal behind can never be faced.
        action_s: duration of an action [s]. Default: the time of one step of `walk`, 32 frames at 60 frames/s.
        smoothing: standard deviation of the Gaussian over alpha at run time [s]. It is cut off at 3 standard deviations
            and delayed by as much, so it needs no future and settles within 0.48 s, less than an action.
        safety_m: the level of preparation must be high enough (see `model.allowed_moves`) wherever the character could come
            within reach of the source of influence, give or take this distance [m].
        rewards: constants of the reward.
        preparation: constants of the synthesis; of these, only the root's blending curve decides the displacement.

    Raises:
        SettingError: not 4 core nodes, or a time that is not positive.
    """

    cores: tuple[str, ...] = ("walk", "turn_left", "turn_right", "stand")
    action_s: float = 32 / 60
    smoothing: float = 0.08
    safety_m: float = 0.03
    rewards: RewardSettings = RewardSettings()
    preparation: PreparationSettings = field(default=DEFAULT_SETTINGS)

    def __post_init__(self) -> None:
        if len(self.cores) != CORE_NODES or len(set(self.cores)) != CORE_NODES:
            raise SettingError(f"core nodes {', '.join(self.cores)}; valid: {CORE_NODES} different motions")
        if not 0.1 <= self.action_s <= 5:
            raise SettingError(f"action_s {self.action_s}; valid: 0.1 to 5 s")
        if not 0 < 6 * self.smoothing <= self.action_s:
            raise SettingError(f"smoothing {self.smoothing} s; valid: above 0, at most a sixth of action_s")
        if not self.safety_m >= 0:
            raise SettingError(f"safety_m {self.safety_m}; valid: 0 or more")
