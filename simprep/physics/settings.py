"""Everything that a simulation depends on besides motions, controller and seed."""

from dataclasses import dataclass, field

from simprep.physics.falls import FallRule
from simprep.physics.mismatch import Mismatch
from simprep.physics.mpc_settings import MpcSettings
from simprep.physics.pushes import Kick, Push
from simprep.physics.reference import ReferenceSettings
from simprep.scene import SceneSettings


@dataclass(frozen=True)
class SimulationSettings:
    """Everything that a run depends on besides motions, controller and seed.

    Attributes:
        scene: obstacles, timestep, friction; its bodies are replaced by the motions'.
        reference: processing of the motions.
        mpc: configuration of the controller `mpc`.
        fall: when a body counts as fallen.
        pushes: external forces on segments, named as in the scene (`pelvis` of a single body, `a_pelvis` of several).
        kicks: sudden changes of roots' velocities.
        mismatch: how the simulated world differs from what controllers know of it.
    """

    scene: SceneSettings = field(default_factory=SceneSettings)
    reference: ReferenceSettings = field(default_factory=ReferenceSettings)
    mpc: MpcSettings = field(default_factory=MpcSettings)
    fall: FallRule = field(default_factory=FallRule)
    pushes: tuple[Push, ...] = ()
    kicks: tuple[Kick, ...] = ()
    mismatch: Mismatch = field(default_factory=Mismatch)
