"""A report: one HTML file that opens from disk and asks the network for nothing."""

import base64
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

from rich.table import Table

from simprep.display import fact_table, table_html
from simprep.files import atomic_path
from simprep.report.gl import pictures_or_warning
from simprep.report.replay.actor import Replay
from simprep.report.replay.record import RECORDING_MARK, record

REPORT_FILE = "report.html"
DPI = 90
LEGEND = (
    "Solid is what was simulated, pale grey its reference. Green is the support polygon, red the centre of mass on the "
    "floor, ochre the force of the floor (1 m for 1000 N)."
)


@dataclass(frozen=True)
class Picture:
    """A picture of a report.

    Attributes:
        title: below it.
        png: the picture, or the path of its file.
    """

    title: str
    png: bytes | Path


@dataclass(frozen=True)
class Page:
    """What a report says.

    Attributes:
        title: what it is about.
        headline: the result in a sentence.
        replays: to look at, one at a time.
        tables: of rich, as the terminal shows them.
        pictures: in order.
        details: how it was made, by name: command, versions, seed.
        warnings: a line each, below the headline.
        legend: what the colours of the replay mean.
    """

    title: str
    headline: str
    replays: Sequence[Replay] = ()
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    warnings: Sequence[str] = ()
    legend: str = LEGEND


def write_report(folder: str | Path, make: Callable[[], Page], warn: Callable[[str], Any]) -> list[Path]:
    """Write `report.html` into a folder; where a library for it is missing, warn and write none.

    Args:
        folder: is made where missing.
        make: makes the page; it is called once.
        warn: receives one line that names what to install.

    Returns:
        The file written, or nothing.
    """
    with pictures_or_warning("no report page", warn):
        return [save_page(make(), Path(folder) / REPORT_FILE)]
    return []


def save_page(page: Page, path: str | Path) -> Path:
    """Write a page as one HTML file, atomically.

    Raises:
        MissingExtraError: it has a replay, and viser is not installed.
    """
    text = page_html(page)
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def page_html(page: Page) -> str:
    """The page as HTML; errors as for `save_page`."""
    from simprep import __version__

    tables = "".join(f'<div class="scroll">{table_html(table)}</div>' for table in page.tables)
    pictures = "".join(_figure_html(picture) for picture in page.pictures)
    return _filled(
        "page.html",
        version=escape(__version__),
        title=escape(page.title),
        headline=escape(page.headline),
        warnings="".join(f'<p class="warning">{escape(line)}</p>' for line in page.warnings),
        replay=_replay_html(page) if page.replays else "",
        tables=f'<h2>Numbers</h2><div class="tables">{tables}</div>' if tables else "",
        pictures=f"<h2>Pictures</h2>{pictures}" if pictures else "",
        details=table_html(fact_table("", _flat(page.details))),
    )


def figure_picture(title: str, figure: Any) -> Picture:
    """A matplotlib figure as a picture of a report."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=DPI, format="png")
    return Picture(title, buffer.getvalue())


def _replay_html(page: Page) -> str:
    recordings = [record(replay) for replay in page.replays]
    marks = [
        f"{replay.title}: " + ", ".join(f"{name.replace('_', ' ')} at {at:.2f} s" for name, at in replay.marks)
        for replay in page.replays
        if replay.marks
    ]
    buttons = "".join(f'<button type="button">{escape(replay.title)}</button>' for replay in page.replays)
    return _filled(
        "replay.html",
        buttons=buttons if len(recordings) > 1 else "",
        viewer=_json(recordings[0].viewer),
        recordings="\n".join(
            f'<script type="text/plain" id="recording-{number}">{one.data}</script>'
            for number, one in enumerate(recordings)
        ),
        placeholder=RECORDING_MARK,
        legend=escape(" ".join([page.legend, *(f"{mark}." for mark in marks)])),
    )


def _figure_html(picture: Picture) -> str:
    png = picture.png if isinstance(picture.png, bytes) else picture.png.read_bytes()
    source = base64.b64encode(png).decode("ascii")
    title = escape(picture.title)
    return f'<figure><img alt="{title}" src="data:image/png;base64,{source}"><figcaption>{title}</figcaption></figure>'


def _json(text: str) -> str:
    """A JSON string that may stand in a script element."""
    return json.dumps(text).replace("<", "\\u003c")


def _filled(name: str, **parts: str) -> str:
    template = (resources.files("simprep") / "report" / name).read_text(encoding="utf-8")
    return Template(template).substitute(parts)


def _flat(details: Mapping[str, Any]) -> dict[str, Any]:
    """Nested mappings as one line each."""
    return {
        name: ", ".join(f"{key} {one}" for key, one in value.items()) if isinstance(value, Mapping) else value
        for name, value in details.items()
        if value not in (None, "", (), [], {})
    }
