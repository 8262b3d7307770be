"""A motion of a person on a robot: retargeted, judged, and performed with the robot's own motors.

    python examples/replay_on_a_robot.py                 # the robot of primitive shapes that simprep has for its tests
    python examples/replay_on_a_robot.py unitree_g1      # a shipped description, or the path of an MJCF or TOML file

The command line does the same: `simprep track MOTION --robot NAME|PATH`.
"""

import sys

import simprep
from simprep.motion.transfer import transferred
from simprep.primitive_robot import primitive_robot

robot = simprep.load_robot(sys.argv[1]) if len(sys.argv) > 1 else primitive_robot()
person = simprep.library_motion("punch_right")

moved = transferred(person, robot)
print(f"{robot.name}: {len(robot.joints)} hinges, {robot.height_m:.2f} m, {robot.mass_kg:.0f} kg")
print(f"{moved.motion.name}: joints {moved.report.residual_mm:.1f} mm from where the person's would be")

live = simprep.SimulationSettings(mpc=simprep.MPC_PRESETS["live"])
run = simprep.track(moved.motion, seed=0, settings=live)
metrics = simprep.evaluate_run(run)
print(
    f"{run.end} after {run.end_s:.2f} s, MPJPE {metrics['mpjpe_mm']:.0f} mm, largest external force {metrics['assist_n']:.0f} N"
)
