"""Data flows one way: a package imports only what lies upstream of it, and so does a room of a package."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "simprep"
FLOW = (
    "motion",
    "physics",
    "library",
    "preparation",
    "controller",
    "duel",
    "metrics",
    "report",
    "check",
    "regression",
    "study",
    "app",
    "cli",
)
BASE = (
    "archive",
    "arrays",
    "character",
    "characters",
    "display",
    "errors",
    "files",
    "geoms",
    "humanoid_model",
    "primitive_robot",
    "random_seed",
    "robots",
    "scene",
    "threads",
)
ROOMS = {"duel": ("stream", "labels", "model", "synthetic", "analysis", "fight")}
"""Packages that consist of rooms in the order of their data; nothing else is in them."""
LAST_ROOMS = {"controller": "runtime", "metrics": "interaction", "study": "sweep"}
"""Rooms that build on the rest of their package; the rest does without them."""
PLOT_METHODS = {"motion/motion.py", "physics/run.py"}
"""Values that can draw themselves. Only inside their method `plot` may these modules reach for `simprep.report`, which knows them."""
OUTSIDE = ("scripts", "examples", "tests")
"""Folders beside the package. They use it; it knows none of them."""


def imported_modules(source: str) -> set[str]:
    """Dotted names that a module imports anywhere, inside functions too: modules, and with them the names taken from them."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide the direction"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def imported_parts(source: str, below: str = "simprep") -> set[str]:
    """Names right below a package that a module imports anywhere."""
    prefix = below + "."
    parts = {name.removeprefix(prefix).split(".")[0] for name in imported_modules(source) if name.startswith(prefix)}
    return parts - {"__version__"}


def without_plot(source: str) -> str:
    """A module without its methods `plot`, which may import from the report and nothing else."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            plots = [one for one in node.body if isinstance(one, ast.FunctionDef) and one.name == "plot"]
            assert all(imported_parts(ast.unparse(one)) == {"report"} for one in plots)
            node.body = [one for one in node.body if one not in plots] or [ast.Pass()]
    return ast.unparse(tree)


def sources(folder: Path) -> dict[Path, str]:
    return {path: path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.py"))}


def outside_modules() -> set[str]:
    """What Python finds when it runs a file of the folders beside the package: their modules and helper folders."""
    return {path.stem for folder in OUTSIDE if (ROOT / folder).is_dir() for path in (ROOT / folder).iterdir()}


def test_every_package_and_every_room_is_in_the_flow():
    packages = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    modules = {path.stem for path in PACKAGE.glob("*.py")} - {"__init__"}
    assert packages | modules == {*FLOW, *BASE}
    assert not packages & modules
    for package, rooms in ROOMS.items():
        found = {path.relative_to(PACKAGE / package).parts[0] for path in (PACKAGE / package).rglob("*.py")}
        assert {name.removesuffix(".py") for name in found} - {"__init__"} == set(rooms)


@pytest.mark.parametrize("package", [*FLOW, *BASE])
def test_a_package_imports_only_what_is_upstream(package):
    allowed = {*BASE, *FLOW[: FLOW.index(package) + 1]} if package in FLOW else set(BASE)
    path = PACKAGE / f"{package}.py"
    files = {path: path.read_text(encoding="utf-8")} if path.exists() else sources(PACKAGE / package)
    assert files
    for name in PLOT_METHODS:
        if PACKAGE / name in files:
            files[PACKAGE / name] = without_plot(files[PACKAGE / name])
    wrong = {
        str(path.relative_to(ROOT)): found for path, text in files.items() if (found := imported_parts(text) - allowed)
    }
    assert not wrong


@pytest.mark.parametrize(("package", "room"), [(package, room) for package, rooms in ROOMS.items() for room in rooms])
def test_a_room_imports_only_what_is_upstream(package, room):
    rooms = ROOMS[package]
    downstream = set(rooms[rooms.index(room) + 1 :])
    path = PACKAGE / package / f"{room}.py"
    files = {path: path.read_text(encoding="utf-8")} if path.exists() else sources(PACKAGE / package / room)
    assert files
    wrong = {
        str(path.relative_to(ROOT)): found
        for path, text in files.items()
        if (found := imported_parts(text, f"simprep.{package}") & downstream)
    }
    assert not wrong


@pytest.mark.parametrize(("package", "room"), LAST_ROOMS.items())
def test_the_rest_of_a_package_does_without_its_last_room(package, room):
    folder = PACKAGE / package
    rest = {path: text for path, text in sources(folder).items() if folder / room not in path.parents}
    assert len(rest) > 1
    wrong = [
        str(path.relative_to(ROOT)) for path, text in rest.items() if room in imported_parts(text, f"simprep.{package}")
    ]
    assert not wrong


def test_nothing_in_the_package_knows_scripts_examples_or_tests():
    outside = {*OUTSIDE, *outside_modules()} - sys.stdlib_module_names - {"simprep"}
    assert {"scripts", "bench", "conftest"} <= outside
    wrong = {
        str(path.relative_to(ROOT)): found
        for path, text in sources(PACKAGE).items()
        if (found := {name.split(".")[0] for name in imported_modules(text)} & outside)
    }
    assert not wrong


@pytest.mark.parametrize("folder", [folder for folder in ("scripts", "examples") if (ROOT / folder).is_dir()])
def test_scripts_and_examples_use_public_names_and_stand_alone(folder):
    """Each runs from a checkout: it imports simprep, libraries, and helpers in folders beside it, but no other script."""
    others = {path.stem for path in (ROOT / folder).glob("*.py")}
    wrong = {}
    for path, text in sources(ROOT / folder).items():
        names = imported_modules(text)
        private = {name for name in names if name.startswith("simprep.") and "._" in name.replace(".__version__", "")}
        scripts = {name for name in names if name.split(".")[0] in others}
        if private | scripts:
            wrong[str(path.relative_to(ROOT))] = private | scripts
    assert not wrong


def test_a_wrong_direction_would_be_found():
    assert imported_parts("def f():\n    from simprep.cli.main import main\n") == {"cli"}
    assert imported_parts("from simprep import humanoid_model\nimport simprep.report.gl") == {
        "humanoid_model",
        "report",
    }
    assert imported_parts("from simprep.duel import fight\nimport simprep.duel.model.store", "simprep.duel") == {
        "fight",
        "model",
    }
    assert imported_modules("from simprep.physics.run import _private") == {"simprep.physics.run._private"}
    drawn = "class A:\n    def plot(self):\n        import simprep.{}.gl\n    def save(self):\n        import simprep.report.gl\n"
    assert imported_parts(without_plot(drawn.format("report"))) == {"report"}  # that of `save`
    assert imported_parts(without_plot(drawn.split("    def save")[0].format("report"))) == set()
    with pytest.raises(AssertionError):
        without_plot(drawn.format("cli"))
