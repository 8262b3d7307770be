"""A run of two fighters as a file: one .npz with both runs and the contacts between them."""

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from simprep.archive import open_archive, write_archive
from simprep.humanoid import Body
from simprep.motion.motion import Motion
from simprep.physics.pair_run import FighterContact, PairRun
from simprep.physics.run import Assist, Run
from simprep.physics.store import run_arrays, run_header

SCHEMA = "simprep.pair-run/1"
NAMES = ("A", "B")
"""Of the two, in the file."""


def save_pair_run(run: PairRun, path: str | Path) -> Path:
    """Write a run of two fighters to .npz, atomically.

    Arrays of `Run` under their own names with `A.` or `B.` before them, those of the references as `A.reference.qpos` and so
    on; contacts and everything else as JSON in `header`.

    Args:
        run: what to write.
        path: the file; `.npz` is appended if missing.

    Returns:
        The path written.
    """
    header: dict[str, Any] = {
        "schema": SCHEMA,
        "contacts": [asdict(contact) for contact in run.contacts],
        "unconverged_steps": run.unconverged_steps,
        "runs": [run_header(one) for one in run.runs],
    }
    arrays: dict[str, Any] = {"penetration": run.penetration, "reference_penetration": run.reference_penetration}
    for player, one in zip(NAMES, run.runs):
        arrays |= {f"{player}.{name}": value for name, value in run_arrays(one).items()}
        arrays[f"{player}.reference.qpos"] = one.reference.qpos
        arrays[f"{player}.reference.contacts"] = one.reference.contacts
    return write_archive(path, header, arrays)


def read_pair_run(path: str | Path) -> PairRun:
    """Read what `save_pair_run` wrote.

    Args:
        path: the file.

    Raises:
        MotionFileError: missing, damaged or not such a file.
    """
    with open_archive(path, "run of two fighters", SCHEMA) as (header, archive):
        runs = [_run(player, part, archive) for player, part in zip(NAMES, header["runs"], strict=True)]
        contacts = tuple(
            FighterContact(**{**one, "impulse": tuple(one["impulse"]), "position": tuple(one["position"])})
            for one in header["contacts"]
        )
        return PairRun(
            (runs[0], runs[1]),
            contacts,
            archive["penetration"],
            archive["reference_penetration"],
            header["unconverged_steps"],
        )


def _run(player: str, header: dict[str, Any], archive: Any) -> Run:
    reference = Motion(
        qpos=archive[f"{player}.reference.qpos"],
        fps=1.0 / header["timestep"],
        contacts=archive[f"{player}.reference.contacts"],
        events=header["events"],
        name=header["motion"],
        source=header["source"],
        body=Body(header["height_m"], header["mass_kg"]),
    )
    names = {field.name for field in fields(Run)}
    arrays = {name: archive[f"{player}.{name}"] for name in names if f"{player}.{name}" in archive}
    return Run(
        reference=reference,
        assist=Assist(header["assist_force_n"], header["assist_torque_nm"]),
        **{name: header[name] for name in names if name in header},
        **arrays,
    )
