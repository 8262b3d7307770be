"""From foreign joint names to the parts of our humanoid: automatic for common skeletons, overridable by the user.

Recognised by name: CMU and Mixamo BVH, Character Creator (`CC_Base_`), 3ds Max Biped, Bandai-Namco, LaFAN1, SMPL,
Xsens, Poser and DAZ (Genesis too) BVH, DeepMimic, Acclaim; any other whose names hold a side and an anatomical word.
Beginnings or ends that all names share (`B_`, of a second person) are ignored. The trunk is found by topology: the
joints from the hips' common ancestor to the neck.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np

from simprep.arrays import IndexArray
from simprep.character import SIDES
from simprep.errors import MotionFileError, UnknownNameError
from simprep.motion.formats.text import open_text

LIMB_PARTS = ("thigh", "shank", "foot", "upper_arm", "forearm", "hand")
OPTIONAL_PARTS = ("toe", "hand_tip")
ROLES = ("neck", "head", *(f"{side}_{part}" for side in SIDES for part in (*LIMB_PARTS, *OPTIONAL_PARTS)))
"""What a foreign joint can be: the proximal joint of that part; `toe` is the ball, `hand_tip` a knuckle."""

# words of a name without its side; the first word that some joint has wins
_WORDS: dict[str, tuple[str, ...]] = {
    "thigh": ("upleg", "upperleg", "thigh", "thighbend", "femur", "hip", "buttock", "hjc"),
    "shank": ("lowerleg", "lowleg", "calf", "shin", "shank", "tibia", "knee", "leg", "kjc"),
    "foot": ("ankle", "foot", "ajc"),
    "toe": ("toebase", "toe", "toes", "ball", "foot", "bigtoe"),
    "upper_arm": ("upperarm", "uparm", "humerus", "shldrbend", "shldr", "arm", "shoulder", "sjc"),
    "forearm": ("forearm", "forearmbend", "lowerarm", "lowarm", "radius", "elbow", "ejc"),
    "hand": ("hand", "wrist", "wjc"),
    "hand_tip": ("handindex", "index", "handmiddle", "mid", "middle", "fingers", "fingerbase", "finger"),
}
_TRUNK_WORDS: dict[str, tuple[str, ...]] = {"neck": ("lowerneck", "necklower", "neck", "necktwist"), "head": ("head",)}
MAX_MAP = 1_000_000
LONG_NAME = 60
_PREFIXES = re.compile(r"^(.*:|mixamorig\d*[:_]?|cc_base_|bip\d+[ _]?|rl_|def[-_]|character\d*_|m_avg_)", re.IGNORECASE)


@dataclass(frozen=True)
class JointMap:
    """Which source joint is which part.

    Attributes:
        joints: index of the source joint of each role (see `ROLES`).
        trunk: source joints from the hips' common ancestor up to the neck, both included.
        unused: names of the source joints that drive nothing.
    """

    joints: Mapping[str, int]
    trunk: tuple[int, ...]
    unused: tuple[str, ...]


def find_joints(
    path: object, names: tuple[str, ...], parents: IndexArray, override: Mapping[str, str] | None = None
) -> JointMap:
    """Recognise the joints of a foreign skeleton.

    Args:
        path: the file, for messages.
        names: J joint names.
        parents: (J,) parent of each joint, -1 for the root.
        override: the user's source joint names by role; `none` leaves a role without a joint.

    Raises:
        UnknownNameError: the override names an unknown role.
        MotionFileError: the override names a joint that the file lacks, or a needed part is missing.
    """
    roles = _roles_by_name(names)
    for side in SIDES:
        _resolve_doubles(side, roles, parents)
    if "neck" not in roles and "head" in roles and parents[roles["head"]] >= 0:
        roles["neck"] = roles.pop("head")
    _override(path, roles, names, override)
    needed = [f"{side}_{part}" for side in SIDES for part in LIMB_PARTS] + ["neck"]
    missing = [role for role in needed if role not in roles]
    if missing:
        raise MotionFileError(
            path,
            f"no joint found for {', '.join(missing)}; joints of the file: {shown_names(names, 30)}. "
            'A joint map (--joint-map FILE with {"part": "joint name"}) can name them',
        )
    taken: dict[int, str] = {}
    for role in needed:
        if roles[role] in taken:
            raise MotionFileError(
                path, f"joint {names[roles[role]][:LONG_NAME]!r} stands for {taken[roles[role]]} and for {role}"
            )
        taken[roles[role]] = role
    trunk = _trunk(path, roles, names, parents)
    used = set(roles.values()) | set(trunk)
    for joint in list(used):
        used.update(_ancestors(joint, parents))
    unused = tuple(name for number, name in enumerate(names) if number not in used and not name.endswith("_end"))
    return JointMap(roles, trunk, unused)


def guess_roles(path: object, names: tuple[str, ...], override: Mapping[str, str] | None = None) -> dict[str, int]:
    """Indices of named points by role, by name alone. Two roles may share a point; a role without a name is left out.

    Args:
        path: the file, for messages.
        names: J names.
        override: the user's names by role; `none` leaves a role without a point.

    Raises:
        UnknownNameError: the override names an unknown role.
        MotionFileError: the override names a point that the file lacks.
    """
    roles = _roles_by_name(names)
    _override(path, roles, names, override)
    return roles


def read_joint_map(path: str | Path) -> dict[str, str]:
    """Read a user's joint map: a JSON object of our part names to the file's joint names.

    Raises:
        MotionFileError: missing, or not an object of strings.
    """
    try:
        with open_text(Path(path), "a JSON object") as stream:
            text = stream.read(MAX_MAP + 1)
        if len(text) > MAX_MAP:
            raise MotionFileError(path, f"longer than {MAX_MAP} characters, which no joint map is")
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MotionFileError(path, f"not valid JSON ({error})") from None
    if not isinstance(content, dict) or not all(isinstance(value, str) for value in content.values()):
        raise MotionFileError(path, f"not an object of strings; valid keys: {', '.join(ROLES)}")
    return content


def _roles_by_name(names: tuple[str, ...]) -> dict[str, int]:
    roles: dict[str, int] = {}
    parts = [_split(name) for name in _without_shared(names)]
    for role in ROLES:
        side, _, part = role.partition("_")
        found = _first(parts, side, _WORDS[part]) if side in SIDES else _first(parts, "", _TRUNK_WORDS[role])
        if found is not None:
            roles[role] = found
    return roles


def _override(path: object, roles: dict[str, int], names: tuple[str, ...], override: Mapping[str, str] | None) -> None:
    index = {name: number for number, name in enumerate(names)}
    for role, name in (override or {}).items():
        if role not in ROLES:
            raise UnknownNameError("part in the joint map", role[:LONG_NAME], ROLES)
        if name == "none":
            roles.pop(role, None)
        elif name in index:
            roles[role] = index[name]
        else:
            raise MotionFileError(
                path,
                f"the joint map names {name[:LONG_NAME]!r} for {role!r}; joints of the file: {shown_names(names, 40)}",
            )


def shown_names(names: Sequence[str], most: int) -> str:
    """Names for a message: the first few, each shortened if too long."""
    return ", ".join(name[:LONG_NAME] for name in names[:most]) + (", ..." if len(names) > most else "")


def _without_shared(names: tuple[str, ...]) -> list[str]:
    """Names without the beginning and end that all share, up to a separator; end sites as they are."""
    joints = [name for name in names if not name.endswith("_end")]
    if len(joints) < 2:
        return list(names)
    begin = _shared_beginning(joints)
    end = _shared_beginning([name[::-1] for name in joints])
    return [name if name.endswith("_end") else name[begin : len(name) - end] for name in names]


def _shared_beginning(names: list[str]) -> int:
    """Length of the beginning that all names share, its last separator included."""
    first, last = min(names), max(names)
    shared = "".join(a for a, _ in takewhile(lambda pair: pair[0] == pair[1], zip(first, last)))
    return len(re.sub(r"[^_:. -]*$", "", shared))


def _split(name: str) -> tuple[str, str]:
    """Side (`left`, `right` or empty) and rest of a joint name, lower-case letters; both empty for helper joints."""
    if name.endswith("_end"):
        return "", ""
    bare = re.sub(r":[0-9]+$", "", name)  # Poser numbers its figures: lThigh:1
    while (match := _PREFIXES.match(bare)) and match.end() < len(bare):
        bare = bare[match.end() :]
    spaced = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", bare)
    spaced = re.sub(r"([A-Z])([A-Z][a-z])", r"\1 \2", spaced)
    tokens = [token for token in re.split(r"[^a-zA-Z]+", spaced.lower()) if token]
    side = ""
    rest = []
    for token in tokens:
        if token in ("left", "l") and not side:
            side = "left"
        elif token in ("right", "r") and not side:
            side = "right"
        elif token.startswith(("left", "right")) and not side:
            side = "left" if token.startswith("left") else "right"
            rest.append(token[len(side) :])
        else:
            rest.append(token)
    word = "".join(rest)
    helpers = ("twist", "share", "roll", "pinky", "ring", "thumb", "nub", "breast", "ribs", "eye", "jaw")
    if any(helper in word for helper in helpers) and word != "necktwist":
        return "", ""
    known = {text for words in _WORDS.values() for text in words}
    if not side and word[:1] in ("l", "r") and word[1:] in known and word not in known:
        side, word = ("left" if word[0] == "l" else "right"), word[1:]
    return side, word


def _first(parts: list[tuple[str, str]], side: str, words: tuple[str, ...]) -> int | None:
    for word in words:
        for number, part in enumerate(parts):
            if part == (side, word):
                return number
    return None


def _resolve_doubles(side: str, roles: dict[str, int], parents: IndexArray) -> None:
    """Let the chain decide where a word has two meanings."""
    for base_role, end_role in ((f"{side}_foot", f"{side}_toe"), (f"{side}_hand", f"{side}_hand_tip")):
        base, end = roles.get(base_role), roles.get(end_role)
        # 'foot' is the ankle in most skeletons; in SMPL, which also has an ankle, it is the ball
        if end is not None and (base is None or base not in _ancestors(end, parents)):
            del roles[end_role]
            end = None
        if end is None and base is not None:
            # an unnamed continuation, such as an end site, shows where the foot or hand points
            child = _continuation(base, parents)
            if child is not None:
                roles[end_role] = child
    forearm = roles.get(f"{side}_forearm")
    if f"{side}_hand" not in roles and forearm is not None:
        child = _continuation(forearm, parents)
        if child is not None:
            roles[f"{side}_hand"] = child


def _continuation(joint: int, parents: IndexArray) -> int | None:
    children = np.flatnonzero(parents == joint)
    return int(children[0]) if len(children) == 1 else None


def _ancestors(joint: int, parents: IndexArray) -> list[int]:
    out = []
    while parents[joint] >= 0:
        joint = int(parents[joint])
        out.append(joint)
    return out


def _trunk(path: object, roles: dict[str, int], names: tuple[str, ...], parents: IndexArray) -> tuple[int, ...]:
    left = [roles["left_thigh"], *_ancestors(roles["left_thigh"], parents)]
    right = [roles["right_thigh"], *_ancestors(roles["right_thigh"], parents)]
    up = [roles["neck"], *_ancestors(roles["neck"], parents)]
    common = [joint for joint in left if joint in right and joint in up]
    if not common:
        raise MotionFileError(
            path,
            f"{names[roles['left_thigh']]!r}, {names[roles['right_thigh']]!r} and {names[roles['neck']]!r} "
            "have no common ancestor: not one skeleton",
        )
    chain = up[: up.index(common[0]) + 1][::-1]
    return tuple(chain)
