"""Simulate a free-floating humanoid that tracks a motion with joint motors only."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from simprep.errors import UnknownNameError
from simprep.motion.motion import Motion
from simprep.physics.controller import PdController
from simprep.physics.falls import FallRule
from simprep.physics.loop import quiet_warnings, simulate
from simprep.physics.mpc import MpcController, MpcSettings
from simprep.physics.pushes import Push
from simprep.physics.reference import Reference, ReferenceSettings, make_reference
from simprep.physics.run import Run
from simprep.scene import SceneSettings, build_scene

CONTROLLERS = ("pd", "mpc")


@dataclass(frozen=True)
class TrackSettings:
    """Everything that a run depends on besides motion, controller and seed.

    Attributes:
        scene: obstacles, timestep, friction; its body is replaced by the motion's.
        reference: processing of the motion.
        mpc: configuration of `mpc`.
        fall: when a run counts as a fall.
        pushes: external forces; none by default.
    """

    scene: SceneSettings = field(default_factory=SceneSettings)
    reference: ReferenceSettings = field(default_factory=ReferenceSettings)
    mpc: MpcSettings = field(default_factory=MpcSettings)
    fall: FallRule = field(default_factory=FallRule)
    pushes: tuple[Push, ...] = ()


def track(
    motion: Motion,
    controller: str = "mpc",
    seed: int = 0,
    settings: TrackSettings | None = None,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Simulate the humanoid tracking a motion from its first frame until the end, a fall or divergence.

    No force acts on the body but joint motors, gravity and contact, unless `settings.pushes` says so.

    Args:
        motion: what to track; a loop is tracked for one cycle (see `simprep.motion.edit.repeat`).
        controller: `pd` or `mpc`.
        seed: of the controller's random generator.
        settings: scene, reference processing, controller configuration.
        progress: called with the completed share (0 to 1) about thirty times a second of motion.

    Returns:
        The run, with its end stated.

    Raises:
        UnknownNameError: no such controller.
        SettingError: a push on an unknown body.
    """
    settings = settings or TrackSettings()
    scene = replace(settings.scene, bodies=(motion.body,))
    model = build_scene(scene)
    reference = make_reference(motion, scene.timestep, settings.reference)
    with quiet_warnings():
        brain = _make_controller(controller, reference, model, scene, seed, settings)
        simulated = simulate(model, [reference], brain, settings.fall, settings.pushes, progress)
    return simulated.run(0, reference, brain, seed, model)


def _make_controller(
    name: str, reference: Reference, model: Any, scene: SceneSettings, seed: int, settings: TrackSettings
) -> PdController | MpcController:
    if name == "pd":
        return PdController([reference], model)
    if name == "mpc":
        return MpcController([reference], model, scene, seed, settings.mpc)
    raise UnknownNameError("controller", name, CONTROLLERS)
