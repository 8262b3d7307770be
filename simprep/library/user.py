"""A user's own clips: a folder with one small TOML file beside each motion file, its sidecar.

`my_kick.toml` beside `my_kick.bvh`:

    family = "kick"
    terms = "my own recording, free for any use"
    events = {target = 0.8, impact = 1.35}  # seconds from the first frame of the imported motion

Optional: `name` (default: the file's), `summary`, and what `simprep.load_motion` takes: `fps`, `up`, `scale` and
`joint_map` (a table, or the name of a JSON file in the folder).
"""

import glob
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from simprep.errors import MotionFileError, SettingError, SimprepError, UnknownNameError
from simprep.library.cache import cached_motion
from simprep.library.entry import FAMILIES, Entry, is_name
from simprep.library.registry import library_entries, library_motion
from simprep.motion.formats.registry import read_suffixes
from simprep.motion.load import load_motion
from simprep.motion.motion import Motion

ENVIRONMENT = "SIMPREP_LIBRARY"
"""Environment variable that names the folder."""
CLIP_SUFFIXES = tuple(suffix for suffix in read_suffixes() if suffix != ".asf")
"""Extensions of motion files; an .asf only belongs to one."""
KEYS = ("family", "terms", "name", "summary", "events", "fps", "up", "scale", "joint_map")
_EXAMPLE_TERMS = 'such as terms = "my own recording" or "CC BY 4.0"'


@dataclass(frozen=True)
class Sidecar:
    """What a sidecar says.

    Attributes:
        path, clip: the TOML file and the motion file.
        name: of the motion.
        family: one of `FAMILIES`.
        terms: of use.
        summary: what a person does in it.
        events: name to time from the first frame of the imported motion [s].
        fps, up, scale, joint_map: as for `load_motion`.
    """

    path: Path
    clip: Path
    name: str
    family: str
    terms: str
    summary: str
    events: Mapping[str, float]
    fps: float | None
    up: str | None
    scale: float | None
    joint_map: Mapping[str, str] | Path | None


def all_entries(folder: Path | None = None) -> tuple[Entry, ...]:
    """The built-in motions and then the user's, without loading any; each `generate` uses the cache.

    Args:
        folder: of the user's clips; None for `SIMPREP_LIBRARY`, and for no clips where that is not set.

    Raises:
        SettingError: no such folder.
        MotionFileError: a sidecar is wrong; the message names it and what is valid.
    """
    entries = {entry.name: entry for entry in _built_in()}
    for sidecar in read_folder(folder):
        if sidecar.name in entries:
            raise MotionFileError(
                sidecar.path, f"there is another motion {sidecar.name!r}; give this one a different name = ..."
            )
        entries[sidecar.name] = Entry(
            name=sidecar.name,
            family=sidecar.family,
            summary=sidecar.summary,
            generate=cache(partial(_load, sidecar)),
            terms=sidecar.terms,
        )
    return tuple(entries.values())


def find_entry(name: str, folder: Path | None = None) -> Entry:
    """A motion of the library by name; a built-in one is found even if the user's folder is faulty.

    Args:
        name: of a built-in motion or of a user's clip.
        folder: as for `all_entries`.

    Raises:
        UnknownNameError: no such motion; the message lists all.
        SimprepError: as for `all_entries`.
    """
    entries = {entry.name: entry for entry in _built_in()}
    if name not in entries:
        entries = {entry.name: entry for entry in all_entries(folder)}
    if name not in entries:
        raise UnknownNameError("motion", name, entries)
    return entries[name]


def _built_in() -> tuple[Entry, ...]:
    return tuple(replace(entry, generate=partial(library_motion, entry.name)) for entry in library_entries())


def read_folder(folder: Path | None = None) -> tuple[Sidecar, ...]:
    """All sidecars of a user's folder, by file name; arguments and errors as for `all_entries`."""
    named = os.environ.get(ENVIRONMENT)
    if folder is None and not named:
        return ()
    source = f"{ENVIRONMENT}={named}" if folder is None else f"--library {folder}"
    folder = Path(named or "").expanduser() if folder is None else folder
    if not folder.is_dir():
        raise SettingError(f"{source}: no such folder; valid: a folder with a .toml beside each motion file")
    return tuple(read_sidecar(path) for path in sorted(folder.glob("*.toml")))


