"""A motion that is still being made: the body follows it in physics, is asked for a punch on the way, and then stands.

    python examples/growing_reference.py

`simprep.Tracker` is the simulation as an object. It takes motions while it runs, and stands where they end.
"""

import simprep
from simprep.motion.edit import concatenate, cut, repeat

walk = repeat(simprep.library_motion("walk"), 2)
punch = simprep.library_motion("punch_right")
tracker = simprep.Tracker(preset="live", seed=0)


def simulate(seconds: float) -> None:
    """Step on, and say where the body is."""
    for _ in range(round(seconds / tracker.timestep)):
        tracker.step()
    state = tracker.state
    x, y, z = state.qpos[:3]
    doing = f"{state.ahead_s[0]:.2f} s of motion left" if state.ahead_s[0] > 0 else "standing"
    print(f"{state.time:.2f} s: pelvis at {x:.2f}, {y:.2f}, {z:.2f} m, {doing}")


tracker.extend(cut(walk, 0, 61))
simulate(0.8)
# decided while it walks: a few steps more, then a punch; one long motion, whose first pose is the last one given
rest = concatenate(cut(walk, 60, 91), punch)
tracker.extend(rest)
simulate(0.2 + rest.duration)
simulate(1.5)
run = tracker.run()
print(f"{run.end}, root-relative error {simprep.evaluate_run(run)['mpjpe_mm']:.0f} mm")
