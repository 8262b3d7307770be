"""What a validation study runs: every combination of target, level, arm, controller and seed."""

from collections.abc import Iterator
from dataclasses import dataclass

from simprep.errors import SettingError, UnknownNameError
from simprep.motion.motion import Motion
from simprep.physics.named_controllers import CONTROLLERS
from simprep.preparation.reference_posture import target_frame
from simprep.preparation.scenario import ALL_ARMS, ARMS, AlphaProfile
from simprep.study.doses import StabilitySettings

ARM_LABELS = {
    "none": "no preparation",
    "traditional": "traditional blending",
    "blended": "preparation",
    "optimised": "preparation + optimisation",
    "dynamic": "preparation + dynamic optimisation",
}
BEFORE_PHYSICS = "motion"
"""What stands for a controller where the motion itself is measured."""
DETERMINISTIC = ("pd", "balance")
"""Controllers without random numbers: only the first seed is run, as every seed gives the same run."""

QUICK_PROFILE = AlphaProfile(lead=0.2, rise=1.0, hold=0.6)
"""Shorter than the preparation's default, so that the default study takes five minutes at most."""


@dataclass(frozen=True)
class Condition:
    """One motion of the study, before physics.

    Attributes:
        target: name of the target motion.
        alpha: level of preparation reached before the launch, 0 to 1.
        arm: one of `ALL_ARMS`.
    """

    target: str
    alpha: float
    arm: str

    @property
    def slug(self) -> str:
        """Name for files, such as `kick_front_a050_optimised`."""
        return f"{self.target}_a{round(100 * self.alpha):03d}_{self.arm}"


@dataclass(frozen=True)
class Case:
    """One simulation of the study: a condition, a controller (one of `CONTROLLERS`) and the seed of its random generator."""

    condition: Condition
    controller: str
    seed: int


@dataclass(frozen=True)
class StudyPlan:
    """A validation study.

    Attributes:
        locomotion: what the character does before the target.
        targets: target motions; their names must differ. An event `target` marks the first frame of the movement.
        alphas: levels of preparation, 0 to 1.
        arms: which of `ALL_ARMS`.
        controllers: which of `CONTROLLERS`.
        seeds: seeds of the random controllers; a deterministic one runs the first only.
        profile: how the level of preparation rises; its own level is replaced by each of `alphas`.
        dose: how much of each disturbance every case takes is measured too, by this; its seeds are the case's. A controller
            without a measure leaves it out. None for not at all.

    Raises:
        SettingError: something is empty or repeated, or a level outside 0 to 1.
        MotionError: the first frame of a target movement is not marked.
        UnknownNameError: an unknown arm or controller.
    """

    locomotion: Motion
    targets: tuple[Motion, ...]
    alphas: tuple[float, ...] = (0.5, 1.0)
    arms: tuple[str, ...] = ARMS
    controllers: tuple[str, ...] = ("pd", "mpc")
    seeds: tuple[int, ...] = (0,)
    profile: AlphaProfile = QUICK_PROFILE
    dose: StabilitySettings | None = None

    def __post_init__(self) -> None:
        names = tuple(target.name for target in self.targets)
        for what, values in (
            ("target", names),
            ("alpha", self.alphas),
            ("arm", self.arms),
            ("controller", self.controllers),
            ("seed", self.seeds),
        ):
            if not values or len(set(values)) < len(values):
                raise SettingError(
                    f"{what}s {', '.join(map(str, values)) or '(none)'}; valid: at least one, all different"
                )
        for alpha in self.alphas:
            if not 0 <= alpha <= 1:
                raise SettingError(f"alpha {alpha:g}; valid: 0 to 1")
        for arm in self.arms:
            if arm not in ALL_ARMS:
                raise UnknownNameError("arm", arm, ALL_ARMS)
        for controller in self.controllers:
            if controller not in CONTROLLERS:
                raise UnknownNameError("controller", controller, CONTROLLERS)
        for target in self.targets:
            target_frame(target)

    def conditions(self) -> Iterator[Condition]:
        """Every motion of the study."""
        for target in self.targets:
            for alpha in self.alphas:
                for arm in self.arms:
                    yield Condition(target.name, alpha, arm)

    def cases(self) -> list[Case]:
        """Every simulation, in such an order that a study cut short still holds comparable arms."""
        return [
            Case(condition, controller, seed)
            for number, seed in enumerate(self.seeds)
            for controller in self.controllers
            for condition in self.conditions()
            if number == 0 or controller not in DETERMINISTIC
        ]
