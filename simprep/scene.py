"""Scenes: a floor, any number of bodies, obstacles and pads."""

from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.errors import SettingError
from simprep.humanoid_model import humanoid

DEFAULT_TIMESTEP_S = 1.0 / 480.0
"""Half of it moves the medians of paired runs by under 5 % (`scripts/timestep_study.py`; distances to an edge, which are near 0,
by 5 mm or less), twice by up to a fifth."""
DEFAULT_FRICTION = 1.0
FLOOR_BIT = 1
OBJECT_BIT = 2**10
CONTACT_S, DAMPING_RATIO = 0.01, 0.5
"""Time constant [s] and damping ratio of contacts between two bodies."""
BONY_S = {"hand": 0.0066, "forearm": 0.0066, "foot": 0.0066, "shank": 0.008, "head": 0.008}
"""Time constant of parts with less flesh, by role without side [s]. Two parts have the mean of theirs. Why these:
docs/fight_physics.md, Contacts."""
GLOVE_S = 0.017
"""Time constant of a hand in a boxing glove, its padding included [s]."""
_BODY_BITS = 9  # the collision bits between floor and objects
BODY_LIMIT = 2**_BODY_BITS - 1
"""Most bodies in a scene: each has its own nonzero code in the collision bits that bodies share."""


@dataclass(frozen=True)
class Obstacle:
    """A box or ball in the world: fixed, or with a mass and free to move.

    Attributes:
        name: geom name.
        position: (x, y, z) of its centre, world [m].
        half_size: half edge lengths; the radius of a ball three times [m].
        soft: a striking pad: compliant contact (about 50 kN/m at 5 kg) instead of a hard surface.
        ball: a ball instead of a box.
        mass: of one that moves freely [kg]; 0: it is fixed.

    Raises:
        SettingError: a negative mass.
    """

    name: str
    position: tuple[float, float, float]
    half_size: tuple[float, float, float]
    soft: bool = False
    ball: bool = False
    mass: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.mass < np.inf:
            raise SettingError(f"obstacle {self.name}: mass {self.mass} kg; valid: 0 (fixed) or more")


@dataclass(frozen=True)
class SceneSettings:
    """What the simulated world holds.

    Attributes:
        bodies: 1 to `BODY_LIMIT` characters; the names of their parts begin with `body_prefix`.
        obstacles: boxes, balls and pads.
        timestep: simulation step [s].
        friction: sliding friction coefficient of the floor. Below 1 it holds for whatever touches the floor; above, the
            larger of both does, as is MuJoCo's rule.
        bodies_meet: bodies collide with each other; otherwise they pass through each other, to compare with.
        gloves: hands of several bodies wear boxing gloves: the same size, but softer against other bodies.
    """

    bodies: tuple[Character, ...] = (humanoid(),)
    obstacles: tuple[Obstacle, ...] = ()
    timestep: float = DEFAULT_TIMESTEP_S
    friction: float = DEFAULT_FRICTION
    bodies_meet: bool = True
    gloves: bool = False


def body_prefix(number: int, count: int) -> str:
    """Prefix of the names of a body's parts: empty for a single body, else `a_`, `b_` ... `z_`, `aa_`, `ab_` ...

    Args:
        number: which body, from 0.
        count: bodies in the scene.
    """
    return "" if count == 1 else f"{body_letters(number)}_"


def body_letters(number: int) -> str:
    """Letters that stand for a body, or a person, of several: `a`, `b` ... `z`, `aa`, `ab` ..., counted from 0."""
    letters = ""
    while number >= 0:
        number, letter = divmod(number, 26)
        letters = chr(ord("a") + letter) + letters
        number -= 1
    return letters


def collision_bits(number: int, count: int, meet: bool = True) -> tuple[int, int]:
    """MuJoCo's `contype` and `conaffinity` of a body's geoms: they meet floor, objects and other bodies only.

    A body's type is its number from 1 as a binary code, its affinity the code's complement. Two different codes differ
    in a bit, so one meets the other's complement; no code meets its own.

    Args:
        number: which body, from 0.
        count: bodies in the scene, 1 to `BODY_LIMIT`.
        meet: whether bodies meet each other.
    """
    code = number + 1
    others = (_code_mask(count) ^ code) << 1 if meet else 0
    return code << 1, FLOOR_BIT | others | OBJECT_BIT


def _code_mask(count: int) -> int:
    return int(2 ** count.bit_length() - 1)


def build_scene(settings: SceneSettings | None = None) -> mujoco.MjModel:
    """Compile a scene; arguments and errors as for `scene_spec`."""
    return scene_spec(settings).compile()


