"""The study's records as comparisons: what changed, by how much, and whether that says something."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from simprep.metrics.effects import MEAN, Effect, Outcome, effect_of, verdict, with_holm
from simprep.metrics.paired import Pair, matched_pairs
from simprep.study.compare import WITH, WITHOUT
from simprep.study.plan import BEFORE_PHYSICS

MATCHED_ON = ("locomotion", "target", "alpha", "height_m", "controller", "disturbance", "seed")
CLUSTER = "target"
LABELS = {
    "success": "success [share]", "survived_s": "time survived [s]", "com_cos_mm": "COM to centre of support [mm]",
    "prepared_com_cos_mm": "the same while prepared [mm]", "margin_of_stability_mm": "margin of stability [mm]",
    "margin_of_stability_p5_mm": "its lowest 5 % [mm]", "com_inside_share": "COM inside [share]",
    "cop_to_edge_mm": "centre of pressure to edge [mm]", "zmp_to_edge_mm": "ZMP to edge [mm]",
    "mpjpe_mm": "MPJPE [mm]", "peak_acceleration_rad_s2": "peak acceleration at the launch [rad/s²]",
    "peak_torque_nm": "peak torque at the launch [N m]", "absolute_work_j": "work [J]", "saturation_share": "at the torque limit [share]",
    "foot_slip_mm_per_stance": "foot slip [mm per stance]",
}  # fmt: skip
STABILITY = (
    Outcome("success", 1, 0.05, MEAN), Outcome("survived_s", 1, 0.1, MEAN), Outcome("margin_of_stability_mm", 1, 5.0),
    Outcome("com_cos_mm", -1, 5.0),
)  # fmt: skip
"""What the question is about; the answer counts these."""
OUTCOMES = (
    *STABILITY, Outcome("prepared_com_cos_mm", -1, 5.0), Outcome("margin_of_stability_p5_mm", 1, 10.0),
    Outcome("com_inside_share", 1, 0.05), Outcome("cop_to_edge_mm", 1, 5.0), Outcome("mpjpe_mm", -1, 2.0),
    Outcome("peak_acceleration_rad_s2", -1, 10.0), Outcome("peak_torque_nm", -1, 10.0), Outcome("absolute_work_j", -1, 10.0),
    Outcome("saturation_share", -1, 0.01), Outcome("foot_slip_mm_per_stance", -1, 5.0),
)  # fmt: skip
MOTION_OUTCOMES = (
    *STABILITY[2:], Outcome("prepared_com_cos_mm", -1, 5.0), Outcome("margin_of_stability_p5_mm", 1, 10.0),
    Outcome("com_inside_share", 1, 0.05), Outcome("zmp_to_edge_mm", 1, 5.0), Outcome("peak_acceleration_rad_s2", -1, 10.0),
)  # fmt: skip
STRATA = ("alpha", "height_m", "locomotion")
SATURATED = "saturated"
"""Verdict where all runs of both arms succeed, or none: success cannot tell the arms apart."""
MIN_CLUSTERS = 6
"""With fewer targets an interval says little, and the test of one number for each cannot reach 0.05."""


@dataclass(frozen=True)
class Comparison:
    """One effect.

    Attributes:
        controller, disturbance: of the cases.
        against: the arm that `optimised` is compared with.
        where: further keys that the cases agree in.
        outcome: the metric.
        effect: what was found.
        says: `verdict` of it.
    """

    controller: str
    disturbance: str
    against: str
    where: Mapping[str, Any]
    outcome: Outcome
    effect: Effect
    says: str = ""

    def record(self) -> dict[str, Any]:
        """Flat, in JSON's types."""
        return {
            "controller": self.controller,
            "disturbance": self.disturbance,
            "with": WITH,
            "without": self.against,
            "where": dict(self.where),
            "metric": self.outcome.name,
            "better": self.outcome.better,
            "smallest_that_matters": self.outcome.smallest,
            "statistic": self.outcome.statistic,
            **asdict(self.effect),
            "verdict": self.says,
        }


