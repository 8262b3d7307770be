"""`simprep duel analyse`: from a stream to a model, with every table and figure of its evaluation."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from simprep.cli import output as cli_output
from simprep.cli.output import BaseCommand, Json, Output, Quiet


@dataclass(frozen=True)
class DuelAnalyse(BaseCommand):
    """Cut, label and model a stream, and evaluate every stage. Writes model.npz with its stream.npz (for `simprep fight`), tables, labels, plots.

    A synthetic stream needs no ANNOTATIONS: a tenth of its actions is annotated from the truth beside it.

    Example: simprep duel analyse synthetic/kickboxing_0.npz -o analysis
    """

    stream: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="STREAM", help_behavior_hint="")]
    """The .npz file that `simprep duel import` or `simprep duel synthetic` wrote, or its folder."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = Path("analysis")
    """Folder to write to (default analysis)."""

    annotations: Annotated[Path | None, tyro.conf.arg(metavar="CSV", help_behavior_hint="")] = None
    """Actions that you have labelled (`simprep duel label` proposes which)."""

    cuts: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Cuts that you have edited; default: found anew."""

    annotated: Annotated[float, tyro.conf.arg(metavar="SHARE", help_behavior_hint="")] = 0.1
    """Share of the actions annotated from the truth of a synthetic stream (default 0.1)."""

    proposed: bool = False
    """Annotate from the truth what `simprep duel label` would propose, in ten rounds. This is the default."""

    no_proposed: bool = False
    """Annotate a random sample from the truth instead."""

    splits: Annotated[int, tyro.conf.arg(metavar="N", help_behavior_hint="")] = 5
    """Random divisions into training and held-out transitions (default 5)."""

    components: Annotated[int, tyro.conf.arg(metavar="N", help_behavior_hint="")] = 8
    """Most principal components in the curve of their number (default 8)."""

    seed: Annotated[int, tyro.conf.arg(metavar="N", help_behavior_hint="")] = 0
    """Decides what is annotated from a truth, folds and splits (default 0)."""

    no_figures: bool = False
    """Draw no plots of cuts, of the number of components and of the structures (they need the extra `report`)."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        import numpy as np

        from simprep.archive import find_archive
        from simprep.duel.analysis import STAGES, AnalysisSettings, analyse
        from simprep.duel.labels.annotations import read_annotations, save_annotations
        from simprep.duel.labels.cuts import read_cuts, save_cuts
        from simprep.duel.labels.labels import ASPECTS, decode
        from simprep.duel.model.evaluation import EvaluationSettings
        from simprep.duel.model.fight_model import save_fight_model
        from simprep.duel.stream.store import KIND, SCHEMA, read_stream
        from simprep.duel.stream.stream import check_stream
        from simprep.duel.synthetic.truth import read_truth, truth_path
        from simprep.errors import MissingExtraError, MotionError, MotionFileError, SettingError
        from simprep.files import atomic_path
        from simprep.report.duel.tables import analysis_markdown
        from simprep.report.results import provenance, save_json

        if not 1 <= self.splits <= 100:
            raise SettingError(f"--splits {self.splits}; valid: 1 to 100")
        if not 1 <= self.components <= 48:
            raise SettingError(f"--components {self.components}; valid: 1 to 48")
        if self.proposed and self.no_proposed:
            raise SettingError("both --proposed and --no-proposed; valid: one of them")
        begun = time.perf_counter()
        settings = AnalysisSettings(
            self.annotated,
            not self.no_proposed,
            EvaluationSettings(splits=self.splits, components=tuple(range(1, self.components + 1))),
        )
        source = find_archive(self.stream, KIND, SCHEMA)  # the truth is beside the file
        stream = read_stream(source)
        for warning in check_stream(stream).warnings:
            output.warn(warning)
        truth = read_truth(truth_path(source), stream) if truth_path(source).is_file() else None
        cuts = None if self.cuts is None else read_cuts(self.cuts, stream)
        path = self.annotations
        annotate = None if path is None else (lambda table: read_annotations(path, table))
        with output.progress() as bar:
            task = bar.add_task("", total=len(STAGES))
            reached = STAGES[0]

            def begin(stage: str) -> None:
                nonlocal reached
                reached = stage
                bar.update(task, description=stage, completed=STAGES.index(stage))

            try:
                found = analyse(stream, np.random.default_rng(self.seed), annotate, truth, cuts, settings, begin)
            except (MotionError, SettingError) as error:
                # the evaluation learns from two thirds of the stream, with up to --components components
                hint = " (a longer stream, or fewer --components)" if reached == "evaluation" else ""
                raise MotionFileError(source, f"{error}{hint}") from None
        for warning in found.tables["warnings"]:
            output.warn(warning)
        self.out.mkdir(parents=True, exist_ok=True)
        command = f"simprep duel analyse {source.name} --seed {self.seed} --splits {self.splits}"
        written = [
            *save_fight_model(found.model, stream, self.out),
            save_cuts(found.segmentation if cuts is None else cuts, stream, self.out / "cuts.txt"),
            save_annotations(
                self.out / "labels.csv", found.labels.table, np.arange(len(found.labels.codes)),
                decode(found.labels.codes), ASPECTS,
            ),
        ]  # fmt: skip
        if not self.no_figures:
            try:
                from simprep.report.duel.figures import plot_components, plot_cuts
                from simprep.report.duel.structures import plot_structures

                written.append(plot_cuts(stream, found.segmentation.force, found.cuts, self.out / "cuts.png"))
                written.append(plot_components(found.tables["components_curve"], self.out / "components.png"))
                written.append(plot_structures(found.model.graph, self.out / "structures.png"))
            except MissingExtraError as error:
                output.warn(str(error))
        used = {"wall_s": time.perf_counter() - begun, "peak_rss_mb": _peak_rss_mb()}
        tables = {**found.tables, **used}
        text = self.out / "tables.md"
        with atomic_path(text) as temporary:
            temporary.write_text(analysis_markdown(tables, command), encoding="utf-8")
        written += [text, save_json(self.out / "tables.json", {**provenance(cli_output.arguments), **tables})]
        _print(output, tables)
        for one in written:
            output.say(f"written: {one}")
        return {key: value for key, value in tables.items() if key != "label_confusion"}


