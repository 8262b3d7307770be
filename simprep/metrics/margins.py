"""Margins of stability as gait studies report them: sideways and fore-aft apart, for each step, left and right.

Definitions differ between studies (Watson et al. 2021, BMC Musculoskelet Disord 22:698), so `definitions` states every choice.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import SIDES
from simprep.display import SelfShowing, data_frame
from simprep.metrics.balance import Balance, mean
from simprep.metrics.smoothing import ANALYSIS_HZ
from simprep.motion.contacts import ContactSettings, stances, without_brief
from simprep.motion.edit import sample
from simprep.motion.motion import Motion
from simprep.preparation.blending import split_heading
from simprep.preparation.trajectory import heading_trend

DIRECTIONS = ("ml", "front", "back")
NODES = 101
"""Points of a time-normalised curve: 0 to 100 %."""
STEP_MARGIN_KEYS = tuple(f"step_margin_{direction}_{side}_mm" for direction in DIRECTIONS for side in SIDES)


@dataclass(frozen=True)
class StepMargin:
    """Margins of one step, from the touch-down of a foot. Positive: the XcoM is within the edge.

    Attributes:
        side: `left` or `right`, the foot that lands.
        touchdown_s: time of the event [s].
        next_touchdown_s: touch-down of the other foot, with which the step ends [s]; NaN where the motion ends before.
        liftoff_s: end of the foot's stance [s]; NaN where the motion ends before.
        ml_m: sideways, to the outer edge of the landing foot, at touch-down [m].
        ml_least_m: the least of it while the foot stands [m].
        front_m: to the foremost edge of the landing foot, at touch-down [m]; negative: the XcoM is ahead of it.
        back_m: to its rearmost edge, at touch-down [m].
        pendulum_m: pendulum length at touch-down [m].
    """

    side: str
    touchdown_s: float
    next_touchdown_s: float
    liftoff_s: float
    ml_m: float
    ml_least_m: float
    front_m: float
    back_m: float
    pendulum_m: float


@dataclass(frozen=True)
class Margins(SelfShowing):
    """Margins of a motion.

    Attributes:
        steps: in the order of their touch-downs.
        time: (n,) seconds from the first frame, at 60 Hz.
        margin: (n, 2, 3) of each foot, left then right, in the order of `DIRECTIONS` [m], whether it stands or not.
        stands: (n, 2) feet on the floor.
        pendulum_m: (n,) pendulum length [m].
    """

    steps: tuple[StepMargin, ...]
    time: FloatArray
    margin: FloatArray
    stands: BoolArray
    pendulum_m: FloatArray

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(margins)` and Jupyter show."""
        counts = ", ".join(f"{sum(one.side == side for one in self.steps)} {side}" for side in SIDES)
        means = {key: value for key, value in step_margin_summary(self.steps).items() if np.isfinite(value)}
        return "margins of stability", {"steps": counts, **means}

    def to_dataframe(self) -> Any:
        """The steps as a pandas DataFrame, one row each; MissingExtraError where pandas is not installed."""
        return data_frame([asdict(one) for one in self.steps])


