"""What the files for contributors say is true: paths, names, versions."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
WHERE = dict(re.findall(r"^\| ([^|]+?) \| `([\w/.]+)` \| `\w+` \|$", CONTRIBUTING, re.MULTILINE))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_where_do_i_answers_the_six_questions():
    assert len(WHERE) == 6


@pytest.mark.parametrize(("file", "name"), re.findall(r"\| `([\w/.]+\.py)` \| `(\w+)` \|$", CONTRIBUTING, re.MULTILINE))
def test_where_do_i_points_to_the_definition(file, name):
    """A class, a function, or a setting with its default."""
    text = (ROOT / file).read_text(encoding="utf-8")
    assert re.search(rf"^(class|def) {name}\b|^    {name}: \w+ = ", text, re.MULTILINE)


@pytest.mark.parametrize(
    "document",
    ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", *(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))],
)
def test_files_that_a_document_names_exist(document):
    text = (ROOT / document).read_text(encoding="utf-8")
    links = [Path(document).parent / link for link in re.findall(r"\]\(([^)#:]+)\)", text)]
    in_code = r"(?<![\w./])(?:simprep|tests|scripts|examples|docs|mjcf)/[\w/]+(?:\.(?:py|md|xml|toml))?"
    named = [Path(path) for code in re.findall(r"`([^`\n]+)`", text) for path in re.findall(in_code, code)]
    assert links or named
    assert not [str(path) for path in (*links, *named) if not (ROOT / path).exists()]


def test_hosted_ci_runs_the_pythons_of_the_classifiers():
    claimed = [text.rsplit(" ", 1)[1] for text in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d+$", text)]
    workflow = (ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8")
    (matrix,) = re.findall(r"python: \[(.*)\]", workflow)
    assert re.findall(r"[\d.]+", matrix) == claimed
    assert "run: .ci/run" in workflow


def test_pre_commit_has_the_locked_ruff():
    lock = tomllib.loads((ROOT / "uv.lock").read_text(encoding="utf-8"))
    (locked,) = [package["version"] for package in lock["package"] if package["name"] == "ruff"]
    assert f"rev: v{locked}\n" in (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8")