def scene_spec(settings: SceneSettings | None = None) -> mujoco.MjSpec:
    """Editable scene. Bodies collide with the floor, the objects and each other.

    Segments of one body collide only in the pairs listed in its model file.

    Args:
        settings: bodies, obstacles, timestep, friction.

    Raises:
        SettingError: no body or more than `BODY_LIMIT`, or a timestep outside (0, 0.02] s.
    """
    settings = settings or SceneSettings()
    count = len(settings.bodies)
    if not 1 <= count <= BODY_LIMIT:
        raise SettingError(
            f"{count} bodies in a scene; valid: 1 to {BODY_LIMIT} (the {_BODY_BITS} collision bits of bodies tell no more apart)"
        )
    if not 0 < settings.timestep <= 0.02:
        raise SettingError(f"timestep {settings.timestep} s; valid: above 0, at most 0.02")
    spec = settings.bodies[0].build() if count == 1 else _bodies_spec(settings)
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
    # two bits at least: the model file of a single body has one
    any_body = _code_mask(max(count, 2)) << 1
    floor.contype, floor.conaffinity = FLOOR_BIT, any_body
    floor.friction = [settings.friction, 0.005, 0.0001]
    if settings.friction < DEFAULT_FRICTION:
        floor.priority = 1  # of equal priorities MuJoCo takes the larger friction: a body's 1 would hold on ice too
    for obstacle in settings.obstacles:
        _add_obstacle(spec, obstacle, any_body)
    spec.worldbody.add_light(pos=[0, 0, 4], dir=[0, 0, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    return spec


def _bodies_spec(settings: SceneSettings) -> mujoco.MjSpec:
    """Several bodies in one world, each with its prefix and collision bits."""
    bodies = settings.bodies
    first = bodies[0].build()
    softness = {**BONY_S, **({"hand": GLOVE_S} if settings.gloves else {})}
    spec = mujoco.MjSpec()
    spec.option = first.option
    # the sparse Jacobian that MuJoCo 4.0.0 chooses for so many velocities makes its Newton solver diverge in some steps
    # with several contacts between two bodies (forces of tens of kN); a dense one costs the same here
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.visual.headlight.ambient = first.visual.headlight.ambient
    spec.visual.headlight.diffuse = first.visual.headlight.diffuse
    spec.visual.map.znear = first.visual.map.znear
    spec.visual.global_.offwidth = first.visual.global_.offwidth
    spec.visual.global_.offheight = first.visual.global_.offheight
    spec.compiler.degree = first.compiler.degree
    # floor and obstacles are as hard as beside a single body, whose file sets the default
    for name in ("condim", "solref", "solimp", "friction"):
        setattr(spec.default.geom, name, getattr(first.default.geom, name))
    for number, character in enumerate(bodies):
        own = character.build()
        kinds = {name: role.removeprefix("left_").removeprefix("right_") for role, name in character.roles.items()}
        for geom in own.geoms:
            if geom.contype:
                geom.contype, geom.conaffinity = collision_bits(number, len(bodies), settings.bodies_meet)
                # without weight in the mixture with floor and obstacles, which stay as hard as they are
                geom.solref[:] = softness.get(kinds.get(geom.parent.name, ""), CONTACT_S), DAMPING_RATIO
                geom.solmix = 0.0
        spec.attach(own, prefix=body_prefix(number, len(bodies)), frame=spec.worldbody.add_frame())
    return spec


def _add_obstacle(spec: mujoco.MjSpec, obstacle: Obstacle, any_body: int) -> None:
    shape = mujoco.mjtGeom.mjGEOM_SPHERE if obstacle.ball else mujoco.mjtGeom.mjGEOM_BOX
    owner, place = spec.worldbody, obstacle.position
    if obstacle.mass:  # behind the characters, so that their entries of qpos stay the first
        owner, place = spec.worldbody.add_body(name=obstacle.name, pos=obstacle.position), (0.0, 0.0, 0.0)
        owner.add_freejoint(name=obstacle.name)
    geom = owner.add_geom(name=obstacle.name, type=shape, pos=place, size=obstacle.half_size)
    geom.contype, geom.conaffinity = OBJECT_BIT, any_body
    if obstacle.mass:
        geom.conaffinity = any_body | OBJECT_BIT | FLOOR_BIT
        # model files of characters say that inertia is given
        owner.explicitinertial, owner.mass, owner.ipos = True, obstacle.mass, [0.0, 0.0, 0.0]
        owner.inertia = _inertia(obstacle)
        # a ball rolls to rest
        geom.condim, geom.friction = 6, [0.7, 0.005, 0.002]
    geom.rgba = np.array([0.75, 0.25, 0.25, 1.0] if obstacle.soft else [0.55, 0.45, 0.35, 1.0])
    if obstacle.soft:
        # direct form: stiffness and damping per kg of effective mass; priority so the pad decides
        geom.solref = np.array([-10000.0, -60.0])
        geom.priority = 1


def _inertia(obstacle: Obstacle) -> FloatArray:
    """Principal moments (3,) of a solid ball or box [kg m^2]."""
    squares = np.square(obstacle.half_size)
    if obstacle.ball:
        return np.full(3, 0.4 * obstacle.mass * squares[0])
    return np.asarray(obstacle.mass / 3 * (squares.sum() - squares))
