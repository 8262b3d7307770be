"""Experiment 3 of the 2013 paper: an obstacle course (duck, jump, crawl), two of the obstacles close together.

Example: python scripts/experiment_obstacle_course.py --seeds 10 -o results/obstacle_course

Distances between the obstacles and the phase of the walk vary with the seed: the first two obstacles are 1.0 to 1.4 m apart
(the style is kept between them), the third 2.6 to 3.2 m further (the style is released). A course lasts 13 to 25 s, so a
window of 2.2 s around each launch is simulated with mpc, each begun on the motion itself; the whole course only for the
first seed. Three arms; finished cases are kept in OUT/cases and not run again. About 40 seconds per seed on 2 free cores,
and two minutes more for the first.
"""

import sys
from collections.abc import Mapping

import numpy as np

from experiments.cases import Experiment, Setting
from experiments.report import main
from simprep.controller.influence import Influence
from simprep.controller.runtime.approach import near_obstacles
from simprep.controller.runtime.task import Task
from simprep.motion.motion import Motion
from simprep.scene import Obstacle

TARGETS = ("duck", "jump_over_low", "crawl")
POST_M = {"duck": 1.5, "jump_over_low": 0.2, "crawl": 1.15}
"""Height of what marks an obstacle."""


def draw(rng: np.random.Generator, targets: Mapping[str, Motion]) -> Setting:
    gaps = np.array([rng.uniform(1.4, 2.0), rng.uniform(1.0, 1.4), rng.uniform(2.6, 3.2)])
    x = np.cumsum(gaps)
    y = rng.uniform(-0.1, 0.1, 3)
    places = [(float(a), float(b)) for a, b in zip(x, y)]
    sources = [Influence(place, {name: 1.0}) for place, name in zip(places, TARGETS)]
    tasks = tuple(
        Task(
            places[number], name, tuple(sources[number : number + 2]),
            near_obstacles(places[number - 1], places[number]) if number else 0.0,
        )
        for number, name in enumerate(TARGETS)
    )  # fmt: skip
    return Setting(
        tasks, frame=int(rng.integers(64)), things=_things(places), drawn={"places_m": places, "gaps_m": gaps.tolist()}
    )


def _things(places: list[tuple[float, float]]) -> tuple[Obstacle, ...]:
    """Two posts beside the way at each obstacle, and a bar across where one has to be passed over."""
    out = []
    for name, (x, y) in zip(TARGETS, places):
        half = POST_M[name] / 2
        for side, sign in (("left", 1), ("right", -1)):
            out.append(Obstacle(f"{name}_{side}", (x, y + 0.6 * sign, half), (0.04, 0.04, half)))
        if name == "jump_over_low":
            out.append(Obstacle(f"{name}_bar", (x, y, POST_M[name] - 0.03), (0.03, 0.56, 0.03)))
    return tuple(out)


if __name__ == "__main__":
    title = "obstacle course: duck and jump close together, crawl further on"
    experiment = Experiment("obstacle_course", title, TARGETS, draw, windows=True, tail_s=5.5)
    sys.exit(main(experiment, __doc__ or ""))