def _peak_rss_mb() -> float:
    """Largest memory that this process has held [MB]; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:
        return 0.0
    import sys

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak / 1024


def _print(output: Output, tables: dict[str, Any]) -> None:
    from rich.table import Table

    title = f"{tables['segments']} actions, {tables['groups']} groups, {tables['annotated']} annotated"
    listing = Table(title=title, title_justify="left")
    for column in ("", "", "value"):
        listing.add_column(column)
    if "cut_f1" in tables:
        listing.add_row("cuts", "F1", f"{tables['cut_f1']:.3f}")
        for aspect, value in tables["label_accuracy"].items():
            listing.add_row(
                "labels", f"{aspect}: accuracy, macro F1", f"{value:.3f}, {tables['label_macro_f1'][aspect]:.3f}"
            )
    else:
        for aspect, one in tables["label_cross_validation"].items():
            shown = f"{one['accuracy']:.3f}, {one['macro_f1']:.3f}"
            listing.add_row("labels", f"{aspect}: accuracy, macro F1 (cross-validated)", shown)
    for kind, value in tables["label_logprob"].items():
        listing.add_row("next label, held out [nats]", kind, f"{value:.3f}")
    for kind, value in tables["density_logprob"].items():
        listing.add_row("geometry, held out [nats]", kind, f"{value:.3f}")
    listing.add_row("time, memory", "", f"{tables['wall_s']:.1f} s, {tables['peak_rss_mb']:.0f} MB")
    output.say(listing)
