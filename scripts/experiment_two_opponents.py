"""Experiment 2 of the 2013 paper: two opponents walk up and attack; the character goes to meet the nearer one and punches.

Example: python scripts/experiment_two_opponents.py --seeds 10 -o results/two_opponents

Opponents are moving sources of influence (points at striking distance before them that come up and stop), each with the
punch that meets it; both count, by time to contact. Where they start, how fast they come and the phase of the walk vary with the seed.
They are people who walk up and jab, built-in motions along the way of the sources. No physics acts on them and they do not react.
The nearer one is placed so that the fist, as synthesised, meets trunk or head at the impact. Whether the simulated fist meets
them is counted by distance: nothing collides with them.
Three arms, simulated with mpc; finished cases are kept in OUT/cases and not run again. About 20 seconds per seed on 2 free
cores.
"""

import sys
from collections.abc import Mapping

import numpy as np

from experiments.cases import Experiment
from experiments.opponents import attacker
from experiments.report import main
from experiments.setting import Setting
from simprep.controller.influence import Influence
from simprep.controller.runtime.task import Task
from simprep.motion.motion import Motion

PUNCHES = ("punch_left", "punch_right")
SPEED_M_S = 0.6
"""At which the character comes to meet them, on average."""
STRIKE_M = 0.6
"""An opponent walks this far behind the place at which it is a source of influence: where its fists reach to."""
BEHIND_M = 0.9
"""The farther opponent stops this far before the place where the nearer one is met."""
ATTACKS = ("jab_left_head", "jab_right_head")


def draw(rng: np.random.Generator, targets: Mapping[str, Motion]) -> Setting:
    sides = np.array([1.0, -1.0]) if rng.random() < 0.5 else np.array([-1.0, 1.0])
    bearings = sides * rng.uniform(0.1, 0.5, 2)
    distances = np.array([rng.uniform(2.8, 3.4), rng.uniform(3.8, 4.6)])
    speeds = rng.uniform(0.5, 0.9, 2)
    starts = distances[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    # the nearer one is met where both walk towards each other; the other one stops an arm's length behind
    meets = distances[0] * SPEED_M_S / (SPEED_M_S + speeds[0])
    goal = meets * starts[0] / distances[0]
    influences = []
    for number, (start, speed) in enumerate(zip(starts, speeds)):
        towards = goal - start
        length = float(np.linalg.norm(towards)) - (0.0 if number == 0 else BEHIND_M)
        velocity = speed * towards / np.linalg.norm(towards)
        punch = PUNCHES[int(bearings[number] < 0)]
        influences.append(
            Influence(
                (float(start[0]), float(start[1])),
                {punch: 1.0},
                (float(velocity[0]), float(velocity[1])),
                max(length, 0.0) / float(speed),
            )
        )
    punch = next(iter(influences[0].targets))
    return Setting(
        tasks=(Task((float(goal[0]), float(goal[1])), punch, tuple(influences), meet=True),),
        place=(0.0, 0.0, float(rng.uniform(-0.3, 0.3))),
        frame=int(rng.integers(64)),
        blows={0: (f"{punch.removeprefix('punch_')}_hand", 0)},
        drawn={"starts_m": starts.tolist(), "speeds_m_s": speeds.tolist(), "punch": punch},
    )


def opponents(setting: Setting, duration: float) -> tuple[Motion, ...]:
    """Both opponents: each walks up with its source of influence and jabs where that stops.

    Args:
        setting: the task.
        duration: of their motions [s].
    """
    return tuple(
        attacker(influence, STRIKE_M, attack, duration)
        for influence, attack in zip(setting.tasks[0].influences, ATTACKS)
    )


if __name__ == "__main__":
    title = "two opponents walk up; punch the nearer one"
    sys.exit(main(Experiment("two_opponents", title, PUNCHES, draw, people=opponents), __doc__ or ""))
