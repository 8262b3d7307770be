"""What the README shows works as shown: its two commands and its Python example."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_it_has_one_command_to_run_and_one_to_test():
    blocks = re.findall(r"```bash\n(.*?)```", README, re.DOTALL)
    assert len(blocks) == 2
    assert "simprep validate" in blocks[0]
    assert "pytest" in blocks[1]
    assert README.index("<!-- ci:test -->\n```bash") < README.index(blocks[1])


def test_its_python_example_runs_as_shown(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert 'controller="mpc"' in code
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    made, simulated = done.stdout.splitlines()
    assert float(made.split()[0]) > 1
    end, error = simulated.split()
    assert end == "done"
    assert 0 < float(error) < 50
