"""The package as others meet it: public names, files that must ship, a lock file without traces of one machine."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import simprep
from simprep.humanoid import mjcf_folder

ROOT = Path(__file__).resolve().parents[1]


def test_public_names_resolve():
    for name in simprep.__all__:
        assert getattr(simprep, name) is not None


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


def test_the_readme_has_one_command_to_run_and_one_to_test():
    readme = (ROOT / "README.md").read_text()
    blocks = re.findall(r"```bash\n(.*?)```", readme, re.DOTALL)
    assert len(blocks) == 2
    assert "simprep validate" in blocks[0]
    assert "pytest" in blocks[1]
    assert readme.index("<!-- ci:test -->\n```bash") < readme.index(blocks[1])


def test_the_readmes_python_example_runs(tmp_path):
    code = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL).group(1)
    assert 'controller="mpc"' in code
    quick = code.replace('"mpc"', '"pd"')  # mpc takes seconds and is tested elsewhere
    done = subprocess.run([sys.executable, "-c", quick], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    assert re.match(r"(done|fell) \d", done.stdout)
