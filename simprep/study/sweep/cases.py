"""What one case of a sweep is, in full: its hash is its name, and the same case has the same name on every machine."""

import hashlib
import json
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from typing import Any

from simprep.errors import SettingError
from simprep.physics.mismatch import Mismatch
from simprep.preparation.scenario import AlphaProfile

SCHEMA = "simprep.sweep_case/1"
TRACK, PREPARE = "track", "prepare"
"""The two kinds of case: a clip as it is, or a locomotion that prepares for a target."""
LAUNCH = "launch"


@dataclass(frozen=True)
class Clip:
    """A motion as a sweep names it.

    Attributes:
        name: of a built-in motion; of a file, its path as it was given.
        path: where the file is; empty for a built-in motion. Not part of a case's name: files may move.
        sha256: of the file's content, and of its skeleton's where it needs one.
        target_frame: first frame of the target movement, where the file does not say.
    """

    name: str
    path: str = ""
    sha256: str = ""
    target_frame: int | None = None


@dataclass(frozen=True)
class Body:
    """Who moves.

    Attributes:
        name: of a character, or name or file of a robot.
        height_m: stature [m]; None: the character's own.
        mass_kg: mass [kg]; None: the character's own, or in proportion to the square of the stature.
        digest: of the character, which changes with its model.
    """

    name: str
    height_m: float | None = None
    mass_kg: float | None = None
    digest: str = ""


@dataclass(frozen=True)
class Disturbance:
    """How the simulated world differs from what the controller expects, by name; the defaults are no difference.

    Attributes:
        name: for tables.
        mass_scale, friction, strength, delay_s, noise: as of `simprep.physics.mismatch.Mismatch`.
        push_n_per_kg: force of one push on the pelvis for each kilogram of the body [N/kg]; 0: no push.
        push_direction_deg: where it points, against the motion's heading then: 0 forward, 90 left [degrees].
        push_s: how long it acts [s].
        push_at: when it begins [s], or `launch`: at the event of that name, in a motion without one at its middle.

    Raises:
        SettingError: a number out of range.
    """

    name: str = "nominal"
    mass_scale: float = 1.0
    friction: float | None = None
    strength: float = 1.0
    delay_s: float = 0.0
    noise: float = 0.0
    push_n_per_kg: float = 0.0
    push_direction_deg: float = 90.0
    push_s: float = 0.2
    push_at: float | str = LAUNCH

    def __post_init__(self) -> None:
        _ = self.mismatch
        for name, low, high in (("push_n_per_kg", 0, 1000), ("push_direction_deg", -360, 360), ("push_s", 1e-3, 10)):
            if not low <= getattr(self, name) <= high:
                raise SettingError(
                    f"disturbance {self.name!r}: {name} {getattr(self, name)}; valid: {low:g} to {high:g}"
                )
        if self.push_at != LAUNCH and not (isinstance(self.push_at, int | float) and self.push_at >= 0):
            raise SettingError(
                f"disturbance {self.name!r}: push_at {self.push_at!r}; valid: {LAUNCH!r} or a time from 0 [s]"
            )

    @property
    def mismatch(self) -> Mismatch:
        """The part of it that is not a push."""
        return Mismatch(**{one.name: getattr(self, one.name) for one in fields(Mismatch)})


NOMINAL = Disturbance()
DISTURBANCES = {
    one.name: one
    for one in (
        NOMINAL,
        Disturbance("push", push_n_per_kg=2.0),
        Disturbance("low_friction", friction=0.5),
        Disturbance("weak_motors", strength=0.7),
    )
}
"""Disturbances that a sweep need not define."""


@dataclass(frozen=True)
class SweepCase:
    """One case of a sweep.

    Attributes:
        code: `results_code` of the code that is to run it.
        body: who moves.
        controller: one of `CONTROLLERS`, or `motion`: nothing is simulated, the motion itself is measured.
        clip: what is tracked; None where a locomotion prepares for a target.
        locomotion, target: what is done first, and what is prepared for.
        arm: one of `ARMS`.
        alpha: level of preparation, 0 to 1; None of the arm `none`, which has none.
        profile: how the level rises; its own level is replaced by `alpha`.
        preset: of `mpc`; None of other controllers.
        seed: of the controller's random generator.
        disturbance: how the world differs from what the controller expects.
        seconds: length that a clip is brought to [s]: loops are repeated, others cut; None: 6 s of a loop, all of others.
    """

    code: str
    body: Body
    controller: str
    clip: Clip | None = None
    locomotion: Clip | None = None
    target: Clip | None = None
    arm: str | None = None
    alpha: float | None = None
    profile: AlphaProfile = field(default_factory=AlphaProfile)
    preset: str | None = None
    seed: int = 0
    disturbance: Disturbance = NOMINAL
    seconds: float | None = None

    @property
    def kind(self) -> str:
        """`track` or `prepare`."""
        return TRACK if self.clip else PREPARE

    @cached_property
    def definition(self) -> dict[str, Any]:
        """All that the result depends on, flat, in JSON's types; what does not apply is left out."""
        clips: dict[str, Any] = {}
        for role in ("clip", "locomotion", "target"):
            if clip := getattr(self, role):
                clips |= {role: clip.name, f"{role}_sha256": clip.sha256 or None, f"{role}_frame": clip.target_frame}
        timing = {"lead_s": self.profile.lead, "rise_s": self.profile.rise, "hold_s": self.profile.hold}
        body = asdict(self.body)
        disturbance = {**asdict(self.disturbance), "push_at": str(self.disturbance.push_at)}
        everything = {
            "schema": SCHEMA,
            "code": self.code,
            "kind": self.kind,
            **clips,
            "arm": self.arm,
            "alpha": self.alpha,
            **(timing if self.kind == PREPARE else {"seconds": self.seconds}),
            "character": body.pop("name"),
            **body,
            "controller": self.controller,
            "preset": self.preset,
            "seed": self.seed,
            "disturbance": disturbance.pop("name"),
            **disturbance,
        }
        return {key: value for key, value in everything.items() if value is not None}

    @cached_property
    def id(self) -> str:
        """Name of the case: 20 hexadecimal digits of the SHA-256 of its definition."""
        return hashlib.sha256(json.dumps(self.definition, sort_keys=True).encode()).hexdigest()[:20]

    @property
    def label(self) -> str:
        """A few words for people."""
        if self.clip:
            what = self.clip.name
        else:
            assert self.locomotion
            assert self.target
            level = "" if self.alpha is None else f" {self.alpha:g}"
            what = f"{self.locomotion.name} to {self.target.name} {self.arm}{level}"
        return f"{what}, {self.controller}, {self.disturbance.name}, seed {self.seed}"
