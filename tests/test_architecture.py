"""Data flows one way: a package imports only what lies upstream of it."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1] / "simprep"
FLOW = ("motion", "physics", "library", "preparation", "behavior", "duel", "metrics", "report", "study", "cli")
BASE = ("archive", "errors", "files", "humanoid", "scene", "threads")


def imported_parts(source: str) -> set[str]:
    """Names right below simprep that a module imports anywhere, inside functions too."""
    parts = set()
    for node in ast.walk(ast.parse(source)):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide the direction"
            names = [node.module or ""]
            if node.module == "simprep":
                names = [f"simprep.{alias.name}" for alias in node.names]
        parts |= {name.split(".")[1] for name in names if name.startswith("simprep.")}
    return parts - {"__version__"}


def test_every_package_is_in_the_flow():
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    modules = {path.stem for path in ROOT.glob("*.py")} - {"__init__"}
    assert packages == set(FLOW)
    assert modules == set(BASE)


@pytest.mark.parametrize("package", [*FLOW, *BASE])
def test_a_package_imports_only_what_is_upstream(package):
    allowed = {*BASE, *FLOW[: FLOW.index(package) + 1]} if package in FLOW else set(BASE)
    files = [ROOT / f"{package}.py"] if package in BASE else sorted((ROOT / package).rglob("*.py"))
    assert files
    wrong = {
        str(path.relative_to(ROOT)): found
        for path in files
        if (found := imported_parts(path.read_text(encoding="utf-8")) - allowed)
    }
    assert not wrong


def test_a_wrong_direction_would_be_found():
    assert imported_parts("def f():\n    from simprep.cli.main import main\n") == {"cli"}
    assert imported_parts("from simprep import humanoid\nimport simprep.report.gl") == {"humanoid", "report"}
