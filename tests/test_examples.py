"""Every example runs as it stands, and prints what it promises."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"


def printed(name: str, folder: Path) -> str:
    """What an example prints, run from another folder, where it leaves nothing behind."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, EXAMPLES / f"{name}.py"],
        capture_output=True, text=True, cwd=folder, env=environment, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert not list(folder.iterdir())
    return done.stdout


def numbers(pattern: str, text: str) -> list[float]:
    found = re.search(pattern, text)
    assert found, text
    return [float(value) for value in found.groups()]


def prepare_and_track(text):
    blended, optimised = numbers(r"(\d+) mm blended, (\d+) mm optimised", text)
    assert optimised < blended
    (error,) = numbers(r"simulated: done at 1\.5\d s .*\nmean joint error (\d+) mm, largest external force 0 N", text)
    assert 0 < error < 50


def import_a_file(text):
    assert "wave: 60 frames at 30/s; y up, 0.01 m per unit" in text
    assert "every limb points where the file's does" in text
    assert numbers(r"worst limb: \w+, 95 % of the frames within ([\d.]+) deg", text)[0] < 5
    assert numbers(r"penetration at most ([\d.]+) mm", text)[0] < 5


def compare_posture_optimisation(text):
    _, blended, optimised = numbers(r"COM to centre .*? ([\d.]+) +([\d.]+) +([\d.]+)\n", text)
    assert optimised < blended
    none, blended, optimised = numbers(r"margin of stability.*? (-?[\d.]+) +(-?[\d.]+) +(-?[\d.]+)\n", text)
    assert none < blended < optimised


def fight_without_physics(text):
    *actions, last = text.splitlines()
    count, nearest, farthest = numbers(r"^(\d+) actions in 6 s; roots ([\d.]+) to ([\d.]+) m apart$", last)
    assert len(actions) == count
    assert {line.split()[2] for line in actions} == {"A", "B"}
    assert any("up" in line or "fwd" in line for line in actions)
    assert 0.2 < nearest < farthest < 3


def own_controller(text):
    plain, ankles = text.splitlines()
    assert re.match(r"pd +fell after [12]\.", plain)
    assert re.match(r"ankle_strategy +done", ankles)


def growing_reference(text):
    walking, _, standing, end = text.splitlines()
    assert numbers(r"^0\.80 s: .*, (0\.\d+) s of motion left$", walking) == [0.2]
    assert 0.85 < numbers(r"pelvis at .*, ([\d.]+) m, standing$", standing)[0] < 1.0
    assert numbers(r"^done, root-relative error (\d+) mm$", end)[0] < 60


def validate_own_clip(text):
    assert "my_punch: 154 frames at 60/s, the target movement begins at frame" in text
    none, optimised = (
        numbers(rf"{arm} +done, MPJPE (\d+) mm, launch (\d+) rad", text) for arm in ("none", "optimised")
    )
    assert max(none[0], optimised[0]) < 100
    assert optimised[1] < none[1]


def compare_arms(text):
    assert text.splitlines()[0].split() == ["metric", "none", "traditional", "blended", "optimised"]
    assert numbers(r"assist_n +(\S+) +(\S+) +(\S+) +(\S+)", text) == [0, 0, 0, 0]
    none, *prepared = numbers(r"com_cos_mm +(\S+) +(\S+) +(\S+) +(\S+)", text)
    assert max(prepared) < none


def replay_on_a_robot(text):
    assert "29 hinges, 1.26 m, 35 kg" in text
    assert numbers(r"joints ([\d.]+) mm", text)[0] < 20
    assert numbers(r"done after .* MPJPE (\d+) mm, largest external force 0 N", text)[0] < 60


def analyse_two_people(text):
    a, b = numbers(r"^45 s: (\d+) actions of A, (\d+) of B", text)
    assert min(a, b) > 36
    assert numbers(r"cut F1 ([\d.]+)", text)[0] > 0.9
    assert numbers(r"A attacks (\d+) times", text)[0] > 3


def stage_a_fight(text):
    (at,) = numbers(r"asked: kick.*answered at ([\d.]+) s", text)
    assert at < 1.2
    assert re.search(r"simulated: (done|fell) after [\d.]+ s, largest external force 0 N", text)


def regression_test(text):
    first, again, changed, *table, files = text.splitlines()
    assert "1 failed" in first
    assert "1 passed" in again
    assert "1 failed" in changed
    assert table[0].endswith("worse  │")
    assert files == "files: test_walk/test_prepared_walk.json"


CHECKS = {
    check.__name__: check
    for check in (
        prepare_and_track,
        import_a_file,
        compare_posture_optimisation,
        fight_without_physics,
        validate_own_clip,
        compare_arms,
        replay_on_a_robot,
        analyse_two_people,
        stage_a_fight,
        regression_test,
        own_controller,
        growing_reference,
    )
}


def test_every_example_is_run():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(CHECKS)


@pytest.mark.parametrize("name", CHECKS)
def test_example(name, tmp_path):
    CHECKS[name](printed(name, tmp_path))
