"""Metrics of a simulated fight: the same numbers as of poses, and contacts, falls and distances to the reference."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from simprep.arrays import BoolArray, IntArray
from simprep.duel.fight.falls import BLOW_NS, KNOCK_DOWN_S, Blow, Fall, blow_before, blows, collision_before
from simprep.duel.fight.fight import Fight
from simprep.duel.fight.hits import GRACE_S, judge
from simprep.duel.stream.stream import DuelStream
from simprep.errors import SettingError
from simprep.metrics.contact import slip_ratio
from simprep.metrics.interaction.distributions import Distributions
from simprep.metrics.interaction.overlap import count_hits, recorded_contacts
from simprep.metrics.interaction.stream import (
    Depths,
    InteractionMetrics,
    Percentiles,
    depths,
    interaction_metrics,
    percentiles,
    plain,
    stream_slip,
)
from simprep.metrics.interaction.strikes import reacted_share
from simprep.metrics.tracking import position_errors
from simprep.motion.contacts import ContactSettings, detect_contacts
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.physics.run import Run

SHORTEST_S = 0.5
"""A run that ended sooner has no metrics but its end [s]."""
CALM_S = 0.5
"""So long after a blow a body may be where it is not wanted [s]."""
STANDING = ContactSettings(enter_height=0.015, leave_height=0.02, enter_speed=0.25, leave_speed=0.5)
"""The one rule by which feet stand where slips are compared. Of the rules tried it agrees best with both the planned
contacts of synthesised fights (96 % of the frames) and the measured ones of simulated fights (88 %)."""


@dataclass(frozen=True)
class FighterErrors:
    """MPJPE of one fighter against what it tracked, where it touches another and where not [mm]; NaN without such frames.

    Attributes:
        touching_mm: root-relative, in frames in which the fighters overlap or touch in the simulation.
        touching_global_mm: the same, global.
        apart_mm: root-relative, in all others.
        apart_global_mm: the same, global.
    """

    touching_mm: float
    touching_global_mm: float
    apart_mm: float
    apart_global_mm: float


@dataclass(frozen=True)
class RunMetrics:
    """Numbers of a simulated fight.

    Attributes:
        end: `done`, `fell` or `diverged`.
        end_s: simulated time [s].
        falls_per_min: of all fighters [1/min].
        falls_unprovoked_per_min: of these, falls without a blow of 15 N s or more in the second before
            (`simprep.duel.fight.falls`) [1/min].
        falls_after_collision_per_min: of the unprovoked, those after another collision of that impulse, as of one's own kick [1/min].
        knock_downs_per_min: the others [1/min].
        simulated: of the simulated motions as far as they go: penetration at every step, hits from the recorded
            contacts, MPJPE against the tracked motions. None for a run that diverged or ended within 0.5 s.
        penetration_before: between the tracked motions over the same time.
        foot_slip_ratio: slip of the simulated over that of the tracked feet (`simprep.metrics.contact.slip_ratio`). Both
            feet stand by one rule, that of heights and speeds (`simprep.motion.contacts`). Where what was tracked was
            moved to where the bodies are, it is taken without these moves.
        slip_mm_per_stance: (tracked without these moves, simulated) slip of a stance by that rule [mm].
        moved_slip_ratio: as `foot_slip_ratio`, but of what was tracked with these moves, whose standing feet move too.
        moved_slip_mm: slip of a stance of what was tracked, moves included, by that rule [mm].
        mpjpe_calm_mm: root-relative MPJPE outside the 0.5 s after a blow of 5 N s or more, while nobody is down [mm].
        fighters: errors of each fighter, with and without contact between them; empty where `simulated` is None.
        touching_share: share of the frames with such a contact.
        contacts: number of recorded contacts by verdict, part by part (an attack that lands makes several).
        impulse_ns: of the contacts [N s]; None without any.
        blows: number of blows of 5 N s or more: all contacts of one attack are one blow.
        blow_ns: impulse of all blows [N s]; None without any.
        reacted_share: share of the blows of 5 N s or more after which the struck fighter reacts (`strikes.reacted_share`).
        assist_n: largest external force [N].
        s_per_s: computing time per simulated second.
    """

    end: str
    end_s: float
    falls_per_min: float
    falls_unprovoked_per_min: float
    falls_after_collision_per_min: float
    knock_downs_per_min: float
    simulated: InteractionMetrics | None
    penetration_before: Depths
    foot_slip_ratio: float
    slip_mm_per_stance: tuple[float, float]
    moved_slip_ratio: float
    moved_slip_mm: float
    mpjpe_calm_mm: float
    fighters: tuple[FighterErrors, ...]
    touching_share: float
    contacts: dict[str, int]
    impulse_ns: Percentiles | None
    blows: int
    blow_ns: Percentiles | None
    reacted_share: float
    assist_n: float
    s_per_s: float

    def as_dict(self) -> dict[str, Any]:
        """Nested dictionary for JSON: None where a number does not exist."""
        return {key: plain(value) for key, value in asdict(self).items()}


def run_metrics(
    run: Run,
    fight: Fight,
    recorded: Distributions | None = None,
    falls: Sequence[Fall] | None = None,
    wall_s: float | None = None,
    resting: DuelStream | None = None,
    meet: bool = True,
) -> RunMetrics:
    """Metrics of a simulated fight; SettingError for a run longer than the fight.

    Args:
        run: of all fighters (`simprep.physics.simulate.simulate`).
        fight: what was simulated; the run's time 0 is its first frame.
        recorded: what to compare labels, distances and facings of two with.
        falls: of a fight that goes on after them (`simprep.duel.fight.live`); None: the run ends with its first.
        wall_s: computing time, where more than the run's counts [s].
        resting: what the slip is compared with (`live.LiveResult.resting`); None: what was tracked.
        meet: whether the bodies collided with each other (`SceneSettings.bodies_meet`). Otherwise no contact was recorded, and
            penetration is that of the simulated poses at the fight's frames.
    """
    contacts = judge(run.contacts, fight)
    struck = blows(contacts)
    fallen = falls_of_run(run, struck) if falls is None else tuple(falls)
    minutes = run.end_s / 60 if run.end_s > 0 else math.nan
    knocked, collided = (sum(getattr(one, kind) for one in fallen) for kind in ("knock_down", "after_collision"))
    reacted, hard = reacted_share(struck, fight)
    computed: dict[str, Any] = {
        "end": run.end,
        "end_s": run.end_s,
        "falls_per_min": len(fallen) / minutes,
        "falls_unprovoked_per_min": (len(fallen) - knocked) / minutes,
        "falls_after_collision_per_min": collided / minutes,
        "knock_downs_per_min": knocked / minutes,
        "penetration_before": depths(run.reference_overlap),
        "contacts": dict(Counter(one.verdict for one in contacts)),
        "impulse_ns": percentiles(np.array([one.impulse_ns for one in contacts])) if contacts else None,
        "blows": hard,
        "blow_ns": percentiles(np.array([one.impulse_ns for one in struck])) if struck else None,
        "reacted_share": reacted,
        "assist_n": run.assist.force_n,
        "s_per_s": (run.wall_s if wall_s is None else wall_s) / run.end_s if run.end_s > 0 else math.nan,
    }
    finite = all(np.isfinite(one.qpos).all() for one in run.bodies)
    if run.end_s < SHORTEST_S or not finite:
        missing = ("foot_slip_ratio", "moved_slip_ratio", "moved_slip_mm", "mpjpe_calm_mm", "touching_share")
        nothing: dict[str, Any] = dict.fromkeys(missing, math.nan)
        return RunMetrics(simulated=None, slip_mm_per_stance=(math.nan, math.nan), fighters=(), **nothing, **computed)
    stream, reference = simulated_stream(run, fight)
    table, codes = fight_so_far(fight, len(stream))
    found = interaction_metrics(stream, table, codes, recorded, reference)
    characters = [motion.character for motion in stream.players]
    touched = recorded_contacts(contacts, characters, len(stream), stream.fps)
    landed = count_hits(touched, characters, stream.fps, stream.bounds, table, codes, GRACE_S)
    simulated = replace(found, penetration=depths(run.overlap) if meet else found.penetration, hits=landed)
    touching = _touching(run, len(stream), stream.fps)
    moved, own = (stream_slip(by_one_rule(one)) for one in (reference, stream))
    still = moved if resting is None else stream_slip(by_one_rule(resting))
    return RunMetrics(
        simulated=simulated,
        foot_slip_ratio=slip_ratio(own, still),
        slip_mm_per_stance=(still.mm_per_stance, own.mm_per_stance),
        moved_slip_ratio=slip_ratio(own, moved),
        moved_slip_mm=moved.mm_per_stance,
        fighters=tuple(_errors_by_contact(*pair, touching) for pair in zip(stream.players, reference.players)),
        touching_share=float(touching.mean()),
        mpjpe_calm_mm=_calm_error(stream, reference, struck, fallen),
        **computed,
    )


def falls_of_run(run: Run, struck: Sequence[Blow]) -> tuple[Fall, ...]:
    """The fall that ended a run, if one did.

    Args:
        run: of all fighters.
        struck: the blows in it.
    """
    if run.fallen is None:
        return ()
    who, end = run.fallen, run.end_s
    return (Fall(who, end, run.end_reason, blow_before(struck, who, end), collision_before(run.contacts, who, end)),)


def by_one_rule(stream: DuelStream) -> DuelStream:
    """The same motions, feet standing where heights and speeds of the soles say so, however they were made."""
    players = tuple(
        replace(motion, contacts=detect_contacts(motion.qpos, motion.fps, motion.character, STANDING))
        for motion in stream.players
    )
    return replace(stream, players=players)


def _touching(run: Run, frames: int, fps: float) -> BoolArray:
    """Frames (T,) of a fight in which any two fighters touch in the simulation; breaks of 1/60 s are no end."""
    times, out = np.arange(frames) / fps, np.zeros(frames, dtype=bool)
    for one in run.contacts:
        out |= (times >= one.start_s - 0.5 / fps) & (times <= one.start_s + one.duration_s + 0.5 / fps)
    return out


def _errors_by_contact(own: Motion, wanted: Motion, touching: BoolArray) -> FighterErrors:
    """See `FighterErrors`."""
    found: list[float] = []
    for rows in (touching, ~touching):
        if rows.any():
            pair = [forward_kinematics(one.qpos[: len(rows)][rows], own.character).xpos for one in (own, wanted)]
            errors = position_errors(*pair)
            found += [errors["mpjpe_mm"], errors["g_mpjpe_mm"]]
        else:
            found += [math.nan, math.nan]
    return FighterErrors(*found)


def _calm_error(stream: DuelStream, reference: DuelStream, struck: Sequence[Blow], falls: Sequence[Fall]) -> float:
    """See `RunMetrics.mpjpe_calm_mm`."""
    times = np.arange(len(stream)) / stream.fps
    calm = np.ones(len(stream), dtype=bool)
    for blow in struck:
        if blow.impulse_ns >= BLOW_NS:
            calm &= (times < blow.start_s) | (times > blow.end_s + CALM_S)
    for fall in falls:
        calm &= (times < fall.time_s - KNOCK_DOWN_S) | (times > (np.inf if fall.up_s is None else fall.up_s))
    if not calm.any():
        return math.nan
    errors = []
    for own, wanted in zip(stream.players, reference.players):
        pair = [forward_kinematics(one.qpos[: len(stream)][calm], own.character).xpos for one in (own, wanted)]
        errors.append(position_errors(*pair)["mpjpe_mm"])
    return float(np.mean(errors))


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
    for number, (name, planned) in enumerate(zip(fight.stream.names, fight.stream.players)):
        one = run.body(number)
        measured = one.simulated_motion()
        simulated.append(
            Motion(measured.qpos[steps], fps, measured.contacts[steps], name=name, character=measured.character)
        )
        feet = planned.contacts[:count]
        tracked.append(Motion(one.reference_qpos[steps], fps, feet, name=name, character=measured.character))
    name = fight.stream.name
    return (DuelStream(tuple(simulated), name=f"{name} simulated"), DuelStream(tuple(tracked), name=f"{name} tracked"))


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
