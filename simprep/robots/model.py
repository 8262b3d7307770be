"""From a robot's MJCF and description to the model that is simulated: free root, hinges, one servo each, spheres as soles.

Servos. Whatever actuators the file has, each hinge gets one position servo. Its stiffness and damping are those of the
description's drive; else those of the file's own position actuator; else kp = armature * omega^2 and
kd = 2 * zeta * armature * omega. Its largest torque is the description's; else that of the file's actuator or joint.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.character import NEEDED_ROLES, SIDES
from simprep.errors import RobotFileError, UnknownNameError
from simprep.robots.description import RobotDescription, matches
from simprep.robots.soles import MOST_POINTS, simplified, sole_outline
from simprep.robots.source import HINGE, read_robot_model

BODY_BIT, FLOOR_BIT = 2, 1
"""Collision bits of a single body and of the floor (`simprep.scene`)."""
_COLOURS = {"left": (0.35, 0.55, 0.80, 1.0), "right": (0.85, 0.50, 0.35, 1.0), "": (0.62, 0.64, 0.68, 1.0)}


@dataclass(frozen=True)
class Servo:
    """How one hinge is driven: stiffness [N m/rad], damping [N m s/rad], largest torque [N m], armature [kg m^2]."""

    kp: float
    kd: float
    torque: float
    armature: float


def build_robot(mjcf: str, description: RobotDescription) -> mujoco.MjSpec:
    """Editable model of a robot alone, without a floor, standing on z = 0 in its reference pose.

    Args:
        mjcf: path of its model file.
        description: what its parts are.

    Raises:
        RobotFileError: the model cannot be read, or lacks something; see `read_robot_model` and the checks here.
    """
    spec, source = read_robot_model(mjcf)
    check_names(mjcf, source, description)
    wanted = servos(mjcf, source, description)
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    _set_reference_pose(spec, source, description)
    for joint in list(spec.joints):
        if joint.type != HINGE:
            continue
        servo = wanted[joint.name]
        joint.armature, joint.limited = servo.armature, mujoco.mjtLimited.mjLIMITED_TRUE
        if joint.name in description.limits:
            joint.range = np.array(description.limits[joint.name]) * _unit(spec)
        actuator = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        actuator.gainprm[0] = servo.kp
        actuator.biasprm[1:3] = -servo.kp, -servo.kd
        actuator.forcelimited, actuator.forcerange = mujoco.mjtLimited.mjLIMITED_TRUE, [-servo.torque, servo.torque]
    _set_contacts(spec)
    _add_soles(mjcf, spec, description)
    for first, second in description.pairs:
        spec.add_pair(geomname1=first, geomname2=second, condim=1)
    _set_options(spec)
    return spec


def sole_names(description: RobotDescription, model: mujoco.MjModel) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the soles' spheres, left and right, in a model of `build_robot`."""
    if description.soles.left:
        return description.soles.left, description.soles.right
    names = [model.geom(geom).name for geom in range(model.ngeom)]
    left, right = (tuple(name for name in names if name.startswith(f"{side}_sole_")) for side in SIDES)
    return left, right


def check_names(mjcf: str, source: mujoco.MjModel, description: RobotDescription) -> None:
    """Check that bodies, joints and geoms of a description are in the model, and that joints are limited.

    Raises:
        RobotFileError: a name is not; the message lists the valid ones. Or a needed role is missing, or a joint has no
            limits.
    """
    lacking = [role for role in NEEDED_ROLES if role not in description.roles]
    if lacking:
        raise RobotFileError(description.path, f"no role {lacking[0]!r}; needed: {', '.join(NEEDED_ROLES)}")
    hinges = hinge_names(source)
    bodies = [source.body(number).name for number in range(1, source.nbody)]
    geoms = [source.geom(number).name for number in range(source.ngeom)]
    used_bodies = [*description.roles.values(), *(body for body, _ in description.frames.values())]
    used_joints = [*description.movements.values(), *description.standing, *description.mirror, *description.limits]
    used_joints += [joint for joint, _ in description.mirror.values()]
    used_geoms = [
        *description.soles.left,
        *description.soles.right,
        *(name for pair in description.pairs for name in pair),
    ]
    for kind, used, valid in (
        ("body", used_bodies, bodies),
        ("joint", used_joints, hinges),
        ("geom", used_geoms, geoms),
    ):
        for name in used:
            if name not in valid:
                error = UnknownNameError(f"{kind} of {mjcf}", name, [one for one in valid if one])
                raise RobotFileError(description.path, str(error))
    free = [name for name in hinges if name not in description.limits and not source.joint(name).limited[0]]
    free = [name for name in free if not matches(name, description.locked)]
    if free:
        raise RobotFileError(
            mjcf,
            f"joints without limits: {', '.join(free)}; valid: a range in the model, or [limits] in {description.path}",
        )


