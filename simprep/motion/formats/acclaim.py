"""Acclaim ASF (skeleton) and AMC (motion): bones with their own axes and degrees of freedom, frames of named values.

A bone's rotation in its parent's frame is C M C^-1, with C its `axis` and M its channels, both Euler angles about fixed
axes in the order written (Lander 1998, "Working with motion capture file formats", Game Developer, January). With all
channels at zero, every bone is oriented as the world. Simprep's joint is the beginning of the bone.
"""

import re
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.errors import MotionFileError
from simprep.motion.formats.format import Format, Glimpse, ReadOptions
from simprep.motion.formats.numbers import LARGEST, Decimals, decimal_notes
from simprep.motion.formats.skeleton import SourceClip, check_size, forward
from simprep.motion.formats.text import MAX_NAME, Comments, lines_of, open_text
from simprep.motion.rotations import axis_rotation

DEFAULT_FPS = 120.0
"""AMC files state no frame rate; those of CMU, the usual source, have 120 frames/s."""
MAX_BONES = 500
# written by the recording system, no remark of a person
_HEAD = re.compile(r"#(!OML|\s*AST/ASF file|\s*-+\s*$)")
_SECTIONS = ("version", "name", "units", "documentation", "root", "bonedata", "hierarchy", "skin")


@dataclass
class _Bone:
    name: str
    line: int
    direction: FloatArray = field(default_factory=lambda: np.zeros(3))
    length: float = 0.0
    axis: FloatArray = field(default_factory=lambda: np.eye(3))
    dofs: tuple[str, ...] = ()


@dataclass
class _Skeleton:
    decimals: Decimals
    notes: list[str] = field(default_factory=list)
    bones: dict[str, _Bone] = field(default_factory=dict)
    children: list[tuple[str, list[str], int]] = field(default_factory=list)
    unit_m: float | None = None
    degrees: bool = True
    order: tuple[str, ...] = ()
    root_axis: FloatArray = field(default_factory=lambda: np.eye(3))
    sections: set[str] = field(default_factory=set)


def read_acclaim(path: Path) -> SourceClip:
    """Read an AMC file with the ASF beside it.

    The skeleton is the .asf of the same name, else that of the part before the first underscore (CMU: 02.asf for
    02_01.amc), else the only one in the folder.

    Raises:
        MotionFileError: no skeleton, or either file malformed, with the line.
    """
    skeleton_path = find_skeleton(path)
    skeleton = _read_skeleton(skeleton_path)
    names, parents = _tree(skeleton_path, skeleton)
    frames, degrees, notes = _read_motion(path, skeleton)
    factor = np.pi / 180 if degrees else 1.0
    count = len(next(iter(frames.values())))
    check_size(path, count, len(names), path.stat().st_size + skeleton_path.stat().st_size)
    offsets = np.zeros((len(names), 3))
    local = np.tile(np.eye(3), (count, len(names), 1, 1))
    place = np.zeros((count, 3))
    channels = {name: (bone.axis, bone.dofs) for name, bone in skeleton.bones.items()}
    channels["root"] = skeleton.root_axis, skeleton.order
    for index, name in enumerate(names):
        parent = skeleton.bones.get(names[parents[index]])
        if name != "root" and parent is not None:
            offsets[index] = parent.direction * parent.length
        if name not in frames:
            continue
        axis, dofs = channels[name]
        turn = np.tile(np.eye(3), (count, 1, 1))
        for dof, values in zip(dofs, frames[name].T):
            if dof[0] == "r":
                turn = axis_rotation(dof[1], values * factor) @ turn
            elif name == "root":
                place[:, "xyz".index(dof[1])] = values
        local[:, index] = axis @ turn @ axis.T
    positions, rotations = forward(parents, offsets, local)
    positions += place[:, None]
    identity = np.tile(np.eye(3), (1, len(names), 1, 1))
    rest, _ = forward(parents, offsets, identity)
    notes = [
        f"skeleton: {skeleton_path.name}",
        f"AMC files state no frame rate: taken as {DEFAULT_FPS:g} frames/s, CMU's",
        *(f"{skeleton_path.name}: {note}" for note in skeleton.notes),
        *notes,
    ]
    return SourceClip(
        path=path, format="Acclaim", names=names, parents=parents, positions=positions, rotations=rotations,
        rest_positions=rest[0], rest_rotations=identity[0], fps=DEFAULT_FPS, unit_m=skeleton.unit_m, notes=tuple(notes),
    )  # fmt: skip


