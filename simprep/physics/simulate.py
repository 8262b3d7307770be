"""Simulate free-floating bodies that track motions with joint motors only: `simulate` any number, `track` one."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.motion.motion import Motion
from simprep.physics.bodies import scene_bodies
from simprep.physics.contacts import merge_touches
from simprep.physics.controller import Controller, ControllerFactory, ControlTask, PdController
from simprep.physics.falls import FallRule
from simprep.physics.loop import Recording, quiet_warnings, run_loop
from simprep.physics.mpc import MpcController, MpcSettings
from simprep.physics.overlap import overlap_of_poses
from simprep.physics.pushes import Push
from simprep.physics.reference import ReferenceSettings, make_reference
from simprep.physics.run import Assist, BodyRun, Run
from simprep.scene import SceneSettings, build_scene

CONTROLLERS = ("pd", "mpc")
"""Controllers known by name."""


@dataclass(frozen=True)
class SimulationSettings:
    """Everything that a run depends on besides motions, controller and seed.

    Attributes:
        scene: obstacles, timestep, friction; its bodies are replaced by the motions'.
        reference: processing of the motions.
        mpc: configuration of the controller `mpc`.
        fall: when a body counts as fallen.
        pushes: external forces on segments, named as in the scene (`pelvis` of a single body, `a_pelvis` of several).
    """

    scene: SceneSettings = field(default_factory=SceneSettings)
    reference: ReferenceSettings = field(default_factory=ReferenceSettings)
    mpc: MpcSettings = field(default_factory=MpcSettings)
    fall: FallRule = field(default_factory=FallRule)
    pushes: tuple[Push, ...] = ()


def simulate(
    motions: Sequence[Motion],
    controller: str | ControllerFactory = "mpc",
    seed: int = 0,
    settings: SimulationSettings | None = None,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Simulate bodies in one world, each tracking its motion, until the motions' end, the first fall or divergence.

    They collide with each other, the floor and the obstacles. Only joint motors, gravity, contact and `settings.pushes`
    act on them.

    Args:
        motions: what each body tracks, up to `simprep.scene.BODY_LIMIT`, of equal length and rate, in one frame. Loops
            are tracked for one cycle (see `simprep.motion.edit.repeat`).
        controller: `pd`, `mpc` (which plans all bodies jointly), or your own class or function
            (`simprep.physics.controller`).
        seed: of the controller's random generator.
        settings: scene, reference processing, configuration of `mpc`.
        progress: called with the completed share (0 to 1) about a hundred times a second of motion.

    Raises:
        MotionError: motions that do not fit together.
        UnknownNameError: no such controller.
        SettingError: a push on an unknown segment, no motion or too many, or something that is no controller.
    """
    settings = settings or SimulationSettings()
    make = _factory(controller, settings.mpc)
    motions = _checked(motions)
    scene = replace(settings.scene, bodies=tuple(motion.character for motion in motions))
    model = build_scene(scene)
    references = tuple(make_reference(motion, scene.timestep, settings.reference) for motion in motions)
    task = ControlTask(model, scene, scene_bodies(model, scene.bodies), references, seed)
    with quiet_warnings():
        brain = make(task)
        recording = run_loop(task, brain, settings.fall, settings.pushes, progress)
    return _run(task, brain, recording)


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
        controller: `pd`, `mpc` or your own.
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


def _factory(controller: str | ControllerFactory, mpc: MpcSettings) -> ControllerFactory:
    if controller == "pd":
        return PdController
    if controller == "mpc":
        return partial(MpcController, settings=mpc)
    if isinstance(controller, str):
        raise UnknownNameError("controller", controller, CONTROLLERS)
    if not callable(controller):
        raise SettingError(
            f"controller {controller!r}; valid: {', '.join(CONTROLLERS)}, or a class or function that takes a ControlTask"
        )
    return controller


def _run(task: ControlTask, brain: Controller, recording: Recording) -> Run:
    taken = recording.taken
    bodies = [
        BodyRun(
            reference=reference.motion,
            reference_qvel=reference.qvel[: taken + 1],
            torque_limit=task.model.actuator_forcerange[recorder.body.controls, 1].copy(),
            processing=reference.processing,
            **recorder.arrays(taken),
        )
        for reference, recorder in zip(task.references, recording.bodies)
    ]
    timestep = float(task.model.opt.timestep)
    poses = [reference.qpos[:taken] for reference in task.references]
    return Run(
        bodies=tuple(bodies),
        controller=brain.name,
        seed=task.seed,
        timestep=timestep,
        end=recording.end,
        end_reason=recording.reason,
        fallen=recording.fallen,
        contacts=merge_touches(recording.between.touches, timestep),
        overlap=recording.between.overlap[:taken],
        reference_overlap=overlap_of_poses(poses, task.scene.bodies),
        unconverged=recording.between.unconverged[:taken],
        settings=brain.settings(),
        assist=Assist(force_n=recording.push_n),
        wall_s=recording.wall_s,
        overhead_share=recording.overhead_share,
    )
