"""A store as one table, a row a case: Arrow in memory, Parquet on disk. Needs pyarrow (extra `table`)."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from simprep.errors import MissingExtraError
from simprep.files import atomic_path
from simprep.metrics.evaluate import MOTION_KEYS, RUN_KEYS
from simprep.study.sweep.store import SweepStore

if TYPE_CHECKING:
    import pyarrow

TEXTS = (
    "schema", "code", "kind", "clip", "clip_sha256", "locomotion", "locomotion_sha256", "target", "target_sha256", "arm",
    "character", "digest", "controller", "preset", "disturbance", "push_at",
)  # fmt: skip
INTEGERS = ("seed", "clip_frame", "locomotion_frame", "target_frame")
NUMBERS = (
    "alpha", "lead_s", "rise_s", "hold_s", "seconds", "height_m", "mass_kg", "mass_scale", "friction", "strength", "delay_s",
    "noise", "push_n_per_kg", "push_direction_deg", "push_s",
)  # fmt: skip
BLOCK_BYTES = 16_000_000


def read_table(folder: str | Path, wanted: Callable[[str], bool] = lambda name: True) -> "pyarrow.Table":
    """The records of a store: `id`, `attempt`, `end`, `reason`, what the case was, its metrics, what it cost.

    Args:
        folder: of the store.
        wanted: whether the case of a name is; default all, those of other sweeps and older code in the folder too.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    arrow = _arrow()
    from pyarrow import json as arrow_json

    case = [(name, arrow.string()) for name in TEXTS] + [(name, arrow.int64()) for name in INTEGERS]
    case += [(name, arrow.float64()) for name in NUMBERS]
    keys = [key for key in dict.fromkeys((*RUN_KEYS, *MOTION_KEYS)) if key not in ("end", "s_per_s")]
    metrics = [(key, arrow.bool_() if key == "success" else arrow.float64()) for key in keys]
    cost = [("wall_s", arrow.float64()), ("cpu_s", arrow.float64()), ("processor", arrow.string())]
    top: list[tuple[str, Any]] = [("id", arrow.string()), ("attempt", arrow.int64()), ("end", arrow.string())]
    top += [("reason", arrow.string())]
    parts = [(name, arrow.struct(fields)) for name, fields in (("case", case), ("metrics", metrics), ("cost", cost))]
    text = b"".join(SweepStore(folder).last_lines(wanted))
    if not text:
        return arrow.schema(top + case + metrics + cost).empty_table()
    table = arrow_json.read_json(
        BytesIO(text),
        read_options=arrow_json.ReadOptions(block_size=BLOCK_BYTES),
        parse_options=arrow_json.ParseOptions(explicit_schema=arrow.schema(top + parts)),
    ).drop_columns(["crc32"])
    columns: dict[str, Any] = {name: table[name] for name, _ in top}
    for name, _ in parts:
        for field, column in zip(table.schema.field(name).type, table.select([name]).flatten().columns):
            columns[field.name] = column
    return arrow.table(columns)


def save_table(folder: str | Path, path: str | Path, wanted: Callable[[str], bool] = lambda name: True) -> Path:
    """Write the table of a store as Parquet, atomically; returns the path.

    Args:
        folder: of the store.
        path: of the file.
        wanted: as of `read_table`.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    _arrow()
    from pyarrow import parquet

    with atomic_path(path) as temporary:
        parquet.write_table(read_table(folder, wanted), temporary)
    return Path(path)


def _arrow() -> Any:
    try:
        import pyarrow
    except ImportError:
        raise MissingExtraError("the table of a sweep", "table") from None
    return pyarrow