def find_skeleton(path: Path) -> Path:
    """The .asf that belongs to an .amc.

    Raises:
        MotionFileError: none, or several without one of the take's name.
    """
    found = sorted(file for file in path.parent.iterdir() if file.suffix.lower() == ".asf")
    for stem in (path.stem, path.stem.split("_")[0]):
        for file in found:
            if file.stem.lower() == stem.lower():
                return file
    if len(found) == 1:
        return found[0]
    wanted = f"{path.stem.split('_')[0]}.asf"
    if not found:
        raise MotionFileError(path, f"needs its skeleton, {wanted}, in the same folder; there is no .asf")
    raise MotionFileError(
        path,
        f"needs its skeleton, {wanted}, in the same folder; there are {', '.join(file.name for file in found[:8])}",
    )


def _lines(path: Path, what: str, comments: Comments) -> Iterator[tuple[int, list[str]]]:
    with open_text(path, what) as stream:
        for line, text in lines_of(path, stream):
            tokens = [] if _HEAD.match(text) else comments.strip(text).split()
            if tokens:
                yield line, tokens


def _read_skeleton(path: Path) -> _Skeleton:
    skeleton = _Skeleton(Decimals(path))
    comments = Comments()
    section = ""
    bone: _Bone | None = None
    for line, tokens in _lines(path, "an Acclaim skeleton (.asf)", comments):
        key = tokens[0].lower()
        if key.startswith(":"):
            if bone is not None:
                raise MotionFileError(path, f"section {tokens[0][:40]} before the 'end' of bone {bone.name!r}", line)
            section = key[1:]
            if section not in _SECTIONS:
                raise MotionFileError(path, f"section {tokens[0][:40]!r}; valid: :{', :'.join(_SECTIONS)}", line)
            skeleton.sections.add(section)
        elif section == "units":
            _unit(path, skeleton, tokens, line)
        elif section == "root":
            _root(path, skeleton, tokens, line)
        elif section == "bonedata":
            bone = _bone_line(path, skeleton, bone, tokens, line)
        elif section == "hierarchy":
            if key not in ("begin", "end"):
                skeleton.children.append((tokens[0], tokens[1:], line))
        elif section == "":
            raise MotionFileError(path, f"begins with {tokens[0][:40]!r}; valid: an Acclaim skeleton", line)
    for needed in ("units", "root", "bonedata", "hierarchy"):
        if needed not in skeleton.sections:
            raise MotionFileError(path, f"no section :{needed} (truncated?)")
    if bone is not None:
        raise MotionFileError(path, f"bone {bone.name!r} has no 'end' (truncated?)", bone.line)
    if not skeleton.order:
        raise MotionFileError(path, "the root has no 'order'")
    skeleton.notes += [*decimal_notes(skeleton.decimals.check()), *comments.notes()]
    return skeleton


def _unit(path: Path, skeleton: _Skeleton, tokens: list[str], line: int) -> None:
    if tokens[0].lower() == "length" and len(tokens) > 1:
        length = skeleton.decimals.number(tokens[1], "the length unit", line)
        if length <= 0:
            raise MotionFileError(path, f"length unit {length:g}; valid: above 0", line)
        # in the file, this number is one inch
        skeleton.unit_m = 0.0254 / length
    elif tokens[0].lower() == "angle" and len(tokens) > 1:
        if tokens[1].lower() not in ("deg", "rad"):
            raise MotionFileError(path, f"angle unit {tokens[1][:40]!r}; valid: deg, rad", line)
        skeleton.degrees = tokens[1].lower() == "deg"


def _euler(path: Path, skeleton: _Skeleton, values: list[str], order: str, what: str, line: int) -> FloatArray:
    """Rotation of Euler angles about fixed axes, the first of `order` first."""
    if sorted(order.lower()) != ["x", "y", "z"]:
        raise MotionFileError(path, f"axis order {order[:20]!r} of {what}; valid: an order of XYZ", line)
    angles = [skeleton.decimals.number(value, f"the axis of {what}", line) for value in values]
    out = np.eye(3)
    for axis, angle in zip(order.lower(), angles):
        out = axis_rotation(axis, np.array(np.radians(angle) if skeleton.degrees else angle)) @ out
    return out


