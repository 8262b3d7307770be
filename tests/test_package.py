"""The package as others meet it: public names, files that must ship, a lock file without traces of one machine."""

import ast
import re
import tomllib
from pathlib import Path

import simprep
from simprep.humanoid_model import mjcf_folder

ROOT = Path(__file__).resolve().parents[1]


def test_public_names_resolve():
    for name in simprep.__all__:
        assert getattr(simprep, name) is not None


def test_editors_find_a_type_for_every_public_name():
    """What loads lazily is also imported for type checkers, from the same module."""
    source = ast.parse((ROOT / "simprep" / "__init__.py").read_text())
    typed = {
        alias.asname: node.module
        for block in source.body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert typed == simprep._EXPORTS


def test_the_model_files_ship_inside_the_wheel():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert settings["force-include"]["mjcf"] == "simprep/mjcf"
    assert (mjcf_folder() / "humanoid.xml").is_file()


def test_the_lock_file_names_only_the_public_index():
    lock = tomllib.loads((ROOT / "uv.lock").read_text())
    sources = {tuple(package["source"].items()) for package in lock["package"]}
    assert sources == {(("editable", "."),), (("registry", "https://pypi.org/simple"),)}
    hosts = set(re.findall(r'url = "(https?://[^/]+)/', (ROOT / "uv.lock").read_text()))
    assert hosts == {"https://files.pythonhosted.org"}


def test_the_version_is_in_one_place():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "version" not in project["project"]
    assert project["tool"]["hatch"]["version"]["path"] == "simprep/__init__.py"
    assert f'__version__ = "{simprep.__version__}"' in (ROOT / "simprep" / "__init__.py").read_text()
    assert re.fullmatch(r"\d+\.\d+\.\d+\S*", simprep.__version__)


def test_no_export_is_hidden_by_a_module_of_its_name():
    """`simprep.x` is the module x as soon as anything imports it; an export of that name would be gone."""
    modules = {path.stem for path in (ROOT / "simprep").iterdir() if path.suffix == ".py" or path.is_dir()}
    assert not modules & set(simprep.__all__)
