"""What the study of posture optimisation runs: a full grid for fast controllers, and a smaller one for `mpc`."""

from collections.abc import Sequence

from simprep.study.plan import BEFORE_PHYSICS
from simprep.study.sweep.cases import SweepCase
from simprep.study.sweep.config import sweep_of

LOCOMOTIONS = ("walk", "walk_fast")
TARGETS = (
    "punch_left", "punch_right", "hook_left_head", "uppercut_right_body", "block_high_right", "kick_front", "kick_low_right",
    "roundhouse_left_body", "side_kick_right_low", "knee_right", "weave_left", "sway_back", "crawl", "duck", "jump", "jump_forward",
)  # fmt: skip
"""Sixteen, since Wilcoxon's test has one number of each: with twelve no p could outlast the correction by level and stature."""
ALPHAS = (0.5, 1.0)
STATURES_M = (1.6, 1.75, 1.9)
DISTURBANCES = ("nominal", "push", "low_friction", "weak_motors")
ARMS = ("none", "traditional", "blended", "optimised", "dynamic")
SLOW_ARMS = ("none", "blended", "optimised")
"""Those of `mpc`, whose cases cost about twenty times as much."""
SMALL = {
    "locomotions": LOCOMOTIONS[:1], "targets": ("punch_right", "kick_front"), "alphas": ALPHAS[1:],
    "disturbances": DISTURBANCES[:2], "statures": STATURES_M[1:],
}  # fmt: skip
"""The grid of `--small`: it proves that everything works, and nothing else."""


def study_cases(
    controllers: Sequence[str],
    seeds: int,
    preset: str,
    small: bool = False,
    statures: Sequence[float] = STATURES_M,
    arms: Sequence[str] = ARMS,
) -> list[SweepCase]:
    """Every case of the study.

    Args:
        controllers: names of tracking controllers; the motions themselves are measured as well.
        seeds: of random controllers.
        preset: of `mpc`.
        small: `SMALL` only.
        statures: of the bodies [m].
        arms: which of `ARMS`; `mpc` runs those of `SLOW_ARMS` among them.
    """
    chosen = SMALL if small else {}
    common = {
        "targets": list(chosen.get("targets", TARGETS)),
        "alphas": list(chosen.get("alphas", ALPHAS)),
        "disturbances": list(chosen.get("disturbances", DISTURBANCES)),
        "characters": [{"height_m": height} for height in chosen.get("statures", statures)],
        "seeds": seeds,
        "preset": preset,
    }
    locomotions = list(chosen.get("locomotions", LOCOMOTIONS))
    fast = [BEFORE_PHYSICS, *(name for name in controllers if name != "mpc")]
    grids = [sweep_of({**common, "locomotions": locomotions, "controllers": fast, "arms": list(arms)})]
    slow = [arm for arm in arms if arm in SLOW_ARMS]
    if "mpc" in controllers and slow:
        grids.append(sweep_of({**common, "locomotions": locomotions[:1], "controllers": ["mpc"], "arms": slow}))
    return [case for grid in grids for case in grid.cases()]
