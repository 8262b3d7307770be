"""Small synthetic motion files, written by tests."""

import json
from pathlib import Path

LIMBS = {"Left": 1.0, "Right": -1.0}


def bvh_hierarchy(unit: float = 100.0, skip: tuple[str, ...] = (), names: dict[str, str] | None = None) -> str:
    """A Mixamo-like standing T-pose, y up, facing z; `unit` per metre. Joints named in `skip` lose their branch."""
    lines = ["HIERARCHY"]
    names = names or {}

    def joint(name: str, offset: tuple[float, float, float], children: list, depth: int = 0) -> None:
        if name in skip:
            return
        pad = "  " * depth
        kind = "ROOT" if depth == 0 else "JOINT"
        lines.append(f"{pad}{kind} {names.get(name, name)}")
        lines.append(pad + "{")
        lines.append(f"{pad}  OFFSET {' '.join(f'{unit * value:.6f}' for value in offset)}")
        rotations = "Zrotation Xrotation Yrotation"
        lines.append(
            f"{pad}  CHANNELS 6 Xposition Yposition Zposition {rotations}"
            if depth == 0
            else f"{pad}  CHANNELS 3 {rotations}"
        )
        for child in children:
            joint(*child, depth + 1)
        if not children:
            lines.extend([f"{pad}  End Site", pad + "  {", f"{pad}    OFFSET 0 0 {0.05 * unit:.6f}", pad + "  }"])
        lines.append(pad + "}")

    legs = [
        (
            f"{side}UpLeg",
            (0.09 * sign, 0.0, 0.0),
            [
                (
                    f"{side}Leg",
                    (0.0, -0.42, 0.0),
                    [(f"{side}Foot", (0.0, -0.43, 0.0), [(f"{side}ToeBase", (0.0, -0.06, 0.14), [])])],
                )
            ],
        )
        for side, sign in LIMBS.items()
    ]
    arms = [
        (
            f"{side}Arm",
            (0.18 * sign, 0.0, 0.0),
            [(f"{side}ForeArm", (0.28 * sign, 0.0, 0.0), [(f"{side}Hand", (0.26 * sign, 0.0, 0.0), [])])],
        )
        for side, sign in LIMBS.items()
    ]
    spine = (
        "Spine",
        (0.0, 0.15, 0.0),
        [("Spine1", (0.0, 0.2, 0.0), [("Neck", (0.0, 0.15, 0.0), [("Head", (0.0, 0.1, 0.0), [])]), *arms])],
    )
    joint("Hips", (0.0, 0.0, 0.0), [*legs, spine])
    return "\n".join(lines)


def bvh_text(frames: int = 30, unit: float = 100.0, frame_time: str = "0.033333", **options) -> str:
    """A whole BVH file: standing, swinging the arms a little."""
    hierarchy = bvh_hierarchy(unit, **options)
    width = 3 * hierarchy.count("CHANNELS") + 3
    rows = []
    for frame in range(frames):
        row = [0.0] * width
        row[1] = 0.92 * unit
        row[min(3 + 3 * 12, width - 1)] = 2.0 * frame / max(frames, 1)
        rows.append(" ".join(f"{value:.6f}" for value in row))
    return "\n".join([hierarchy, "MOTION", f"Frames: {frames}", f"Frame Time: {frame_time}", *rows, ""])


ASF = """:version 1.10
:name TEST
:units
  mass 1.0
  length 0.45
  angle deg
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
{bones}
:hierarchy
  begin
{hierarchy}
  end
"""

BONES = {
    # name: parent, direction, length in file units (0.0564 m)
    "lhipjoint": ("root", (0.65, -0.72, 0.25), 2.5),
    "lfemur": ("lhipjoint", (0.34, -0.94, 0), 7.5),
    "ltibia": ("lfemur", (0.34, -0.94, 0), 7.2),
    "lfoot": ("ltibia", (0.09, -0.24, 0.96), 2.2),
    "ltoes": ("lfoot", (0, 0, 1), 1.1),
    "rhipjoint": ("root", (-0.65, -0.72, 0.25), 2.5),
    "rfemur": ("rhipjoint", (-0.34, -0.94, 0), 7.5),
    "rtibia": ("rfemur", (-0.34, -0.94, 0), 7.2),
    "rfoot": ("rtibia", (-0.09, -0.24, 0.96), 2.2),
    "rtoes": ("rfoot", (0, 0, 1), 1.1),
    "lowerback": ("root", (0, 1, 0), 2.1),
    "upperback": ("lowerback", (0, 1, 0), 2.1),
    "thorax": ("upperback", (0, 1, 0), 2.1),
    "lowerneck": ("thorax", (0, 1, 0), 1.6),
    "head": ("lowerneck", (0, 1, 0), 1.6),
    "lclavicle": ("thorax", (0.97, 0.25, 0), 3.6),
    "lhumerus": ("lclavicle", (1, 0, 0), 4.9),
    "lradius": ("lhumerus", (1, 0, 0), 5.0),
    "lhand": ("lradius", (1, 0, 0), 0.7),
    "rclavicle": ("thorax", (-0.97, 0.25, 0), 3.6),
    "rhumerus": ("rclavicle", (-1, 0, 0), 4.9),
    "rradius": ("rhumerus", (-1, 0, 0), 5.0),
    "rhand": ("rradius", (-1, 0, 0), 0.7),
}


def asf_text() -> str:
    """A small Acclaim skeleton in its rest pose."""
    bones = "\n".join(
        f"  begin\n    id {number}\n    name {name}\n    direction {' '.join(map(str, direction))}\n    length {length}\n"
        f"    axis 0 0 0 XYZ\n    dof rx ry rz\n    limits (-180 180)\n           (-180 180)\n           (-180 180)\n  end"
        for number, (name, (_, direction, length)) in enumerate(BONES.items(), 1)
    )
    children: dict[str, list[str]] = {}
    for name, (parent, _, _) in BONES.items():
        children.setdefault(parent, []).append(name)
    hierarchy = "\n".join(f"    {parent} {' '.join(names)}" for parent, names in children.items())
    return ASF.format(bones=bones, hierarchy=hierarchy)


def amc_text(frames: int = 30) -> str:
    """Standing still."""
    lines = [":FULLY-SPECIFIED", ":DEGREES"]
    for frame in range(1, frames + 1):
        lines.append(str(frame))
        lines.append("root 0 16 0 0 0 0")
        lines.extend(f"{name} 0 0 0" for name in BONES)
    return "\n".join(lines) + "\n"


def deepmimic_frame(duration: float = 0.0333) -> list[float]:
    """One upright frame."""
    identity = [1.0, 0.0, 0.0, 0.0]
    leg, arm = [*identity, 0.0, *identity], [*identity, 0.3]
    return [duration, 0.0, 0.89, 0.0, *identity, *identity, *identity, *leg, *arm, *leg, *arm]


def deepmimic_text(frames: list | None = None, loop: object = "none") -> str:
    """A DeepMimic clip."""
    return json.dumps({"Loop": loop, "Frames": [deepmimic_frame() for _ in range(20)] if frames is None else frames})


def write(folder: Path, name: str, content: str | bytes) -> Path:
    """Write a file."""
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path
