"""Small synthetic humanoids as MJCF text: hip axes that lean and miss each other, forearms that point forward at 0."""

from pathlib import Path

LIMITS = 'range="-2.5 2.5"'
TORQUE_NM = {"hip": 90, "knee": 110, "ankle": 50, "waist": 80, "shoulder": 30, "elbow": 25}
ARMATURE = 0.01
FEET = {
    "capsules": '<geom type="capsule" size="0.01" fromto="-0.05 {y} -0.03 0.12 {y} -0.03"/>',
    "box": '<geom type="box" size="0.09 0.03 0.01" pos="0.035 0 -0.03"/>',
    "mesh": '<geom type="mesh" mesh="foot" pos="0.035 0 -0.03"/>',
    "spheres": '<geom type="sphere" size="0.008" pos="{x} {y} -0.032"/>',
    "none": "",
}
MESH = '<mesh name="foot" vertex="-.08 -.03 -.01  -.08 .03 -.01  .1 -.02 -.01  .1 .02 -.01  0 0 .03"/>'
JOINTS = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
AXES = {"pitch": "0 1 0", "roll": "1 0 0", "yaw": "0 0 1"}
ARM_JOINTS = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow")


def robot_xml(
    feet: str = "capsules",
    actuators: str = "position",
    *,
    root: str = '<freejoint name="root"/>',
    knee: str = "",
    degrees: bool = False,
    before: str = "",
    extra: str = "",
    looks: str = "",
    hips: tuple[str, str, str] = ("pitch", "roll", "yaw"),
    inverts: bool = True,
) -> str:
    """MJCF of a robot of 21 hinges.

    Args:
        feet: one of `FEET`.
        actuators: position, motor, general or none.
        root: the joint of its root.
        knee: limits of its left knee; empty for those of all.
        degrees: write angles in degrees.
        before: at the beginning of the file.
        extra: at its end.
        looks: geoms of the pelvis.
        hips: the turns of its hips, from the pelvis outwards.
        inverts: whether its ankles roll; without, it has 19 hinges.
    """
    limits = 'range="-143.2394487827058 143.2394487827058"' if degrees else LIMITS
    joints = (*JOINTS[: 6 if inverts else 5], *ARM_JOINTS)
    names = ["waist", *(f"{side}_{name}" for side in ("left", "right") for name in joints)]
    moved = "".join(_actuator(actuators, name) for name in names)
    return f"""<mujoco model="synthetic">
  {before}
  <compiler angle="{"degree" if degrees else "radian"}" autolimits="true"/>
  <default><joint {limits} armature="{ARMATURE}"/><geom density="500"/></default>
  <asset>{MESH if feet == "mesh" else ""}</asset>
  <worldbody>
    <geom name="ground" type="plane" size="5 5 1"/>
    <body name="pelvis" pos="0 0 2">
      {root}{looks}
      <geom type="box" size="0.06 0.1 0.05" mass="5"/>
      {_leg("left", 1, feet, knee, hips, inverts)}{_leg("right", -1, feet, "", hips, inverts)}
      <body name="torso" pos="0 0 0.1">
        <joint name="waist" axis="0 0 1"/>
        <geom type="box" size="0.07 0.1 0.15" pos="0 0 0.15" mass="9"/>
        {_arm("left", 1)}{_arm("right", -1)}
      </body>
    </body>
  </worldbody>
  <actuator>{moved}</actuator>
  {extra}
</mujoco>"""


def toml_of(
    name: str = "synthetic", more: str = "", standing: str = "1.5707963267948966", *, inverts: bool = True
) -> str:
    """Its description, without drives."""
    roles = {"pelvis": "pelvis", "thorax": "torso"}
    joints = {"lumbar_rotation": "waist"}
    movements = (
        "hip_flexion",
        "hip_abduction",
        "hip_rotation",
        "knee_flexion",
        "ankle_dorsiflexion",
        "ankle_inversion",
    )
    shoulder = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")
    for side in ("left", "right"):
        for part in ("upper_arm", "forearm", "thigh", "shank", "foot"):
            roles[f"{side}_{part}"] = f"{side}_{part}"
        roles[f"{side}_hand"] = f"{side}_forearm"
        for movement, joint in zip((*movements, *shoulder), (*JOINTS, *ARM_JOINTS)):
            if movement == "ankle_inversion" and not inverts:
                continue
            joints[f"{side}_{movement}"] = f"{side}_{joint}"
    tables = {"roles": roles, "joints": joints}
    text = f'schema = "simprep.robot/1"\nname = "{name}"\nmodel = "{name}.xml"\n{more}\n'
    for title, entries in tables.items():
        text += f"[{title}]\n" + "".join(f'{key} = "{value}"\n' for key, value in entries.items())
    text += f"[standing]\nleft_elbow = {standing}\nright_elbow = {standing}\n"
    for side in ("left", "right"):
        text += f'[frames.{side}_hand]\nbody = "{side}_forearm"\nposition = [0.2, 0.0, 0.0]\n'
    return text