def step_margins(motion: Motion, series: Balance) -> Margins:
    """Margins of stability of each step; `definitions` says of what, from where to where.

    A step begins where a foot touches down after it was in the air. Contacts and gaps under 0.06 s are no events, as a
    simulated foot chatters. Sideways: the least distance while the foot stands, and backward at touch-down, are those of
    Hak et al. (2013, PLoS One 8:e82842, Fig. 1). Captures which way balance is short. Hides that the XcoM ahead of the
    foot is how walking goes on: front margins are negative there.

    Args:
        motion: with its contacts.
        series: its `balance`.
    """
    heading, _ = split_heading(sample(motion, series.time)[:, 3:7])
    axis = heading_trend(np.unwrap(heading), ANALYSIS_HZ)
    forward = np.stack([np.cos(axis), np.sin(axis)], axis=1)
    left = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
    points = series.foot_points.reshape(len(series.time), 2, -1, 2) - series.xcom[:, None, None]  # (n, 2, N, 2)
    along, aside = (np.einsum("tfpk,tk->tfp", points, one) for one in (forward, left))
    outward = aside * np.array([1.0, -1.0])[:, None]
    margin = np.stack([outward.max(axis=2), along.max(axis=2), -along.min(axis=2)], axis=2)
    brief = ContactSettings().minimum * motion.fps
    contacts = without_brief(~without_brief(~motion.contacts, brief), brief)
    frame = np.clip(np.round(series.time * motion.fps).astype(int), 0, len(contacts) - 1)
    pendulum = series.com[:, 2]
    landings = sorted(
        (first / motion.fps, side, after / motion.fps if after < len(contacts) else np.nan)
        for side in (0, 1)
        for first, after in stances(contacts[:, side])
        if first >= max(brief, 1)  # a gap at the beginning may be brief too
    )
    steps = []
    for begin, side, end in landings:
        at = [float(np.interp(begin, series.time, margin[:, side, k])) for k in range(3)]
        standing = (series.time >= begin) & ~(series.time > end)
        steps.append(
            StepMargin(
                side=SIDES[side],
                touchdown_s=float(begin),
                next_touchdown_s=next((float(t) for t, other, _ in landings if t > begin and other != side), np.nan),
                liftoff_s=float(end),
                ml_m=at[0],
                ml_least_m=min([at[0], *margin[standing, side, 0].tolist()]),
                front_m=at[1],
                back_m=at[2],
                pendulum_m=float(np.interp(begin, series.time, pendulum)),
            )
        )
    return Margins(tuple(steps), series.time, margin, contacts[frame], pendulum)


def step_margin_summary(steps: Sequence[StepMargin]) -> dict[str, float]:
    """Means at touch-down by name (`STEP_MARGIN_KEYS`) [mm]; NaN where a foot never lands."""
    return {
        f"step_margin_{direction}_{side}_mm": 1e3
        * mean(np.array([getattr(one, f"{direction}_m") for one in steps if one.side == side]))
        for direction in DIRECTIONS
        for side in SIDES
    }


def normalised_curves(margins: Margins, cycle: bool = False) -> dict[str, FloatArray]:
    """Margins over 0 to 100 % of each whole step or gait cycle: (101,) by name, such as `left_1_ml_m`.

    The base of support of a curve is the foot that landed at 0 %; it is NaN while that foot is in the air.

    Args:
        margins: from `step_margins`.
        cycle: to the next touch-down of the same foot, instead of the other's.
    """
    curves: dict[str, FloatArray] = {}
    for side, name in enumerate(SIDES):
        own = [one for one in margins.steps if one.side == name]
        for number, one in enumerate(own):
            following = own[number + 1].touchdown_s if number + 1 < len(own) else np.nan
            end = following if cycle else one.next_touchdown_s
            if not end <= margins.time[-1] or (not cycle and following < end):  # not whole, or a hop on one foot
                continue
            at = np.linspace(one.touchdown_s, end, NODES)
            stands = ~(at > one.liftoff_s)
            for k, direction in enumerate(DIRECTIONS):
                values = np.interp(at, margins.time, margins.margin[:, side, k])
                curves[f"{name}_{number + 1}_{direction}_m"] = np.where(stands, values, np.nan)
    return curves


def definitions(motion: Motion) -> dict[str, str]:
    """What the numbers are, to be printed with them."""
    body = motion.character
    mass = float(body.model.body_mass.sum())
    return {
        "com_model": f"whole body of {body.name}: {len(body.segments)} rigid segments, {mass:.1f} kg",
        "xcom": "COM + velocity / omega0, omega0 = sqrt(g / l), g = 9.81 m/s^2 (Hof et al. 2005)",
        "pendulum_length": "l: height of the COM above the floor in that frame, at least 0.2 m",
        "base_of_support": "points of the sole of the foot that landed last, all of them, on the floor",
        "sign": "positive: the XcoM lies inside that edge (ml: medial of the outer edge, front: behind the foremost, back: ahead of the rearmost)",
        "event": "touch-down: first frame in which the foot bears load after it was in the air; contacts and gaps under 0.06 s left out",
        "axes": "pelvis heading, averaged over 1.2 s; not the direction of travel",
        "filter": "velocity: Gaussian of 20 ms; positions as they are",
    }
