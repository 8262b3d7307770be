"""Simulate two free-floating humanoids in one world, each tracking a motion with joint motors only."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from simprep.errors import MotionError, UnknownNameError
from simprep.motion.motion import Motion
from simprep.physics.controller import PdController
from simprep.physics.falls import FallRule
from simprep.physics.loop import quiet_warnings, simulate
from simprep.physics.mpc import MpcController, MpcSettings
from simprep.physics.pair_contacts import ContactReader, merge_touches
from simprep.physics.pair_penetration import fighter_penetration
from simprep.physics.pair_run import PairRun
from simprep.physics.pushes import Push
from simprep.physics.reference import ReferenceSettings, make_reference
from simprep.physics.track import CONTROLLERS
from simprep.scene import SceneSettings, build_scene


@dataclass(frozen=True)
class PairSettings:
    """Everything that a run of two fighters depends on besides motions, controller and seed.

    Attributes:
        scene: obstacles, timestep, friction; its bodies are replaced by the motions'.
        reference: processing of both motions.
        mpc: configuration of `mpc`.
        common_elites: whether `mpc` judges the samples by the sum of both fighters' costs, instead of each fighter's part
            of them by its own.
        fall: when a fighter counts as fallen.
        pushes: external forces on bodies named a_... and b_...; none by default.
    """

    scene: SceneSettings = field(default_factory=SceneSettings)
    reference: ReferenceSettings = field(default_factory=ReferenceSettings)
    mpc: MpcSettings = field(default_factory=MpcSettings)
    common_elites: bool = False
    fall: FallRule = field(default_factory=FallRule)
    pushes: tuple[Push, ...] = ()


def track_pair(
    motions: tuple[Motion, Motion],
    controller: str = "mpc",
    seed: int = 0,
    settings: PairSettings | None = None,
    progress: Callable[[float], None] | None = None,
) -> PairRun:
    """Simulate two fighters in one world, from their motions' first frames until the end, the first fall or divergence.

    They collide with each other and the floor. No force acts on them but joint motors, gravity and contact, unless
    `settings.pushes` says so.

    Args:
        motions: what A and B track, of equal length and rate, in one frame.
        controller: `pd` or `mpc`; `mpc` plans both jointly.
        seed: of the controller's random generator.
        settings: scene, reference processing, controller configuration.
        progress: called with the completed share (0 to 1) about a hundred times a second of motion.

    Returns:
        Both runs and the contacts between them.

    Raises:
        MotionError: motions that do not fit together.
        UnknownNameError: no such controller.
        SettingError: a push on an unknown body.
    """
    settings = settings or PairSettings()
    a, b = motions
    if len(a) != len(b) or a.fps != b.fps:
        raise MotionError(
            f"{a.name} has {len(a)} frames at {a.fps:g} per second, {b.name} {len(b)} at {b.fps:g}; "
            "two fighters need equal length and rate"
        )
    bodies = a.body, b.body
    scene = replace(settings.scene, bodies=bodies)
    model = build_scene(scene)
    references = [make_reference(motion, scene.timestep, settings.reference) for motion in motions]
    with quiet_warnings():
        brain: MpcController | PdController
        if controller == "mpc":
            brain = MpcController(references, model, scene, seed, settings.mpc, settings.common_elites)
        elif controller == "pd":
            brain = PdController(references, model)
        else:
            raise UnknownNameError("controller", controller, CONTROLLERS)
        reader = ContactReader(model, len(references[0].qpos) - 1)
        simulated = simulate(model, references, brain, settings.fall, settings.pushes, progress, reader)
    runs = [simulated.run(number, reference, brain, seed, model) for number, reference in enumerate(references)]
    taken = simulated.taken
    return PairRun(
        runs=(runs[0], runs[1]),
        contacts=merge_touches(reader.touches, scene.timestep),
        penetration=reader.penetration[:taken],
        reference_penetration=fighter_penetration(references[0].qpos[:taken], references[1].qpos[:taken], bodies),
        unconverged_steps=reader.unconverged,
    )
