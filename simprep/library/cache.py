"""Motions on disk: made once, then loaded from the user's cache folder, bit by bit the same.

The key of a motion covers all it depends on: versions of simprep and its packages, kind of machine, model file, and
source text of the code that makes motions. A damaged or foreign file or a read-only folder only means that the motion
is made anew.
"""

import contextlib
import hashlib
import os
import platform
import shutil
import time
from collections.abc import Callable, Iterator
from functools import lru_cache
from importlib import metadata
from pathlib import Path

import simprep
from simprep.errors import MotionFileError
from simprep.humanoid_model import mjcf_folder
from simprep.library.entry import is_name
from simprep.motion.motion import Motion
from simprep.motion.store import read_motion, save_motion

ENVIRONMENT = "SIMPREP_CACHE_DIR"
"""Environment variable that names another cache folder."""
PACKAGES = ("numpy", "scipy", "mujoco", "daqp")
"""Packages that poses are computed with."""
SOURCES = ("library", "motion")
"""Folders of simprep whose code makes motions."""
KEPT_VERSIONS = 4
"""Keys whose motions are kept; the oldest go. Several, so that two versions in use do not delete each other's."""
_IMPORT_S = 5.0
"""Longest time from the start of importing simprep to this module [s]."""
_IMPORTED_AT = time.time() - _IMPORT_S


def cache_folder() -> Path:
    """Folder of cached motions: `SIMPREP_CACHE_DIR` where set, else the platform's for caches."""
    named = os.environ.get(ENVIRONMENT)
    if named:
        return Path(named).expanduser()
    import platformdirs

    return Path(platformdirs.user_cache_dir("simprep", appauthor=False))


def cached_motion(name: str, generate: Callable[[], Motion], inputs: bytes = b"") -> Motion:
    """A motion from the cache, or made and put there.

    Args:
        name: of the motion that `generate` makes.
        generate: makes the motion; deterministic. Its errors pass through.
        inputs: what it depends on besides our code and the model, such as the contents of a file.
    """
    if not is_name(name):
        return generate()
    suffix = f"-{hashlib.sha256(inputs).hexdigest()[:16]}" if inputs else ""
    path = cache_folder() / "motions" / code_key() / f"{name}{suffix}.npz"
    with contextlib.suppress(MotionFileError):
        motion = read_motion(path)
        if motion.name == name:
            return motion
    motion = generate()
    if motion.name == name and not edited_since_import():
        with contextlib.suppress(OSError):
            save_motion(motion, path)
            drop_old_versions(path.parents[1])
    return motion


@lru_cache(maxsize=4)
def code_key(folders: tuple[str, ...] = SOURCES, packages: tuple[str, ...] = PACKAGES) -> str:
    """Hash of all that something generated depends on, 16 hexadecimal digits.

    Args:
        folders: of simprep, or single files, whose code makes it; the humanoid's description always counts.
        packages: that it is computed with.
    """
    digest = hashlib.sha256()
    versions = [f"{package} {metadata.version(package)}" for package in packages]
    digest.update("\n".join((simprep.__version__, platform.machine(), *versions)).encode())
    for path in _sources(folders):
        digest.update(f"\n{path.name} {path.stat().st_size}\n".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _sources(folders: tuple[str, ...] = SOURCES) -> Iterator[Path]:
    package = Path(simprep.__file__).parent
    for folder in folders:
        yield from [package / folder] if folder.endswith(".py") else sorted((package / folder).rglob("*.py"))
    yield package / "character.py"
    yield package / "humanoid_model.py"
    yield from sorted(mjcf_folder().glob("*.xml"))


def edited_since_import(folders: tuple[str, ...] = SOURCES) -> bool:
    """Whether files may have changed since this process loaded them; what it makes then belongs under no key."""
    return any(path.stat().st_mtime > _IMPORTED_AT for path in _sources(folders))


def drop_old_versions(folder: Path) -> None:
    """Remove all but the newest keys of a cache, a folder with one folder for each key."""
    versions = sorted((path for path in folder.iterdir() if path.is_dir()), key=lambda path: path.stat().st_mtime)
    for old in versions[:-KEPT_VERSIONS]:
        shutil.rmtree(old, ignore_errors=True)