def write_robot(folder: Path, xml: str, toml: str | None = None, name: str = "synthetic") -> Path:
    """Both files in a folder; returns the MJCF's path."""
    path = folder / f"{name}.xml"
    path.write_text(xml)
    path.with_suffix(".toml").write_text(toml_of(name) if toml is None else toml)
    return path


def _actuator(kind: str, joint: str) -> str:
    torque = next(value for part, value in TORQUE_NM.items() if part in joint)
    return {
        "position": f'<position name="{joint}" joint="{joint}" kp="70" kv="4" forcerange="-{torque} {torque}"/>',
        "motor": f'<motor name="{joint}" joint="{joint}" gear="2" ctrlrange="-{torque / 2} {torque / 2}"/>',
        "general": f'<general name="{joint}" joint="{joint}" gainprm="60" biastype="affine" biasprm="0 -60 -3" '
        f'forcerange="-{torque} {torque}"/>',
        "none": "",
    }[kind]


def _foot(kind: str) -> str:
    if kind == "spheres":
        return "".join(FEET[kind].format(x=x, y=y) for x in (-0.05, 0.12) for y in (-0.03, 0.03))
    return "".join(FEET[kind].format(y=y) for y in (-0.02, 0.02)) if kind == "capsules" else FEET[kind]


def _leg(side: str, sign: int, feet: str, knee: str, hips: tuple[str, str, str], inverts: bool) -> str:
    """The second axis of the hip leans by 10 degrees and lies 3 cm below the first one."""
    one, two, three = (f'<joint name="{side}_hip_{turn}" axis="{AXES[turn]}"/>' for turn in hips)
    foot = f"""<inertial pos="0.03 0 -0.02" mass="0.6" diaginertia="0.0004 0.0016 0.0017"/>
                  {_foot(feet)}"""
    pitch = f'<joint name="{side}_ankle_pitch" axis="0 1 0"/>'
    if inverts:
        ankle = f"""<body name="{side}_ankle" pos="0 0 -0.3">
                {pitch}<geom type="sphere" size="0.02" mass="0.1" contype="0" conaffinity="0"/>
                <body name="{side}_foot">
                  <joint name="{side}_ankle_roll" axis="1 0 0"/>{foot}
                </body>
              </body>"""
    else:
        ankle = f"""<body name="{side}_foot" pos="0 0 -0.3">{pitch}{foot}</body>"""
    return f"""
      <body name="{side}_hip_{hips[0]}" pos="0 {sign * 0.06} -0.05">
        {one}<geom type="sphere" size="0.03" mass="1"/>
        <body name="{side}_hip_{hips[1]}" pos="0 {sign * 0.04} -0.03" quat="0.9961947 0 -0.0871557 0">
          {two}<geom type="sphere" size="0.03" mass="1"/>
          <body name="{side}_thigh" quat="0.9961947 0 0.0871557 0">
            {three}<geom type="capsule" size="0.04" fromto="0 0 -0.03 0 0 -0.24" mass="3"/>
            <body name="{side}_shank" pos="0 0 -0.28">
              <joint name="{side}_knee" axis="0 1 0" {knee}/><geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.26" mass="2"/>
              {ankle}
            </body>
          </body>
        </body>
      </body>"""


def _arm(side: str, sign: int) -> str:
    """Its forearm points forward at 0."""
    return f"""
        <body name="{side}_shoulder_pitch" pos="0 {sign * 0.12} 0.27">
          <joint name="{side}_shoulder_pitch" axis="0 1 0"/><geom type="sphere" size="0.03" mass="0.5"/>
          <body name="{side}_shoulder_roll" pos="0 {sign * 0.03} -0.01">
            <joint name="{side}_shoulder_roll" axis="1 0 0"/><geom type="sphere" size="0.03" mass="0.4"/>
            <body name="{side}_upper_arm">
              <joint name="{side}_shoulder_yaw" axis="0 0 1"/><geom type="capsule" size="0.03" fromto="0 0 -0.03 0 0 -0.17" mass="0.8"/>
              <body name="{side}_forearm" pos="0 0 -0.2">
                <joint name="{side}_elbow" axis="0 1 0"/><geom type="capsule" size="0.025" fromto="0.02 0 0 0.19 0 0" mass="0.6"/>
              </body>
            </body>
          </body>
        </body>"""