def _root(path: Path, skeleton: _Skeleton, tokens: list[str], line: int) -> None:
    key = tokens[0].lower()
    if key == "order":
        order = tuple(token.lower() for token in tokens[1:])
        if any(not re.fullmatch("[tr][xyz]", token) for token in order) or len(set(order)) < len(order):
            raise MotionFileError(
                path, f"root order {' '.join(tokens[1:])[:60]!r}; valid: TX TY TZ RX RY RZ, each once", line
            )
        skeleton.order = order
    elif key == "orientation" and len(tokens) == 4:
        angles = [skeleton.decimals.number(value, "the root's orientation", line) for value in tokens[1:]]
        if any(angles):
            skeleton.root_axis = _euler(path, skeleton, tokens[1:], "xyz", "the root", line)


def _bone_line(path: Path, skeleton: _Skeleton, bone: _Bone | None, tokens: list[str], line: int) -> _Bone | None:
    key = tokens[0].lower()
    if key == "begin":
        if bone is not None:
            raise MotionFileError(path, f"'begin' inside bone {bone.name!r}", line)
        if len(skeleton.bones) >= MAX_BONES:
            raise MotionFileError(path, f"more than {MAX_BONES} bones", line)
        return _Bone("", line)
    if bone is None:
        raise MotionFileError(path, f"{tokens[0][:40]!r} outside of a bone; valid: begin", line)
    if key == "end":
        if not bone.name:
            raise MotionFileError(path, "a bone without a name", line)
        if bone.name in skeleton.bones or bone.name == "root":
            raise MotionFileError(path, f"a second bone called {bone.name!r}", line)
        skeleton.bones[bone.name] = bone
        return None
    if key == "name" and len(tokens) == 2:
        if len(tokens[1]) > MAX_NAME:
            raise MotionFileError(path, f"a name of {len(tokens[1])} characters; valid: up to {MAX_NAME}", line)
        bone.name = tokens[1]
    elif key == "direction" and len(tokens) == 4:
        bone.direction = np.array(
            [skeleton.decimals.number(t, f"the direction of {bone.name!r}", line) for t in tokens[1:]]
        )
        norm = float(np.linalg.norm(bone.direction))
        if not 1e-6 < norm < 1e6:
            raise MotionFileError(path, f"the direction of {bone.name!r} has length {norm:g}; valid: 1", line)
        bone.direction /= norm
    elif key == "length" and len(tokens) == 2:
        bone.length = skeleton.decimals.number(tokens[1], f"the length of {bone.name!r}", line)
        if not 0 <= bone.length < 1e6:
            raise MotionFileError(path, f"the length of {bone.name!r} is {bone.length:g}; valid: 0 to 1e6", line)
    elif key == "axis" and len(tokens) == 5:
        bone.axis = _euler(path, skeleton, tokens[1:4], tokens[4], repr(bone.name), line)
    elif key == "dof":
        bone.dofs = tuple(token.lower() for token in tokens[1:])
        if any(not re.fullmatch("[tr][xyz]|l", token) for token in bone.dofs):
            raise MotionFileError(path, f"dof {' '.join(tokens[1:])[:60]!r} of {bone.name!r}; valid: rx ry rz", line)
    elif key in ("name", "direction", "length", "axis"):
        raise MotionFileError(path, f"{' '.join(tokens)[:60]!r} has the wrong number of values", line)
    return bone


def _tree(path: Path, skeleton: _Skeleton) -> tuple[tuple[str, ...], IndexArray]:
    """Bones, parents before children; the end of every last bone follows as `<bone>_end`."""
    children: dict[str, list[str]] = {}
    parent_of: dict[str, str] = {}
    for parent, names, line in skeleton.children:
        for name in (parent, *names):
            if name != "root" and name not in skeleton.bones:
                raise MotionFileError(path, f"the hierarchy names {name[:40]!r}, which has no bone data", line)
        for name in names:
            if name in parent_of or name == "root":
                raise MotionFileError(path, f"{name!r} has two parents, or is its own ancestor", line)
            parent_of[name] = parent
            children.setdefault(parent, []).append(name)
    names_out, parents, queue = ["root"], [-1], ["root"]
    index = {"root": 0}
    while queue:
        parent = queue.pop(0)
        for name in children.get(parent, []):
            index[name] = len(names_out)
            names_out.append(name)
            parents.append(index[parent])
            queue.append(name)
    lost = sorted(set(skeleton.bones) - set(index))
    if lost:
        what = "in a cycle" if lost[0] in parent_of else "missing from the hierarchy"
        raise MotionFileError(path, f"bone {lost[0]!r} is {what}: it does not hang on the root")
    for name in list(names_out[1:]):
        if name not in children:
            names_out.append(f"{name}_end")
            parents.append(index[name])
    return tuple(names_out), np.array(parents, dtype=np.intp)


