"""What posture optimisation does to a motion: the same walk and punch with and without it, measured before physics.

python examples/compare_posture_optimisation.py
"""

import simprep

NUMBERS = {
    "prepared_com_cos_mm": "COM to centre of support, prepared [mm]",
    "prepared_margin_of_stability_mm": "margin of stability, prepared [mm]",
    "peak_acceleration_rad_s2": "peak joint acceleration at launch [rad/s^2]",
}

walk = simprep.library_motion("walk")
punch = simprep.library_motion("punch_right")

# A scenario is one whole motion: walk, rising level of preparation, launch, target. Both share timing and launch.
arms = {arm: simprep.scenario(walk, punch, 0.7, arm=arm) for arm in ("none", "blended", "optimised")}
measured = {arm: simprep.evaluate_motion(motion) for arm, motion in arms.items()}

print(f"{'':45}" + "".join(f"{arm:>11}" for arm in measured))
for key, label in NUMBERS.items():
    print(f"{label:45}" + "".join(f"{metrics[key]:11.1f}" for metrics in measured.values()))
