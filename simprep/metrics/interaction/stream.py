"""How people fight, two or more: one set of numbers for recorded streams, synthesised and simulated fights."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.duel.labels.segmentation import stream_kinematics
from simprep.duel.stream.stream import DuelStream, facing_error, root_distance
from simprep.errors import SettingError
from simprep.metrics.contact import FootSlip, floor_penetration, foot_slip, stance_drift
from simprep.metrics.interaction.distributions import Distributions, distributions, js_distances
from simprep.metrics.interaction.overlap import Hits, count_hits, overlaps
from simprep.metrics.interaction.reactions import Reactions, check_table, reactions
from simprep.metrics.interaction.stability import Stability, stability
from simprep.metrics.interaction.strikes import strike_misses
from simprep.metrics.tracking import position_errors
from simprep.motion.edit import cut, yaw
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import wrap_angle
from simprep.physics.run import FELL

SKATE_MM = 10.0
"""A stance that slips farther skates [mm]."""


@dataclass(frozen=True)
class Depths:
    """Overlap over time.

    Attributes:
        mean_mm: mean over all frames, those without overlap as 0 [mm].
        mean_inside_mm: mean over the frames with overlap; 0 without any [mm].
        max_mm: deepest [mm].
        share: of frames with overlap.
    """

    mean_mm: float
    mean_inside_mm: float
    max_mm: float
    share: float


@dataclass(frozen=True)
class Percentiles:
    """Spread of a quantity over frames: 5th, 50th, 90th and 95th percentile, in its own unit."""

    p5: float
    median: float
    p90: float
    p95: float


@dataclass(frozen=True)
class Feet:
    """Slip of the fighters' standing feet: path length and drift (`foot_slip`, `stance_drift`).

    Measurement noise adds to the path length; of noisy motions read the drift.

    Attributes:
        mm_per_stance: mean path length of a stance [mm].
        p95_mm: 95th percentile of the stances [mm].
        max_mm: worst stance [mm].
        skating_share: share of the stances that slip more than 10 mm.
        stances: how many.
        m_s: slip of both feet per second of a fight, all fighters together [m/s].
        drift_mm: mean drift of a stance [mm].
        drift_p95_mm: 95th percentile of the stances [mm].
        drift_max_mm: worst stance [mm].
    """

    mm_per_stance: float
    p95_mm: float
    max_mm: float
    skating_share: float
    stances: int
    m_s: float
    drift_mm: float
    drift_p95_mm: float
    drift_max_mm: float


@dataclass(frozen=True)
class InteractionMetrics:
    """Numbers of a fight.

    Attributes:
        duration_s: length without what passed between clips [s].
        penetration: between the fighters' colliding geoms.
        ground_penetration: of the deepest fighter into the floor.
        feet: slip.
        facing_error_deg: size of the angle from the pelvis' heading to the root of the opponent, who is the nearest of the
            others, all fighters [deg]. A bladed stance turns the pelvis away on purpose.
        head_facing_error_deg: the same of the head: who looks at whom.
        distance_m: from the opponent, of the roots, horizontal, mean over the fighters at every frame [m].
        reactions: attacks per minute and how many are answered.
        hits: attacks that land.
        strike_miss_mm: by how much attacks miss that are not blocked (`strikes.strike_misses`) [mm]; None without any.
        stability: tilt of pelvis and trunk.
        g_mpjpe_mm: mean distance of the segments from a reference [mm]; NaN without one.
        mpjpe_mm: the same after subtracting each root's position [mm].
        js: `simprep.metrics.interaction.distributions.js_distances` to a recorded stream; empty without one.
    """

    duration_s: float
    penetration: Depths
    ground_penetration: Depths
    feet: Feet
    facing_error_deg: Percentiles
    head_facing_error_deg: Percentiles
    distance_m: Percentiles
    reactions: Reactions
    hits: Hits
    strike_miss_mm: Percentiles | None
    stability: Stability
    g_mpjpe_mm: float
    mpjpe_mm: float
    js: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """Nested dictionary for JSON: None where a number does not exist."""
        return {key: plain(value) for key, value in asdict(self).items()}


def interaction_metrics(
    stream: DuelStream,
    table: IntArray,
    codes: IntArray,
    recorded: Distributions | None = None,
    reference: DuelStream | None = None,
) -> InteractionMetrics:
    """Metrics of two people or more, recorded, synthesised or simulated.

    Args:
        stream: all motions; of a simulated fight the simulated ones, with the contacts measured.
        table: (S, 4) player, first frame, frame after the last, clip, as of `Cuts.table` or `Fight.table`.
        codes: (S,) label codes of the actions.
        recorded: what to compare labels, distances and facings of two with (`distributions`).
        reference: what the stream should have been, frame by frame (it may go on longer): for MPJPE.

    Raises:
        MotionError: a table that is not this stream's, or distributions to compare with and more than two people.
        SettingError: a reference with another frame rate, or shorter than the stream.
    """
    table, codes = np.asarray(table, dtype=np.int64), np.asarray(codes, dtype=np.int64)
    check_table(table, codes, stream.bounds, len(stream.players))
    bodies = stream_kinematics(stream)
    inside = overlaps(stream.players)
    floor = np.max([floor_penetration(motion) for motion in stream.players], axis=0)
    errors = _errors(stream, reference, [one.xpos for one in bodies])
    characters = [motion.character for motion in stream.players]
    pelvis, head = facings(stream, [one.xquat for one in bodies])
    misses = strike_misses(stream.players, stream.bounds, table, codes)
    return InteractionMetrics(
        duration_s=stream.duration,
        penetration=depths(inside.deepest),
        ground_penetration=depths(floor),
        feet=_feet(stream),
        facing_error_deg=percentiles(pelvis),
        head_facing_error_deg=percentiles(head),
        distance_m=percentiles(root_distance(stream)),
        reactions=reactions(table, codes, stream.bounds, stream.fps, len(stream.players)),
        hits=count_hits(inside, characters, stream.fps, stream.bounds, table, codes),
        strike_miss_mm=percentiles(1e3 * misses) if len(misses) else None,
        stability=stability([one.xquat for one in bodies], characters, stream.bounds, stream.fps),
        g_mpjpe_mm=errors.get("g_mpjpe_mm", math.nan),
        mpjpe_mm=errors.get("mpjpe_mm", math.nan),
        js={} if recorded is None else js_distances(distributions(stream, table, codes), recorded),
    )


def facings(stream: DuelStream, rotations: Sequence[FloatArray] | None = None) -> tuple[FloatArray, FloatArray]:
    """Angles (T, N) by which pelvises and heads turn away from the root of the opponent, their sizes [deg].

    Args:
        stream: of N people; the opponent is the nearest of the others.
        rotations: (T, segments, 4) of each body's segments, where already known.
    """
    if rotations is None:
        rotations = [one.xquat for one in stream_kinematics(stream)]
    pelvis, head = (
        np.stack([yaw(one[:, own.character.segment(role)]) for one, own in zip(rotations, stream.players)], axis=1)
        for role in ("pelvis", "head")
    )
    facing = facing_error(stream)
    return np.degrees(np.abs(facing)), np.degrees(np.abs(wrap_angle(facing + pelvis - head)))


def falls_per_minute(ends: Sequence[tuple[str, float]]) -> float:
    """Falls per simulated minute of several bouts that each end with their first fall [1/min]; NaN without time.

    Args:
        ends: (end, end_s) of each bout: `done`, `fell` or `diverged`, and its simulated time [s]. A bout that diverged
            adds its time and no fall; report it beside.
    """
    seconds = sum(end_s for _, end_s in ends)
    return 60 * sum(end == FELL for end, _ in ends) / seconds if seconds > 0 else math.nan


def depths(depth: FloatArray) -> Depths:
    """Summary of a depth (T,) over time [m], 0 where there is no overlap; NaN without frames."""
    if not len(depth):
        return Depths(*[math.nan] * 4)
    inside = depth[depth > 0]
    return Depths(
        1e3 * float(depth.mean()),
        1e3 * float(inside.mean()) if len(inside) else 0.0,
        1e3 * float(depth.max()),
        len(inside) / len(depth),
    )


def percentiles(values: FloatArray) -> Percentiles:
    """Spread of values of any shape."""
    return Percentiles(*(float(value) for value in np.percentile(values, (5, 50, 90, 95))))


def stream_slip(stream: DuelStream) -> FootSlip:
    """Slip of all fighters' feet, clip by clip (`foot_slip`); the duration is that of all together."""
    parts = [foot_slip(clip) for clip in _clips(stream)]
    return FootSlip(
        sum(part.travel_m for part in parts),
        sum(part.contact_s for part in parts),
        sum(part.duration_s for part in parts),
        sum(part.stance_count for part in parts),
        tuple(one for part in parts for one in part.stance_travel_m),
    )


