"""Biovision BVH files: a joint hierarchy with channels, then one line of numbers per frame."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import MotionFileError
from simprep.motion.formats.format import Format, Glimpse, ReadMotion, ReadOptions
from simprep.motion.formats.numbers import Decimals, decimal_notes, number, numbers
from simprep.motion.formats.skeleton import SourceClip, check_size, forward, tidy_fps
from simprep.motion.formats.text import MAX_NAME, Comments, lines_of, open_text
from simprep.motion.motion import Motion
from simprep.motion.rotations import turned_on

MAX_JOINTS = 2000
_CHANNELS = {f"{axis}{kind}": (kind, axis) for axis in "xyz" for kind in ("position", "rotation")}


@dataclass
class _Joint:
    name: str
    parent: int
    line: int
    offset: list[float] | None = None
    channels: list[tuple[str, str]] = field(default_factory=list)  # (position or rotation, axis), file order


def read_bvh(path: Path) -> SourceClip:
    """Read a BVH file of one person, in file units and file axes.

    Some exporters write position channels on every joint. They replace the OFFSET where they contain it, else they are
    added to it. The report notes this, and comments, decimal commas and a number of frames that is off by one.

    Raises:
        MotionFileError: anything malformed, with the line; a second ROOT.
    """
    return _read(path, most=1)[0]


def read_bvh_people(path: Path) -> tuple[SourceClip, ...]:
    """Read a BVH file with one ROOT for each person, all in one frame of reference: a clip for each, in file order.

    Raises:
        MotionFileError: as for `read_bvh`.
    """
    return _read(path, most=MAX_JOINTS)


def _read(path: Path, most: int) -> tuple[SourceClip, ...]:
    comments = Comments()
    with open_text(path, "a BVH file") as stream:
        lines = lines_of(path, stream)
        offsets = Decimals(path)
        joints = _hierarchy(path, lines, most, offsets, comments)
        head = Decimals(path)
        count, frame_time, line = _motion_header(path, lines, head, comments)
        columns = sum(len(joint.channels) for joint in joints)
        if columns == 0:
            raise MotionFileError(path, "no joint has channels")
        check_size(path, count, len(joints))
        values, commas, notes = numbers(path, stream.read(), line + 1, columns, count, comments)
    notes += [*decimal_notes(offsets.check() + head.check() + commas), *comments.notes()]
    # only now do numbers back the number of frames, and the hierarchy the number of joints
    check_size(path, len(values), len(joints), path.stat().st_size)
    first = [index for index, joint in enumerate(joints) if joint.parent < 0]
    clips, column = [], 0
    for start, end in pairwise([*first, len(joints)]):
        person = joints[start:end]
        width = sum(len(joint.channels) for joint in person)
        own = [replace(joint, parent=max(joint.parent - start, -1)) for joint in person]
        clips.append(_clip(path, own, values[:, column : column + width], tidy_fps(1 / frame_time), notes))
        column += width
    return tuple(clips)


def _hierarchy(
    path: Path, lines: Iterator[tuple[int, str]], most: int, decimals: Decimals, comments: Comments
) -> list[_Joint]:
    """Joints of up to `most` people in file order, MOTION read too. A loop, because recursion has a largest depth."""
    joints: list[_Joint] = []
    stack: list[int] = []
    seen: set[str] = set()
    people = 0
    pending: _Joint | None = None
    started = False
    line = 0
    for line, text in lines:
        named = text.lstrip()[:5].upper().startswith(("ROOT", "JOINT"))
        text = comments.strip_whole(text) if named else comments.strip(text)
        tokens = text.replace("{", " { ").replace("}", " } ").split()
        while tokens:
            word = tokens.pop(0)
            key = word.upper()
            if not started:
                if key != "HIERARCHY":
                    raise MotionFileError(path, f"begins with {word[:40]!r}; valid: HIERARCHY", line)
                started = True
            elif key in ("ROOT", "JOINT", "END"):
                if pending is not None:
                    raise MotionFileError(path, f"{word} before the '{{' of {pending.name!r}", line)
                if key == "ROOT":
                    if stack:
                        raise MotionFileError(path, f"ROOT before the '}}' of {joints[stack[-1]].name!r}", line)
                    people, seen = people + 1, set()
                    if people > most:
                        raise MotionFileError(
                            path,
                            "a second ROOT; valid: one skeleton in a file (`simprep duel import` takes two people in one)",
                            line,
                        )
                elif not stack:
                    raise MotionFileError(path, f"{word} outside of the ROOT", line)
                name = " ".join(tokens[: tokens.index("{")] if "{" in tokens else tokens)
                tokens = tokens[tokens.index("{") :] if "{" in tokens else []
                if key == "END":
                    name = f"{joints[stack[-1]].name}_end"
                elif not name:
                    raise MotionFileError(path, f"{word} without a name", line)
                elif len(name) > MAX_NAME:
                    raise MotionFileError(path, f"a name of {len(name)} characters; valid: up to {MAX_NAME}", line)
                elif name in seen:
                    raise MotionFileError(path, f"a second joint called {name!r}", line)
                seen.add(name)
                pending = _Joint(name, stack[-1] if stack else -1, line)
                if len(joints) >= MAX_JOINTS:
                    raise MotionFileError(path, f"more than {MAX_JOINTS} joints", line)
            elif key == "{":
                if pending is None:
                    raise MotionFileError(path, "'{' without a joint", line)
                stack.append(len(joints))
                joints.append(pending)
                pending = None
            elif key == "}":
                if not stack:
                    raise MotionFileError(path, "'}' without a '{'", line)
                _finish(path, joints[stack.pop()], line)
            elif key == "OFFSET":
                if not stack or len(tokens) < 3:
                    raise MotionFileError(path, "OFFSET needs a joint and 3 numbers", line)
                joint = joints[stack[-1]]
                joint.offset = [decimals.number(token, f"the offset of {joint.name!r}", line) for token in tokens[:3]]
                tokens = tokens[3:]
            elif key == "CHANNELS":
                if not stack or not tokens:
                    raise MotionFileError(path, "CHANNELS needs a joint and a count", line)
                tokens = _channels(path, joints[stack[-1]], tokens, line)
            elif key == "MOTION":
                if stack or pending is not None or not joints:
                    where = joints[stack[-1]].name if stack else "the hierarchy"
                    raise MotionFileError(path, f"MOTION before the '}}' of {where!r}", line)
                return joints
            else:
                valid = "ROOT, JOINT, End Site, OFFSET, CHANNELS, braces, MOTION"
                raise MotionFileError(path, f"unknown word {word[:40]!r}; valid: {valid}", line)
    raise MotionFileError(path, "no MOTION section (truncated?)" if started else "empty; valid: a BVH file", line)


def _finish(path: Path, joint: _Joint, line: int) -> None:
    if joint.offset is None:
        raise MotionFileError(path, f"joint {joint.name!r} has no OFFSET", line)
    if max(abs(value) for value in joint.offset) > 1e6:
        raise MotionFileError(path, f"the offset of {joint.name!r} is beyond 1e6 units", joint.line)


def _channels(path: Path, joint: _Joint, tokens: list[str], line: int) -> list[str]:
    count = number(path, tokens[0], f"the channel count of {joint.name!r}", line)
    if count not in range(7) or len(tokens) <= count:
        raise MotionFileError(
            path,
            f"{tokens[0][:40]} channels of {joint.name!r}, {len(tokens) - 1} named; valid: 0 to 6, all on this line",
            line,
        )
    names = tokens[1 : 1 + int(count)]
    for name in names:
        if name.lower() not in _CHANNELS:
            valid = "Xposition, Yposition, Zposition, Xrotation, Yrotation, Zrotation"
            raise MotionFileError(path, f"channel {name[:40]!r} of {joint.name!r}; valid: {valid}", line)
    channels = [_CHANNELS[name.lower()] for name in names]
    if len(set(channels)) < len(channels) or joint.channels:
        raise MotionFileError(path, f"joint {joint.name!r} has a channel twice", line)
    joint.channels = channels
    return tokens[1 + int(count) :]


def _motion_header(
    path: Path, lines: Iterator[tuple[int, str]], decimals: Decimals, comments: Comments
) -> tuple[int, float, int]:
    """Number of frames, frame time [s], and its line."""
    count: int | None = None
    line = 0
    for line, whole in lines:
        text = comments.strip(whole).strip()
        if not text:
            continue
        key, _, value = text.partition(":")
        key = " ".join(key.lower().split())
        if key == "frames":
            if re.fullmatch("0*[0-9]{9,}", value.strip()):
                raise MotionFileError(path, f"{value.strip()[:40]} frames declared: more than can be imported", line)
            declared = number(path, value.strip() or "nothing", "the number of frames", line)
            if declared != int(declared) or declared < 1:
                raise MotionFileError(path, f"{value.strip()} frames; valid: a whole number, 1 or more", line)
            count = int(declared)
        elif key == "frame time":
            frame_time = decimals.number(value.strip() or "nothing", "the frame time", line)
            if not 1e-3 <= frame_time <= 1:
                raise MotionFileError(
                    path, f"frame time {frame_time:g} s; valid: 0.001 to 1 (1000 to 1 frames/s)", line
                )
            if count is None:
                raise MotionFileError(path, "'Frame Time:' before 'Frames:'", line)
            return count, frame_time, line
        else:
            raise MotionFileError(path, f"{text[:40]!r} found; valid: 'Frames:' then 'Frame Time:'", line)
    raise MotionFileError(path, "no 'Frames:' and 'Frame Time:' after MOTION (truncated?)", line or None)


def _clip(path: Path, joints: list[_Joint], values: FloatArray, fps: float, noted: list[str]) -> SourceClip:
    parents = np.array([joint.parent for joint in joints], dtype=np.intp)
    offsets = np.array([joint.offset for joint in joints], dtype=np.float64)
    n = len(values)
    local = np.empty((len(joints), n, 3, 3))  # joint by joint: see `forward`
    moves: dict[int, FloatArray] = {}
    column = 0
    moving: list[str] = []
    notes = list(noted)
    for index, joint in enumerate(joints):
        moved = np.zeros((n, 3))
        has_position = False
        turn: FloatArray | None = None
        for kind, axis in joint.channels:
            if kind == "rotation":
                turn = turned_on(turn, axis, np.radians(values[:, column]))
            else:
                moved[:, "xyz".index(axis)] = values[:, column]
                has_position = True
            column += 1
        local[index] = np.eye(3) if turn is None else turn
        if not has_position:
            continue
        contains = np.abs(moved - offsets[index]).mean() <= np.abs(moved).mean()
        moves[index] = offsets[index] + moved if index == 0 or not contains else moved
        if index > 0:
            moving.append(joint.name)
    if max(np.abs(moved).max() for moved in (offsets, *moves.values())) > 1e7:
        raise MotionFileError(path, "positions beyond 1e7 units")
    if moving:
        place = np.tile(offsets, (n, 1, 1))
        for index, moved in moves.items():
            place[:, index] = moved
        length = np.linalg.norm(place[:, 1:], axis=-1)
        change = float(np.ptp(length, axis=0).max()) if n > 1 else 0.0
        notes.append(
            f"{len(moving)} inner joints have position channels (followed: bone lengths vary by up to {change:.3g} file "
            f"units): {', '.join(moving[:6])}{', ...' if len(moving) > 6 else ''}"
        )
        positions, rotations = forward(parents, place, np.swapaxes(local, 0, 1))
    else:
        positions, rotations = forward(parents, offsets, np.swapaxes(local, 0, 1))
        if moves:  # of the root, with which all joints go
            positions += (moves[0] - offsets[0])[:, None]
    identity = np.tile(np.eye(3), (1, len(joints), 1, 1))
    rest, _ = forward(parents, offsets, identity)
    if not math.isfinite(float(positions.sum())):
        raise MotionFileError(path, "positions that are not finite")
    return SourceClip(
        path=path, format="BVH", names=tuple(joint.name for joint in joints), parents=parents,
        positions=positions, rotations=rotations, rest_positions=rest[0], rest_rotations=identity[0],
        fps=fps, notes=tuple(notes),
    )  # fmt: skip


def _recognise(seen: Glimpse) -> str | None:
    first = next((line.split() for text in seen.text.splitlines() if (line := Comments().strip(text).strip())), [""])
    return "BVH" if first[0].upper() == "HIERARCHY" else None


def _read_format(path: Path, options: ReadOptions) -> SourceClip | ReadMotion:
    from simprep.motion.formats.own_skeleton import own_motion

    clip = read_bvh(path)
    return own_motion(clip, options.character) or clip


def _write(motion: Motion, path: Path) -> tuple[str, ...]:
    from simprep.motion.formats.bvh_write import write_bvh

    return write_bvh(motion, path)


FORMAT = Format("bvh", "BVH", (".bvh",), _recognise, _read_format, _write)
