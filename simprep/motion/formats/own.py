"""simprep's own .npz among the formats; `simprep.motion.store` reads and writes it."""

from pathlib import Path

from simprep.archive import schema_of
from simprep.motion.formats.format import Format, Glimpse, ReadMotion, ReadOptions
from simprep.motion.motion import Motion


def _recognise(seen: Glimpse) -> str | None:
    if "header" not in seen.entries:
        return None
    schema = schema_of(seen.path)
    return f"simprep's own file, {schema}" if schema else None


def _read(path: Path, options: ReadOptions) -> ReadMotion:
    from simprep.motion.store import read_motion

    return ReadMotion(read_motion(path))


def _write(motion: Motion, path: Path) -> tuple[str, ...]:
    from simprep.motion.store import write_motion

    with path.open("wb") as stream:
        write_motion(motion, stream)
    return ()


FORMAT = Format("simprep", "simprep", (".npz",), _recognise, _read, _write)
