"""The grid of a sweep: every combination of clips, arms, levels, controllers, bodies, disturbances and seeds."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from simprep.errors import SettingError, UnknownNameError
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.named_controllers import CONTROLLERS
from simprep.preparation.scenario import ALL_ARMS, ARMS, AlphaProfile
from simprep.study.plan import BEFORE_PHYSICS, DETERMINISTIC, QUICK_PROFILE
from simprep.study.sweep.cases import NOMINAL, Body, Clip, Disturbance, SweepCase
from simprep.study.sweep.code import results_code


@dataclass(frozen=True)
class Sweep:
    """A grid of cases. Clips are tracked as they are; locomotions prepare for targets. Either may be empty, not both.

    Attributes:
        bodies: who moves.
        clips: motions to track.
        locomotions, targets: what prepares for what.
        arms: which of `ALL_ARMS`.
        alphas: levels of preparation, 0 to 1. The arm `none` has no level and is run once.
        controllers: which of `CONTROLLERS`; `motion` measures the motions before physics.
        preset: of `mpc`.
        seeds: of random controllers; a deterministic one runs with the first only.
        disturbances: how the world differs from what the controller expects.
        seconds: length that clips are brought to [s] (see `SweepCase`).
        profile: how the level of preparation rises.
        code: of the code that is to run it.

    Raises:
        SettingError: something is empty or repeated, or a level outside 0 to 1.
        UnknownNameError: an unknown arm, controller or preset.
    """

    bodies: tuple[Body, ...]
    clips: tuple[Clip, ...] = ()
    locomotions: tuple[Clip, ...] = ()
    targets: tuple[Clip, ...] = ()
    arms: tuple[str, ...] = ARMS
    alphas: tuple[float, ...] = (0.5, 1.0)
    controllers: tuple[str, ...] = ("mpc",)
    preset: str = "default"
    seeds: tuple[int, ...] = (0,)
    disturbances: tuple[Disturbance, ...] = (NOMINAL,)
    seconds: float | None = None
    profile: AlphaProfile = QUICK_PROFILE
    code: str = field(default_factory=results_code)

    def __post_init__(self) -> None:
        names = {
            "bodies": self.bodies,
            "arms": self.arms,
            "alphas": self.alphas,
            "controllers": self.controllers,
            "seeds": self.seeds,
            "disturbances": tuple(one.name for one in self.disturbances),
        }
        clips = {"clips": self.clips, "locomotions": self.locomotions, "targets": self.targets}
        for what, values in {**names, **clips}.items():
            shown = [value.name if isinstance(value, Clip | Body) else str(value) for value in values]
            if len(set(values)) < len(values):
                raise SettingError(f"{what} {', '.join(shown)}; valid: all different")
            if not values and what in names:
                raise SettingError(f"no {what}; valid: at least one")
        if bool(self.locomotions) != bool(self.targets):
            raise SettingError("locomotions and targets need each other; one of them is empty")
        if not (self.clips or self.locomotions):
            raise SettingError("nothing to run; valid: clips, or locomotions with targets")
        for alpha in self.alphas:
            if not 0 <= alpha <= 1:
                raise SettingError(f"alpha {alpha:g}; valid: 0 to 1")
        for kind, values, valid in (
            ("arm", self.arms, ALL_ARMS),
            ("controller", self.controllers, (*CONTROLLERS, BEFORE_PHYSICS)),
            ("preset", (self.preset,), tuple(MPC_PRESETS)),
        ):
            for value in values:
                if value not in valid:
                    raise UnknownNameError(kind, value, valid)
        if self.seconds is not None and not 0 < self.seconds <= 600:
            raise SettingError(f"seconds {self.seconds:g}; valid: above 0, at most 600")

    def cases(self) -> Iterator[SweepCase]:
        """Every case once, in such an order that a sweep cut short still holds comparable arms.

        What is not simulated, or has no random numbers, is run with the first seed only; what is not simulated, in one
        world only.
        """
        for number, seed in enumerate(self.seeds):
            for place, disturbance in enumerate(self.disturbances):
                for controller in self.controllers:
                    unmoved = controller == BEFORE_PHYSICS
                    random = disturbance.noise > 0 or not (unmoved or controller in DETERMINISTIC)
                    if (number and not random) or (unmoved and (number or place)):
                        continue
                    for body in self.bodies:
                        yield from self._of(body, controller, seed, NOMINAL if unmoved else disturbance)

    def _of(self, body: Body, controller: str, seed: int, disturbance: Disturbance) -> Iterator[SweepCase]:
        preset = self.preset if controller == "mpc" else None
        for clip in self.clips:
            yield SweepCase(
                self.code, body, controller, clip=clip, preset=preset, seed=seed, disturbance=disturbance,
                seconds=self.seconds,
            )  # fmt: skip
        for locomotion in self.locomotions:
            for target in self.targets:
                for level, alpha in enumerate(self.alphas):
                    for arm in self.arms:
                        if arm == "none" and level:
                            continue
                        yield SweepCase(
                            self.code, body, controller, locomotion=locomotion, target=target, arm=arm,
                            alpha=None if arm == "none" else alpha, profile=self.profile, preset=preset, seed=seed,
                            disturbance=disturbance,
                        )  # fmt: skip
