"""All checks of one motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from simprep.check.conventions import conventions
from simprep.check.dynamics import frame_rate, support
from simprep.check.finding import FAIL, WARN, Finding, worst
from simprep.check.floor import collisions, floating, footing, skating
from simprep.check.limits import joint_range, joint_velocity, jumps, torque
from simprep.check.subject import subject
from simprep.display import SelfShowing, data_frame
from simprep.motion.motion import Motion


@dataclass(frozen=True)
class MotionCheck(SelfShowing):
    """What is wrong with a motion.

    Attributes:
        name: of the motion.
        character: whose it is.
        frames: of it.
        fps: frames per second [1/s].
        findings: one for each check.
    """

    name: str
    character: str
    frames: int
    fps: float
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> str:
        """The worst verdict: `pass`, `warn` or `fail`."""
        return worst(self.findings)

    def finding(self, check: str) -> Finding:
        """The finding of a check by its name.

        Raises:
            KeyError: no such check.
        """
        found = {one.check: one for one in self.findings}
        return found[check]

    @property
    def raised(self) -> tuple[str, ...]:
        """Names of the checks that did not pass."""
        return tuple(one.check for one in self.findings if one.verdict in (WARN, FAIL))

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(check)` and Jupyter show: the verdict, and what was raised."""
        raised = {
            one.check: f"{one.verdict}: {'' if one.value is None else f'{one.value:.4g} {one.unit}'}"
            + (f" ({one.where})" if one.where else "")
            for one in self.findings
            if one.check in self.raised
        }
        return self.name, {
            "verdict": self.verdict,
            "body": self.character,
            "frames": f"{self.frames} at {self.fps:g}/s",
            "checks": len(self.findings),
            **raised,
        }

    def to_dataframe(self) -> Any:
        """A pandas DataFrame: a row for each check."""
        return data_frame([one.as_dict() for one in self.findings])

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "motion": self.name,
            "character": self.character,
            "frames": self.frames,
            "fps": self.fps,
            "verdict": self.verdict,
            "raised": list(self.raised),
            "findings": [one.as_dict() for one in self.findings],
        }


def check_motion(motion: Motion) -> MotionCheck:
    """Examine a motion by its poses alone; `simprep.check.follow` simulates it.

    Args:
        motion: of any character; a loop is examined with its seam.

    Raises:
        MotionError: too short.
    """
    one = subject(motion)
    findings = (
        *conventions(one),
        *frame_rate(one),
        jumps(one),
        joint_range(one),
        joint_velocity(one),
        torque(one),
        *collisions(one),
        floating(one),
        *skating(one),
        footing(one),
        *support(one),
    )
    return MotionCheck(motion.name, motion.character.name, len(motion), motion.fps, findings)
