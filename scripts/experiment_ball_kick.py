"""Experiment 1 of the 2013 paper: a user picks one of three balls; the character walks to it and kicks it.

Example: python scripts/experiment_ball_kick.py --seeds 10 -o results/ball_kick

Start, balls and choice vary with the seed. Each seed runs in three arms (plain motion graph, preparation, preparation with
posture optimisation), simulated with mpc. Finished cases are kept in OUT/cases and not run again. About 1 minute per seed
on 2 free cores.
"""

import sys
from collections.abc import Mapping

import numpy as np

from experiments.cases import Experiment, Setting
from experiments.report import main
from simprep.controller.influence import Influence
from simprep.controller.runtime.task import Task
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.preparation.reference_posture import reference_posture
from simprep.scene import Obstacle

KICK = "kick_front"
STOPS_M = 0.35
"""About where a character that has reached its goal comes to stand before it."""


def reach(kick: Motion) -> tuple[float, float]:
    """How far before the root at the launch, and how high, the foot is at impact [m]."""
    foot = kick.character.segment("right_foot")
    impact = forward_kinematics(kick.qpos[kick.events["impact"]][None], kick.character).xpos[0, foot]
    start = kick.qpos[reference_posture(kick).frame]
    return float(impact[0] - start[0]), float(impact[2])


def draw(rng: np.random.Generator, targets: Mapping[str, Motion]) -> Setting:
    ahead, high = reach(targets[KICK])
    heading = rng.uniform(-0.3, 0.3)
    bearings = np.array([-0.45, 0.0, 0.45]) + rng.uniform(-0.15, 0.15, 3)
    distances = rng.uniform(2.3, 3.0, 3)
    balls = distances[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    chosen = int(rng.integers(3))
    towards = balls[chosen] / distances[chosen]
    goal = balls[chosen] - (ahead - STOPS_M) * towards
    place = (float(goal[0]), float(goal[1]))
    things = tuple(
        Obstacle(f"ball{number}", (float(x), float(y), high), (0.11, 0.11, 0.11), soft=number == chosen, ball=True)
        for number, (x, y) in enumerate(balls)
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
