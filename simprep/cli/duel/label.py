"""`simprep duel label`: every action of a stream from a few annotated ones, and what to annotate next."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from rich.table import Table

from simprep.cli.output import BaseCommand, Json, Output, Quiet

if TYPE_CHECKING:
    from simprep.duel.labels.scores import AspectScore

CONFUSED = 6


@dataclass(frozen=True)
class DuelLabel(BaseCommand):
    """Label the actions of a stream, and propose which to annotate next (most uncertain first).

    Without ANNOTATIONS, writes the actions to begin with to PROPOSALS: fill in its empty cells, and give it as ANNOTATIONS
    the next time. Qualifiers: punches fwd, bwd, bwdfwd, fwdbwd; kicks up, down, downup; jump up, down; otherwise others.

    Example: simprep duel label fight.npz annotations.csv -o labels.csv
    """

    OUT_IS_FILE = True

    stream: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="STREAM", help_behavior_hint="")]
    """The .npz file that `simprep duel import` wrote, or its folder."""

    annotations: Annotated[
        tyro.conf.Positional[Path | None], tyro.conf.arg(metavar="[ANNOTATIONS]", help_behavior_hint="")
    ] = None
    """CSV of annotated actions."""

    cuts: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Cuts as text: read where the file exists, else written there to be edited; default: made anew."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="OUT", help_behavior_hint="")] = Path("labels.csv")
    """CSV of all labelled actions to write (default labels.csv)."""

    proposals: Annotated[Path, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = Path("proposals.csv")
    """CSV of the actions to annotate next, to write (default proposals.csv)."""

    count: Annotated[int, tyro.conf.arg(metavar="N", help_behavior_hint="")] = 20
    """How many actions to propose (default 20)."""

    figure: Annotated[Path | None, tyro.conf.arg(metavar="PNG", help_behavior_hint="")] = None
    """Plot of contact forces and cuts to write; needs the extra `report`."""

    seed: Annotated[int, tyro.conf.arg(metavar="N", help_behavior_hint="")] = 0
    """Decides the folds of the cross-validation (default 0)."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        import numpy as np

        from simprep.duel.labels.annotations import read_annotations, save_annotations, segment_names
        from simprep.duel.labels.cuts import read_cuts, save_cuts
        from simprep.duel.labels.labelling import label_stream, propose, stream_features
        from simprep.duel.labels.labels import ASPECTS, LEARNED_ASPECTS, decode
        from simprep.duel.labels.scores import cross_validate
        from simprep.duel.labels.segmentation import segment_stream, stream_kinematics
        from simprep.duel.stream.store import read_stream
        from simprep.duel.stream.stream import check_stream
        from simprep.errors import SettingError

        if not 1 <= self.count <= 10_000:
            raise SettingError(f"--count {self.count}; valid: 1 to 10000")
        stream = read_stream(self.stream)
        for warning in check_stream(stream).warnings:
            output.warn(warning)
        kinematics = stream_kinematics(stream)
        segmentation = segment_stream(stream, kinematics=kinematics)
        cuts = segmentation.cuts
        if self.cuts is not None and self.cuts.exists():
            cuts = read_cuts(self.cuts, stream)
        table = cuts.table()
        # everything is read before anything is written
        annotations = None if self.annotations is None else read_annotations(self.annotations, table)
        features = stream_features(cuts, kinematics)
        labels = None
        if annotations is not None:
            labels = label_stream(stream, cuts, annotations.rows, annotations.qualifiers, features=features)
        if self.figure is not None:
            from simprep.report.duel.figures import plot_cuts

            output.say(f"written: {plot_cuts(stream, segmentation.force, cuts, self.figure)}")
        if self.cuts is None or not self.cuts.exists():
            output.say(f"{len(segmentation.suspicious)} doubtful cuts or actions (listed in the file of --cuts)")
            if self.cuts is not None:
                output.say(f"written: {save_cuts(segmentation, stream, self.cuts)}")
        result: dict[str, Any] = {"actions": len(table), "suspicious": len(segmentation.suspicious)}
        done, margins = np.zeros(0, dtype=np.int64), None
        if annotations is not None and labels is not None:
            done, margins = annotations.rows, labels.margins
            for warning in labels.warnings:
                output.warn(warning)
            written = save_annotations(self.out, table, np.arange(len(table)), decode(labels.codes), ASPECTS)
            output.say(f"written: {written}")
            result |= {"annotated": len(done), "warnings": list(output.warnings), "out": str(written)}
            if len(done) >= 4:
                rng, character = np.random.default_rng(self.seed), stream.players[0].character
                scores = cross_validate(features[done], annotations.qualifiers, character, rng)
                _print_scores(output, scores, len(done))
                result["cross_validation"] = {aspect: one.as_dict() for aspect, one in scores.items()}
        chosen = propose(features, done, margins, self.count)
        known = None if labels is None else decode(labels.codes)[chosen][:, : len(LEARNED_ASPECTS)]
        save_annotations(self.proposals, table, chosen, None)
        names = segment_names(table)
        listing = Table(title="Annotate next", title_justify="left")
        for column in ("action", "from [s]", "to [s]", "lead", "now labelled"):
            listing.add_column(column)
        for number, row in enumerate(chosen):
            lead = "" if margins is None else f"{margins[row].min():.2f}"
            now = "" if known is None else _words(known[number])
            listing.add_row(
                names[row], f"{table[row, 1] / stream.fps:.2f}", f"{table[row, 2] / stream.fps:.2f}", lead, now
            )
        output.say(listing)
        output.say(f"written, to be filled in: {self.proposals}")
        return {**result, "proposals": [names[row] for row in chosen]}


def _words(qualifiers: Any) -> str:
    from simprep.duel.labels.labels import LEARNED_ASPECTS, OTHERS, QUALIFIERS

    named = [(aspect, QUALIFIERS[aspect][index]) for aspect, index in zip(LEARNED_ASPECTS, qualifiers)]
    return " ".join(f"{aspect}={name}" for aspect, name in named if name != OTHERS) or OTHERS


def _print_scores(output: Output, scores: "dict[str, AspectScore]", count: int) -> None:
    table = Table(title=f"Held-out labels of {count} annotated actions", title_justify="left")
    for column in ("aspect", "accuracy", "macro F1", "confused (truth -> label: number)"):
        table.add_column(column)
    for aspect, score in scores.items():
        confused = [
            (int(score.confusion[i, j]), f"{a} -> {b}")
            for i, a in enumerate(score.qualifiers)
            for j, b in enumerate(score.qualifiers)
            if i != j and score.confusion[i, j]
        ]
        shown = "; ".join(f"{name}: {number}" for number, name in sorted(confused, reverse=True)[:CONFUSED])
        table.add_row(aspect, f"{score.accuracy:.3f}", f"{score.macro_f1:.3f}", shown)
    output.say(table)
