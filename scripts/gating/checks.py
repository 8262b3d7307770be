"""What the gate measures, with a fault or without: motions before physics, states after a few steps, ensembles under `mpc`."""

from dataclasses import replace

from gating.faults import Fault
from simprep.metrics.evaluate import evaluate_motion, evaluate_run
from simprep.metrics.metric import Metrics
from simprep.motion.edit import cut, repeat
from simprep.motion.motion import Motion
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.pushes import Push
from simprep.physics.run import Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track

TARGET = "kick_front"


def before_physics(fault: Fault) -> Metrics:
    """Metrics of a walk that prepares for a kick, and of the kick."""
    return evaluate_motion(fault.scenario(TARGET))


def walking(fault: Fault) -> Run:
    """The first 0.15 s of a walk under servos alone."""
    return track(_part(fault.motion("walk"), 0.0, 0.15), "pd", settings=fault.settings())


def landing(fault: Fault) -> Run:
    """0.2 s of servos alone that begin in the flight of a jump: the ankles reach their limits when it lands."""
    return track(_part(fault.motion("jump"), 1.35, 0.2), "pd", settings=fault.settings())


def slipping(fault: Fault) -> Run:
    """0.15 s of standing under servos alone, one foot pushed so hard that it slips."""
    push = Push("left_foot", 0.02, 0.1, (400.0, 0.0, 0.0))
    return track(
        _part(fault.motion("stand"), 0.0, 0.15), "pd", settings=fault.settings(SimulationSettings(pushes=(push,)))
    )


GOLDENS = {"walking": walking, "landing": landing, "slipping": slipping}
"""Runs by name, of which the first `GOLDEN_STEPS` steps are compared."""
GOLDEN_STEPS = {"walking": 50, "landing": 80, "slipping": 60}


def _fast_walk(fault: Fault) -> Motion:
    return repeat(fault.motion("walk_fast"), 2)


def _jump(fault: Fault) -> Motion:
    return fault.motion("jump_forward")


def _kick(fault: Fault) -> Motion:
    whole = fault.scenario(TARGET)
    launch = whole.events["launch"]
    return cut(whole, launch - round(0.5 * whole.fps), launch + round(1.2 * whole.fps))


ENSEMBLES = {"walk_fast": _fast_walk, "jump_forward": _jump, "prepared_kick": _kick}
"""Motions by name that `mpc` tracks with several seeds."""


def tracked(fault: Fault, name: str, seed: int) -> Metrics:
    """Metrics of a motion of `ENSEMBLES` under `mpc`, preset `live`, in one thread."""
    settings = SimulationSettings(mpc=replace(MPC_PRESETS["live"], threads=1))
    return evaluate_run(track(ENSEMBLES[name](fault), "mpc", seed, fault.settings(settings)))


def _part(motion: Motion, start_s: float, seconds: float) -> Motion:
    # in frames of the unharmed motion: a wrong rate is part of the fault
    fps = 1 / (motion.duration / len(motion)) if motion.loop else motion.fps
    first = round(start_s * fps)
    return cut(motion, first, min(len(motion), first + round(seconds * fps) + 2))
