"""The pages say what is so: their Python blocks run, their commands parse, the names in their tables exist."""

import importlib.util
import os
import re
import shlex
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import simprep
from simprep.cli.main import parse
from simprep.metrics.evaluate import MOTION_KEYS, RUN_KEYS

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md"))
BLOCK = re.compile(r"^(?P<indent> *)```(?P<language>\w*)\n(?P<code>.*?)^(?P=indent)```$", re.MULTILINE | re.DOTALL)
NOT_RUN = re.compile(r"<!-- not run: .{15,} -->\n *$")
NOT_COMMANDS = {"python", "toml"}


def blocks(page: Path) -> list[tuple[str, str, bool]]:
    """Language, text, and whether it is marked as not run, of every block of code."""
    text = page.read_text(encoding="utf-8")
    return [
        (one["language"], textwrap.dedent(one["code"]), bool(NOT_RUN.search(text[: one.start() + len(one["indent"])])))
        for one in BLOCK.finditer(text)
    ]


def commands(page: Path) -> list[str]:
    """Calls of simprep in the blocks of a page, without comments and what stands before them in the line."""
    lines = [line for language, text, _ in blocks(page) if language not in NOT_COMMANDS for line in text.splitlines()]
    found = [re.search(r"(?:^|[ /])simprep (.*)$", line) for line in lines if not line.startswith("pip ")]
    return [one[1] for one in found if one]


PROGRAMS = {
    page.name: [code for name, code, marked in blocks(page) if name == "python" and not marked] for page in PAGES
}


def test_few_blocks_are_not_run():
    marked = [page.name for page in PAGES for language, _, marked in blocks(page) if language == "python" and marked]
    assert len(marked) <= 5
    assert sum(map(len, PROGRAMS.values())) >= 10


@pytest.mark.parametrize("page", [name for name, program in PROGRAMS.items() if program])
def test_the_python_blocks_of_a_page_run_as_one_program(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    for number, code in enumerate(PROGRAMS[page]):
        exec(compile(code, f"{page}, block {number + 1}", "exec"), names)
    assert len(names) > 2


@pytest.mark.parametrize(
    ("page", "command"), [(page.name, command) for page in [ROOT / "README.md", *PAGES] for command in commands(page)]
)
def test_a_command_has_the_options_that_a_page_gives_it(page, command, capsys):
    try:
        parse(shlex.split(command, comments=True))
    except SystemExit as stop:
        pytest.fail(f"{page}: simprep {command}: exit code {stop.code}\n{capsys.readouterr().err}")


def test_a_wrong_option_does_not_parse(capsys):
    with pytest.raises(SystemExit) as stop:
        parse(["track", "walk", "--no-such-option"])
    assert stop.value.code == 2


PAPER_ROWS = [
    (file, names)
    for line in (ROOT / "docs/papers.md").read_text(encoding="utf-8").splitlines()
    for file, names in re.findall(r"`(simprep/[\w/]+\.py)`: ((?:(?:, )?`\w+`(?: \([^)|]*\))?)+)", line)
]


def test_every_equation_of_both_papers_has_a_row():
    text = (ROOT / "docs/papers.md").read_text(encoding="utf-8")
    for title, last in (("2013", 19), ("2008", 20)):
        sections = re.findall(rf"^## {title}:.*?(?=^## )", text, re.MULTILINE | re.DOTALL)
        firsts = re.findall(r"^\| ([\d, ]+)(?:, Table I|, Fig\. 9)? \|", "".join(sections), re.MULTILINE)
        numbers = [int(number) for cell in firsts for number in re.findall(r"\d+", cell)]
        assert sorted(numbers) == list(range(1, last + 1))


@pytest.mark.parametrize(("file", "names"), PAPER_ROWS)
def test_what_the_page_on_the_papers_names_is_defined_in_the_file_beside_it(file, names):
    text = (ROOT / file).read_text(encoding="utf-8")
    for name in re.findall(r"`(\w+)`", names):
        assert re.search(rf"^ *(?:class|def) {name}\b|^ *{name}\b(?:: .*)? = |^    {name}: ", text, re.MULTILINE), name


def test_the_page_on_metrics_names_every_number():
    named = set(re.findall(r"`(\w+)`", (ROOT / "docs/metrics.md").read_text(encoding="utf-8")))
    assert {*MOTION_KEYS, *RUN_KEYS} <= named


def test_the_reference_lists_the_whole_public_api():
    text = (ROOT / "docs/reference.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\.\. (?:auto\w+|py:data):: (\w+)$", text, re.MULTILINE)
    assert sorted(listed) == sorted(set(simprep.__all__) - {"__version__"})


def test_every_page_is_in_the_contents():
    contents = re.findall(r"```{toctree}\n(.*?)```", (ROOT / "docs/index.md").read_text(encoding="utf-8"), re.DOTALL)
    listed = [line for block in contents for line in block.split() if not line.startswith(":")]
    pages = {page.stem for page in PAGES} - {"index"}
    assert pages <= set(listed)


def test_the_site_builds_without_a_warning_and_asks_no_other_host(tmp_path):
    for name in ("sphinx", "furo", "myst_parser"):
        if not importlib.util.find_spec(name):
            pytest.skip(f"{name} is not installed (group docs)")
    site = tmp_path / "site"
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", tmp_path / "cache", ROOT / "docs", site],
        env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    pages = [path.read_text(encoding="utf-8") for path in site.glob("*.html")]
    assert len(pages) > len(PAGES)
    elsewhere = r"[\"'(=]\s*(?:https?:)?//[\w.-]+"
    for text in pages:
        tags = re.findall(r"<(?:script|img|iframe|source|object|embed)\b[^>]*>", text)
        tags += [tag for tag in re.findall(r"<link\b[^>]*>", text) if 'rel="canonical"' not in tag]
        assert tags
        assert not [tag for tag in tags if re.search(elsewhere, tag)]
    for style in site.rglob("*.css"):
        assert not re.search(rf"(?:@import\s*|url){elsewhere}", style.read_text(encoding="utf-8"))
