"""All metrics of a motion or a run in one flat mapping: units in the names, ready for JSON, None where undefined."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.metrics.balance import (
    Balance,
    balance,
    centre_of_pressure_to_edge,
    mean,
    plausibility_summary,
    posture_summary,
)
from simprep.metrics.contact import FootSlip, floor_penetration, foot_slip, slip_ratio
from simprep.metrics.margins import STEP_MARGIN_KEYS, step_margin_summary, step_margins
from simprep.metrics.metric import Metric, Metrics, collect
from simprep.metrics.tracking import (
    body_positions,
    derivative_errors,
    effort,
    peak_speed_share,
    position_errors,
    succeeded,
)
from simprep.metrics.transition import TRANSITION_KEYS, transition_peaks
from simprep.motion.motion import Motion
from simprep.physics.run import DIVERGED, Run

SHORTEST_S = 0.1
"""Shorter runs have no metrics but their end: derivatives would be extrapolation."""

PREPARED_KEYS = ("com_cos_mm", "com_inside_share", "com_to_edge_mm", "margin_of_stability_mm")


def evaluate_motion(
    motion: Motion,
    launch_s: float | None = None,
    prepared_s: tuple[float, float] | None = None,
    own: Mapping[str, Metric[Motion]] | None = None,
) -> Metrics:
    """Metrics of a kinematic motion by name, the same names for every motion; None where one does not exist.

    Args:
        motion: at least 0.1 s long, with its contacts.
        launch_s: launch of the target from the first frame [s]; None: its event `launch`, else no transition metrics.
        prepared_s: from and to [s]: balance of this span is also given, as `prepared_...`; None: from the event
            `rise` to `launch`, if it has both.
        own: metrics of your own by name (`simprep.Metric`); they come after ours.

    Raises:
        SettingError: an own metric has the name of one of ours, or gives no single value.
    """
    if motion.duration < SHORTEST_S or len(motion) < 3:
        return collect(dict.fromkeys(MOTION_KEYS), own, None)
    launch_s, prepared_s = _launch(motion, launch_s), _prepared(motion, prepared_s)
    series = balance(motion)
    slip = foot_slip(motion)
    depth = floor_penetration(motion)
    numbers = {
        "duration_s": motion.duration,
        **_posture(series, prepared_s),
        **step_margin_summary(step_margins(motion, series).steps),
        **plausibility_summary(series),
        **transition_peaks(motion.qpos[:, 7:], motion.fps, math.nan if launch_s is None else launch_s),
        **_contact(slip, depth),
    }
    return collect(numbers, own, motion)


def evaluate_run(
    run: Run,
    launch_s: float | None = None,
    prepared_s: tuple[float, float] | None = None,
    own: Mapping[str, Metric[Run]] | None = None,
) -> Metrics:
    """Metrics of a simulated run by name, as `track --json` prints them; None where one does not exist.

    A run that fell is measured over what it completed: read `success` (`simprep.metrics.tracking.succeeded`),
    `completed_share` and `survived_s` first. A run that diverged or ended within 0.1 s has no numbers at all. `s_per_s`
    is computing time per simulated second, `assist_n` and `assist_nm` the largest external force and torque,
    `penetration_mm` the deepest of any step, `foot_slip_ratio` that of `simprep.metrics.contact.slip_ratio`.

    Args:
        run: what the simulation returned.
        launch_s: launch of the target from the start [s]; None: the reference's event `launch`, else no such metrics.
        prepared_s: from and to [s]: balance of this span is also given, as `prepared_...`, if the run reaches its end;
            None: from the reference's event `rise` to `launch`.
        own: metrics of your own by name (`simprep.Metric`); they come after ours.

    Raises:
        SettingError: an own metric has the name of one of ours, or gives no single value.
    """
    result: dict[str, object] = dict.fromkeys(RUN_KEYS)
    result |= {
        "success": False,
        "end": run.end,
        "fell_at_s": run.fell_at_s,
        "survived_s": float(run.end_s),
        "completed_share": run.completed_share,
        "s_per_s": run.wall_s / run.end_s if run.end_s > 0 else None,
        "assist_n": run.assist.force_n,
        "assist_nm": run.assist.torque_nm,
    }
    if run.end == DIVERGED or len(run.torque) * run.timestep < SHORTEST_S or not np.isfinite(run.qpos).all():
        return collect(result, own, None)
    launch_s, prepared_s = _launch(run.reference, launch_s), _prepared(run.reference, prepared_s)
    motion = run.simulated_motion()
    series = balance(motion)
    simulated, reference, rate = body_positions(run)
    errors = position_errors(simulated, reference)
    reference_motion = _reference_motion(run, motion)
    slip, reference_slip = foot_slip(motion), foot_slip(reference_motion)
    pressure = centre_of_pressure_to_edge(series, run.time[:-1] - run.time[0], run.centre_of_pressure)
    result |= {
        "success": succeeded(run, errors["max_body_distance_mm"]),
        **errors,
        **derivative_errors(simulated, reference, rate),
        **_posture(series, prepared_s),
        **step_margin_summary(step_margins(motion, series).steps),
        "cop_to_edge_mm": 1e3 * mean(pressure[np.isfinite(pressure)]),
        "peak_speed_share": peak_speed_share(run),
        **effort(run.torque, run.torque_limit, run.qvel[:, 6:], run.timestep),
        **transition_peaks(
            run.qpos[:, 7:], motion.fps, math.nan if launch_s is None else launch_s, run.torque, run.torque_limit
        ),
        **_contact(slip, run.penetration),
        "foot_slip_reference_mm_per_stance": reference_slip.mm_per_stance,
        "foot_slip_ratio": slip_ratio(slip, reference_slip),
    }
    return collect(result, own, run)


def _contact(slip: FootSlip, depth: FloatArray) -> dict[str, float]:
    return {
        "foot_slip_mm_per_stance": slip.mm_per_stance,
        "foot_slip_m_s": slip.contact_m_per_s,
        "penetration_mm": 1e3 * float(depth.max()),
        "penetration_mean_mm": 1e3 * float(depth.mean()),
    }


def _reference_motion(run: Run, simulated: Motion) -> Motion:
    # the reference at the simulation's instants; its contacts are those of its nearest frames
    source = run.reference
    frame = np.round((run.time - run.time[0]) * source.fps).astype(int)
    frame = frame % len(source) if source.loop else np.clip(frame, 0, len(source) - 1)
    return replace(simulated, qpos=run.reference_qpos, contacts=source.contacts[frame], name=source.name)


def _posture(series: Balance, prepared_s: tuple[float, float] | None) -> dict[str, float]:
    result = posture_summary(series)
    inside: BoolArray = np.zeros(len(series.time), dtype=bool)
    if prepared_s is not None and series.time[-1] >= prepared_s[1] - 1e-9:
        inside = (series.time >= prepared_s[0] - 1e-9) & (series.time <= prepared_s[1] + 1e-9)
    part = posture_summary(series, inside)
    return result | {f"prepared_{key}": part[key] for key in PREPARED_KEYS}


def _launch(motion: Motion, launch_s: float | None) -> float | None:
    if launch_s is None and "launch" in motion.events:
        return motion.events["launch"] / motion.fps
    return launch_s


def _prepared(motion: Motion, prepared_s: tuple[float, float] | None) -> tuple[float, float] | None:
    if prepared_s is None and {"rise", "launch"} <= set(motion.events):
        return motion.events["rise"] / motion.fps, motion.events["launch"] / motion.fps
    return prepared_s


_POSTURE_KEYS = (
    "com_cos_mm", "com_inside_share", "com_to_edge_mm", "margin_of_stability_mm", "margin_of_stability_p5_mm",
    "unsupported_share", *(f"prepared_{key}" for key in PREPARED_KEYS), *STEP_MARGIN_KEYS,
)  # fmt: skip
_CONTACT_KEYS = ("foot_slip_mm_per_stance", "foot_slip_m_s", "penetration_mm", "penetration_mean_mm")

MOTION_KEYS = (
    "duration_s", *_POSTURE_KEYS,
    "zmp_to_edge_mm", "zmp_inside_share",
    "residual_force_n", "residual_force_p95_n", "residual_torque_nm", "residual_torque_p95_nm",
    *TRANSITION_KEYS, *_CONTACT_KEYS,
)  # fmt: skip
"""Names of `evaluate_motion`'s numbers."""

RUN_KEYS = (
    "success", "end", "fell_at_s", "survived_s", "completed_share", "g_mpjpe_mm", "mpjpe_mm", "max_body_distance_mm",
    "velocity_error_m_s", "acceleration_error_m_s2", *_POSTURE_KEYS, "cop_to_edge_mm",
    "peak_speed_share", "torque_rms_nm", "torque_rms_share", "saturation_share", "positive_work_j", "absolute_work_j",
    *TRANSITION_KEYS, *_CONTACT_KEYS, "foot_slip_reference_mm_per_stance", "foot_slip_ratio",
    "s_per_s", "assist_n", "assist_nm",
)  # fmt: skip
"""Names of `evaluate_run`'s numbers."""