def hinge_names(model: mujoco.MjModel) -> list[str]:
    """Names of the hinges in model order."""
    return [model.joint(number).name for number in range(model.njnt) if model.jnt_type[number] == HINGE]


def servos(mjcf: str, source: mujoco.MjModel, description: RobotDescription) -> Mapping[str, Servo]:
    """The servo of every hinge by joint name; see the module's beginning.

    Raises:
        RobotFileError: no torque limit is known of some joints, or neither gains nor an armature.
    """
    found: dict[str, Servo] = {}
    no_torque: list[str] = []
    no_gains: list[str] = []
    omega = 2 * np.pi * description.frequency_hz
    for name in hinge_names(source):
        drive = description.drive(name)
        own = _actuator_of(source, name)
        armature = drive.armature or float(source.dof_armature[source.joint(name).dofadr[0]])
        torque = drive.torque or own_torque(source, name)
        kp, kd = drive.kp, drive.kd
        if kp is None and description.own_gains and own is not None and source.actuator_biasprm[own, 1] < 0:
            gear = float(source.actuator_gear[own, 0])
            kp, kd = float(source.actuator_gainprm[own, 0]) * gear**2, float(-source.actuator_biasprm[own, 2]) * gear**2
        kp = kp or armature * omega**2
        kd = kd or 2 * description.damping_ratio * armature * omega
        if matches(name, description.locked):
            continue
        if not torque:
            no_torque.append(name)
        elif not kp or not kd:
            no_gains.append(name)
        found[name] = Servo(kp, kd, torque or 0.0, armature)
    for lacking, what, key in ((no_torque, "torque limit", "torque"), (no_gains, "gains or armature", "armature")):
        if lacking:
            none = "no actuators, and " if not source.nu else ""
            raise RobotFileError(
                mjcf,
                f"{none}no {what} of {', '.join(lacking)}; valid: in the model, or {key} in a [[drive]] of {description.path}",
            )
    return found


def _actuator_of(source: mujoco.MjModel, joint: str) -> int | None:
    moved = (source.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT) & (
        source.actuator_trnid[:, 0] == source.joint(joint).id
    )
    return int(np.flatnonzero(moved)[0]) if moved.any() else None


def own_torque(source: mujoco.MjModel, joint: str) -> float | None:
    """Torque limit that a model states: of the actuator's force, of the joint, or of a motor's control; the least [N m]."""
    actuator = _actuator_of(source, joint)
    limits = []
    one = source.joint(joint).id
    if source.jnt_actfrclimited[one]:
        limits.append(float(np.abs(source.jnt_actfrcrange[one]).max()))
    if actuator is not None:
        gear = abs(float(source.actuator_gear[actuator, 0]))
        if source.actuator_forcelimited[actuator]:
            limits.append(gear * float(np.abs(source.actuator_forcerange[actuator]).max()))
        motor = source.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
        if motor and source.actuator_ctrllimited[actuator]:
            gain = abs(float(source.actuator_gainprm[actuator, 0]))
            limits.append(gear * gain * float(np.abs(source.actuator_ctrlrange[actuator]).max()))
    return min(limits, default=None)


def _unit(spec: mujoco.MjSpec) -> float:
    """Units of the spec's angles in a radian."""
    return 180 / np.pi if spec.compiler.degree else 1.0


def _set_reference_pose(spec: mujoco.MjSpec, source: mujoco.MjModel, description: RobotDescription) -> None:
    """Make the standing pose the reference, without changing what joint angles mean; fix locked joints in it."""
    for body in spec.bodies:
        hinges = [joint for joint in body.joints if joint.type == HINGE]
        if not any(description.standing.get(joint.name) or matches(joint.name, description.locked) for joint in hinges):
            continue
        number = source.body(body.name).id
        place, turn = np.array(source.body_pos[number]), np.array(source.body_quat[number])
        earlier: list[Any] = []
        for joint in hinges:
            one = source.joint(joint.name).id
            axis, anchor = source.jnt_axis[one], source.jnt_pos[one]
            angle = description.standing.get(joint.name, 0.0) - float(source.qpos0[source.jnt_qposadr[one]])
            quat, back = np.zeros(4), np.zeros(4)
            mujoco.mju_axisAngle2Quat(quat, axis, angle)
            mujoco.mju_negQuat(back, quat)
            place = place + _rotated(anchor - _rotated(anchor, quat), turn)
            after = np.zeros(4)
            mujoco.mju_mulQuat(after, turn, quat)
            turn = after
            for before in earlier:  # the axes of those that turn first move with the body
                before.axis = _rotated(before.axis, back)
                before.pos = anchor + _rotated(before.pos - anchor, back)
            earlier.append(joint)
            joint.ref = description.standing.get(joint.name, 0.0) * _unit(spec)
            joint.springref = joint.ref
        body.pos, body.quat = place, turn
        body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
        for joint in hinges:
            if matches(joint.name, description.locked):
                spec.delete(joint)


