"""Prepare a walk for a front kick, and let the motor-driven humanoid perform it.

python examples/prepare_and_track.py
"""

import simprep

walk = simprep.library_motion("walk")
kick = simprep.library_motion("kick_front")

# One and a half seconds of walking in the style of the kick; 0 is the plain walk, 1 stands in the posture before the kick.
prepared = simprep.prepare(walk, kick, alpha=0.7, duration=1.5)
record = prepared.record
before, after = (cost[:, 0].mean() for cost in (record.costs_before, record.costs_after))
print(f"balance cost of the posture: {1000 * before:.0f} mm blended, {1000 * after:.0f} mm optimised")

# The same motion in physics: joint motors only, no force on the root.
run = simprep.track(prepared.motion, controller="mpc", seed=0)
metrics = simprep.evaluate_run(run)
print(f"simulated: {run.end} at {run.end_s:.2f} s ({run.end_reason})")
print(f"mean joint error {metrics['mpjpe_mm']:.0f} mm, largest external force {metrics['assist_n']:.0f} N")
