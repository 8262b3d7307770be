"""Where the feet of a fighter stand and step, how they roll and pivot, and where the pressure is."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.duel.synthetic.kinds import SIDES, context_of
from simprep.duel.synthetic.pieces import PITCH, PIVOT
from simprep.duel.synthetic.planned import FPS, Fighter, Planned
from simprep.humanoid_model import GRAVITY
from simprep.library.parts.feet import FootPath, Stance, ankle_height
from simprep.library.parts.limbs import SIGNS
from simprep.motion.contacts import stances

CLEARANCE_M, KICK_CLEARANCE_M, TUCK_M = 0.045, 0.28, 0.03
"""Height of the ankle above its stance in the middle of a step, and of a kick's way up and down; how far legs fold in a
flight [m]."""
STRIKING_SHARE = 0.62
"""Load on the front foot at the end of a punch (60 %, Dinu & Louis 2020)."""
BRIEF_S = 0.1
"""While both feet stand for longer than this, both bear the load [s]."""
HEEL_MOST = np.radians(8.0)
"""A supporting foot never rolls farther over the heel."""


@dataclass
class Stay:
    """A foot on the floor.

    Attributes:
        start: touch-down [s].
        end: lift-off [s].
        place: (2,) [m].
        toes: direction, world [rad].
        kick: the foot kicks after it.
        flies: the body flies after it.
    """

    start: float
    end: float
    place: FloatArray
    toes: float
    kick: bool = False
    flies: bool = False


def stays_of(fighter: Fighter, actions: list[Planned]) -> list[list[Stay]]:
    """Stays of a fighter's left and right foot during a clip's actions."""
    out: list[list[Stay]] = []
    total = actions[-1].end / FPS
    for foot in range(2):
        place, toes = fighter.initial_feet[foot], fighter.initial_toes[foot]
        stays = [Stay(-1.0, total + 9.0, place, toes)]
        in_air = False
        for action in actions:
            length = (action.end - action.start) / FPS
            start = action.start / FPS
            for step in action.steps:
                if step.foot != foot:
                    continue
                if step.lift >= 0:
                    lift = start + step.lift * length
                    if action.flight:
                        # both feet are off the floor when the flight begins; the leading leg a little earlier
                        off = action.end / FPS - 0.5 * action.flight
                        lift = off - 0.09 if step.lift > 0 else off
                    side = SIDES[foot]
                    stays[-1].end = lift
                    stays[-1].kick = action.kind.endswith("_up") and action.kind.startswith(side) and step.land > 1
                    stays[-1].flies = action.flight > 0
                    in_air = True
                if step.land <= 1 and in_air:
                    land = start + step.land * length
                    if step.land <= 0:
                        land = start + 0.5 * _flight_before(actions, action)
                    elif action.kind.endswith("jump_down"):
                        land = max(land, start + 0.5 * _flight_before(actions, action) + 0.08)
                    stays.append(Stay(land, total + 9.0, step.place, step.toes))
                    in_air = False
        if in_air:
            last = stays[-1]
            stays.append(Stay(total + 0.35, total + 9.0, last.place, last.toes))
        out.append(stays)
    return out


def _flight_before(actions: list[Planned], action: Planned) -> float:
    number = actions.index(action)
    return actions[number - 1].flight if number else 0.0


def foot_path(side: int, stays: list[Stay], channels: FloatArray, flights: FloatArray, cuts: IntArray) -> FootPath:
    """Path of one foot.

    Args:
        side: 0 left, 1 right.
        stays: of this foot.
        channels: (T, channels) postures, for roll and pivot.
        flights: (N + 1,) how long the body flies around each cut [s].
        cuts: (N + 1,) frames.
    """
    name = SIDES[side]
    frames = np.arange(len(channels))
    pitch = make_interp_spline(frames / FPS, np.minimum(channels[:, PITCH + side], HEEL_MOST), k=3)
    pivot = make_interp_spline(frames / FPS, channels[:, PIVOT + side], k=3)
    last = frames[-1] / FPS
    via = []
    for before, after in pairwise(stays):
        middle = 0.5 * (before.end + after.start)
        lift = KICK_CLEARANCE_M if before.kick else CLEARANCE_M
        if before.flies:
            flight = float(flights[int(np.argmin(np.abs(cuts / FPS - middle)))])
            lift = TUCK_M + GRAVITY * flight**2 / 8
        via.append((middle, 2, ankle_height() + lift))
    return FootPath(
        name,
        tuple(Stance(s.start, s.end, float(s.place[0]), float(s.place[1]), SIGNS[name] * s.toes) for s in stays),
        pitch=lambda at: np.asarray(pitch(np.clip(at, 0.0, last))),
        pivot=lambda at: np.asarray(pivot(np.clip(at, 0.0, last))),
        via=tuple(via),
    )


def pressure_point(
    actions: Sequence[Planned], lead: str, position: FloatArray, rotation: FloatArray, contacts: BoolArray
) -> FloatArray:
    """Planned pressure point (T, 2): under the foot that stands alone, else between both, forward in a punch [m].

    Args:
        actions: of a clip.
        lead: foot in front, left or right.
        position: (T, 2, 3) ankles [m].
        rotation: (T, 2, 3, 3) of the feet.
        contacts: (T, 2) supporting feet.
    """
    soles = (position + 0.06 * rotation[..., 0])[..., :2]  # (T, 2, 2)
    share = np.full(len(contacts), np.nan)  # of the left foot
    alone = contacts.sum(axis=1) == 1
    share[alone] = contacts[alone, 0]
    striking = STRIKING_SHARE if lead == "left" else 1 - STRIKING_SHARE
    punches = np.zeros(len(share), dtype=bool)
    for action in actions:
        if context_of(action.kind) == "punch" and not action.kind.endswith("fwdbwd"):
            punches[max(0, action.end - 6) : action.end + 7] = True
    for first, after in stances(np.asarray(contacts.all(axis=1))):
        if after - first > BRIEF_S * FPS:
            margin = round(min(0.5 * (after - first) - 1, 0.06 * FPS))
            share[first + margin : after - margin] = np.where(punches[first + margin : after - margin], striking, 0.5)
    share[[0, -1]] = np.where(np.isnan(share[[0, -1]]), 0.5, share[[0, -1]])
    known = np.flatnonzero(~np.isnan(share))
    share = np.interp(np.arange(len(share)), known, share[known])
    share = np.clip(np.asarray(gaussian_filter1d(share, 0.035 * FPS, mode="nearest")), 0.0, 1.0)[:, None]
    return np.asarray(share * soles[:, 0] + (1 - share) * soles[:, 1])
