"""A robot's description: one TOML file that says which body plays which role, which joint moves what, and how it is driven."""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from simprep.character import ROLES, SIDES
from simprep.errors import RobotFileError

SCHEMA = "simprep.robot/1"
LEG = ("hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "ankle_dorsiflexion", "ankle_inversion")
ARM = (
    "shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion", "forearm_pronation",
    "wrist_flexion", "wrist_deviation",
)  # fmt: skip
TRUNK = tuple(
    f"{part}_{turn}" for part in ("lumbar", "thorax", "neck", "head") for turn in ("flexion", "bending", "rotation")
)
MOVEMENTS = (*TRUNK, *(f"{side}_{movement}" for side in SIDES for movement in (*LEG, *ARM)))
"""Anatomical movements that a joint can make."""
LARGEST_BYTES = 1_000_000


@dataclass(frozen=True)
class Drive:
    """How some joints are driven. What is None comes from the model file.

    Attributes:
        joints: patterns of joint names (`*_knee_joint`).
        armature: reflected inertia of motor and gear [kg m^2].
        torque: largest torque [N m].
        velocity: largest speed [rad/s].
        kp: stiffness of the servo [N m/rad]; else armature * omega^2.
        kd: damping of the servo [N m s/rad]; else 2 * zeta * armature * omega.
    """

    joints: tuple[str, ...]
    armature: float | None = None
    torque: float | None = None
    velocity: float | None = None
    kp: float | None = None
    kd: float | None = None


@dataclass(frozen=True)
class Soles:
    """Where the soles are. What is empty or None is found from the geoms of the feet.

    Attributes:
        left: names of spheres of the model under the left foot.
        right: the same of the right foot, equally many.
        points: centres of spheres to be added to each foot, in its frame, by side [m].
        radius: of the spheres that are added [m].
        geoms: patterns of the geoms that the soles are found from; empty for all that collide.
    """

    left: tuple[str, ...] = ()
    right: tuple[str, ...] = ()
    points: Mapping[str, tuple[tuple[float, float, float], ...]] = field(default_factory=dict)
    radius: float | None = None
    geoms: tuple[str, ...] = ()


@dataclass(frozen=True)
class RobotDescription:
    """The content of a robot's TOML file. Joints, bodies and geoms are called by their names in the model file.

    Attributes:
        path: the file.
        name: of the robot, as motion files state it.
        model: path of the MJCF, beside the TOML file or absolute; empty if `menagerie` or the user names it.
        menagerie: name of the robot in the package `mujoco-menagerie`, and after a slash that of one of its models.
        roles: body of each role (`simprep.character.ROLES`).
        movements: joint of each anatomical movement (`MOVEMENTS`).
        standing: angles in which the robot stands upright with straight limbs and hanging arms [rad]; 0 where not
            named. It is the reference pose; the meaning of angles does not change.
        frames: where a role's joint centre is: a body, and a place in its frame [m]. Else it is found from the axes.
        mirror: joint on the other side and sign, where names and axes do not tell them.
        drives: gains and limits; the first whose pattern fits a joint counts.
        frequency_hz: omega / 2 pi of gains from armature [1/s].
        damping_ratio: zeta of gains from armature.
        own_gains: use the gains of the model's position actuators where it has some.
        soles: the soles.
        locked: patterns of joints that are fixed in the standing pose (fingers).
        fused: patterns of joints that a planner leaves out (wrists).
        pairs: geoms of the robot that meet each other.
        limits: ranges of joints that the model leaves unlimited [rad].
        height_m: stature [m]; else measured.
    """

    path: Path
    name: str
    roles: Mapping[str, str]
    movements: Mapping[str, str]
    model: str = ""
    menagerie: str = ""
    standing: Mapping[str, float] = field(default_factory=dict)
    frames: Mapping[str, tuple[str, tuple[float, float, float]]] = field(default_factory=dict)
    mirror: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    drives: tuple[Drive, ...] = ()
    frequency_hz: float = 10.0
    damping_ratio: float = 2.0
    own_gains: bool = True
    soles: Soles = field(default_factory=Soles)
    locked: tuple[str, ...] = ()
    fused: tuple[str, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    height_m: float | None = None

    def drive(self, joint: str) -> Drive:
        """The drive of a joint; an empty one if none is described."""
        return next((one for one in self.drives if matches(joint, one.joints)), Drive(()))


def matches(name: str, patterns: tuple[str, ...]) -> bool:
    """Whether a name fits one of some shell patterns."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def read_description(path: str | Path) -> RobotDescription:
    """Read a robot's TOML file.

    Args:
        path: the file.

    Raises:
        RobotFileError: missing, no TOML, unknown keys, or values of a wrong kind; the message names the key and what is
            valid.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise RobotFileError(path, f"larger than {LARGEST_BYTES // 10**6} MB, which no robot description is")
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise RobotFileError(path, f"cannot be read ({getattr(error, 'strerror', None) or error})") from None
    except tomllib.TOMLDecodeError as error:
        raise RobotFileError(path, f"no valid TOML ({error})") from None
    return _Reader(path).description(content)


class _Reader:
    """Checks values and says what is wrong with them."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def description(self, content: Mapping[str, Any]) -> RobotDescription:
        if content.get("schema") != SCHEMA:
            raise RobotFileError(self.path, f"schema {content.get('schema')!r}; this version reads {SCHEMA!r}")
        readers: dict[str, Callable[[str, Any], Any]] = {
            "name": self.text, "model": self.text, "menagerie": self.text, "roles": self.roles, "joints": self.movements,
            "standing": self.numbers, "frames": self.frames, "mirror": self.mirror, "drive": self.drives,
            "frequency_hz": self.positive, "damping_ratio": self.positive, "own_gains": self.boolean,
            "soles": self.soles, "locked": self.texts, "fused": self.texts, "pairs": self.pairs, "limits": self.ranges,
            "height_m": self.positive,
        }  # fmt: skip
        self.only("", content, ("schema", *readers))
        for key in ("name", "roles", "joints"):
            if key not in content:
                raise RobotFileError(self.path, f"no {key!r}; needed: name, roles, joints")
        values = {key: readers[key](key, value) for key, value in content.items() if key != "schema"}
        values = {{"joints": "movements", "drive": "drives"}.get(key, key): value for key, value in values.items()}
        return RobotDescription(path=self.path, **values)

    def wrong(self, key: str, value: Any, valid: str) -> RobotFileError:
        return RobotFileError(self.path, f"{key} is {str(value)[:80]!r}; valid: {valid}")

    def only(self, where: str, table: Any, valid: tuple[str, ...]) -> Mapping[str, Any]:
        if not isinstance(table, dict):
            raise self.wrong(where, table, f"a table with {', '.join(valid)}")
        for key in table:
            if key not in valid:
                raise RobotFileError(
                    self.path, f"unknown key {key[:60]!r}{f' in {where}' if where else ''}; valid: {', '.join(valid)}"
                )
        return table

    def text(self, key: str, value: Any) -> str:
        if not isinstance(value, str) or not value:
            raise self.wrong(key, value, "text")
        return value

    def boolean(self, key: str, value: Any) -> bool:
        if not isinstance(value, bool):
            raise self.wrong(key, value, "true or false")
        return value

    def number(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
            raise self.wrong(key, value, "a number")
        return float(value)

    def positive(self, key: str, value: Any) -> float:
        if self.number(key, value) <= 0:
            raise self.wrong(key, value, "a number above 0")
        return float(value)

    def texts(self, key: str, value: Any) -> tuple[str, ...]:
        if not isinstance(value, list):
            raise self.wrong(key, value, "a list of names")
        return tuple(self.text(key, one) for one in value)

    def vector(self, key: str, value: Any, size: int) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) != size:
            raise self.wrong(key, value, f"a list of {size} numbers")
        return tuple(self.number(key, one) for one in value)

    def table(self, key: str, value: Any) -> Mapping[str, Any]:
        if not isinstance(value, dict):
            raise self.wrong(key, value, "a table")
        return value

    def roles(self, key: str, value: Any) -> dict[str, str]:
        return {role: self.text(f"{key}.{role}", body) for role, body in self.only(key, value, ROLES).items()}

    def movements(self, key: str, value: Any) -> dict[str, str]:
        return {name: self.text(f"{key}.{name}", joint) for name, joint in self.only(key, value, MOVEMENTS).items()}

    def numbers(self, key: str, value: Any) -> dict[str, float]:
        return {name: self.number(f"{key}.{name}", one) for name, one in self.table(key, value).items()}

    def ranges(self, key: str, value: Any) -> dict[str, tuple[float, float]]:
        found: dict[str, tuple[float, float]] = {}
        for name, one in self.table(key, value).items():
            low, high = self.vector(f"{key}.{name}", one, 2)
            if not low < high:
                raise self.wrong(f"{key}.{name}", one, "a lower limit below the upper one")
            found[name] = (low, high)
        return found

    def frames(self, key: str, value: Any) -> dict[str, tuple[str, tuple[float, float, float]]]:
        found: dict[str, tuple[str, tuple[float, float, float]]] = {}
        for role, one in self.only(key, value, ROLES).items():
            table = self.only(f"{key}.{role}", one, ("body", "position"))
            x, y, z = self.vector(f"{key}.{role}.position", table.get("position"), 3)
            found[role] = (self.text(f"{key}.{role}.body", table.get("body")), (x, y, z))
        return found

    def mirror(self, key: str, value: Any) -> dict[str, tuple[str, float]]:
        found: dict[str, tuple[str, float]] = {}
        for joint, one in self.table(key, value).items():
            if not isinstance(one, list) or len(one) != 2 or one[1] not in (1, -1):
                raise self.wrong(f"{key}.{joint}", one, "[joint on the other side, 1 or -1]")
            found[joint] = (self.text(f"{key}.{joint}", one[0]), float(one[1]))
        return found

    def pairs(self, key: str, value: Any) -> tuple[tuple[str, str], ...]:
        if not isinstance(value, list) or not all(isinstance(one, list) and len(one) == 2 for one in value):
            raise self.wrong(key, value, "a list of [geom, geom]")
        return tuple((self.text(key, first), self.text(key, second)) for first, second in value)

    def drives(self, key: str, value: Any) -> tuple[Drive, ...]:
        if not isinstance(value, list):
            raise self.wrong(key, value, "tables [[drive]]")
        numbers = ("armature", "torque", "velocity", "kp", "kd")
        found = []
        for one in value:
            table = self.only(key, one, ("joints", *numbers))
            given = {name: self.positive(f"{key}.{name}", table[name]) for name in numbers if name in table}
            found.append(Drive(self.texts(f"{key}.joints", table.get("joints")), **given))
        return tuple(found)

    def soles(self, key: str, value: Any) -> Soles:
        table = self.only(key, value, ("left", "right", "left_points", "right_points", "radius", "geoms"))
        names = {one: self.texts(f"{key}.{one}", table[one]) for one in ("left", "right", "geoms") if one in table}
        points: dict[str, tuple[tuple[float, float, float], ...]] = {}
        for side in SIDES:
            listed = table.get(f"{side}_points")
            if listed is None:
                continue
            if not isinstance(listed, list) or len(listed) < 3:
                raise self.wrong(f"{key}.{side}_points", listed, "three points [x, y, z] or more")
            triples = [self.vector(f"{key}.{side}_points", one, 3) for one in listed]
            points[side] = tuple((x, y, z) for x, y, z in triples)
        if len(names.get("left", ())) != len(names.get("right", ())) or len({len(one) for one in points.values()}) > 1:
            raise RobotFileError(self.path, f"{key}: as many on the left as on the right are needed")
        if len(points) == 1:
            raise RobotFileError(self.path, f"{key}: left_points and right_points belong together")
        radius = self.positive(f"{key}.radius", table["radius"]) if "radius" in table else None
        return Soles(points=points, radius=radius, **names)
