"""Write a regression test: the first run writes a baseline, the second passes, and a changed program fails.

    python examples/regression_test.py

It needs pytest; the fixture `stability_regression` comes with simprep. Here the change is a lower level of preparation. In a project of
yours the test file and its baseline lie in the repository, and pytest is all that you call.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

TEST = """
import os
import simprep

def test_prepared_walk(stability_regression):
    walk, kick = simprep.library_motion("walk"), simprep.library_motion("kick_front")
    prepared = simprep.prepare(walk, kick, alpha=float(os.environ["ALPHA"]), duration=1.0)
    stability_regression.check(prepared.motion)
"""

with tempfile.TemporaryDirectory() as folder:
    (Path(folder) / "test_walk.py").write_text(TEST)
    for what, alpha in (
        ("first run, writes the baseline and fails on purpose", "0.8"),
        ("same again", "0.8"),
        ("something changed", "0.4"),
    ):
        environment = {**os.environ, "ALPHA": alpha, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
        command = [sys.executable, "-m", "pytest", "-q", "-p", "simprep.regression.plugin", "test_walk.py"]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        print(f"{what}: {done.stdout.splitlines()[-1]}")
        print("".join(f"    {line}\n" for line in done.stdout.splitlines() if "com_cos_mm" in line), end="")
    print("files:", *sorted(str(path.relative_to(folder)) for path in Path(folder).rglob("*.json")))
