"""The four arms of a study on one walk and one punch, simulated with the same controller and seed.

python examples/compare_arms.py
"""

import simprep
from simprep.preparation.scenario import ARMS, AlphaProfile

walk = simprep.library_motion("walk")
punch = simprep.library_motion("punch_right")
live = simprep.SimulationSettings(mpc=simprep.MPC_PRESETS["live"])
profile = AlphaProfile(level=0.7, lead=0.1, rise=0.4, hold=0.1)  # short, so that this runs in seconds

columns = {}
for arm in ARMS:
    motion = simprep.scenario(walk, punch, profile, arm=arm)  # all share timing and launch
    run = simprep.track(motion, seed=0, settings=live)
    columns[arm] = simprep.evaluate_run(run)

shown = (
    "success",
    "mpjpe_mm",
    "com_cos_mm",
    "margin_of_stability_mm",
    "peak_acceleration_rad_s2",
    "peak_torque_nm",
    "assist_n",
)
print(simprep.metrics_table({arm: {name: metrics[name] for name in shown} for arm, metrics in columns.items()}))
