"""Your own clip in a study: what preparing for it is worth, before physics and in it.

    python examples/validate_own_clip.py                     # writes a punch to a BVH file first
    python examples/validate_own_clip.py my_kick.bvh 48      # your file, and the first frame of its target movement

`simprep validate --target FILE --target-frame N` does more of the same, and writes pictures.
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import simprep
from simprep.preparation.scenario import AlphaProfile
from simprep.study.compare import case_rows
from simprep.study.plan import StudyPlan
from simprep.study.validate import run_study

with tempfile.TemporaryDirectory() as folder:
    if len(sys.argv) > 2:
        path, target_frame = Path(sys.argv[1]), int(sys.argv[2])
    else:
        punch = simprep.library_motion("punch_right")
        path, target_frame = Path(folder) / "my_punch.bvh", punch.events["target"]
        simprep.export_motion(punch, path)
    clip = simprep.load_motion(path)

clip = replace(clip, events={"target": target_frame})
print(f"{clip.name}: {len(clip)} frames at {clip.fps:g}/s, the target movement begins at frame {target_frame}")

plan = StudyPlan(
    locomotion=simprep.library_motion("walk"),
    targets=(clip,),
    alphas=(1.0,),
    arms=("none", "optimised"),
    controllers=("mpc",),
    profile=AlphaProfile(lead=0.1, rise=0.5, hold=0.1),
)
settings = simprep.SimulationSettings(mpc=simprep.MPC_PRESETS["live"])
for row in case_rows(run_study(plan, settings=settings)):
    print(
        f"{row['arm']:10} {row['end']}, MPJPE {row['mpjpe_mm']:.0f} mm, launch {row['peak_acceleration_rad_s2']:.0f} rad/s^2"
    )
