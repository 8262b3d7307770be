"""`simprep render`: a motion or a run as a film or a film strip, drawn off screen."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from simprep.cli.library import LibraryFolder
from simprep.cli.output import BaseCommand, Json, Output, Quiet, Robot
from simprep.errors import SettingError

if TYPE_CHECKING:
    from simprep.cli.shown import Shown

ENDINGS = (".mp4", ".gif", ".png")


@dataclass(frozen=True)
class Render(BaseCommand):
    """Draw a motion or a run with MuJoCo's renderer: a film (.mp4, .gif) or a film strip (.png).

    A run is drawn with its reference, pale. MP4 needs the extra `video`, GIF and PNG the extra `report`, and all of them
    a GL library (`apt install libegl1 libgl1-mesa-dri`, or `libosmesa6`).

    Example: simprep render results/track/walk_mpc -o walk.mp4
    """

    OUT_IS_FILE = True

    file: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FILE", help_behavior_hint="")]
    """A run (run.npz), a motion or a stream of people; the folder of a result; any motion file (docs/formats.md); or the name
    of a motion of the library."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="FILE")]
    """The file to write; its ending tells the kind: .mp4, .gif or .png."""

    fps: float = 30.0
    """Pictures per second of a film."""

    size: Annotated[str, tyro.conf.arg(metavar="WxH", help_behavior_hint="")] = "640x480"
    """Width and height of a film [px]."""

    columns: int = 9
    """Pictures in a film strip."""

    azimuth: Annotated[float, tyro.conf.arg(metavar="DEGREES", help_behavior_hint="")] = 112.0
    """Where the camera looks: 90 along y, so that who walks along x walks to the right."""

    robot: Robot = None
    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        if self.out.suffix.lower() not in ENDINGS:
            raise SettingError(f"-o {self.out}; valid endings: {', '.join(ENDINGS)}")
        width, height = parse_size(self.size)
        from simprep.cli.shown import read_shown
        from simprep.report.film import save_film
        from simprep.report.film_strip import OTHER_TINTS, REFERENCE_TINTS, StripSettings, save_film_strip

        shown = read_shown(self.file, output.warn, self.library, self.robot)
        motion, others = shown.motions()
        if self.out.suffix.lower() == ".png":
            if not 2 <= self.columns <= 60:
                raise SettingError(f"--columns {self.columns}; valid: 2 to 60")
            settings = StripSettings(columns=self.columns, azimuth_deg=self.azimuth)
            path = save_film_strip(self._rows(shown), self.out, settings)
        else:
            reference = shown.run is not None and len(shown.run.bodies) == 1
            tints = REFERENCE_TINTS if reference else OTHER_TINTS
            settings = StripSettings(width_px=width, height_px=height, azimuth_deg=self.azimuth, tints=tints)
            with output.simulating("drawing", motion) as progress:
                path = save_film(self.out, motion, others, self.fps, settings, progress)
        output.say(f"written: {path}")
        return {"schema": "simprep.render/1", "kind": shown.kind, "file": str(path), "duration_s": motion.duration}

    def _rows(self, shown: "Shown") -> Any:
        from simprep.report.film_strip import Row
        from simprep.report.replay.actor import end_note

        motion, others = shown.motions()
        if shown.run is None or len(shown.run.bodies) > 1:
            return [Row(shown.name, motion, others=others)]
        note = end_note(shown.run)
        return [Row("reference", shown.run.reference), Row(f"simulated, {shown.run.controller}", motion, note)]


def parse_size(text: str) -> tuple[int, int]:
    """Read `WxH`, 16 to 4096 pixels each.

    Raises:
        SettingError: anything else.
    """
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        width = height = 0
    if not (16 <= width <= 4096 and 16 <= height <= 4096):
        raise SettingError(f"--size {text}; valid: WIDTHxHEIGHT, 16 to 4096 pixels each, such as 640x480")
    return width, height
