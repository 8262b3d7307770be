"""`simprep duel synthetic` and `simprep duel analyse`, as a user runs them."""

import json

import pytest

from simprep.cli.main import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("duel")


def run(capsys, *arguments):
    code = main(["duel", *map(str, arguments)])
    return code, *capsys.readouterr()


def test_synthetic_stream_then_analysis(folder, capsys):
    code, out, _ = run(capsys, "synthetic", "taekwondo", "--clips", 1, "--seed", 1, "-o", folder, "--json")
    assert code == 0
    made = json.loads(out)
    assert made["clips"] == 1
    assert "synthetic" in made["source"]
    assert (folder / "taekwondo_1.md").read_text().startswith("# taekwondo_1\n\nSynthetic")
    code, out, _ = run(
        capsys,
        "analyse",
        folder,  # the stream in it, and its truth
        "-o",
        folder / "out",
        "--splits",
        1,
        "--components",
        1,
        "--annotated",
        0.4,
        "--json",
    )
    assert code == 0
    found = json.loads(out)
    wanted = {
        "segments", "groups", "cut_f1", "label_accuracy", "label_macro_f1", "label_logprob", "density_logprob",
        "components_curve", "wall_s", "peak_rss_mb",
    }  # fmt: skip
    assert wanted <= found.keys()
    assert set(found["label_logprob"]) >= {"eq7", "eq8", "eq9", "truth"}
    assert set(found["density_logprob"]) == {"semi_tied", "full", "diagonal"}
    written = {path.name for path in (folder / "out").iterdir()}
    assert {
        "model.npz",
        "tables.json",
        "tables.md",
        "cuts.txt",
        "labels.csv",
        "cuts.png",
        "components.png",
        "structures.png",
        "stream.npz",
    } == written


def test_a_stream_without_truth_needs_annotations(folder, capsys):
    (folder / "taekwondo_1.npz").rename(folder / "recorded.npz")
    code, _, err = run(capsys, "analyse", folder / "recorded.npz", "-o", folder / "none")
    assert code == 2
    assert "no annotations" in err
    assert not (folder / "none").exists()
    code, _, _ = run(
        capsys, "analyze", folder / "recorded.npz", "--annotations", folder / "out", "--cuts",
        folder / "out", "-o", folder / "own", "--splits", 1, "--components", 1, "--no-figures", "--json",
    )  # fmt: skip
    assert code == 0
    tables = json.loads((folder / "own" / "tables.json").read_text())
    assert "cut_f1" not in tables
    assert "truth" not in tables["label_logprob"]


def test_a_model_without_attacks_is_warned_of_when_made_and_when_used(folder, capsys):
    labels = (folder / "out" / "labels.csv").read_text().splitlines()
    quiet = [labels[0], *(line for line in labels[1:] if line.split(",")[5:10] == ["others"] * 5)]
    assert len(quiet) > 20
    (folder / "quiet.csv").write_text("\n".join(quiet) + "\n")
    code, _, err = run(
        capsys, "analyze", folder / "recorded.npz", "--annotations", folder / "quiet.csv", "--cuts",
        folder / "out" / "cuts.txt", "-o", folder / "quiet", "--splits", 1, "--components", 1, "--no-figures",
    )  # fmt: skip
    assert code == 0
    assert "warning: no action of the stream is labelled as an attack: there is no fight to learn from" in err
    arguments = [
        "fight",
        "--model",
        str(folder / "quiet"),
        "--no-physics",
        "--no-pictures",
        "-o",
        str(folder / "fight"),
    ]
    assert main([*arguments, "--seconds", "1"]) == 0
    assert "warning: A never attacks in taekwondo_1" in capsys.readouterr().err
    (folder / "wish.csv").write_text("time_s,action,x_m,y_m\n0,kick,,\n")
    assert main([*arguments, "--mode", "interactive", "--requests", str(folder / "wish.csv")]) == 2
    assert "player A has no 'kick' in the examples of this model; valid: no attack" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("example", "kickboxing", "--clips", "0"), "--clips 0; valid: 1 to 1000"),
        (("synthetic", "kickboxing", "--seed", "-1"), "--seed -1; valid: 0 or more"),
        (("analyze", "nothing.npz"), "no such file"),
        (("analyze", "nothing.npz", "--annotated", "2"), "valid: above 0, below 1"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(capsys, arguments, said):
    code, _, err = run(capsys, *arguments)
    assert code == 2
    assert said in err
    assert "Traceback" not in err
