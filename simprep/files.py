"""Files and folders: which file a folder means, and writing whole or not at all."""

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from simprep.errors import MotionFileError

SHOWN = 6
"""Number of files of a folder that an error names."""


@contextlib.contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """A temporary file beside `path`. It replaces `path` if the block ends without an error, else it is deleted.

    Args:
        path: the file; its folder is made.

    Raises:
        OSError: the folder cannot be made or written to.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def find_file(
    path: str | Path, what: str, suffix: str, fits: Callable[[Path], bool] = lambda _: True, usual: str = ""
) -> Path:
    """The file that a path means, which names a file or the folder that it is in.

    Args:
        path: a file, returned as it is, there or not; or a folder.
        what: what the file should be, for the message: `duel model`.
        suffix: how the file's name ends: `.npz`.
        fits: whether a file with that suffix is such a file.
        usual: name that simprep gives the file; in a folder, a file of this name is preferred to all others.

    Raises:
        MotionFileError: a folder without such a file, with several, or one that cannot be read.
    """
    path = Path(path)
    if not path.is_dir():
        return path
    if usual and (path / usual).is_file():
        return path / usual
    try:
        files = sorted(file for file in path.iterdir() if file.suffix == suffix and file.is_file())
    except OSError as error:
        raise MotionFileError(path, f"a directory that cannot be read ({error.strerror})") from None
    found = [file for file in files if fits(file)]
    if len(found) == 1:
        return found[0]
    if found:
        raise MotionFileError(
            path, f"a directory with {len(found)} files that hold a {what}: {_listed(found)}; valid: one of them"
        )
    there = _listed(files) if files else f"no {suffix}"
    raise MotionFileError(path, f"a directory without a {what}; in it: {there}")


def _listed(files: list[Path]) -> str:
    more = f" and {len(files) - SHOWN} more" if len(files) > SHOWN else ""
    return ", ".join(file.name for file in files[:SHOWN]) + more
