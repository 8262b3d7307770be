"""How far a number may move before anybody is told, and which direction is the better one."""

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from simprep.errors import SettingError


@dataclass(frozen=True)
class Tolerance:
    """A move that is too small to matter, whatever its cause.

    Attributes:
        pattern: which metrics: a name with `*` for any text; with a `/` in it, `case/metric`.
        absolute: in the metric's unit.
        relative: share of the baseline's value. The larger of both holds.

    Raises:
        SettingError: a negative number, or an empty pattern.
    """

    pattern: str
    absolute: float = 0.0
    relative: float = 0.0

    def __post_init__(self) -> None:
        if not self.pattern or not (0 <= self.absolute < float("inf") and 0 <= self.relative < float("inf")):
            raise SettingError(
                f"tolerance {self.pattern!r}: {self.absolute:g} and {100 * self.relative:g} %; "
                "valid: a pattern and numbers of 0 or more"
            )

    def allowed(self, value: float) -> float:
        """How far a metric may move from the baseline's value, in its unit."""
        return max(self.absolute, self.relative * abs(value))

    def fits(self, case: str, metric: str) -> bool:
        """Whether it is meant for a metric of a case."""
        if "/" in self.pattern:
            return fnmatchcase(f"{case}/{metric}", self.pattern)
        return fnmatchcase(metric, self.pattern) or fnmatchcase(own_name(metric), self.pattern)


DEFAULTS = (
    Tolerance("assist_*", 1e-9),
    Tolerance("*_share", 0.02),
    Tolerance("*_ratio", 0.02, 0.02),
    Tolerance("*_mm", 1.0, 0.02),
    Tolerance("*_mm_per_stance", 1.0, 0.02),
    Tolerance("*_m_s", 0.01, 0.02),
    Tolerance("*_m_s2", 0.1, 0.02),
    Tolerance("*_rad_s*", 0.1, 0.02),
    Tolerance("*_rad", 0.002, 0.02),
    Tolerance("*_nm", 0.5, 0.02),
    Tolerance("*_n", 2.0, 0.02),
    Tolerance("*_j", 1.0, 0.02),
    Tolerance("*_m", 0.002, 0.02),
    Tolerance("*_s", 0.01, 0.01),
    Tolerance("*", 1e-9, 0.02),
)
"""By the unit at the end of a metric's name; the first that fits holds. Smaller moves are noise to a reader."""

HIGHER_IS_BETTER = (
    "success", "completed_share", "survived_s", "max_force_n", "com_inside_share", "prepared_com_inside_share",
    "com_to_edge_mm", "prepared_com_to_edge_mm", "margin_of_stability*", "prepared_margin_of_stability*",
    "cop_to_edge_mm", "zmp_to_edge_mm", "zmp_inside_share",
)  # fmt: skip
LOWER_IS_BETTER = (
    "mpjpe_mm", "g_mpjpe_mm", "max_body_distance_mm", "velocity_error_m_s", "acceleration_error_m_s2", "com_cos_mm",
    "prepared_com_cos_mm", "unsupported_share", "peak_*", "torque_rms_*", "saturation_share", "foot_slip_mm_per_stance",
    "foot_slip_m_s", "foot_slip_ratio", "penetration_*", "residual_*", "falls_per_min",
)  # fmt: skip


def own_name(metric: str) -> str:
    """A metric's name without that of the mapping and the place in a list that it stands in: `max_n` of `a.max_n[2]`."""
    return metric.rpartition(".")[2].partition("[")[0]


def parse_tolerance(text: str) -> Tolerance:
    """A tolerance as it is written on the command line: `mpjpe_mm=2`, `peak_*=5%`, `*_mm=1+2%`.

    Raises:
        SettingError: anything else.
    """
    pattern, _, allowed = text.rpartition("=")
    absolute = relative = 0.0
    try:
        for part in allowed.split("+"):
            if part.strip().endswith("%"):
                relative = float(part.strip()[:-1]) / 100
            else:
                absolute = float(part)
    except ValueError:
        pattern = ""
    if not pattern:
        raise SettingError(
            f"tolerance {text!r}; valid: METRIC=2, METRIC=5%, METRIC=2+5%, with * in METRIC for any text"
        )
    return Tolerance(pattern, absolute, relative)


def tolerance_of(case: str, metric: str, tolerances: Sequence[Tolerance]) -> Tolerance:
    """The first of some tolerances, then of the defaults, that is meant for a metric of a case."""
    return next(one for one in (*tolerances, *DEFAULTS) if one.fits(case, metric))


def better_sign(metric: str) -> int:
    """1 if a higher value is better, -1 if a lower one is, 0 where neither is known."""
    metric = own_name(metric)
    if any(fnmatchcase(metric, pattern) for pattern in HIGHER_IS_BETTER):
        return 1
    return -1 if any(fnmatchcase(metric, pattern) for pattern in LOWER_IS_BETTER) else 0
