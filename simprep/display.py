"""Values that show themselves: as a table in a terminal (rich), and as the same table in HTML."""

from collections.abc import Mapping
from html import escape
from typing import Any

from rich.table import Table
from rich.text import Text


def fact_table(title: str, facts: Mapping[str, Any], columns: tuple[str, str] = ("", "")) -> Table:
    """A table of names and values.

    Args:
        title: its heading.
        facts: values by name; numbers have 4 digits, None is a dash.
        columns: headings of the two columns; empty for none.
    """
    table = Table(title=Text(title), title_justify="left", show_header=any(columns))
    table.add_column(Text(columns[0]), no_wrap=True)
    table.add_column(Text(columns[1]))
    for name, value in facts.items():
        table.add_row(Text(name), Text(value_text(value)))
    return table


def value_text(value: Any) -> str:
    """A value in words for people: 4 digits of a number, a dash for None, `yes` and `no`."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def table_html(table: Table) -> str:
    """A rich table as an HTML table, without styles. Cells that are neither text nor markup are shown by their `str`."""
    caption = f"<caption>{escape(_plain(table.title))}</caption>" if table.title else ""
    heads = "".join(f"<th{_side(column.justify)}>{escape(_plain(column.header))}</th>" for column in table.columns)
    rows = zip(*(list(column.cells) for column in table.columns))
    sides = [_side(column.justify) for column in table.columns]
    body = "".join(
        "<tr>" + "".join(f"<td{side}>{escape(_plain(cell))}</td>" for side, cell in zip(sides, row)) + "</tr>"
        for row in rows
    )
    head = f"<thead><tr>{heads}</tr></thead>" if table.show_header else ""
    return f"<table>{caption}{head}<tbody>{body}</tbody></table>"


def _side(justify: str) -> str:
    return ' style="text-align:right"' if justify == "right" else ""


def _plain(cell: Any) -> str:
    if isinstance(cell, Text):
        return cell.plain
    return Text.from_markup(cell).plain if isinstance(cell, str) else str(cell)
