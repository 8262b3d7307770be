"""Scenes: a floor, one or two humanoids, obstacles and pads, built with `mujoco.MjSpec`."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from simprep.errors import SettingError
from simprep.humanoid import DEFAULT_BODY, Body, humanoid_spec

DEFAULT_TIMESTEP_S = 1.0 / 480.0
"""Halving it moves the medians of paired runs by under 5 % (`scripts/timestep_study.py`); at 1/240 s mechanical work
and COM distances still move by a fifth."""
FLOOR_BIT = 1
OBJECT_BIT = 2**10


@dataclass(frozen=True)
class Obstacle:
    """A fixed box or ball in the world.

    Attributes:
        name: geom name.
        position: (x, y, z) of its centre, world [m].
        half_size: half edge lengths, of a ball its radius three times [m].
        soft: a striking pad: compliant contact (about 50 kN/m at 5 kg) instead of a hard surface.
        ball: round instead of a box.
    """

    name: str
    position: tuple[float, float, float]
    half_size: tuple[float, float, float]
    soft: bool = False
    ball: bool = False


@dataclass(frozen=True)
class SceneSettings:
    """What the simulated world holds.

    Attributes:
        bodies: one humanoid, or two (their parts are then prefixed `a_` and `b_`).
        obstacles: fixed boxes and pads.
        timestep: simulation step [s].
        friction: sliding friction coefficient of the floor.
    """

    bodies: tuple[Body, ...] = (DEFAULT_BODY,)
    obstacles: tuple[Obstacle, ...] = ()
    timestep: float = DEFAULT_TIMESTEP_S
    friction: float = 1.0


def build_scene(settings: SceneSettings | None = None) -> Any:
    """Compile a scene (see `scene_spec`).

    Args:
        settings: bodies, obstacles, timestep, friction.

    Returns:
        mujoco.MjModel.
    """
    return scene_spec(settings).compile()


def scene_spec(settings: SceneSettings | None = None) -> Any:
    """Editable scene.

    Args:
        settings: bodies, obstacles, timestep, friction.

    Returns:
        mujoco.MjSpec. Fighters collide with the floor, the objects and each other, never with their own
        neighbouring segments (own limbs and trunk: through the pairs listed in the model file).

    Raises:
        SettingError: no body or more than two, or a timestep outside (0, 0.02] s.
    """
    settings = settings or SceneSettings()
    if not 1 <= len(settings.bodies) <= 2:
        raise SettingError(f"{len(settings.bodies)} bodies in a scene; valid: 1 or 2")
    if not 0 < settings.timestep <= 0.02:
        raise SettingError(f"timestep {settings.timestep} s; valid: above 0, at most 0.02")
    if len(settings.bodies) == 1:
        spec = humanoid_spec(settings.bodies[0])
    else:
        spec = humanoid_spec(settings.bodies[0])
        only = mujoco.MjSpec()
        only.option = spec.option
        # MuJoCo 4.0.0's Newton solver with sparse Jacobians, its choice for so many velocities, fails to converge in some
        # steps with several contacts between the fighters: tens of kN out of nothing. Dense ones cost the same here.
        only.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        only.visual.headlight.ambient = spec.visual.headlight.ambient
        only.visual.headlight.diffuse = spec.visual.headlight.diffuse
        only.visual.map.znear = spec.visual.map.znear
        only.visual.global_.offwidth, only.visual.global_.offheight = (
            spec.visual.global_.offwidth, spec.visual.global_.offheight
        )  # fmt: skip
        only.compiler.degree = spec.compiler.degree
        # floor and obstacles are as hard as beside one humanoid, whose file sets the default
        for name in ("condim", "solref", "solimp", "friction"):
            setattr(only.default.geom, name, getattr(spec.default.geom, name))
        for number, body in enumerate(settings.bodies):
            fighter = humanoid_spec(body)
            own, other = 2 ** (1 + number), 2 ** (2 - number)
            for geom in fighter.geoms:
                if geom.contype:
                    geom.contype, geom.conaffinity = own, FLOOR_BIT | other | OBJECT_BIT
            only.attach(fighter, prefix="ab"[number] + "_", frame=only.worldbody.add_frame())
        spec = only
    spec.option.timestep = settings.timestep
    spec.add_texture(
        name="floor", type=mujoco.mjtTexture.mjTEXTURE_2D, builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        width=512, height=512, rgb1=[0.80, 0.82, 0.84], rgb2=[0.70, 0.72, 0.75],
    )  # fmt: skip
    material = spec.add_material(name="floor", texrepeat=[1, 1], texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        width=64, height=64, rgb1=[0.95, 0.97, 1.0], rgb2=[0.85, 0.88, 0.92],
    )  # fmt: skip
    floor = spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.5])
    floor.material = "floor"
    floor.contype, floor.conaffinity = FLOOR_BIT, 2**1 | 2**2
    floor.friction = [settings.friction, 0.005, 0.0001]
    for obstacle in settings.obstacles:
        _add_obstacle(spec, obstacle)
    spec.worldbody.add_light(pos=[0, 0, 4], dir=[0, 0, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    return spec


def _add_obstacle(spec: Any, obstacle: Obstacle) -> None:
    shape = mujoco.mjtGeom.mjGEOM_SPHERE if obstacle.ball else mujoco.mjtGeom.mjGEOM_BOX
    geom = spec.worldbody.add_geom(name=obstacle.name, type=shape, pos=obstacle.position, size=obstacle.half_size)
    geom.contype, geom.conaffinity = OBJECT_BIT, 2**1 | 2**2
    geom.rgba = np.array([0.75, 0.25, 0.25, 1.0] if obstacle.soft else [0.55, 0.45, 0.35, 1.0])
    if obstacle.soft:
        # direct form: stiffness and damping per kg of effective mass; priority so the pad decides
        geom.solref = np.array([-10000.0, -60.0])
        geom.priority = 1
