"""Can the body follow the motion: `mpc` tracks it with the joint motors alone, within the character's own limits."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from simprep.check.finding import FAIL, WARN, Finding, graded
from simprep.check.mend import in_range
from simprep.metrics.evaluate import evaluate_run
from simprep.motion.edit import repeat
from simprep.motion.motion import Motion
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.run import DONE, Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track

MPJPE_WARN_MM = 100.0
"""Mean error of the pose from which the body does something else than the motion."""
LOOP_S = 6.0
CHECK = "followed by mpc"


@dataclass(frozen=True)
class Followed:
    """How a simulated body followed a motion.

    Attributes:
        finding: the verdict.
        run: the simulation.
        replay: what physics made of the motion, at its frame rate, with joints set back to the end of their range where
            they gave way at it; None if the body fell.
        changes: what was set back so, one line; or none.
    """

    finding: Finding
    run: Run
    replay: Motion | None
    changes: tuple[str, ...] = ()


def follow(
    motion: Motion, seed: int = 0, preset: str = "default", progress: Callable[[float], None] | None = None
) -> Followed:
    """Track a motion with `mpc` and judge the result.

    Args:
        motion: of at least two frames; a loop is followed for `LOOP_S` at least.
        seed: of the controller.
        preset: how much it computes, of `MPC_PRESETS`.
        progress: told the share that is done.

    Raises:
        SimprepError: the motion or the character cannot be simulated.
    """
    if motion.loop:
        motion = replace(repeat(motion, max(1, math.ceil(LOOP_S / motion.duration))), loop=False)
    run = track(motion, "mpc", seed, SimulationSettings(mpc=MPC_PRESETS[preset]), progress)
    metrics = evaluate_run(run)
    mpjpe = metrics["mpjpe_mm"]
    frame = min(len(motion) - 1, round(run.end_s * motion.fps))
    value = mpjpe if isinstance(mpjpe, float) else math.nan
    if run.end != DONE:
        finding = Finding(
            CHECK, FAIL, value if math.isfinite(value) else None, "mm", MPJPE_WARN_MM, None, frame, "",
            f"{run.end} at {run.end_s:.2f} of {motion.duration:.2f} s: {run.end_reason}",
        )  # fmt: skip
        return Followed(finding, run, None)
    note = (
        f"mean error of the pose over {run.end_s:.1f} s; "
        f"{100 * float(metrics['saturation_share'] or 0):.1f} % of the torques at their limit"
    )
    finding = graded(CHECK, value, "mm", MPJPE_WARN_MM, None, None, "", note)
    if not metrics["success"]:  # it strays from its place, and does what it should
        note = f"{note}; strays: {float(metrics['max_body_distance_mm'] or 0) / 1e3:.2f} m from the motion at most"
        finding = replace(finding, verdict=WARN, note=note)
    replay = run.simulated_motion().resample(motion.fps)
    qpos, changes = in_range(replay.qpos, motion.character)  # stops of joints are soft in a simulation
    replay = replace(replay, qpos=qpos, name=f"{motion.name}_replay", source=f"simulated: {motion.source}")
    return Followed(finding, run, replay, tuple(changes))
