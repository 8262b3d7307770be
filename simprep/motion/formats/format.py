"""What a motion file format is: a name, its extensions, how it is recognised, read and written."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from simprep.character import Character
from simprep.humanoid_model import humanoid
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.motion import Motion


@dataclass(frozen=True)
class Glimpse:
    """What is seen of a file before it is read; recognisers decide by this alone.

    Attributes:
        path: the file.
        raw: its first bytes, up to 4096.
        text: the same as text, whatever the encoding; empty for a binary file.
        entries: names of the arrays of an .npz, without `.npy`; empty for any other file.
    """

    path: Path
    raw: bytes
    text: str
    entries: frozenset[str]

    @property
    def suffix(self) -> str:
        """The extension in lower case, with its dot."""
        return self.path.suffix.lower()


@dataclass(frozen=True)
class ReadOptions:
    """What a reader may need to know that a file does not say.

    Attributes:
        character: whose joint angles a file of joint angles holds, unless the file says so; who moves.
        file_fps: frame rate of the file, for formats that do not state it; None for the format's usual one [1/s].
        joint_map: our parts to the file's names, for formats of points; None for names that are recognised.
        body_model: file of a body model with the shape of the person (SMPL family); None for a mean body.
        clip: which clip of a file with several; None if there is only one.
    """

    character: Character = humanoid()
    file_fps: float | None = None
    body_model: Path | None = None
    joint_map: Mapping[str, str] | None = None
    clip: str | None = None


DEFAULT_OPTIONS = ReadOptions()


@dataclass(frozen=True)
class ReadMotion:
    """A file of joint angles of a character we know: taken as it is, never retargeted.

    Attributes:
        motion: as in the file, at its frame rate.
        notes: the reader's decisions, for the report.
        up: the file's vertical axis.
        scale: metres per file unit.
        velocity_fps: frame rate that the file's stored joint velocities fit [1/s]; None where they tell nothing.
    """

    motion: Motion
    notes: tuple[str, ...] = ()
    up: str = "z"
    scale: float = 1.0
    velocity_fps: float | None = None


Recogniser = Callable[[Glimpse], str | None]
"""What a file is, in words for the report (`AMASS, SMPL-H: 52 joints`); None if it is not of the format."""
Reader = Callable[[Path, ReadOptions], SourceClip | ReadMotion]
"""Reads a file: a foreign skeleton, still to be retargeted, or a motion of a character of ours."""
Writer = Callable[[Motion, Path], tuple[str, ...]]
"""Writes a motion to exactly that path, whatever its extension; returns what the format cannot keep."""


@dataclass(frozen=True)
class Format:
    """A motion file format.

    Attributes:
        name: short name, as `simprep convert --to` takes it: `bvh`.
        title: for messages and tables: `BVH`.
        suffixes: extensions in lower case; the first is the usual one.
        recognise: tells by content whether a file is of this format.
        read: the reader; None if it is only written.
        write: the writer; None if it is only read.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    recognise: Recogniser
    read: Reader | None = None
    write: Writer | None = None
