"""A sweep as a person writes it, in TOML; the docs page docs/sweep.md explains every key."""

import glob
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from simprep.errors import MotionFileError, SettingError, SimprepError, UnknownNameError
from simprep.library import library_names
from simprep.motion.formats.registry import read_suffixes
from simprep.preparation.scenario import AlphaProfile
from simprep.study.plan import QUICK_PROFILE
from simprep.study.sweep.cases import DISTURBANCES, Body, Clip, Disturbance
from simprep.study.sweep.grid import Sweep
from simprep.study.sweep.measure import body_character, clip_digest

LISTS = ("clips", "locomotions", "targets", "arms", "alphas", "controllers", "characters", "disturbances")
KEYS = (*LISTS, "seeds", "preset", "seconds", "profile", "disturbance")
CLIP_KEYS = ("clip", "target_frame")
BODY_KEYS = ("character", "height_m", "mass_kg")
PROFILE_KEYS = ("lead_s", "rise_s", "hold_s")


def read_sweep(path: str | Path) -> Sweep:
    """The sweep of a TOML file. Paths in it are relative to its folder.

    Raises:
        MotionFileError: the file cannot be read, or a key or value is wrong; the message names it and what is valid.
    """
    path = Path(path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise MotionFileError(path, f"cannot be read ({error.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise MotionFileError(path, f"no TOML: {error}") from None
    try:
        return sweep_of(content, path.parent)
    except SimprepError as error:
        raise MotionFileError(path, str(error)) from None


def sweep_of(content: Mapping[str, Any], folder: Path = Path()) -> Sweep:
    """The sweep that a mapping describes, with the keys of a configuration file.

    Args:
        content: as TOML gives it.
        folder: that paths are relative to.

    Raises:
        SimprepError: a key or value is wrong.
    """
    _known("key", content, KEYS)
    for key in LISTS:
        if not isinstance(content.get(key, []), list):
            raise SettingError(f"{key} = {content[key]!r}; valid: a list in brackets")
    given: dict[str, Any] = {key: tuple(_texts(key, content[key])) for key in ("arms", "controllers") if key in content}
    if "alphas" in content:
        given["alphas"] = tuple(_number("alphas", value) for value in content["alphas"])
    if "seeds" in content:
        given["seeds"] = _seeds(content["seeds"])
    if "preset" in content:
        given["preset"] = next(iter(_texts("preset", [content["preset"]])))
    if "seconds" in content:
        given["seconds"] = _number("seconds", content["seconds"])
    if "profile" in content:
        profile = _table("profile", content["profile"], PROFILE_KEYS)
        times = {key.removesuffix("_s"): _number(key, value) for key, value in profile.items()}
        usual = {"lead": QUICK_PROFILE.lead, "rise": QUICK_PROFILE.rise, "hold": QUICK_PROFILE.hold}
        given["profile"] = AlphaProfile(**{**usual, **times})
    worlds = {**DISTURBANCES, **_disturbances(content.get("disturbance", {}))}
    wanted = list(_texts("disturbances", content.get("disturbances", ["nominal"])))
    for name in wanted:
        if name not in worlds:
            raise UnknownNameError("disturbance", name, worlds)
    return Sweep(
        bodies=tuple(body_of(item, folder) for item in content.get("characters", ["humanoid"])),
        clips=_clips("clips", content.get("clips", []), folder),
        locomotions=_clips("locomotions", content.get("locomotions", []), folder),
        targets=_clips("targets", content.get("targets", []), folder),
        disturbances=tuple(worlds[name] for name in wanted),
        **given,
    )


def _clips(key: str, items: Iterable[Any], folder: Path) -> tuple[Clip, ...]:
    """Clips by name, file, folder or glob, each once."""
    found: dict[Clip, None] = {}
    for item in items:
        frame = None
        if isinstance(item, Mapping):
            table = _table(key, item, CLIP_KEYS)
            item, frame = table.get("clip"), table.get("target_frame")
            if not (frame is None or (type(frame) is int and frame >= 0)):
                raise SettingError(f"{key}: target_frame {frame!r}; valid: a whole number from 0")
        if not isinstance(item, str) or not item:
            raise SettingError(
                f"{key}: {item!r}; valid: a name, file, folder or glob, or {{clip = ..., target_frame = ...}}"
            )
        if item in library_names():
            found[Clip(item, target_frame=frame)] = None
            continue
        for path in _files(key, item, folder):
            name = path.relative_to(folder) if path.is_relative_to(folder) else path
            found[Clip(name.as_posix(), str(path.resolve()), clip_digest(path), frame)] = None
    return tuple(found)


def _files(key: str, text: str, folder: Path) -> list[Path]:
    """Motion files that a text means: one, those of a folder and below, or those that fit a glob."""
    path = folder / Path(text).expanduser()
    if path.is_file():
        return [path]
    suffixes = {suffix for suffix in read_suffixes() if suffix != ".asf"}
    if path.is_dir():
        there = list(path.rglob("*"))
    elif glob.has_magic(text):
        there = [Path(name) for name in glob.glob(str(path), recursive=True)]
    else:
        close = ", ".join(library_names()[:5])
        raise SettingError(f"{key}: {text!r} is no built-in motion ({close}, ... `simprep library list`) and no file")
    files = sorted(one for one in there if one.suffix.lower() in suffixes and one.is_file())
    if not files:
        raise SettingError(f"{key}: no motion file fits {text!r}; valid: {', '.join(sorted(suffixes))}")
    return files


def body_of(item: Any, folder: Path = Path()) -> Body:
    """The body that an entry of `characters` means: a name, a robot's file, or a table with the keys of `BODY_KEYS`.

    Args:
        item: the entry.
        folder: that a path is relative to.

    Raises:
        SimprepError: there is no such body, or a key or value is wrong.
    """
    if isinstance(item, str):
        item = {"character": item}
    table = _table("characters", item, BODY_KEYS)
    (name,) = _texts("character", [table.get("character", "humanoid")])
    if (folder / name).is_file():
        name = str((folder / name).resolve())
    height, mass = ((_number(key, table[key]) if key in table else None) for key in ("height_m", "mass_kg"))
    character = body_character(Body(name, height, mass))
    if height is not None:  # the mass that follows from it is said
        mass = character.mass_kg
    return Body(name, height, mass, character.digest)


def _disturbances(tables: Any) -> dict[str, Disturbance]:
    keys = tuple(one.name for one in fields(Disturbance) if one.name != "name")
    found = {}
    for name, table in _table("disturbance", tables, None).items():
        values = _table(f"disturbance.{name}", table, keys)
        for key, value in values.items():
            if not (key == "push_at" and isinstance(value, str)):
                _number(f"disturbance.{name}.{key}", value)
        found[name] = Disturbance(name, **values)
    return found


def _seeds(value: Any) -> tuple[int, ...]:
    if type(value) is int and 1 <= value <= 100_000:
        return tuple(range(value))
    if isinstance(value, list) and value and all(type(one) is int and one >= 0 for one in value):
        return tuple(value)
    raise SettingError(f"seeds = {value!r}; valid: how many, from 1, or a list of whole numbers from 0")


def _known(what: str, given: Iterable[str], valid: Iterable[str]) -> None:
    for name in given:
        if name not in valid:
            raise UnknownNameError(what, name, valid)


def _table(what: str, value: Any, keys: Iterable[str] | None) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise SettingError(f"{what}: {value!r}; valid: a table" + (f" with {', '.join(keys)}" if keys else ""))
    if keys is not None:
        _known(f"key of {what}", value, keys)
    return value


def _texts(what: str, values: Iterable[Any]) -> Iterable[str]:
    for value in values:
        if not isinstance(value, str):
            raise SettingError(f"{what}: {value!r}; valid: text")
        yield value


def _number(what: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise SettingError(f"{what}: {value!r}; valid: a number")
    return float(value)
