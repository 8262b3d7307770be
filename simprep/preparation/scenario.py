"""Whole scenarios of the validation study: walk while the level of preparation rises, hold it, launch the target."""

from dataclasses import dataclass, replace

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import SettingError, UnknownNameError
from simprep.motion.edit import resample
from simprep.motion.motion import Motion
from simprep.preparation.letting_down import let_down
from simprep.preparation.prepare import Preparation, extend, prepare
from simprep.preparation.reference_posture import ReferencePosture, reference_posture
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings
from simprep.preparation.transition import DEFAULT_WINDOW_S, launch, launch_frame

ARMS = ("none", "traditional", "blended", "optimised")
"""The arms that a study compares where it is not told otherwise."""
ALL_ARMS = (*ARMS, "dynamic")
RISE_EVENT = "rise"
SCENARIO_FPS = 60.0


@dataclass(frozen=True)
class AlphaProfile:
    """How the level of preparation goes before the launch.

    Attributes:
        level: level of preparation reached, 0 to 1.
        lead: time at level 0 first [s].
        rise: time of the smooth rise from 0 to the level (minimum jerk) [s].
        hold: least time at the level until the launch, which waits up to one stride for a fitting frame [s].
        window: time of the transition into the target [s].

    Raises:
        SettingError: a level outside 0 to 1, or a negative time.
    """

    level: float = 1.0
    lead: float = 1.0
    rise: float = 1.2
    hold: float = 1.2
    window: float = DEFAULT_WINDOW_S

    def __post_init__(self) -> None:
        if not 0 <= self.level <= 1:
            raise SettingError(f"level of preparation {self.level}; valid: 0 to 1")
        for name in ("lead", "rise", "hold"):
            if not getattr(self, name) >= 0:
                raise SettingError(f"{name} {getattr(self, name)} s; valid: 0 or more")

    def levels(self, frames: int, fps: float) -> FloatArray:
        """Level of preparation of every frame, (frames,)."""
        x = np.clip((np.arange(frames) / fps - self.lead) / max(self.rise, 1e-9), 0.0, 1.0)
        return np.asarray(self.level * x**3 * (10 - 15 * x + 6 * x * x))


@dataclass(frozen=True)
class ScenarioResult:
    """A scenario and how it came about.

    Attributes:
        motion: the whole motion; events `rise`, `launch` and those of the target.
        approach: the prepared locomotion, with its record; it goes on past the launch.
        launch: frame of the launch.
        reference: the target's reference posture, at which it is entered.
    """

    motion: Motion
    approach: Preparation
    launch: int
    reference: ReferencePosture


def scenario(
    locomotion: Motion,
    target: Motion,
    alpha_profile: AlphaProfile | float = 1.0,
    arm: str = "optimised",
    settings: PreparationSettings = DEFAULT_SETTINGS,
) -> Motion:
    """The whole motion of a scenario; arguments and errors as for `build_scenario`."""
    return build_scenario(locomotion, target, alpha_profile, arm, settings).motion


def build_scenario(
    locomotion: Motion,
    target: Motion,
    alpha_profile: AlphaProfile | float = 1.0,
    arm: str = "optimised",
    settings: PreparationSettings = DEFAULT_SETTINGS,
) -> ScenarioResult:
    """Locomotion while the level of preparation rises, held, then the target, in one of the arms.

    All share timing, launch frame, entry frame of the target and transition. `none` walks on unprepared (a plain motion-graph
    transition), `traditional` blends every joint with the one weight alpha, `blended` is the preparation without posture
    optimisation, `optimised` the one with it, and `dynamic` the one with the optimiser of that name (`PreparationSettings.optimiser`).
    A target that begins near the floor is led in by its own way up, backwards (`simprep.preparation.letting_down`): the longer, the
    higher an arm's body is.

    Args:
        locomotion: a loop, or a clip long enough.
        target: with the event `target` at the first frame of the target movement.
        alpha_profile: level over time, or just the level.
        arm: one of `ALL_ARMS`.
        settings: constants of the preparation.

    Raises:
        MotionError: the target movement is not marked, the bodies differ, or the locomotion is too short.
        UnknownNameError: an unknown arm.
        SettingError: a level outside 0 to 1.
    """
    if arm not in ALL_ARMS:
        raise UnknownNameError("arm", arm, ALL_ARMS)
    profile = alpha_profile if isinstance(alpha_profile, AlphaProfile) else AlphaProfile(level=float(alpha_profile))
    reference_posture(target, settings)  # an unmarked target is refused before the work
    locomotion = resample(locomotion, SCENARIO_FPS)
    target = replace(resample(replace(target, loop=False), locomotion.fps), name=target.name)
    reference = reference_posture(target, settings)
    fps = locomotion.fps
    profile, earliest, latest = _launch_span(locomotion, profile)
    source = extend(locomotion, latest + 2)
    at = launch_frame(source, earliest, latest + 1, target, reference.frame)
    levels = profile.levels(at + 2, fps)
    used = settings
    if arm == "none":
        levels = np.zeros_like(levels)
    elif arm == "traditional":
        used = replace(settings, curve="linear")
    elif arm == "dynamic":
        used = replace(settings, optimiser="dynamic")
    approach = prepare(locomotion, target, levels, settings=used, optimise=arm in ("optimised", "dynamic"))
    begin = {RISE_EVENT: min(round(profile.lead * fps), at)}
    played, entry = let_down(target, reference.frame, approach.motion.qpos[at], profile.window)
    motion = launch(replace(approach.motion, events=begin), at, played, entry, profile.window, settings)
    motion = replace(motion, name=f"{locomotion.name}_{target.name}_a{round(100 * profile.level):03d}_{arm}")
    return ScenarioResult(motion, approach, at, reference)


def _launch_span(locomotion: Motion, profile: AlphaProfile) -> tuple[AlphaProfile, int, int]:
    """First and last frame at which to launch; a clip that is no loop shortens lead and hold to fit."""
    fps = locomotion.fps
    if locomotion.loop:
        earliest = round((profile.lead + profile.rise + profile.hold) * fps)
        return profile, earliest, earliest + len(locomotion) - 1
    stride = 1.2
    spare = (len(locomotion) - 2) / fps - profile.rise
    wanted = profile.lead + profile.hold + stride
    scale = min(1.0, max(spare, 0.0) / wanted)
    profile = replace(profile, lead=profile.lead * scale, hold=profile.hold * scale)
    earliest = round((profile.lead + profile.rise + profile.hold) * fps)
    return profile, earliest, max(earliest, min(earliest + round(stride * scale * fps), len(locomotion) - 2))
