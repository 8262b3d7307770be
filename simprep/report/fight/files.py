"""A fight as files: streams, the simulated run, and tables of its actions and contacts."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from simprep.duel.fight.fight import Fight
from simprep.duel.fight.hits import JudgedContact
from simprep.duel.labels.labels import ASPECTS, Label
from simprep.duel.stream.store import save_stream
from simprep.files import atomic_path
from simprep.metrics.interaction.evaluate import FightResults
from simprep.physics.store import RUN_FILE, save_run

ACTIONS = ("player", "start_s", "end_s", "moment_s", *ASPECTS, "example", "request", "note")
CONTACTS = (
    "start_s", "duration_s", "part_a", "part_b", "impulse_ns", "impulse_x_ns", "impulse_y_ns", "impulse_z_ns",
    "peak_force_n", "closing_speed_m_s", "depth_mm", "x_m", "y_m", "z_m", "verdict", "attacker",
)  # fmt: skip
WHO = ("fighter_a", "fighter_b")
"""Whose `part_a` and `part_b` are: columns where more than two fight; of two they are A's and B's."""


def save_fight(results: FightResults, folder: str | Path) -> list[Path]:
    """Write `fight.npz` and `actions.csv`; of a simulation `tracked.npz`, `run.npz`, `contacts.csv`, `simulated.npz`.

    A simulation without a second frame has no `simulated.npz`.

    Args:
        results: what to write.
        folder: is made where missing.
    """
    folder = Path(folder)
    files = [
        save_stream(results.fight.stream, folder / "fight.npz"),
        save_actions(results.fight, folder / "actions.csv"),
    ]
    if results.run is None or results.tracked is None:
        return files
    files.append(save_stream(results.tracked.stream, folder / "tracked.npz"))
    files.append(save_run(results.run, folder / RUN_FILE))
    names = results.fight.stream.names
    columns = CONTACTS if len(names) == 2 else (*CONTACTS, *WHO)
    rows = [_contact(one, names) for one in results.contacts]
    files.append(_save_csv(folder / "contacts.csv", rows, columns))
    if results.simulated_stream:
        files.append(save_stream(results.simulated_stream, folder / "simulated.npz"))
    return files


def save_actions(fight: Fight, path: str | Path) -> Path:
    """Write the actions of a fight as CSV, a line each."""
    fps = fight.stream.fps
    rows = []
    for one in fight.actions:
        label = Label.from_code(one.label)
        rows.append(
            {
                "player": fight.stream.names[one.player],
                "start_s": round(one.start / fps, 4),
                "end_s": round(one.end / fps, 4),
                "moment_s": "" if one.moment < 0 else round(one.moment / fps, 4),
                **{aspect: getattr(label, aspect) for aspect in ASPECTS},
                "example": "" if one.example < 0 else one.example,
                "request": one.request,
                "note": one.note,
            }
        )
    return _save_csv(Path(path), rows, ACTIONS)


def _contact(one: JudgedContact, names: Sequence[str]) -> dict[str, Any]:
    return {
        "start_s": round(one.start_s, 5),
        "duration_s": round(one.duration_s, 5),
        "part_a": one.parts[0],
        "part_b": one.parts[1],
        "impulse_ns": round(one.impulse_ns, 4),
        **{f"impulse_{axis}_ns": round(value, 4) for axis, value in zip("xyz", one.impulse)},
        "peak_force_n": round(one.peak_force_n, 2),
        "closing_speed_m_s": round(one.closing_speed, 3),
        "depth_mm": round(1e3 * one.depth, 3),
        **{f"{axis}_m": round(value, 4) for axis, value in zip("xyz", one.position)},
        "verdict": one.verdict,
        "attacker": "" if one.attacker < 0 else names[one.attacker],
        **{column: names[body] for column, body in zip(WHO, one.bodies, strict=True)},
    }


def _save_csv(path: Path, rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> Path:
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return path