def _clips(stream: DuelStream) -> list[Motion]:
    return [
        cut(motion, int(first), int(after))
        for motion in stream.players
        for first, after in stream.bounds
        if after - first > 1
    ]


def _feet(stream: DuelStream) -> Feet:
    slip = stream_slip(stream)
    travel = 1e3 * np.array(slip.stance_travel_m)
    drift = 1e3 * np.concatenate([stance_drift(clip) for clip in _clips(stream)])
    return Feet(
        *_mean_p95_max(travel),
        float(np.mean(travel > SKATE_MM)) if len(travel) else math.nan,
        len(travel),
        slip.travel_m / (slip.duration_s / len(stream.players)),
        *_mean_p95_max(drift),
    )


def _mean_p95_max(values: FloatArray) -> tuple[float, float, float]:
    if not len(values):
        return math.nan, math.nan, math.nan
    return float(values.mean()), float(np.percentile(values, 95)), float(values.max())


def _errors(stream: DuelStream, reference: DuelStream | None, simulated: Sequence[FloatArray]) -> dict[str, float]:
    if reference is None:
        return {}
    if reference.fps != stream.fps or len(reference) < len(stream):
        raise SettingError(
            f"reference of {len(reference)} frames at {reference.fps:g} 1/s for a stream of {len(stream)} at "
            f"{stream.fps:g} 1/s; valid: equal rates, and at least as many frames"
        )
    wanted = [forward_kinematics(motion.qpos[: len(stream)], motion.character).xpos for motion in reference.players]
    return position_errors(np.concatenate(simulated), np.concatenate(wanted))


def plain(value: Any) -> Any:
    """A value for JSON, inside dictionaries too: None for numbers that are not finite, lists for tuples."""
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, tuple | list):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
