"""Simulate free-floating bodies that track motions with joint motors only: `simulate` any number, `track` one."""

from collections.abc import Callable, Sequence

from simprep.errors import MotionError
from simprep.motion.motion import Motion
from simprep.physics.controller import ControllerFactory
from simprep.physics.run import Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.tracker import Tracker


def simulate(
    motions: Sequence[Motion],
    controller: str | ControllerFactory = "mpc",
    seed: int = 0,
    settings: SimulationSettings | None = None,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Simulate bodies in one world, each tracking its motion, until the motions' end, the first fall or divergence.

    They collide with each other, the floor and the obstacles. Only joint motors, gravity, contact and the
    pushes and kicks of `settings` act on them.

    Args:
        motions: what each body tracks, up to `simprep.scene.BODY_LIMIT`, of equal length and rate, in one frame. Loops
            are tracked for one cycle (see `simprep.motion.edit.repeat`).
        controller: `pd`, `balance`, `mpc` (which plans all bodies jointly), or your own class or function
            (`simprep.physics.controller`).
        seed: of the controller's random generator.
        settings: scene, reference processing, configuration of `mpc`.
        progress: called with the completed share (0 to 1) about a hundred times a second of motion.

    Raises:
        MotionError: motions that do not fit together.
        UnknownNameError: no such controller.
        SettingError: a push on an unknown segment, no motion or too many, or something that is no controller.
    """
    motions = _checked(motions)
    characters = [motion.character for motion in motions]
    tracker = Tracker(characters, None, seed, controller, settings, stands=False)
    tracker.extend(*motions)
    steps = max(1.0, tracker.ahead_s / tracker.timestep)
    number = 0
    while not tracker.end:
        tracker.step()
        if progress and number % 4 == 0 and not tracker.end:
            progress((number + 1) / steps)
        number += 1
    return tracker.run()


def track(
    motion: Motion,
    controller: str | ControllerFactory = "mpc",
    seed: int = 0,
    settings: SimulationSettings | None = None,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Simulate one body that tracks a motion. Arguments, run and errors are those of `simulate`.

    Args:
        motion: what to track.
        controller: `pd`, `balance`, `mpc` or your own.
        seed: of the controller's random generator.
        settings: as of `simulate`.
        progress: as of `simulate`.
    """
    return simulate((motion,), controller, seed, settings, progress)


def _checked(motions: Sequence[Motion]) -> tuple[Motion, ...]:
    if isinstance(motions, Motion):
        raise MotionError(f"simulate takes a sequence of motions; for {motions.name} alone use track")
    motions = tuple(motions)
    for other in motions[1:]:
        first = motions[0]
        if len(first) != len(other) or first.fps != other.fps:
            raise MotionError(
                f"{first.name} has {len(first)} frames at {first.fps:g} per second, {other.name} {len(other)} at "
                f"{other.fps:g}; the bodies of a scene need equal length and rate"
            )
    return motions
