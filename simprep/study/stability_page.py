"""The report of `simprep stability`: of each measure the hardest dose survived beside the mildest that was not."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from simprep.physics.pushes import Push
from simprep.report.page import Page, Picture
from simprep.report.replay.actor import Replay
from simprep.study.doses import LAUNCH, STANCE, StabilitySettings
from simprep.study.limit_replay import limit_replay
from simprep.study.limit_runs import LimitRuns
from simprep.study.push_limits import BEFORE_S
from simprep.study.stability import MeasureLimits, Stability, number_of
from simprep.study.stability_results import stability_table

_DOSES = {
    "friction": "friction {:.3g}", "strength": "{:.0%} of the motors' strength", "noise": "{:.3g} times the noise",
    "horizon": "{:.3g} s of look-ahead", "samples": "{:.0f} samples",
}  # fmt: skip
_SAID = {
    LAUNCH: "pushes of {:.0f} N at the launch", STANCE: "pushes of {:.0f} N in mid-stance",
    "friction": "friction down to {:.3g}", "strength": "motors down to {:.0%} of their strength",
    "noise": "{:.3g} times the sensors' noise", "horizon": "a look-ahead of no more than {:.3g} s", "samples": "as few as {:.0f} samples",
}  # fmt: skip


def stability_page(
    title: str,
    result: Stability,
    settings: StabilitySettings,
    runs: LimitRuns,
    files: Sequence[Path],
    details: Mapping[str, Any],
    warnings: Sequence[str] = (),
) -> Page:
    """A result of `simprep.study.stability.stability`.

    Args:
        title: of what motion, with which controller.
        result: what came out.
        settings: what was tried.
        runs: the runs at the limits.
        files: what was drawn; all of it is shown.
        details: how it was made.
        warnings: what was said about it.
    """
    replays = [_replay(one, settings, runs) for one in result.measured]
    return Page(
        title=title,
        headline=stability_headline(result),
        replays=[replay for replay in replays if replay is not None],
        tables=[stability_table(result)],
        pictures=[Picture("what is survived", path) for path in files if path.suffix == ".png"],
        details={**details, "runs": result.runs, "largest force [N]": f"{result.assist_n:.0f}"},
        warnings=warnings,
    )


def stability_headline(result: Stability) -> str:
    """The limits in a sentence."""
    if not result.measured:
        return "Nothing was measured."
    seeds = max(len(one.seeds) for one in result.measured)
    words = [_SAID[one.name].format(_weakest(one)[0]) for one in result.measured]
    pushed = any(one.directions_deg for one in result.measured)
    note = ", pushes in the weakest direction" if pushed else ""
    undisturbed = " Without any disturbance it is not always completed either." if result.falls_undisturbed else ""
    return f"It survives {', '.join(words)} (median of {seeds} seed{'s' * (seeds > 1)}{note}).{undisturbed}"


def _weakest(one: MeasureLimits) -> tuple[float, float | None]:
    """The limit, and of pushes the direction in which it is least [degrees]."""
    medians = [float(np.median([number_of(limit) for limit in row])) for row in one.limits]
    if not one.directions_deg:
        return medians[0], None
    least = int(np.argmin(medians))
    return medians[least], one.directions_deg[least]


def _replay(one: MeasureLimits, settings: StabilitySettings, runs: LimitRuns) -> Replay | None:
    _, direction = _weakest(one)
    name, search = one.name.replace("_", " "), (one.name, direction)
    if direction is None or one.at_s is None:
        return limit_replay(name, search, runs, _DOSES[one.name])
    push = Push(settings.segment, min(BEFORE_S, one.at_s), settings.duration_s, (0.0, 0.0, 0.0))
    return limit_replay(f"{name}, {direction:g}°", search, runs, "{:.0f} N", push)
