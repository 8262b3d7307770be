"""Markdown of synthetic streams and of analyses of two-person streams."""

from collections.abc import Mapping, Sequence
from typing import Any

from simprep.duel.labels.labels import ASPECTS, LEARNED_ASPECTS

PLURAL = {"punch": "punches", "kick": "kicks"}


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A Markdown table; numbers get three significant decimals."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(_text(cell) for cell in line) + " |" for line in lines)


def synthetic_markdown(summary: Mapping[str, Any], name: str, command: str) -> str:
    """What a synthetic stream holds, from `simprep.duel.synthetic.summary`, its name and the command that made it."""
    rates, distance, reaction = (summary[key] for key in ("attacks_per_min", "strike_distance_m", "reaction_s"))
    parts = [
        f"# {name}",
        "Synthetic: drawn from a known model and choreographed from simprep's built-in motions. Not a recording.",
        f"Made by `{command}`.",
        markdown_table(
            ("", ""),
            [
                ("length", f"{summary['minutes']:.1f} min, {summary['clips']} clips, {summary['fps']:g} frames per second"),
                ("actions, labels", f"{summary['segments']}, {summary['labels']}"),
                ("length of an action, median (10 to 90 %)", _spread(summary["duration_s"], "s")),
                *[(f"{PLURAL[kind]} per minute, A and B", " and ".join(f"{rate:.1f}" for rate in rates[kind])) for kind in rates],
                *[(f"distance of the roots at a {kind}", _spread(distance[kind], "m")) for kind in distance],
                *[(f"reaction to a {kind}", _spread(reaction[kind], "s")) for kind in reaction],
                ("attacks that a fitting reaction begins during", f"{100 * summary['answered_share']:.0f} %"),
                ("pelvis from the direction of the other", _spread(summary["facing_deg"], "deg")),
                ("supporting foot off its place, 99th percentile and most", " and ".join(f"{v:.0f} mm" for v in summary["foot_missed_mm"])),
            ],
        ),
        markdown_table(("kind of action", "number"), sorted(summary["kinds"].items(), key=lambda item: -item[1])),
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def analysis_markdown(tables: Mapping[str, Any], command: str) -> str:
    """All tables of an analysis (`simprep.duel.analysis`), with the command that made them."""
    parts = [
        f"# Analysis of {tables['stream']}",
        f"Made by `{command}`." + (f" The stream is {tables['source']}." if tables.get("source") else ""),
        markdown_table(
            ("actions", "groups A", "groups B", "annotated", "doubtful cuts"),
            [(tables["segments"], *tables["groups_per_player"], tables["annotated"], tables["suspicious"])],
        ),
    ]
    if "cut_f1" in tables:
        parts += _against_truth(tables)
    elif tables["label_cross_validation"]:
        scores = tables["label_cross_validation"]
        rows = [(aspect, one["accuracy"], one["macro_f1"]) for aspect, one in scores.items()]
        parts += ["## Labels, held out among the annotated", markdown_table(("aspect", "accuracy", "macro F1"), rows)]
    names = list(tables["label_logprob"])
    parts += [
        "## Next label: mean log-likelihood, held out [nats]",
        markdown_table(
            ("", *names),
            [
                ("held out", *tables["label_logprob"].values()),
                ("training", *tables["label_logprob_train"].values()),
                *_row(tables, "label_total_variation", "distance to the true model (total variation)", names),
                *_row(tables, "label_relative_to_truth", "below the truth, as a share of it", names),
            ],
        ),
        "## Geometry: mean log density, held out [nats]",
        markdown_table(
            ("", *tables["density_logprob"]),
            [
                ("held out", *tables["density_logprob"].values()),
                ("training", *tables["density_logprob_train"].values()),
            ],
        ),
        "## Principal components of the pose",
        markdown_table(
            ("components", "variance explained", "training", "held out", "gain, training", "gain, held out"),
            [
                (one["components"], one["explained"], one["train"], one["held_out"], one["train_gain"], one["held_out_gain"])
                for one in tables["components_curve"]
            ],
        ),
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def _against_truth(tables: Mapping[str, Any]) -> list[str]:
    accuracy, macro, rules = tables["label_accuracy"], tables["label_macro_f1"], tables["rules_on_true_cuts"]
    parts = [
        "## Against the truth",
        f"Cuts within 50 ms: F1 {tables['cut_f1']:.3f} (precision {tables['cut_precision']:.3f}, recall "
        f"{tables['cut_recall']:.3f}); {100 * tables['matched_share']:.1f} % of the actions have both ends right.",
        markdown_table(
            ("aspect", "accuracy", "macro F1"), [(aspect, accuracy[aspect], macro[aspect]) for aspect in ASPECTS]
        ),
        f"On true cuts the rules are right in {100 * rules['react']:.2f} % (react) and {100 * rules['move']:.2f} % (move; "
        f"{100 * rules['move_detected']:.1f} % with contacts detected in the noisy poses).",
    ]
    for aspect in LEARNED_ASPECTS:
        one = tables["label_confusion"][aspect]
        rows = [(name, *row) for name, row in zip(one["qualifiers"], one["confusion"])]
        parts += [f"### {aspect}: truth by row", markdown_table(("", *one["qualifiers"]), rows)]
    return parts


def _row(tables: Mapping[str, Any], key: str, title: str, names: Sequence[str]) -> list[tuple[Any, ...]]:
    return [(title, *(tables[key].get(name, "") for name in names))] if key in tables else []


def _spread(percentiles: Mapping[str, float], unit: str) -> str:
    if not percentiles:
        return "none"
    return f"{percentiles['50']:.2f} {unit} ({percentiles['10']:.2f} to {percentiles['90']:.2f})"


def _text(cell: Any) -> str:
    return f"{cell:.3f}" if isinstance(cell, float) else str(cell)
