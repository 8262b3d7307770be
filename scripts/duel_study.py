"""Numbers of the built-in two-person streams: cuts, labels, label models and densities against the truth, over seeds.

Example: python scripts/duel_study.py --seeds 5 -o results/duel
"""

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from simprep.duel.analysis import AnalysisSettings, analyse
from simprep.duel.labels.labels import ASPECTS, LEARNED_ASPECTS
from simprep.duel.model.evaluation import EvaluationSettings
from simprep.duel.model.semi_tied import PRIOR_COUNT
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import PRESETS, preset
from simprep.duel.synthetic.summary import summarise_synthetic
from simprep.files import atomic_path
from simprep.report.duel.tables import markdown_table
from simprep.report.results import provenance, save_json

KEPT = (
    "segments", "groups", "annotated", "cut_f1", "cut_precision", "cut_recall", "cut_error_frames", "matched_share",
    "label_accuracy", "label_macro_f1", "rules_on_true_cuts", "label_logprob", "label_relative_to_truth",
    "label_total_variation", "density_logprob", "density_logprob_train", "components_curve", "stages_s",
)  # fmt: skip


def one_stream(name: str, seed: int, splits: int) -> dict[str, Any]:
    """Make, analyse and compare one stream."""
    begun = time.process_time()
    example = make_synthetic(preset(name), seed)
    made = time.process_time()
    curve = tuple(range(1, 9)) if seed == 1 else (3,)
    settings = AnalysisSettings(
        proposed=False, evaluation=EvaluationSettings(splits=splits, components=curve, prior_counts=(PRIOR_COUNT,))
    )
    found = analyse(example.stream, np.random.default_rng(seed), truth=example.truth, settings=settings)
    analysed = time.process_time()
    proposed = analyse(
        example.stream,
        np.random.default_rng(seed),
        truth=example.truth,
        settings=AnalysisSettings(
            proposed=True, evaluation=EvaluationSettings(splits=1, components=(1,), prior_counts=(PRIOR_COUNT,))
        ),
    )
    return {
        "preset": name,
        "seed": seed,
        "proposed": {key: proposed.tables[key] for key in ("label_accuracy", "label_macro_f1", "annotated")},
        "make_cpu_s": made - begun,
        "analyse_cpu_s": analysed - made,
        "example": summarise_synthetic(example),
        **{key: found.tables[key] for key in KEPT},
    }


def spread(values: list[float]) -> str:
    """Mean and range."""
    return f"{np.mean(values):.3f} ({min(values):.3f} to {max(values):.3f})"


def report(streams: list[dict[str, Any]], command: str) -> str:
    """Markdown of all streams, mean and range over seeds."""
    names = [name for name in PRESETS if any(one["preset"] == name for one in streams)]
    sets = {name: [one for one in streams if one["preset"] == name] for name in names}

    def row(title: str, *keys: str) -> tuple[str, ...]:
        cells = []
        for name in names:
            values = []
            for one in sets[name]:
                value: Any = one
                for key in keys:
                    value = value[key]
                values.append(value)
            cells.append(spread(values))
        return (title, *cells)

    rows = [
        row("actions", "segments"),
        row("groups", "groups"),
        row("cuts: F1 within 50 ms", "cut_f1"),
        row("actions with both ends right", "matched_share"),
        *[row(f"{aspect}: accuracy", "label_accuracy", aspect) for aspect in ASPECTS],
        *[row(f"{aspect}: macro F1", "label_macro_f1", aspect) for aspect in ASPECTS],
        *[row(f"{aspect}: accuracy, annotated as proposed", "proposed", "label_accuracy", aspect) for aspect in LEARNED_ASPECTS],
        *[row(f"{aspect}: macro F1, annotated as proposed", "proposed", "label_macro_f1", aspect) for aspect in LEARNED_ASPECTS],
        *[row(f"{rule}, on true cuts", "rules_on_true_cuts", rule) for rule in streams[0]["rules_on_true_cuts"]],
        *[row(f"next label, held out [nats]: {kind}", "label_logprob", kind) for kind in streams[0]["label_logprob"]],
        *[row(f"below the truth: {kind}", "label_relative_to_truth", kind) for kind in streams[0]["label_relative_to_truth"]],
        *[row(f"total variation to the truth: {kind}", "label_total_variation", kind) for kind in streams[0]["label_total_variation"]],
        *[row(f"geometry, held out [nats]: {kind}", "density_logprob", kind) for kind in streams[0]["density_logprob"]],
        *[row(f"distance at a {kind}, median [m]", "example", "strike_distance_m", kind, "50") for kind in ("punch", "kick")],
        *[row(f"reaction to a {kind}, median [s]", "example", "reaction_s", kind, "50") for kind in ("punch", "kick")],
        row("attacks answered", "example", "answered_share"),
        row("making, processor time [s]", "make_cpu_s"),
        row("analysis, processor time [s]", "analyse_cpu_s"),
    ]  # fmt: skip
    seeds = ", ".join(str(one["seed"]) for one in sets[names[0]])
    return (
        "\n\n".join(
            [
                "# Built-in two-person streams against their truth",
                f"Synthetic streams. `{command}`. Mean and range over seeds {seeds}; a random tenth of the actions annotated.",
                markdown_table(("", *names), rows),
            ]
        )
        + "\n"
    )


def earlier(path: Path, splits: int) -> list[dict[str, Any]]:
    """Streams of an interrupted run with as many splits; delete the file to begin anew."""
    if not path.is_file():
        return []
    return [one for one in json.loads(path.read_text(encoding="utf-8"))["streams"] if one.get("splits") == splits]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="seeds 1 to this number; 0 was looked at while building")
    parser.add_argument("--splits", type=int, default=5)
    parser.add_argument("--presets", nargs="+", default=list(PRESETS), choices=list(PRESETS))
    parser.add_argument("-o", "--out", type=Path, default=Path("results/duel"))
    given = parser.parse_args()
    streams = earlier(given.out / "study.json", given.splits)
    for name in given.presets:
        for seed in range(1, given.seeds + 1):
            if any((one["preset"], one["seed"]) == (name, seed) for one in streams):
                continue  # done in an earlier run
            streams.append({**one_stream(name, seed, given.splits), "splits": given.splits})
            last = streams[-1]
            print(
                f"{name} {seed}: cuts {last['cut_f1']:.3f}, macro F1 {last['label_macro_f1']}",
                file=sys.stderr,
                flush=True,
            )
            given.out.mkdir(parents=True, exist_ok=True)
            content = provenance(["scripts/duel_study.py", *sys.argv[1:]])
            save_json(given.out / "study.json", {"schema": "simprep.duel-study/1", **content, "streams": streams})
            with atomic_path(given.out / "study.md") as temporary:
                temporary.write_text(report(streams, content["command"]), encoding="utf-8")


if __name__ == "__main__":
    main()
