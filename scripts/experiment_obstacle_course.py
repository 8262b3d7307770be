"""Experiment 3 of the 2013 paper: an obstacle course (duck, jump, crawl), two of the obstacles close together.

Example: python scripts/experiment_obstacle_course.py --seeds 10 -o results/obstacle_course

Distances between the obstacles and the phase of the walk vary with the seed: the first two obstacles are 2.0 to 2.4 m apart
(measured from where the first target ends, less than 1.5 m: the style is kept between them), the third 2.6 to 3.2 m further (the
style is released). The gates are those of `simprep app`: a bar on two posts, fixed here, stops who does not clear it. The duck goes on low while
it passes under its bar; it is that of `simprep app`, since those of the library duck on the spot.
The start, and the goals before the later gates, are placed so that each target is launched at its distance before its bar.
A course lasts 13 to 25 s and is simulated as a whole. Three arms; finished cases are kept in OUT/cases and not run again. About
1 minute per seed on 2 free cores.
"""

import sys
from collections.abc import Mapping

import numpy as np

from experiments.cases import Experiment
from experiments.report import main
from experiments.setting import Gate, Setting
from simprep.app.stage import BARS, DUCK_UNDER, DUCKED_WALK, STOPS_M, gate
from simprep.controller.influence import Influence
from simprep.controller.runtime.approach import near_obstacles
from simprep.controller.runtime.task import Task
from simprep.library.crawl import crawl
from simprep.motion.motion import Motion

TARGETS = tuple(BARS)
ENDS_M = {DUCK_UNDER: 1.1, "jump_over_low": 0.55, "crawl": 0.9}
"""About how far past its goal a target takes the body."""


def draw(rng: np.random.Generator, targets: Mapping[str, Motion]) -> Setting:
    gaps = np.array([rng.uniform(1.4, 2.0), rng.uniform(2.0, 2.4), rng.uniform(2.6, 3.2)])
    x = np.cumsum(gaps)
    y = rng.uniform(-0.1, 0.1, 3)
    places = [(float(a), float(b)) for a, b in zip(x, y)]
    sources = [Influence(place, {name: 1.0}) for place, name in zip(places, TARGETS)]
    # the first target takes the body past its gate; what is left of the way decides whether the style is kept
    left = [(first[0] + ENDS_M[name], first[1]) for first, name in zip(places, TARGETS)]
    tasks = tuple(
        Task(
            places[number], name, tuple(sources[number : number + 2]),
            near_obstacles(left[number - 1], places[number]) if number else 0.0,
        )
        for number, name in enumerate(TARGETS)
    )  # fmt: skip
    bars = [place[0] + BARS[name][0] - STOPS_M for place, name in zip(places, TARGETS)]
    gates = tuple(Gate(name, bar, BARS[name][0]) for name, bar in zip(TARGETS, bars))
    things = tuple(
        thing
        for gate_, (_, b) in zip(gates, places)
        for thing in gate(gate_.name, (gate_.x, b), BARS[gate_.name][1], free=False)
    )
    drawn = {"places_m": places, "gaps_m": gaps.tolist(), "bars_x_m": bars}
    return Setting(tasks, frame=int(rng.integers(64)), things=things, gates=gates, drawn=drawn)


if __name__ == "__main__":
    title = "obstacle course: duck and jump close together, crawl further on"
    experiment = Experiment(
        "obstacle_course", title, TARGETS, draw, tail_s=5.5, own={DUCK_UNDER: crawl(DUCKED_WALK, DUCK_UNDER)}
    )
    sys.exit(main(experiment, __doc__ or ""))
