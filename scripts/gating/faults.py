"""Faults that a regression gate has to find, made with public values: another body, another floor, another arm, another rate."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import mujoco

from simprep.character import Character
from simprep.library import library_motion
from simprep.motion.motion import Motion
from simprep.physics.settings import SimulationSettings
from simprep.preparation.scenario import scenario
from simprep.study.plan import QUICK_PROFILE

TRUNK = ("pelvis", "abdomen", "thorax")
MISREAD = 25.0 / 30.0
"""A motion of 30 frames a second that is taken for one of 25."""
Edit = Callable[[mujoco.MjSpec], None]


def weaker_servos(spec: mujoco.MjSpec) -> None:
    """Stiffness of every servo 20 % less."""
    for actuator in spec.actuators:
        actuator.gainprm[0] *= 0.8
        actuator.biasprm[1] *= 0.8


def weaker_ankles(spec: mujoco.MjSpec) -> None:
    """Torque limits of the ankles 30 % less."""
    for actuator in spec.actuators:
        if "ankle" in actuator.target:
            actuator.forcerange = actuator.forcerange * 0.7


def com_forward(spec: mujoco.MjSpec) -> None:
    """The COM of the whole body 2 cm farther forward, by the trunk's segments."""
    parts = [body for body in spec.bodies if body.name in TRUNK]
    share = sum(body.mass for body in parts) / sum(body.mass for body in spec.bodies[1:])
    for body in parts:
        body.ipos[0] += 0.02 / share


def changed_spec(build: Callable[[], mujoco.MjSpec], edit: Edit) -> mujoco.MjSpec:
    """An editable model with a change."""
    spec = build()
    edit(spec)
    return spec


@dataclass(frozen=True)
class Fault:
    """What is wrong.

    Attributes:
        body: change of the body's model; None for none.
        friction: of the floor, as a factor.
        arm: of a scenario.
        rate: factor on the frame rates of the motions.
    """

    body: Edit | None = None
    friction: float = 1.0
    arm: str = "optimised"
    rate: float = 1.0

    def motion(self, name: str) -> Motion:
        """A motion of the library, as the fault leaves it."""
        motion = library_motion(name)
        return replace(motion, character=self.character(motion.character), fps=motion.fps * self.rate)

    def scenario(self, target: str) -> Motion:
        """A walk that prepares for a target, fully, and the target."""
        return scenario(self.motion("walk"), self.motion(target), replace(QUICK_PROFILE, level=1.0), self.arm)

    def character(self, body: Character) -> Character:
        """A body, as the fault leaves it."""
        return body if self.body is None else replace(body, build=partial(changed_spec, body.build, self.body))

    def settings(self, settings: SimulationSettings | None = None) -> SimulationSettings:
        """Settings of a simulation, as the fault leaves them."""
        settings = settings or SimulationSettings()
        scene = replace(settings.scene, friction=settings.scene.friction * self.friction)
        return replace(settings, scene=scene)


NO_FAULT = Fault()
FAULTS = {
    "kp -20 %": Fault(body=weaker_servos),
    "ankle limit -30 %": Fault(body=weaker_ankles),
    "friction -40 %": Fault(friction=0.6),
    "optimiser off": Fault(arm="blended"),
    "COM off by 2 cm": Fault(body=com_forward),
    "frame rate misread": Fault(rate=MISREAD),
}
