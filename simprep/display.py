"""Values that show themselves: a table in a terminal (rich), the same table in HTML (Jupyter), and data frames (pandas)."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

from simprep.errors import MissingExtraError

if TYPE_CHECKING:
    from rich.table import Table


class SelfShowing(ABC):
    """A value that rich prints and Jupyter displays as a table of its facts."""

    @abstractmethod
    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """A heading, and what is to be told by name; units are in the names."""

    def __rich__(self) -> "Table":
        return fact_table(*self.facts())

    def _repr_html_(self) -> str:
        return table_html(fact_table(*self.facts()))


def fact_table(title: str, facts: Mapping[str, Any], columns: tuple[str, str] = ("", "")) -> "Table":
    """A table of names and values.

    Args:
        title: its heading.
        facts: values by name; numbers have 4 digits, None is a dash.
        columns: headings of the two columns; empty for none.
    """
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(title) if title else None, title_justify="left", show_header=any(columns))
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


def table_html(table: "Table") -> str:
    """A rich table as an HTML table, without styles. Cells that are neither text nor markup are shown by their `str`."""
    title = escape(_plain(table.title)) if table.title else ""
    caption = f"<caption>{title}</caption>" if title else ""
    heads = "".join(f"<th{_side(column.justify)}>{escape(_plain(column.header))}</th>" for column in table.columns)
    rows = zip(*(list(column.cells) for column in table.columns))
    sides = [_side(column.justify) for column in table.columns]
    body = "".join(
        "<tr>" + "".join(f"<td{side}>{escape(_plain(cell))}</td>" for side, cell in zip(sides, row)) + "</tr>"
        for row in rows
    )
    head = f"<thead><tr>{heads}</tr></thead>" if table.show_header else ""
    return f"<table>{caption}{head}<tbody>{body}</tbody></table>"


def data_frame(content: Any, index: Any = None, index_name: str | None = None) -> Any:
    """A pandas DataFrame.

    Args:
        content: columns by name, or a list of rows that are mappings.
        index: of the rows; None to number them.
        index_name: name of the index.

    Raises:
        MissingExtraError: pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise MissingExtraError("a data frame", "pandas") from None
    frame = pandas.DataFrame(content, index=index)
    frame.index.name = index_name
    return frame


def _side(justify: str) -> str:
    return ' style="text-align:right"' if justify == "right" else ""


def _plain(cell: Any) -> str:
    from rich.text import Text

    if isinstance(cell, Text):
        return cell.plain
    return Text.from_markup(cell).plain if isinstance(cell, str) else str(cell)
