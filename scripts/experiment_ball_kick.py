"""Experiment 1 of the 2013 paper: a user picks one of three balls; the character walks to it and kicks it.

Example: python scripts/experiment_ball_kick.py --seeds 10 -o results/ball_kick

Start, balls and choice vary with the seed. Each seed runs in three arms (plain motion graph, preparation, preparation with
posture optimisation), simulated with mpc. The balls lie on posts as in `simprep app`; the chosen one flies when it is hit. Each arm begins
where its foot, as synthesised, passes through the ball when it strikes. Finished cases are kept in OUT/cases and not run again.
About 20 seconds per seed on 2 free cores.
"""

import sys
from collections.abc import Mapping

import numpy as np

from experiments.cases import Experiment
from experiments.placing import RIGHT
from experiments.report import main
from experiments.setting import Setting
from simprep.app.aiming import strike
from simprep.app.stage import STOPS_M, ball_on_post
from simprep.controller.influence import Influence
from simprep.controller.runtime.task import Task
from simprep.motion.motion import Motion
from simprep.preparation.reference_posture import reference_posture

KICK = "kick_front"


def reach(kick: Motion) -> float:
    """How far before the root at the launch the sole is when the kick strikes [m]."""
    return float(strike(kick, RIGHT)[0] - kick.qpos[reference_posture(kick).frame, 0])


def draw(rng: np.random.Generator, targets: Mapping[str, Motion]) -> Setting:
    ahead = reach(targets[KICK])
    heading = rng.uniform(-0.3, 0.3)
    bearings = np.array([-0.45, 0.0, 0.45]) + rng.uniform(-0.15, 0.15, 3)
    distances = rng.uniform(2.3, 3.0, 3)
    balls = distances[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    chosen = int(rng.integers(3))
    towards = balls[chosen] / distances[chosen]
    goal = balls[chosen] - (ahead - STOPS_M) * towards
    place = (float(goal[0]), float(goal[1]))
    things = tuple(
        thing
        for number, (x, y) in enumerate(balls)
        for thing in ball_on_post((float(x), float(y)), f"ball{number}", free=number == chosen)
    )
    return Setting(
        tasks=(Task(place, KICK, (Influence(place, {KICK: 1.0}),)),),
        place=(0.0, 0.0, float(heading)),
        frame=int(rng.integers(64)),
        things=things,
        strikes={0: ("right_foot", f"ball{chosen}")},
        drawn={"heading_rad": heading, "balls_m": balls.tolist(), "chosen": chosen},
    )


if __name__ == "__main__":
    sys.exit(main(Experiment("ball_kick", "walk to the chosen ball and kick it", (KICK,), draw), __doc__ or ""))
