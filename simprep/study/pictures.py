"""Pictures of a study: blending curves, balance margins, COM against support polygon, film strips."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from simprep.motion.motion import Motion
from simprep.report.film_strip import Row, StripSettings, save_film_strip
from simprep.report.gl import pictures_or_warning
from simprep.study.compare import WITH, WITHOUT
from simprep.study.plan import ARM_LABELS, Condition
from simprep.study.validate import Study, launch_s

MOMENTS = 4


def draw_study(study: Study, folder: Path, warn: Callable[[str], None]) -> list[Path]:
    """Draw every picture that can be drawn.

    Args:
        study: finished, or cut short.
        folder: where the PNG files go.
        warn: receives one line per kind of picture that cannot be drawn.
    """
    files: list[Path] = []
    with pictures_or_warning("no plots", warn):
        files.append(draw_blending_curves(folder))
        for target, alpha in drawn_targets(study):
            files += _draw_plots(study, target, alpha, folder)
    with pictures_or_warning("no film strips", warn):
        for target, alpha in drawn_targets(study):
            files += _draw_strips(study, target, alpha, folder)
    return files


def drawn_targets(study: Study) -> Iterator[tuple[str, float]]:
    """Targets with the highest level at which every arm was built."""
    plan = study.plan
    alpha = max(plan.alphas)
    for target in plan.targets:
        if all(Condition(target.name, alpha, arm) in study.conditions for arm in plan.arms):
            yield target.name, alpha


def _draw_plots(study: Study, target: str, alpha: float, folder: Path) -> list[Path]:
    from simprep.report.figures import plot_com_and_support, plot_margins, support_margin

    arms = {arm: Condition(target, alpha, arm) for arm in study.plan.arms}
    panels = {
        "motion before physics": {
            ARM_LABELS[arm]: support_margin(study.conditions[condition]) for arm, condition in arms.items()
        }
    }
    for controller in study.plan.controllers:
        lines = {
            ARM_LABELS[arm]: support_margin(simulated)
            for arm, condition in arms.items()
            for simulated, _ in simulated_of(study, condition, controller)
        }
        if lines:
            panels[f"simulated, {controller}"] = lines
    last = study.conditions[arms[study.plan.arms[-1]]]
    title = f"{study.plan.locomotion.name} to {target}, level of preparation {alpha:g}"
    files = [plot_margins(panels, folder / f"margin_{target}.png", title, launch_s(last))]
    if WITH in arms and WITHOUT in arms:
        motions = {ARM_LABELS[arm]: study.conditions[arms[arm]] for arm in (WITHOUT, WITH)}
        frames = _moments(motions[ARM_LABELS[WITH]])
        files.append(plot_com_and_support(motions, frames, folder / f"com_{target}.png", title))
    return files


def _draw_strips(study: Study, target: str, alpha: float, folder: Path) -> list[Path]:
    arms = {arm: Condition(target, alpha, arm) for arm in study.plan.arms}
    motions = {arm: study.conditions[condition] for arm, condition in arms.items()}
    last = motions[study.plan.arms[-1]]
    launch = launch_s(last)
    marks = {} if launch is None else {"launch": launch, **_later_events(last)}
    settings = StripSettings(times_s=_instants(last), marks=marks)
    files = [
        save_film_strip(
            [Row(ARM_LABELS[arm], motion) for arm, motion in motions.items()], folder / f"strip_{target}.png", settings
        )
    ]
    for controller in study.plan.controllers:
        rows = [
            Row(f"{ARM_LABELS[arm]}, simulated with {controller}", simulated, note)
            for arm, condition in arms.items()
            for simulated, note in simulated_of(study, condition, controller)
        ]
        if rows:
            files.append(save_film_strip(rows, folder / f"strip_{target}_{controller}.png", settings))
    return files


def draw_blending_curves(folder: Path) -> Path:
    """Draw the default blending curve, and the one that the paper prints, with the paper's constants, in a folder."""
    from simprep.preparation.blending import blending_weight
    from simprep.preparation.settings import DEFAULT_SETTINGS
    from simprep.report.figures import plot_blending_curves

    curves = {
        "described and shown (default)": partial(blending_weight, curve="described"),
        "formula as printed": partial(blending_weight, curve="printed"),
        "traditional": partial(blending_weight, curve="linear"),
    }
    constants = {"upper body": DEFAULT_SETTINGS.curvature_upper, "lower body": DEFAULT_SETTINGS.curvature_lower}
    return plot_blending_curves(curves, constants, folder / "blending_curves.png")


def _later_events(motion: Motion) -> dict[str, float]:
    """Name and time [s] of the events after the launch, such as the impact of a strike, in order."""
    launch = launch_s(motion)
    times = {name: frame / motion.fps for name, frame in motion.events.items()}
    later = {name: time for name, time in times.items() if launch is not None and launch < time < motion.duration}
    return dict(sorted(later.items(), key=lambda item: item[1]))


def _instants(motion: Motion) -> tuple[float, ...]:
    """Nine instants that show the launch and the events after it."""
    end, launch = motion.duration, launch_s(motion)
    if launch is None or not 0 < launch < end:
        return tuple(float(time) for time in np.linspace(0, end, 9))
    match list(_later_events(motion).values()):
        case []:
            after = [launch + share * (end - launch) for share in (0.25, 0.5, 0.75)]
        case [first]:
            after = [(launch + first) / 2, first, (first + end) / 2]
        case [first, *_, last]:
            after = [first, (first + last) / 2, last]
    return (*(float(time) for time in np.linspace(0, launch, 5)), *after, end)


def _moments(motion: Motion) -> list[int]:
    """Evenly spaced frames from the start to the launch, both left out."""
    end = motion.events.get("launch", len(motion) - 1)
    return [int(frame) for frame in np.linspace(0, end, MOMENTS + 2)[1:-1]]


def simulated_of(study: Study, condition: Condition, controller: str) -> list[tuple[Motion, str]]:
    """The simulated motion of a condition, and how it ended; nothing where none is kept."""
    for result in study.results:
        case, fell = result.case, result.metrics.get("fell_at_s")
        if case.condition == condition and case.controller == controller and result.simulated is not None:
            end = f"fell at {fell:.2f} s" if fell is not None else str(result.metrics.get("end", "ended"))
            return [(result.simulated, end)]
    return []
