"""What a study leaves: its numbers as JSON, and the same as Markdown for people."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simprep.files import atomic_path
from simprep.report.results import save_json


def save_study(folder: Path, name: str, content: Mapping[str, Any], text: str) -> None:
    """Write NAME.json and NAME.md into a folder, atomically, and print where they are.

    Args:
        folder: made where it is missing.
        name: of both files.
        content: numbers, in JSON's types.
        text: Markdown.
    """
    path = save_json(folder / f"{name}.json", content)
    with atomic_path(folder / f"{name}.md") as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(f"written: {path}, {folder / f'{name}.md'}")
