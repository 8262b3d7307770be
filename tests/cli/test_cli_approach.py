import json

import pytest

from simprep.cli.approach import HEADLINE
from simprep.cli.main import main


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--goal", "3"], "--goal '3'; valid: x,y in metres"),
        (["--goal", "3,nan"], "--goal '3,nan'; valid: x,y in metres"),
        (["--goal", "3,0", "--influence", "1"], "--influence '1'; valid: x,y or x,y,target or x,y,target,probability"),
        (["--goal", "3,0", "--influence", "1,0,duck,often"], "probability 'often'; valid: above 0, at most 1"),
        (["--goal", "3,0", "--influence", "1,0,duck,0.7", "--influence", "1,0,jump,0.7"], "add up to 1.4"),
        (["--goal", "3,0", "--influence", "1,0,duck", "--influence", "1,0,duck"], "duck is given twice"),
        (["--goal", "3,0", "--target", "headbutt"], "unknown target 'headbutt'; valid: punch_left"),
        (["--goal", "3,0", "--influence", "1,0,walk"], "unknown target 'walk'"),
        (["--goal", "3,0", "--policy", "none.npz"], "none.npz: no such file"),
        ([], "goal"),
    ],
)
def test_bad_input_is_one_line_and_code_2(arguments, message, capsys, tmp_path):
    assert main(["approach", *arguments, "--no-physics", "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not (tmp_path / "out").exists()


def test_an_approach_with_two_uncertain_sources_writes_its_results(capsys, tmp_path):
    command = [
        "approach", "--goal", "1.6,0.2", "--influence", "1.6,0.2", "--influence", "4,0,duck,0.5", "--influence", "4,0,jump,0.3",
        "--no-physics", "--no-optimise", "--json", "-o", str(tmp_path),
    ]  # fmt: skip
    assert main(command) == 0
    printed = json.loads(capsys.readouterr().out)
    assert set(HEADLINE) <= set(printed)
    assert printed["reached"] is True
    assert printed["alpha_at_influence"] > 0.9
    assert printed["max_alpha_jump"] <= 0.25
    assert printed["influences"][1]["targets"] == {"duck": 0.5, "jump": 0.3}
    written = json.loads((tmp_path / "metrics.json").read_text())
    assert written["schema"] == "simprep.approach/1"
    assert {path.name for path in tmp_path.iterdir()} == {*written["files"]}
    assert "plan.png" in written["files"]
