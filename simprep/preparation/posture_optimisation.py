"""Posture optimisation: the upper body moves so that the COM comes over its support (paper, section 5.3, Eq. 6-10)."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import FloatArray, IntArray
from simprep.character import Character
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.preparation.com_path import displacement_path, displacement_repair
from simprep.preparation.posture_problem import PostureProblem
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings

_REPAIRS = 3
_REPAIRED_M = 1e-6
_REPAIR_S = 0.03  # time constant of the repairs


@dataclass(frozen=True)
class OptimisedPostures:
    """Result of `optimise_postures`.

    Attributes:
        qpos: (T, nq).
        before: (T, 4) costs C_b, C_s, C_m, C of the blended posture after the optimised ones of the two frames before; NaN
            where the optimisation was skipped.
        after: (T, 4) costs of the result.
        steps: (T,) descent steps taken.
        goals: (T, 2) where C_b wanted the COM on the floor [m]; NaN where it was left out.
    """

    qpos: FloatArray
    before: FloatArray
    after: FloatArray
    steps: IntArray
    goals: FloatArray


def optimise_postures(
    qpos: FloatArray,
    blended: Kinematics,
    centres: FloatArray,
    share: FloatArray,
    fps: float,
    character: Character,
    settings: PreparationSettings = DEFAULT_SETTINGS,
    measure: bool = True,
    goals: FloatArray | None = None,
) -> OptimisedPostures:
    """Optimise the balancing joints frame by frame; root and all others stay exactly as they are.

    Each descent starts from the blended posture, or from it plus the change of the previous frame where that costs less.
    With `support_smoothing` above 0, C_b draws the COM along a smooth path (`com_path`), and where smoothing the postures
    has led the COM farther from the support centre, it is put back. With 0, C_b draws it to the support centre.

    Args:
        qpos: (T, nq) blended postures.
        blended: their kinematics.
        centres: (T, 2) support centres [m]; NaN in flight, where C_b is left out with `support_smoothing` 0.
        share: (T,) how much of the change is used, 0 (skipped) to 1.
        fps: frames per second [1/s].
        character: whose poses they are; its `balancing` joints move.
        settings: weights and step limit.
        measure: whether to give the costs before and after; NaN otherwise.
        goals: (T, 2) where C_b wants the COM instead [m]; NaN leaves it out.
    """
    given, com = goals is not None, blended.com[:, :2]
    if goals is None:
        goals = centres
    if not given and settings.support_smoothing > 0:
        goals = com + displacement_path(centres - com, settings.com_reach, settings.support_smoothing * fps)
    problem = PostureProblem(character, settings)
    n = len(qpos)
    change = np.zeros((n, len(problem.columns)))
    steps = np.zeros(n, dtype=np.int64)
    before_last, last = (blended.xipos[np.maximum(np.arange(n) - back, 0)] for back in (2, 1))
    # where the optimisation begins, its history is the blended motion
    frames = problem.frames(qpos, blended.xipos, goals, 2 * last - before_last, 1 + int(share[0] > 0))
    active, going_on = np.flatnonzero(share > 0).tolist(), (share > 0).tolist()
    optimised = blended.xipos.take(problem.moved, axis=1)
    for t in active:
        posture = frames[t]
        if t > 1 and going_on[t - 1]:
            posture = posture.after(optimised[t - 2], optimised[t - 1])
        warm = [posture.hinges + change[t - 1]] if t > 0 else []
        best, steps[t] = problem.minimise(posture, posture.hinges, *warm)
        change[t] = best - posture.hinges
        optimised[t] = problem.moved_centres(posture, best)
    if settings.change_smoothing > 0:
        change = gaussian_filter1d(change, settings.change_smoothing * fps, axis=0, mode="nearest")
    out = qpos.copy()
    hinges = out[:, problem.columns]
    moved = np.clip(hinges + share[:, None] * change, problem.low, problem.high)
    out[:, problem.columns] = np.where(share[:, None] > 0, moved, hinges)
    if not given and settings.support_smoothing > 0:
        _repair(problem, out, com, centres, share, fps)

    before, after = np.full((n, 4), np.nan), np.full((n, 4), np.nan)
    if measure:
        final = forward_kinematics(out, character).xipos.take(problem.moved, axis=1)
        used = [frames[t].after(final[t - 2], final[t - 1]) if t > 1 and going_on[t - 1] else frames[t] for t in active]
        for costs, poses, moved in ((before, qpos, blended.xipos.take(problem.moved, axis=1)), (after, out, final)):
            costs[active] = problem.costs_of_all(used, poses[active][:, problem.columns], moved[active])
    return OptimisedPostures(out, before, after, steps, goals)


def _repair(
    problem: PostureProblem, qpos: FloatArray, com: FloatArray, centres: FloatArray, share: FloatArray, fps: float
) -> None:
    """Change postures in place, as little as needed, so that the COM is nearer to the support centre than `com`."""
    pull = centres - com
    moved = np.zeros_like(com)
    changed = np.flatnonzero(share > 0).tolist()
    for _ in range(_REPAIRS):
        for frame in changed:
            moved[frame] = problem.com_of(qpos[frame]) - com[frame]
        push = displacement_repair(moved, pull, share, _REPAIR_S * fps)
        changed = np.flatnonzero(np.abs(push).max(axis=1) > _REPAIRED_M).tolist()
        for frame in changed:
            jacobian = problem.com_jacobian(qpos[frame])
            change = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T, push[frame])
            hinges = qpos[frame, problem.columns]
            qpos[frame, problem.columns] = np.clip(hinges + change, problem.low, problem.high)
        if not changed:
            return
