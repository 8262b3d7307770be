"""Stability by dose as JSON and as a table."""

from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from simprep.study.doses import DOSES
from simprep.study.stability import MeasureLimits, Stability, number_of


def content_of(result: Stability) -> dict[str, Any]:
    """A result in JSON's types: the doses, and of each measure every seed's limit and the share that completed each level."""
    return {
        **result.doses(),
        "falls_undisturbed": result.falls_undisturbed,
        "left_out": dict(result.left_out),
        "runs": result.runs,
        "assist_n": result.assist_n,
        "measures": {one.name: _measure_content(one) for one in result.measured},
    }


def _measure_content(one: MeasureLimits) -> dict[str, Any]:
    unit = "_n" if one.directions_deg else "_s" if DOSES[one.name].key.endswith("_s") else ""
    limits = one.all_limits
    numbers = [[number_of(limit) for limit in row] for row in one.limits]
    content: dict[str, Any] = {
        "seeds": list(one.seeds),
        f"levels{unit}": list(limits[0].levels),
        "completed_share": np.mean([limit.completed for limit in limits], axis=0).tolist(),
        f"survived{unit}": [[limit.survived for limit in row] for row in one.limits],
        f"failed{unit}": [[limit.failed for limit in row] for row in one.limits],
        "monotone_share": float(np.mean([limit.monotone for limit in limits])),
        "never_failed_share": float(np.mean([limit.failed is None for limit in limits])),
    }
    for label, combine in (("median", np.median), ("low", np.min), ("high", np.max)):
        values = [float(combine(row)) for row in numbers]
        content[f"{label}{unit}"] = values if one.directions_deg else values[0]
    if one.directions_deg:
        content.update(directions_deg=list(one.directions_deg), at_s=one.at_s, watched_s=one.watched_s)
    return content


def stability_table(result: Stability) -> Table:
    """The limits for people: median over the seeds, least and largest, and the share of searches beyond whose first failure all failed."""
    table = Table()
    for heading in ("measure", "limit", "least to largest", "monotone", "never failed"):
        table.add_column(heading, justify="left" if heading == "measure" else "right")
    for one in result.measured:
        rows = zip(one.directions_deg or (None,), one.limits)
        for direction, limits in rows:
            label = DOSES[one.name].words if direction is None else f"{one.name}, {direction:g} degrees [N]"
            numbers = [number_of(limit) for limit in limits]
            table.add_row(
                Text(label),
                f"{np.median(numbers):.3g}",
                f"{min(numbers):.3g} to {max(numbers):.3g}" if len(numbers) > 1 else "-",
                f"{sum(limit.monotone for limit in limits)}/{len(limits)}",
                f"{sum(limit.failed is None for limit in limits)}/{len(limits)}",
            )
    return table