def read_sidecar(path: Path) -> Sidecar:
    """Read one sidecar and find its clip.

    Raises:
        MotionFileError: not TOML, an unknown or missing key, a value of the wrong kind, or not exactly one clip.
    """
    try:
        with path.open("rb") as stream:
            content = tomllib.load(stream)
    except OSError as error:
        raise MotionFileError(path, f"cannot be read ({error.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise MotionFileError(path, f"not valid TOML: {error}") from None
    for key in content:
        if key not in KEYS:
            raise MotionFileError(path, f"unknown key {key!r}; valid: {', '.join(KEYS)}")
    texts = {key: _text(path, content, key) for key in ("family", "terms", "name", "summary", "up")}
    if texts["family"] not in FAMILIES:
        given = "no family" if texts["family"] is None else f"family {texts['family']!r}"
        raise MotionFileError(path, f"{given}; valid: {', '.join(FAMILIES)}")
    if not (texts["terms"] or "").strip():
        raise MotionFileError(path, f"no terms of use; say under what terms the clip may be used, {_EXAMPLE_TERMS}")
    name = texts["name"] if texts["name"] is not None else path.stem
    if not is_name(name):
        raise MotionFileError(path, f"name {name!r}; valid: letters, digits, _ and -; set it with name = ...")
    return Sidecar(
        path=path,
        clip=_clip_of(path),
        name=name,
        family=str(texts["family"]),
        terms=str(texts["terms"]).strip(),
        summary=texts["summary"] or "",
        events=_events(path, content.get("events", {})),
        fps=_number(path, content, "fps"),
        up=texts["up"],
        scale=_number(path, content, "scale"),
        joint_map=_joint_map(path, content.get("joint_map")),
    )


def _load(sidecar: Sidecar) -> Motion:
    files = [sidecar.path, sidecar.clip]
    if sidecar.clip.suffix.lower() == ".amc":
        files.extend(sorted(sidecar.clip.parent.glob("*.asf")))
    if isinstance(sidecar.joint_map, Path):
        files.append(sidecar.joint_map)
    try:
        inputs = b"\0".join(file.read_bytes() for file in files)
    except OSError as error:
        raise MotionFileError(error.filename, f"cannot be read ({error.strerror})") from None
    return cached_motion(sidecar.name, partial(_import, sidecar), inputs)


def _import(sidecar: Sidecar) -> Motion:
    try:
        motion = load_motion(sidecar.clip, sidecar.fps, sidecar.up, sidecar.scale, sidecar.joint_map)
    except MotionFileError:
        raise
    except SimprepError as error:
        raise MotionFileError(sidecar.path, str(error)) from None
    last = (len(motion) - 1) / motion.fps
    for event, time in sidecar.events.items():
        if not 0 <= time <= last + 0.5 / motion.fps:
            raise MotionFileError(
                sidecar.path, f"event {event!r} at {time:g} s; valid: 0 to {last:.2f} s, the clip's end"
            )
    frames = {event: min(round(time * motion.fps), len(motion) - 1) for event, time in sidecar.events.items()}
    return replace(motion, name=sidecar.name, events={**motion.events, **frames})


def _clip_of(path: Path) -> Path:
    beside = sorted(path.parent.glob(f"{glob.escape(path.stem)}.*"))
    clips = [file for file in beside if file.suffix.lower() in CLIP_SUFFIXES and file.stem == path.stem]
    if len(clips) != 1:
        found = f"clips {', '.join(file.name for file in clips)}" if clips else "no clip"
        names = ", ".join(f"{path.stem}{suffix}" for suffix in CLIP_SUFFIXES)
        raise MotionFileError(path, f"{found} beside it; valid: exactly one of {names}")
    return clips[0]


def _text(path: Path, content: Mapping[str, Any], key: str) -> str | None:
    value = content.get(key)
    if value is not None and not isinstance(value, str):
        raise MotionFileError(path, f"{key} = {value!r}; valid: text in quotes")
    return value


def _number(path: Path, content: Mapping[str, Any], key: str) -> float | None:
    value = content.get(key)
    if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
        raise MotionFileError(path, f"{key} = {value!r}; valid: a number")
    return value


def _events(path: Path, content: Any) -> dict[str, float]:
    example = "such as events = {target = 0.8, impact = 1.35}"
    if not isinstance(content, dict):
        raise MotionFileError(path, f"events = {content!r}; valid: names with times in seconds, {example}")
    for event, time in content.items():
        if isinstance(time, bool) or not isinstance(time, int | float):
            raise MotionFileError(path, f"event {event!r} = {time!r}; valid: a time in seconds, {example}")
    return {event: float(time) for event, time in content.items()}


def _joint_map(path: Path, content: Any) -> Mapping[str, str] | Path | None:
    if content is None:
        return None
    if isinstance(content, str):
        return path.parent / content
    if isinstance(content, dict) and all(isinstance(value, str) for value in content.values()):
        return content
    raise MotionFileError(
        path, 'joint_map; valid: a table of "our part" = "joint of the file", or the name of a JSON file'
    )
