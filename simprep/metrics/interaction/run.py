"""Metrics of a simulated fight: the same numbers as of poses, and contacts, falls and distances to the reference."""

import math
from collections import Counter
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from simprep.arrays import IntArray
from simprep.duel.fight.fight import Fight
from simprep.duel.fight.hits import GRACE_S, judge
from simprep.duel.stream.stream import PLAYERS, DuelStream
from simprep.errors import SettingError
from simprep.metrics.contact import slip_ratio
from simprep.metrics.interaction.distributions import Distributions
from simprep.metrics.interaction.overlap import count_hits, recorded_contacts
from simprep.metrics.interaction.stream import (
    Depths,
    InteractionMetrics,
    Percentiles,
    depths,
    falls_per_minute,
    interaction_metrics,
    percentiles,
    plain,
    stream_slip,
)
from simprep.motion.motion import Motion
from simprep.physics.run import Run

SHORTEST_S = 0.5
"""A run that ended sooner has no metrics but its end [s]."""


@dataclass(frozen=True)
class RunMetrics:
    """Numbers of a simulated fight.

    Attributes:
        end: `done`, `fell` or `diverged`.
        end_s: simulated time [s].
        falls_per_min: of this run, which ends with its first fall [1/min].
        simulated: of the simulated motions as far as they go: penetration at every step, hits from the recorded
            contacts, MPJPE against the tracked motions. None for a run that diverged or ended within 0.5 s.
        penetration_before: between the tracked motions over the same time.
        foot_slip_ratio: slip of the simulated over that of the tracked feet (`simprep.metrics.contact.slip_ratio`).
        contacts: number of recorded contacts by verdict, part by part (an attack that lands makes several).
        impulse_ns: of the contacts [N s]; None without any.
        assist_n: largest external force [N].
        s_per_s: computing time per simulated second.
    """

    end: str
    end_s: float
    falls_per_min: float
    simulated: InteractionMetrics | None
    penetration_before: Depths
    foot_slip_ratio: float
    contacts: dict[str, int]
    impulse_ns: Percentiles | None
    assist_n: float
    s_per_s: float

    def as_dict(self) -> dict[str, Any]:
        """Nested dictionary for JSON: None where a number does not exist."""
        return {key: plain(value) for key, value in asdict(self).items()}


def run_metrics(run: Run, fight: Fight, recorded: Distributions | None = None) -> RunMetrics:
    """Metrics of a simulated fight; SettingError for a run longer than the fight.

    Args:
        run: of both fighters (`simprep.physics.simulate.simulate`).
        fight: what was simulated; the run's time 0 is its first frame.
        recorded: what to compare labels, distances and facings with.
    """
    contacts = judge(run.contacts, fight)
    computed: dict[str, Any] = {
        "end": run.end,
        "end_s": run.end_s,
        "falls_per_min": falls_per_minute([(run.end, run.end_s)]),
        "penetration_before": depths(run.reference_overlap),
        "contacts": dict(Counter(one.verdict for one in contacts)),
        "impulse_ns": percentiles(np.array([one.impulse_ns for one in contacts])) if contacts else None,
        "assist_n": run.assist.force_n,
        "s_per_s": run.wall_s / run.end_s if run.end_s > 0 else math.nan,
    }
    finite = all(np.isfinite(one.qpos).all() for one in run.bodies)
    if run.end_s < SHORTEST_S or not finite:
        return RunMetrics(simulated=None, foot_slip_ratio=math.nan, **computed)
    stream, reference = simulated_stream(run, fight)
    table, codes = fight_so_far(fight, len(stream))
    found = interaction_metrics(stream, table, codes, recorded, reference)
    landed = count_hits(recorded_contacts(contacts, stream), stream, table, codes, GRACE_S)
    simulated = replace(found, penetration=depths(run.overlap), hits=landed)
    ratio = slip_ratio(stream_slip(stream), stream_slip(reference))
    return RunMetrics(simulated=simulated, foot_slip_ratio=ratio, **computed)


def simulated_stream(run: Run, fight: Fight) -> tuple[DuelStream, DuelStream]:
    """Simulated motions with measured contacts, and the tracked ones, at a fight's frames as far as the run goes.

    Args:
        run: of the fight; SettingError if it is longer.
        fight: gives the frame rate, names and the contacts of the tracked feet.
    """
    fps, dt = fight.stream.fps, run.timestep
    count = math.floor(run.end_s * fps + 1e-6) + 1
    if count > len(fight.stream):
        raise SettingError(f"a run of {run.end_s:.2f} s of a fight of {len(fight.stream)} frames at {fps:g} 1/s")
    steps = np.minimum(np.round(np.arange(count) / fps / dt).astype(int), run.steps)
    simulated, tracked = [], []
    for number, (name, planned) in enumerate(zip(PLAYERS, fight.stream.players)):
        one = run.body(number)
        measured = one.simulated_motion()
        simulated.append(
            Motion(measured.qpos[steps], fps, measured.contacts[steps], name=name, character=measured.character)
        )
        feet = planned.contacts[:count]
        tracked.append(Motion(one.reference_qpos[steps], fps, feet, name=name, character=measured.character))
    names = ((f"{fight.stream.name} {word}",) for word in ("simulated", "tracked"))
    first, second = (
        DuelStream((pair[0], pair[1]), name=name) for pair, (name,) in zip((simulated, tracked), names, strict=True)
    )
    return first, second


def fight_so_far(fight: Fight, frames: int) -> tuple[IntArray, IntArray]:
    """Table and label codes of the actions begun in the first frames of a fight; the last ones end with them.

    Args:
        fight: of one clip.
        frames: how many, at least 1.
    """
    rows = fight.table[:, 1] < frames
    table = fight.table[rows]
    table[:, 2] = np.minimum(table[:, 2], frames)
    return table, fight.codes[rows]
