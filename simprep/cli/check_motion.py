"""`simprep check-motion`: what is wrong with a motion, and can the body follow it."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from simprep import __version__
from simprep.cli import output as output_module
from simprep.cli.file_options import Clip, FileFps
from simprep.cli.output import BaseCommand, Json, Output, Preset, Quiet, Robot
from simprep.errors import SettingError

if TYPE_CHECKING:
    from simprep.check.finding import Finding
    from simprep.check.motion_check import MotionCheck
    from simprep.motion.motion import Motion

CANNOT_BE_FOLLOWED = 1
"""Exit code for a motion with a verdict `fail`, or a folder with a file to drop."""
_STYLES = {"pass": "green", "warn": "yellow", "fail": "red", "info": "dim"}


@dataclass(frozen=True)
class CheckMotion(BaseCommand):
    """Check a motion before anything is trained on it: was the file read as it was meant, does it respect joints, floor
    and gravity, and can a simulated body follow it.

    One line for each check: verdict, number, thresholds, where. Exit code 1 if a check fails. Of a folder, a table says
    which files to keep and which to drop; a second call goes on where the first one stopped.

    Example: simprep check-motion dance.csv --robot unitree_g1 --file-fps 30
    """

    motion: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MOTION", help_behavior_hint="")]
    """A motion file, a folder of them, or a motion of the library."""

    robot: Robot = None

    file_fps: FileFps = None

    clip: Clip = None

    no_track: bool = False
    """Look at the poses only; simulate nothing."""

    preset: Preset = "default"

    seed: int = 0
    """Seed of the controller's random numbers."""

    fix: Annotated[Path | None, tyro.conf.arg(metavar="OUT", help_behavior_hint="")] = None
    """Write the motion cleaned of spikes, angles beyond limits, sliding soles, float and penetration; what was changed is
    said, and the cleaned motion is what is checked and tracked. The extension tells the format."""

    replay: Annotated[Path | None, tyro.conf.arg(metavar="OUT", help_behavior_hint="")] = None
    """Write what physics made of the motion: a reference that can be followed, as it has been. Not written if the body
    fell."""

    to: Annotated[str | None, tyro.conf.arg(metavar="FORMAT", help_behavior_hint="")] = None
    """Name of the format that --fix and --replay write, where the extension does not tell it: unitree, beyondmimic, mjlab ..."""

    records: Annotated[Path | None, tyro.conf.arg(metavar="DIR", help_behavior_hint="")] = None
    """Folder for a folder's records, one for each file; default: check-motion in the folder that is checked."""

    json: Json = False
    quiet: Quiet = False

    def run(self) -> Any:
        """As every command; exit code 1 where the verdict is `fail`."""
        content = super().run()
        if content.get("verdict") == "fail":
            sys.exit(CANNOT_BE_FOLLOWED)
        return content

    def _run(self, output: Output) -> dict[str, Any]:
        if self.replay and self.no_track:
            raise SettingError("--replay needs the simulation that --no-track leaves out; valid: one of them")
        if Path(self.motion).is_dir():
            return self._folder(Path(self.motion), output)
        motion, notes, stored = self._read(self.motion)
        for note in notes:
            output.say(f"read: {note}")
        return self._checked(motion, notes, stored, output)

    def _checked(
        self,
        motion: "Motion",
        notes: tuple[str, ...],
        stored: "tuple[Finding, ...]",
        output: Output,
        table: bool = True,
    ) -> dict[str, Any]:
        from dataclasses import replace

        from simprep.check.finding import worst
        from simprep.check.follow import follow
        from simprep.check.motion_check import check_motion

        content: dict[str, Any] = {"notes": list(notes)}
        if self.fix:
            before = check_motion(motion)
            motion, changes = self._mended(motion, output, table)
            content |= {"changes": changes, "raised_before": list(before.raised)}
        checked = check_motion(motion)
        checked = replace(checked, findings=(*checked.findings, *stored))
        if not self.no_track:
            with output.simulating(f"mpc {motion.name}", motion) as progress:
                followed = follow(motion, self.seed, self.preset, progress)
            checked = replace(checked, findings=(*checked.findings, followed.finding))
            if self.replay:
                content |= {"replay": self._write_replay(followed, output), "replay_changes": list(followed.changes)}
        if table:
            output.say(_table(checked))
            output.say(
                f"{motion.name}: {checked.verdict}" + (f" ({', '.join(checked.raised)})" if checked.raised else "")
            )
        return {"schema": "simprep.check/1", **checked.as_dict(), **content, "verdict": worst(checked.findings)}

    def _mended(self, motion: "Motion", output: Output, table: bool) -> "tuple[Motion, list[str]]":
        from simprep.check.mend import mend
        from simprep.motion.export import export_motion

        assert self.fix is not None
        mended = mend(motion)
        lost = export_motion(mended.motion, self.fix, self.to)
        if table:
            for change in mended.changes or ("nothing was to be changed",):
                output.say(f"fixed: {change}")
            output.say(f"written: {self.fix}" + (f"; not kept: {'; '.join(lost)}" if lost else ""))
        return mended.motion, list(mended.changes)

    def _write_replay(self, followed: Any, output: Output) -> str | None:
        from simprep.motion.export import export_motion

        assert self.replay is not None
        if followed.replay is None:
            output.warn(f"no replay written: {followed.finding.note}")
            return None
        lost = export_motion(followed.replay, self.replay, self.to)
        output.say(
            f"replay: every pose is now the simulated one, {followed.finding.value:.0f} mm from the motion's on average; "
            f"written: {self.replay}" + (f"; not kept: {'; '.join(lost)}" if lost else "")
        )
        for change in followed.changes:
            output.say(f"replay: {change}, as stops of joints are soft in the simulation")
        return str(self.replay)

    def _read(self, text: str) -> "tuple[Motion, tuple[str, ...], tuple[Finding, ...]]":
        """The motion, what its reader decided, and what the file's stored velocities say of its frame rate."""
        from simprep.check.dynamics import stored_rate
        from simprep.cli.resolve import imported, resolve_motion, resolve_robot

        path, notes = Path(text), list[str]()
        if not path.suffix and len(path.parts) == 1 and not path.exists():
            return resolve_motion(text, notes.append, None, self.robot), tuple(notes), ()
        result = imported(path, resolve_robot(self.robot), file_fps=self.file_fps, clip=self.clip)
        rate = result.report.velocity_fps
        stored = () if rate is None else (stored_rate(result.motion.fps, rate),)
        return result.motion, (result.report.recognised, *result.report.warnings), stored

    def _folder(self, folder: Path, output: Output) -> dict[str, Any]:
        from rich.table import Table

        from simprep.check.folder import KEEP, RECORDS, SCHEMA, check_folder
        from simprep.check.follow import CHECK
        from simprep.cli.resolve import resolve_robot
        from simprep.report.results import provenance

        if self.fix or self.replay or self.clip:
            raise SettingError("--fix, --replay and --clip are for a single file")
        records = self.records or folder / RECORDS
        body = resolve_robot(self.robot)
        settings = {
            "robot": body.digest if body else None, "file_fps": self.file_fps, "track": not self.no_track,
            "preset": self.preset, "seed": self.seed, "simprep": __version__,
        }  # fmt: skip
        table = Table()
        for heading in ("file", "decision", "raised", "why"):
            table.add_column(heading)
        files = []

        def check(path: Path) -> dict[str, Any]:
            return self._checked(*self._read(str(path)), output, table=False)

        try:
            for path, record, known in check_folder(folder, records, settings, check):
                files.append(record)
                reasons = [
                    one["note"] if one["check"] == CHECK else f"{one['check']} {one['value']:.3g} {one['unit']}"
                    for one in record.get("findings", ())
                    if one["verdict"] == "fail"
                ]
                told = [f"read: {note}" for note in record.get("notes", ())[1:]]  # the first names the format
                table.add_row(
                    str(path.relative_to(folder)), record["decision"], ", ".join(record["raised"]),
                    record.get("error") or "; ".join(reasons + told) or ("as recorded" if known else ""),
                )  # fmt: skip
        except KeyboardInterrupt:
            raise KeyboardInterrupt(
                f"the records of {len(files)} files are in {records}; the same call goes on"
            ) from None
        finally:
            output.say(table)
        kept = sum(record["decision"] == KEEP for record in files)
        output.say(f"{kept} of {len(files)} to keep; records in {records}")
        return {
            "schema": SCHEMA,
            **provenance(output_module.arguments),
            "folder": str(folder),
            "verdict": "pass" if kept == len(files) else "fail",
            "kept": kept,
            "files": [
                {key: record.get(key) for key in ("file", "decision", "verdict", "raised", "error", "notes")}
                for record in files
            ],
        }


def _table(checked: "MotionCheck") -> Any:
    from rich.table import Table

    table = Table()
    table.add_column("")
    table.add_column("check", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    table.add_column("warn / fail above", justify="right")
    table.add_column("where and what")
    for one in checked.findings:
        value = "-" if one.value is None else f"{one.value:.3g}"
        about = "; ".join(text for text in (one.where, one.note) if text) if one.verdict != "pass" else one.note
        table.add_row(one.verdict, one.check, value, one.unit, one.thresholds, about, style=_STYLES[one.verdict])
    return table