def _read_motion(path: Path, skeleton: _Skeleton) -> tuple[dict[str, FloatArray], bool, list[str]]:
    """Values of every bone (T, dofs), whether they are degrees, and notes for the report."""
    decimals, comments = Decimals(path), Comments()
    widths = {name: len(bone.dofs) for name, bone in skeleton.bones.items()}
    widths["root"] = len(skeleton.order)
    degrees = skeleton.degrees
    values: dict[str, array[float]] = {}
    frames, here = 0, set[str]()
    for line, tokens in _lines(path, "an Acclaim motion (.amc)", comments):
        key = tokens[0]
        if key.startswith(":"):
            if key.upper() in (":DEGREES", ":RADIANS"):
                degrees = key.upper() == ":DEGREES"
        elif len(tokens) == 1 and re.fullmatch("-?[0-9]+", key):
            if frames and len(here) < max(1, len(values)):
                raise _incomplete(path, frames, here, values, line)
            if len(key) > 9 or int(key) < 0:
                raise MotionFileError(path, f"frame number {key[:20]}; valid: 1 or more", line)
            frames, here = frames + 1, set()
        elif not frames:
            raise MotionFileError(path, f"{key[:40]!r} before the first frame number", line)
        elif key not in widths:
            shown = ", ".join(list(widths)[:12])
            raise MotionFileError(path, f"bone {key[:40]!r}, which the skeleton lacks; it has {shown}, ...", line)
        elif len(tokens) - 1 != widths[key]:
            raise MotionFileError(path, f"{len(tokens) - 1} values of {key!r}; valid: {widths[key]}", line)
        elif key in here:
            raise MotionFileError(path, f"bone {key!r} twice in a frame", line)
        elif frames > 1 and key not in values:
            raise MotionFileError(path, f"bone {key!r} in frame {frames} but not in the first", line)
        else:
            here.add(key)
            try:
                row = [float(token) for token in tokens[1:]]
                decimals.look_for_point(tokens[1:])
            except ValueError:
                row = [decimals.number(token, f"a value of {key!r}", line) for token in tokens[1:]]
            if not all(-LARGEST <= value <= LARGEST for value in row):  # also NaN
                row = [decimals.number(token, f"a value of {key!r}", line) for token in tokens[1:]]
            values.setdefault(key, array("d")).extend(row)
    if not frames or not values:
        raise MotionFileError(path, "no frames")
    if len(here) < len(values):
        raise _incomplete(path, frames, here, values, None)
    if "root" not in values:
        raise MotionFileError(path, "no values of the root")
    notes = [*decimal_notes(decimals.check()), *comments.notes()]
    return {name: np.array(row).reshape(frames, widths[name]) for name, row in values.items()}, degrees, notes


def _incomplete(path: Path, frame: int, here: set[str], names: Iterable[str], line: int | None) -> MotionFileError:
    missing = [name for name in names if name not in here] or ["any bone"]
    return MotionFileError(path, f"frame {frame} has no values of {missing[0]!r} (truncated?)", line)


_MOTION_WORDS = {":FULLY-SPECIFIED", ":DEGREES", ":RADIANS"}
_SKELETON_WORDS = {":version", ":bonedata", ":root"}


def _recognise(seen: Glimpse) -> str | None:
    first = {line.split()[0] for line in seen.text.splitlines() if line.strip()}
    if {word.upper() for word in first} & _MOTION_WORDS:
        return "Acclaim motion (AMC), with its skeleton (ASF)"
    if first >= _SKELETON_WORDS:
        return "Acclaim skeleton (ASF) without motion"
    return None


def _read_format(path: Path, options: ReadOptions) -> SourceClip:
    if path.suffix.lower() == ".asf":
        raise MotionFileError(path, "an Acclaim skeleton without motion; valid: its .amc file")
    return read_acclaim(path)


FORMAT = Format("acclaim", "Acclaim, .amc with its .asf", (".amc", ".asf"), _recognise, _read_format)
