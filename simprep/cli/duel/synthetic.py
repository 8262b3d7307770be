"""`simprep duel synthetic`: write a built-in stream of two fighters with its truth."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from simprep.cli.output import BaseCommand, Json, Output, Quiet


@dataclass(frozen=True)
class DuelSynthetic(BaseCommand):
    """Write a built-in stream: two fighters, choreographed (synthetic, not a recording), with the truth beside it.

    Example: simprep duel synthetic kickboxing -o synthetic
    """

    preset: Annotated[
        tyro.conf.Positional[Literal["kickboxing", "taekwondo"]], tyro.conf.arg(metavar="PRESET", help_behavior_hint="")
    ]
    """kickboxing (16 min at 60 frames/s) or taekwondo (9.8 min at 30 frames/s, more kicks)."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = Path(".")
    """Folder to write to: PRESET_SEED.npz, .truth.npz, .json and .md (default: here)."""

    seed: Annotated[int, tyro.conf.arg(metavar="N", help_behavior_hint="")] = 0
    """Another seed, another fight (default 0)."""

    clips: Annotated[int | None, tyro.conf.arg(metavar="N", help_behavior_hint="")] = None
    """Number of rounds, for shorter streams (default: all)."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from dataclasses import replace

        from simprep.duel.stream.store import save_stream
        from simprep.duel.synthetic.make import make_synthetic
        from simprep.duel.synthetic.presets import preset
        from simprep.duel.synthetic.summary import summarise_synthetic
        from simprep.duel.synthetic.truth import save_truth, truth_path
        from simprep.errors import SettingError
        from simprep.files import atomic_path
        from simprep.report.duel.tables import synthetic_markdown
        from simprep.report.results import save_json

        settings = preset(self.preset)
        if self.clips is not None:
            if not 1 <= self.clips <= 1000:
                raise SettingError(f"--clips {self.clips}; valid: 1 to 1000")
            settings = replace(settings, clips=self.clips)
        with output.progress() as bar:
            task = bar.add_task("rounds", total=settings.clips)
            made = make_synthetic(settings, self.seed, lambda done, _: bar.update(task, completed=done))
        self.out.mkdir(parents=True, exist_ok=True)
        stream = save_stream(made.stream, self.out / f"{made.stream.name}.npz")
        truth = save_truth(made.truth, truth_path(stream))
        summary = summarise_synthetic(made)
        command = f"simprep duel synthetic {self.preset} --seed {self.seed}"
        command += f" --clips {self.clips}" if self.clips is not None else ""
        written = save_json(stream.with_suffix(".json"), {"command": command, **summary})
        text = stream.with_suffix(".md")
        with atomic_path(text) as temporary:
            temporary.write_text(synthetic_markdown(summary, made.stream.name, command), encoding="utf-8")
        output.say("synthetic: drawn from a known model and choreographed from built-in motions, not a recording")
        output.say(
            f"{summary['minutes']:.1f} min in {summary['clips']} clips, {summary['segments']} actions, "
            f"{summary['labels']} different labels"
        )
        for path in (stream, truth, written, text):
            output.say(f"written: {path}")
        return {**summary, "stream": str(stream), "truth": str(truth)}
