"""One line of a check: what was measured, against which threshold, where, and the verdict."""

import math
from dataclasses import asdict, dataclass
from typing import Any

PASS, WARN, FAIL, INFO = "pass", "warn", "fail", "info"


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Attributes:
        check: its name.
        verdict: `pass`, `warn`, `fail`, or `info` for a number without a verdict, where no threshold is established.
        value: the number judged; None where it does not exist.
        unit: of the number and its thresholds.
        warn_above: the verdict is `warn` above this.
        fail_above: and `fail` above this; None: never.
        frame: the worst frame; None where the number belongs to no single one.
        part: the joint, segment or foot.
        note: what it means, in words.
    """

    check: str
    verdict: str
    value: float | None
    unit: str
    warn_above: float | None = None
    fail_above: float | None = None
    frame: int | None = None
    part: str = ""
    note: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)

    @property
    def where(self) -> str:
        """Part and frame in words."""
        at = "" if self.frame is None else f"frame {self.frame}"
        return ", ".join(text for text in (self.part, at) if text)

    @property
    def thresholds(self) -> str:
        """Both thresholds in words."""
        if self.warn_above is None:
            return "-"
        return f"{self.warn_above:g}" + ("" if self.fail_above is None else f" / {self.fail_above:g}")


def graded(
    check: str,
    value: float,
    unit: str,
    warn_above: float,
    fail_above: float | None = None,
    frame: int | None = None,
    part: str = "",
    note: str = "",
) -> Finding:
    """A finding with the verdict that its thresholds give; a value that does not exist passes.

    Arguments are those of `Finding`.
    """
    verdict = PASS
    if not math.isfinite(value):
        return Finding(check, PASS, None, unit, warn_above, fail_above, None, "", note or "does not exist here")
    if value > warn_above:
        verdict = FAIL if fail_above is not None and value > fail_above else WARN
    return Finding(check, verdict, float(value), unit, warn_above, fail_above, frame, part, note)


def worst(findings: tuple[Finding, ...]) -> str:
    """The worst verdict of several findings."""
    verdicts = {finding.verdict for finding in findings}
    return FAIL if FAIL in verdicts else WARN if WARN in verdicts else PASS
