"""Posture optimisation of the fighters (2013 paper, section 5.3): trunk and arms bring the COM over the feet.

Every frame counts as prepared. Root and legs stay as they are, and with them footwork and kicks; punching fists are
brought back to where they were, as far as the arm reaches.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.character import SIDES
from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.labels.labels import ATTACKING_QUALIFIERS, PUNCHES, Label
from simprep.motion.curves import smooth_step
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.support import support_centre, support_points
from simprep.preparation.posture_optimisation import optimise_postures
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings

FADE_S = 0.15
"""Time over which a fist is brought back to its path before the punch, and let go after it [s]."""
_STEPS = 8
_DAMPING = 1e-4  # [m^2]: keeps nearly straight arms from flailing
_EXACT_M = 5e-4


@dataclass(frozen=True)
class PostureChange:
    """What the optimisation did to one fighter.

    Attributes:
        com_cos_before_mm: mean distance of the COM from the centre of support, over the frames with support [mm].
        com_cos_after_mm: the same afterwards [mm].
        hand_mm: mean displacement of the fists [mm].
        striking_hand_mm: the same of the punching fist during punches [mm]; NaN without punches.
        striking_hand_max_mm: largest of these [mm]; NaN without punches.
        root_and_legs_rad: largest change of a coordinate of root or legs: 0 [m or rad].
    """

    com_cos_before_mm: float
    com_cos_after_mm: float
    hand_mm: float
    striking_hand_mm: float
    striking_hand_max_mm: float
    root_and_legs_rad: float


def optimise_fight_posture(
    fight: Fight, settings: PreparationSettings = DEFAULT_SETTINGS
) -> tuple[Fight, tuple[PostureChange, ...]]:
    """The fight with posture optimised in every frame, and what changed in each fighter."""
    optimised = [
        _optimise(motion, punching(fight, player), settings) for player, motion in enumerate(fight.stream.players)
    ]
    stream = replace(fight.stream, players=tuple(motion for motion, _ in optimised))
    changes = tuple(change for _, change in optimised)
    return replace(fight, stream=stream, record={**fight.record, "posture_optimised": True}), changes


def punching(fight: Fight, player: int) -> FloatArray:
    """How far each fist (T, 2) punches: 1 during the player's attacks with it, smoothly 0 before and after."""
    return punching_at(np.arange(len(fight.stream)), fight.of(player), fight.stream.fps)


def punching_at(frames: IntArray, actions: Sequence[FightAction], fps: float) -> FloatArray:
    """As `punching`, at some frames, by the actions of one player."""
    fade = max(1.0, FADE_S * fps)
    weight = np.zeros((len(frames), len(PUNCHES)))
    for action in actions:
        label = Label.from_code(action.label)
        for hand, aspect in enumerate(PUNCHES):
            if getattr(label, aspect) in ATTACKING_QUALIFIERS[aspect]:
                outside = np.maximum(action.start - frames, frames - (action.end - 1)).clip(0)
                ramp = np.clip(1 - outside / fade, 0, 1)
                weight[:, hand] = np.maximum(weight[:, hand], smooth_step(ramp))
    return weight


def posture_of_piece(motion: Motion, weight: FloatArray, before: int) -> FloatArray:
    """Poses (F - before, nq) of a piece of a fight with its posture optimised.

    Args:
        motion: F frames, of which the first `before` only lead to the piece.
        weight: (F, 2) how far each fist punches (`punching_at`).
        before: number of frames that lead to it.
    """
    return _optimise(motion, weight, DEFAULT_SETTINGS)[0].qpos[before:]


def posture_change(before: Motion, after: Motion, weight: FloatArray) -> PostureChange:
    """What was changed in one fighter, of motions before and after and how far each fist (T, 2) punches."""
    first, second = (forward_kinematics(one.qpos, one.character) for one in (before, after))
    centre = support_centre(*support_points(first.foot_points, before.contacts))
    supported = np.isfinite(centre[:, 0])
    hands = [before.character.segment(f"{side}_hand") for side in SIDES]
    moved = np.linalg.norm(second.xipos[:, hands] - first.xipos[:, hands], axis=-1)
    lean = [np.linalg.norm((one.com[:, :2] - centre)[supported], axis=1) for one in (first, second)]
    striking = moved[weight == 1]
    legs = np.r_[0:7, 7 + before.character.lower_joints]
    return PostureChange(
        com_cos_before_mm=1e3 * _mean(lean[0]),
        com_cos_after_mm=1e3 * _mean(lean[1]),
        hand_mm=1e3 * float(moved.mean()),
        striking_hand_mm=1e3 * _mean(striking),
        striking_hand_max_mm=1e3 * float(striking.max()) if len(striking) else np.nan,
        root_and_legs_rad=float(np.abs(after.qpos - before.qpos)[:, legs].max()),
    )


def _optimise(motion: Motion, weight: FloatArray, settings: PreparationSettings) -> tuple[Motion, PostureChange]:
    before = forward_kinematics(motion.qpos, motion.character)
    centre = support_centre(*support_points(before.foot_points, motion.contacts))
    found = optimise_postures(
        motion.qpos, before, centre, np.ones(len(motion)), motion.fps, motion.character, settings, measure=False
    )
    hands = [motion.character.segment(f"{side}_hand") for side in SIDES]
    fists = before.xipos[:, hands]
    after = replace(motion, qpos=_reach(motion, found.qpos, fists, weight))
    return after, posture_change(motion, after, weight)


def _reach(motion: Motion, qpos: FloatArray, fists: FloatArray, weight: FloatArray) -> FloatArray:
    """Bring hands (T, 2, 3) back, weighed (T, 2), by damped least squares in the arm (Buss 2004, section 5).

    Joints that a planner may leave out (`fused`: wrist and forearm) stay.
    """
    character = motion.character
    model = character.model
    data = mujoco.MjData(model)
    out = qpos.copy()
    jacobian = np.zeros((3, model.nv))
    for hand, side in enumerate(SIDES):
        body = 1 + character.segment(f"{side}_hand")
        joints = [model.joint(name) for name in character.group(f"{side}_arm") if name not in character.fused]
        at = np.array([joint.qposadr[0] for joint in joints])
        dof = np.array([joint.dofadr[0] for joint in joints])
        low, high = model.jnt_range[[joint.id for joint in joints]].T
        for frame in np.flatnonzero(weight[:, hand] > 0):
            data.qpos[:] = out[frame]
            mujoco.mj_kinematics(model, data)
            goal = data.xipos[body] + weight[frame, hand] * (fists[frame, hand] - data.xipos[body])
            for _ in range(_STEPS):
                missing = goal - data.xipos[body]
                if np.linalg.norm(missing) < _EXACT_M:
                    break
                mujoco.mj_comPos(model, data)
                mujoco.mj_jacBodyCom(model, data, jacobian, None, body)
                part = jacobian[:, dof]
                step = part.T @ np.linalg.solve(part @ part.T + _DAMPING * np.eye(3), missing)
                data.qpos[at] = np.clip(data.qpos[at] + step, low, high)
                mujoco.mj_kinematics(model, data)
            out[frame] = data.qpos
    return out


def _mean(values: FloatArray) -> float:
    return float(values.mean()) if len(values) else np.nan