def _rotated(vector: FloatArray, quat: FloatArray) -> FloatArray:
    out = np.zeros(3)
    mujoco.mju_rotVecQuat(out, np.asarray(vector, dtype=np.float64), quat)
    return out


def _set_contacts(spec: mujoco.MjSpec) -> None:
    """Contacts as our own bodies have them: with the floor and objects, not with each other."""
    for geom in spec.geoms:
        if geom.contype or geom.conaffinity:
            geom.contype, geom.conaffinity = BODY_BIT, FLOOR_BIT
        _set_surface(geom)


def _set_surface(geom: Any) -> None:
    side = next((side for side in SIDES if geom.parent.name.lower().startswith((side, f"{side[0]}_"))), "")
    geom.condim, geom.group, geom.priority, geom.margin, geom.gap = 3, 0, 0, 0.0, 0.0
    geom.solref, geom.solimp[:3] = [0.01, 1], [0.95, 0.99, 0.001]
    geom.friction = [1, 0.005, 0.0001]
    geom.rgba = _COLOURS[side]


def _add_soles(mjcf: str, spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Spheres under the feet, which then bear the load in place of the feet's own geoms, and the root's height above the floor."""
    root = next(body for body in spec.worldbody.bodies if body.joints)
    root.pos = [0.0, 0.0, 0.0]
    soles = description.soles
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    if not soles.left:
        centres, radii = [], []
        for side in SIDES:
            foot = model.body(description.roles[f"{side}_foot"]).id
            own = _foot_geoms(model, foot, description)
            if side in soles.points:
                found, radius = np.array(soles.points[side]), soles.radius or 0.005
            else:
                found, radius = _outline(mjcf, model, data, foot, own, soles.radius)
            centres.append(found)
            radii.append(radius)
            for geom in own:  # they stay for the looks
                spec.geoms[geom].contype = spec.geoms[geom].conaffinity = 0
        most = min(MOST_POINTS, *map(len, centres)) if not soles.points else len(centres[0])
        for side, corners, radius in zip(SIDES, centres, radii):
            body = spec.body(description.roles[f"{side}_foot"])
            for number, centre in enumerate(simplified(corners, most)):
                geom = body.add_geom(name=f"{side}_sole_{number}", type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=centre)
                geom.size, geom.mass = [radius, 0, 0], 0.0
                geom.contype, geom.conaffinity = BODY_BIT, FLOOR_BIT
                _set_surface(geom)
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
    ids = [model.geom(name).id for side in sole_names(description, model) for name in side]
    root.pos = [0.0, 0.0, -float((data.geom_xpos[ids, 2] - model.geom_size[ids, 0]).min())]


def _outline(
    mjcf: str, model: mujoco.MjModel, data: mujoco.MjData, foot: int, geoms: Sequence[int], radius: float | None
) -> tuple[FloatArray, float]:
    name = model.body(foot).name
    if not geoms:
        raise RobotFileError(
            mjcf, f"the foot {name!r} has no colliding geom; valid: geoms, or [soles] with points in the TOML"
        )
    try:
        return sole_outline(model, data, foot, list(geoms), radius)
    except ValueError as error:
        raise RobotFileError(mjcf, f"the foot {name!r} gives no sole: {error}") from None


def _foot_geoms(model: mujoco.MjModel, foot: int, description: RobotDescription) -> list[int]:
    """Ids of the colliding geoms of a foot and of what is fixed to it."""
    return [
        geom for geom in range(model.ngeom)
        if model.body_weldid[model.geom_bodyid[geom]] == foot
        and (model.geom_contype[geom] or model.geom_conaffinity[geom])
        and (not description.soles.geoms or matches(model.geom(geom).name, description.soles.geoms))
    ]  # fmt: skip


def _set_options(spec: mujoco.MjSpec) -> None:
    """Solver and looks as of our own bodies (`mjcf/humanoid.xml`)."""
    spec.option.timestep = 1 / 480
    spec.option.gravity = [0, 0, -9.81]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    spec.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    spec.option.iterations, spec.option.ls_iterations = 20, 10
    spec.option.disableflags, spec.option.enableflags = 0, 0
    spec.option.impratio = 1.0
    spec.visual.headlight.ambient = [0.45, 0.45, 0.45]
    spec.visual.headlight.diffuse = [0.55, 0.55, 0.55]
    spec.visual.headlight.specular = [0.05, 0.05, 0.05]
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1920, 1080
    spec.visual.map.znear = 0.02
