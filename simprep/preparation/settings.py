"""Every constant of the preparation synthesis in one place, with the 2013 paper's values as defaults."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from simprep.errors import SettingError, UnknownNameError

CURVES = ("described", "printed", "linear")
ROOT_HEIGHTS = ("support", "mean")
OPTIMISERS = ("paper", "dynamic")
DESCENTS = ("gauss-newton", "steepest")


@dataclass(frozen=True)
class PreparationSettings:
    """Constants of "Natural preparation behavior synthesis" (2013), called the paper here, and of our additions.

    Attributes:
        curve: blending curve of Eq. 1. `described` is what the paper describes and shows (arms first), the mirror image of
            the `printed` formula (arms last); `linear` uses one weight for every joint, w = alpha: traditional blending,
            the baseline of Fig. 6.
        curvature_lower: C of the root and the hinges of the lower body (paper: 1.0, a straight line).
        curvature_upper: C of the hinges of the upper body (paper: 0.5).
        curvature: C of single hinges by name, or of `root`; overrides the two above.
        leg_threshold: largest sum of squared differences of the leg joints' positions (hips, knees, ankles, relative to the
            root, in its heading) between a reference posture and the target's first frame [m^2]. The paper gives no value;
            0.05 is reached when both knees and both ankles have moved by 11 cm.
        root_height: `mean` is Eq. 5: the root moves against the mean height change of both feet. `support` (default) takes
            the lowest sole point of the supporting feet, so a fully prepared character does not bob with the swing foot.
        balance_weight: weight of the balance cost C_b, Eq. 10 (paper: 2.0).
        style_weight: weight of the style cost C_s, Eq. 10 (paper: 1.0).
        smoothness_weight: weight of the smoothness cost C_m, Eq. 10 (paper: 0.25). C_m is in metres per frame squared: it
            falls with the square of the frame rate, which the paper does not state.
        joint_weight: weight of half the sum of squared hinge changes in the cost [m/rad^2], an addition of ours; 0 for the
            paper's. C_s sees body centres only: without it the hinges of the arms spin freely to gain a millimetre.
        optimiser: `paper` draws the COM to the centre of support as it is in the frame. `dynamic` draws the extrapolated COM
            to the mean centre of support of the coming half step, and lets hips and pelvis help while the feet stay
            (`simprep.preparation.dynamic_balance`).
        look_ahead: what `dynamic` takes for half a step: 108 steps a minute [s].
        pelvis_reach: farthest shift of the pelvis that `dynamic` may ask for [m]; 0 leaves it where it is.
        descent: `gauss-newton` divides the gradient by the Gauss-Newton matrix; `steepest` goes along the gradient, as far as the
            same matrix says, which is as near to the paper's gradient descent as it tells.
        max_steps: most descent steps per frame (paper: 10).
        threshold: posture optimisation is skipped below this level of preparation (paper: 0.3).
        threshold_ramp: time over which the posture change is eased in after alpha has passed `threshold`, and out before it
            falls below [s]; 0 for the paper's hard switch, at which the body jumps.
        support_smoothing: time constant of the path along which C_b draws the COM (`com_path`) [s]; longer means calmer and
            less near. 0 for the paper: to the raw support centre, and the upper body jumps with it at every step.
        com_reach: longest displacement of the COM that the path asks for [m]: at 0.08 a walking trunk leans by 5 to 15
            degrees on average and at most 28. Without effect where `support_smoothing` is 0.
        change_smoothing: standard deviation of the Gaussian in time over the posture change [s], as the optimum has kinks
            from frame to frame; 0 for the paper's.
        smooth_norm: the costs' norms are `sqrt(|r|^2 + s^2) - s` with this s [m], as their gradient does not exist at 0.
        foot_ease: longest time over which a foot correction fades in before touch-down and out after lift-off [s].
        step_clearance: least mid-swing clearance of a foot at full preparation that has to travel [m].
        leg_reach: share of the straight leg length that inverse kinematics may use before the pelvis is lowered.

    Raises:
        SettingError: a value outside its range.
        UnknownNameError: a curve or root height that does not exist.
    """

    curve: str = "described"
    curvature_lower: float = 1.0
    curvature_upper: float = 0.5
    curvature: Mapping[str, float] = field(default_factory=dict)
    leg_threshold: float = 0.05
    root_height: str = "support"
    balance_weight: float = 2.0
    style_weight: float = 1.0
    smoothness_weight: float = 0.25
    joint_weight: float = 0.02
    optimiser: str = "paper"
    look_ahead: float = 0.28
    pelvis_reach: float = 0.02
    descent: str = "gauss-newton"
    max_steps: int = 10
    threshold: float = 0.3
    threshold_ramp: float = 0.2
    support_smoothing: float = 0.16
    com_reach: float = 0.08
    change_smoothing: float = 0.04
    smooth_norm: float = 0.005
    foot_ease: float = 0.3
    step_clearance: float = 0.03
    leg_reach: float = 0.995

    def __post_init__(self) -> None:
        if self.curve not in CURVES:
            raise UnknownNameError("blending curve", self.curve, CURVES)
        if self.root_height not in ROOT_HEIGHTS:
            raise UnknownNameError("root height", self.root_height, ROOT_HEIGHTS)
        if self.optimiser not in OPTIMISERS:
            raise UnknownNameError("posture optimiser", self.optimiser, OPTIMISERS)
        if self.descent not in DESCENTS:
            raise UnknownNameError("descent", self.descent, DESCENTS)
        for name, value in {
            "curvature_lower": self.curvature_lower,
            "curvature_upper": self.curvature_upper,
            "smooth_norm": self.smooth_norm,
            **self.curvature,
        }.items():
            if not 0 < value < 100:
                raise SettingError(f"{name} {value}; valid: above 0, below 100")
        for name in (
            "leg_threshold", "balance_weight", "style_weight", "smoothness_weight", "max_steps", "threshold",
            "threshold_ramp", "support_smoothing", "com_reach", "change_smoothing", "joint_weight", "foot_ease", "step_clearance",
            "look_ahead", "pelvis_reach",
        ):  # fmt: skip
            if not getattr(self, name) >= 0:
                raise SettingError(f"{name} {getattr(self, name)}; valid: 0 or more")
        if not 0.5 <= self.leg_reach <= 1:
            raise SettingError(f"leg_reach {self.leg_reach}; valid: 0.5 to 1")


DEFAULT_SETTINGS = PreparationSettings()
