"""Check of an import: how far limbs point away from the source's, and which hinges are at their limits."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import ROLES, SIDES, Character
from simprep.motion.closed_form import least_errors
from simprep.motion.contacts import stances
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.targets import Targets, unit

LIMBS = {
    f"{side}_{bone}": (f"{side}_{bone}", f"{side}_{end}")
    for side in SIDES
    for bone, end in (("upper_arm", "forearm"), ("forearm", "hand"), ("thigh", "shank"), ("shank", "foot"))
}
"""Bones that are checked, each by the joints at its ends."""
GOOD_P95_DEG = 5.0
GOOD_MAX_DEG = 15.0
FAR_DEG = 20.0
OUT_OF_REACH_DEG = 1.0
"""Where no pose within the limits comes nearer than this, the body cannot do what the file shows: no error of the import."""
LONG_OUT_OF_REACH = 0.2
"""A limb that is bad and out of reach in a larger share of the frames is doubtful nevertheless: the file may be misread."""
LONG_AT_LIMIT = 0.2
"""A hinge at a limit in a larger share of the frames is reported."""
AT_LIMIT = 1e-3
"""A hinge this near to a limit is at it [rad]."""


@dataclass(frozen=True)
class LimbError:
    """Angle between a bone and the source's over a clip.

    Attributes:
        median_deg: median over the frames [deg].
        p95_deg: 95th percentile [deg].
        max_deg: worst frame [deg].
        max_frame: which frame that is.
        far_share: share of the frames in which it is over 20 deg.
        out_of_reach_share: share of the frames in which no pose within the limits has it; asked only where the limb is bad.
        reachable_p95_deg: 95th percentile over the other frames [deg]; None if there is none.
        reachable_max_deg: the worst of these [deg].
    """

    median_deg: float
    p95_deg: float
    max_deg: float
    max_frame: int
    far_share: float
    out_of_reach_share: float = 0.0
    reachable_p95_deg: float | None = None
    reachable_max_deg: float | None = None

    @property
    def good(self) -> bool:
        """Whether it is within 5 deg in 95 % of the frames, and never more than 15 off."""
        return self.p95_deg <= GOOD_P95_DEG and self.max_deg <= GOOD_MAX_DEG

    @property
    def doubtful(self) -> bool:
        """Whether it is not good though the body could do it, or out of reach for long: then the file may be misread."""
        if self.good:
            return False
        if self.out_of_reach_share > LONG_OUT_OF_REACH or self.reachable_p95_deg is None:
            return True
        return self.reachable_p95_deg > GOOD_P95_DEG or (self.reachable_max_deg or 0.0) > GOOD_MAX_DEG


@dataclass(frozen=True)
class ImportCheck:
    """Result of comparing an import with its source.

    Attributes:
        residual_mm: mean joint distance, root aligned [mm].
        worst_residual_mm: the same in the worst frame [mm].
        worst_residual_frame: that frame.
        limbs: error of every limb's direction, by name.
        saturated: hinges at a limit in more than 20 % of the frames, with that share.
        warnings: what is bad, in words.
    """

    residual_mm: float
    worst_residual_mm: float
    worst_residual_frame: int
    limbs: Mapping[str, LimbError]
    saturated: Mapping[str, float]
    warnings: tuple[str, ...]

    @property
    def worst_limb(self) -> str:
        """The limb with the largest 95th percentile."""
        return max(self.limbs, key=lambda limb: self.limbs[limb].p95_deg)

    @property
    def doubtful(self) -> bool:
        """Whether some limb is doubtful (`LimbError.doubtful`)."""
        return any(limb.doubtful for limb in self.limbs.values())


def check_import(qpos: FloatArray, unsettled: BoolArray, targets: Targets, character: Character) -> ImportCheck:
    """Compare an import with its source.

    Args:
        qpos: (T, nq) poses.
        unsettled: (T,) frames whose inverse kinematics did not settle.
        targets: the source's joints with our bone lengths, before feet were placed.
        character: the body.
    """
    roles = [role for role in ROLES if character.has(role)]
    ours = forward_kinematics(qpos, character).xpos[:, [character.segment(role) for role in roles]]
    wanted = targets.positions[:, [ROLES.index(role) for role in roles]]
    distance = 1000 * np.linalg.norm((ours - ours[:, :1]) - (wanted - wanted[:, :1]), axis=-1)[:, 1:].mean(axis=1)
    place = {name: number for number, name in enumerate(roles)}
    limbs: dict[str, LimbError] = {}
    reached: dict[str, BoolArray] = {}
    doubts: list[str] = []
    warnings: list[str] = []
    for limb, (a, b) in LIMBS.items():
        bone, source = (unit(at[:, place[b]] - at[:, place[a]]) for at in (ours, wanted))
        angle = np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(bone - source, axis=-1) / 2, 0.0, 1.0)))
        error = _limb_error(angle)
        if not error.good:
            chain = f"{limb.partition('_')[0]}_{'arm' if 'arm' in limb else 'leg'}"
            if chain not in reached:
                reached[chain] = np.degrees(least_errors(targets, character, chain)) < OUT_OF_REACH_DEG
            error = _limb_error(angle, reached[chain])
            worst = error.max_frame
            limit = GOOD_MAX_DEG if error.p95_deg <= GOOD_P95_DEG else GOOD_P95_DEG
            (doubts if error.doubtful else warnings).append(
                f"the {limb.replace('_', ' ')} points up to {error.max_deg:.0f} deg away from the file's (frame {worst}; "
                f"95 % of the frames within {error.p95_deg:.0f}); more than {limit:.0f} in frames {_spans(angle > limit)}"
                + (f"; out of reach in {error.out_of_reach_share:.0%} of them all" if error.out_of_reach_share else "")
            )
        limbs[limb] = error
    low, high = character.limits.T
    share = ((qpos[:, 7:] < low + AT_LIMIT) | (qpos[:, 7:] > high - AT_LIMIT)).mean(axis=0)
    saturated = {name: float(value) for name, value in zip(character.joints, share) if value > LONG_AT_LIMIT}
    if unsettled.any():
        warnings.append(f"the inverse kinematics did not settle in frames {_spans(unsettled)}")
    return ImportCheck(
        residual_mm=float(distance.mean()),
        worst_residual_mm=float(distance.max()),
        worst_residual_frame=int(distance.argmax()),
        limbs=limbs,
        saturated=saturated,
        warnings=(*doubts, *warnings),
    )


def _limb_error(angle: FloatArray, reached: BoolArray | None = None) -> LimbError:
    """Of angles (T,) [deg], where asked over the frames that are reached (T,), too."""
    worst = int(angle.argmax())
    error = LimbError(
        float(np.median(angle)),
        float(np.percentile(angle, 95)),
        float(angle[worst]),
        worst,
        float((angle > FAR_DEG).mean()),
    )
    if reached is None:
        return replace(error, reachable_p95_deg=error.p95_deg, reachable_max_deg=error.max_deg)
    error = replace(error, out_of_reach_share=float(1 - reached.mean()))
    if not reached.any():
        return error
    inside = angle[reached]
    return replace(error, reachable_p95_deg=float(np.percentile(inside, 95)), reachable_max_deg=float(inside.max()))


def _spans(flags: BoolArray, most: int = 4) -> str:
    """Runs of flagged frames in words: 3-7, 12."""
    runs = stances(flags)
    words = [f"{first}-{after - 1}" if after - first > 1 else f"{first}" for first, after in runs[:most]]
    return ", ".join(words) + (f" and {len(runs) - most} more runs" if len(runs) > most else "")