def rows_of(records: Iterable[Mapping[str, Any]]) -> tuple[list[dict[str, Any]], Counter[str]]:
    """Cases as flat mappings, and how many ended how. The arm without a level stands for every level of the others.

    Cases that could not be run are counted and left out.
    """
    rows, ends = [], Counter[str]()
    for record in records:
        ends[record["end"]] += 1
        if record["end"] in ("bad_input", "error"):
            continue
        row = {**record["case"], **record["metrics"], "end": record["end"]}
        row.setdefault("success", True)  # of a motion that is not simulated
        rows.append(row)
    alphas = sorted({row["alpha"] for row in rows if "alpha" in row})
    return [{**row, "alpha": alpha} for row in rows for alpha in ([row["alpha"]] if "alpha" in row else alphas)], ends


def compared(rows: Sequence[Mapping[str, Any]], against: str = WITHOUT, strata: bool = False) -> list[Comparison]:
    """`optimised` against another arm, by controller and disturbance, or by one more key each.

    Tests of one controller are corrected together: those of stability, and those of all else.

    Args:
        rows: of `rows_of`.
        against: the other arm.
        strata: the metrics of `STABILITY` by level, stature and locomotion, instead of all over all of them.
    """
    pairs = matched_pairs(rows, WITH, against, MATCHED_ON)
    groups: dict[tuple[str, str], list[Pair]] = {}
    for pair in pairs:
        groups.setdefault((pair[0]["controller"], pair[0]["disturbance"]), []).append(pair)
    found = []
    generator = np.random.default_rng(2013)
    for (controller, disturbance), of_group in sorted(groups.items()):
        before = controller == BEFORE_PHYSICS
        if strata:
            outcomes: Sequence[Outcome] = STABILITY[2:] if before else STABILITY
            parts = [({key: value}, _of(of_group, key, value)) for key in STRATA for value in _values(of_group, key)]
        else:
            outcomes, parts = (MOTION_OUTCOMES if before else OUTCOMES), [({}, of_group)]
        for where, some in parts:
            for outcome in outcomes:
                effect = effect_of(outcome, some, CLUSTER, generator)
                found.append(Comparison(controller, disturbance, against, where, outcome, effect))
    primary = {outcome.name for outcome in STABILITY}
    families: dict[tuple[str, bool], list[int]] = {}
    for number, one in enumerate(found):
        families.setdefault((one.controller, one.outcome.name in primary), []).append(number)
    for numbers in families.values():
        for number, effect in zip(numbers, with_holm([found[number].effect for number in numbers]), strict=True):
            found[number] = replace(found[number], effect=effect, says=_says(effect, found[number].outcome))
    return found


def _says(effect: Effect, outcome: Outcome) -> str:
    """`verdict`, but `saturated` where success is the same in all runs."""
    failed = effect.n_failed_with, effect.n_failed_without
    if outcome.name == "success" and failed in ((0, 0), (effect.n, effect.n)):
        return SATURATED
    return verdict(effect, outcome)


def by_target(rows: Sequence[Mapping[str, Any]], outcome: Outcome, against: str = WITHOUT) -> list[dict[str, Any]]:
    """Effect on one metric target by target, by controller: described, not tested."""
    found = []
    generator = np.random.default_rng(2013)
    pairs = matched_pairs(rows, WITH, against, MATCHED_ON)
    for controller in sorted({pair[0]["controller"] for pair in pairs}):
        for target in sorted({pair[0]["target"] for pair in pairs}):
            some = [pair for pair in pairs if (pair[0]["controller"], pair[0]["target"]) == (controller, target)]
            effect = effect_of(outcome, some, CLUSTER, generator, resamples=2)
            found.append(
                {
                    "controller": controller,
                    "target": target,
                    "n": effect.n,
                    "estimate": effect.estimate,
                    "worse": effect.worse,
                }
            )
    return found


def _of(pairs: Sequence[Pair], key: str, value: Any) -> list[Pair]:
    return [pair for pair in pairs if pair[0][key] == value]


def _values(pairs: Sequence[Pair], key: str) -> list[Any]:
    values = sorted({pair[0][key] for pair in pairs}, key=str)
    return values if len(values) > 1 else []
