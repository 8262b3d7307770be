"""Import a motion file onto the humanoid, and read how far the result can be trusted.

python examples/import_a_file.py            # writes a small BVH file to a temporary folder first
python examples/import_a_file.py walk.bvh   # your own file: .bvh, .amc with its .asf, DeepMimic's .txt or .json
"""

import math
import sys
import tempfile
from pathlib import Path

import simprep
from simprep.motion.load import import_motion

# A person of a capture file: name, offset from the parent [cm], children. BVH is usually y up.
LEGS = [
    (f"{side}UpLeg", (9 * x, 0, 0), [(f"{side}Leg", (0, -42, 0), [(f"{side}Foot", (0, -43, 0), [(f"{side}ToeBase", (0, -6, 14), [])])])])
    for side, x in (("Left", 1), ("Right", -1))
]  # fmt: skip
ARMS = [
    (f"{side}Arm", (18 * x, 0, 0), [(f"{side}ForeArm", (28 * x, 0, 0), [(f"{side}Hand", (26 * x, 0, 0), [])])])
    for side, x in (("Left", 1), ("Right", -1))
]
SPINE = ("Spine", (0, 15, 0), [("Spine1", (0, 20, 0), [("Neck", (0, 15, 0), [("Head", (0, 10, 0), [])]), *ARMS])])


def hierarchy(joint, keyword="ROOT"):
    """One joint and everything below it, as BVH lines, and the names in the order of the file's numbers."""
    name, offset, children = joint
    position = "6 Xposition Yposition Zposition" if keyword == "ROOT" else "3"
    lines = [f"{keyword} {name}", "{", "OFFSET {} {} {}".format(*offset)]
    lines.append(f"CHANNELS {position} Zrotation Xrotation Yrotation")
    names = [name]
    for child in children:
        below, more = hierarchy(child, "JOINT")
        lines, names = lines + below, names + more
    if not children:
        lines += ["End Site", "{", "OFFSET 0 0 5", "}"]
    return [*lines, "}"], names


def write_wave(path):
    """Two seconds of waving with the right arm, at 30 frames per second."""
    lines, names = hierarchy(("Hips", (0, 0, 0), [*LEGS, SPINE]))
    lines = ["HIERARCHY", *lines, "MOTION", "Frames: 60", f"Frame Time: {1 / 30:.6f}"]
    for frame in range(60):
        angles = {"LeftArm": -75, "RightArm": -20, "RightForeArm": -60 + 25 * math.sin(2 * math.pi * frame / 20)}
        numbers = [0, 92, 0] + [number for name in names for number in (angles.get(name, 0), 0, 0)]
        lines.append(" ".join(f"{number:.3f}" for number in numbers))
    path.write_text("\n".join(lines) + "\n")
    return path


with tempfile.TemporaryDirectory() as folder:
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else write_wave(Path(folder) / "wave.bvh")
    imported = import_motion(file)
motion, report = imported.motion, imported.report

print(f"{motion.name}: {report.frames} frames at {report.fps:g}/s; {report.up} up, {report.scale:g} m per unit")
print(f"mean distance of the joints to the file's: {report.residual_mm:.1f} mm")
worst = report.check.worst_limb
print(f"worst limb: {worst}, 95 % of the frames within {report.check.limbs[worst].p95_deg:.1f} deg")
print("doubtful" if report.doubtful else "every limb points where the file's does")
for warning in report.warnings:
    print(f"note: {warning}")
print(f"floor penetration at most {simprep.evaluate_motion(motion)['penetration_mm']:.1f} mm")
