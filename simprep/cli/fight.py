"""`simprep fight`: a new fight from a model, and its simulation."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from simprep.cli import output as output_module
from simprep.cli.output import BaseCommand, Json, Output, Preset, Quiet

PICTURES = 12


@dataclass(frozen=True)
class FightCommand(BaseCommand):
    """Let two fighters fight by a learned model, simulated with joint motors only, and measure the fight.

    It is simulated while it is drawn: every action is chosen and placed by where both bodies are. Who falls gets up where
    that is possible, and the fight goes on.

    Writes fight.npz (both motions), actions.csv, metrics.json; of the simulation tracked.npz (what was simulated), run.npz,
    simulated.npz, contacts.csv; and, where pictures can be drawn, strip.png, timeline.png
    and report.html (a page with a replay that opens from disk). Without --model the built-in kickboxing stream is used, which is
    synthetic; its model is made once (about a minute) and kept.

    Example: simprep fight --seconds 10 --seed 3 -o out/fight
    """

    mode: Literal["automatic", "interactive", "passive"] = "automatic"
    """automatic: both by the model; interactive: the player follows --requests; passive: the player performs held-out
    attacks, the other only reacts."""

    seconds: Annotated[float, tyro.conf.arg(metavar="FLOAT", help_behavior_hint="")] = 10.0
    """Length [s] (default 10)."""

    seed: Annotated[int, tyro.conf.arg(metavar="N", help_behavior_hint="")] = 0
    """Another seed, another fight (default 0)."""

    model: Annotated[Path | None, tyro.conf.arg(metavar="DIR", help_behavior_hint="")] = None
    """Folder that `simprep duel analyse` wrote, or the model.npz in it (default: the built-in one)."""

    requests: Annotated[Path | None, tyro.conf.arg(metavar="CSV", help_behavior_hint="")] = None
    """Timed requests of the interactive mode: columns time_s, action (kick, left punch, ...), x_m, y_m (where to be)."""

    player: Literal["A", "B"] = "A"
    """Whom the requests control, or who performs the held-out attacks (default A)."""

    no_physics: bool = False
    """Do not simulate the fight."""

    no_feedback: bool = False
    """Draw the whole fight first and simulate it then, up to the first fall."""

    no_optimise: Annotated[bool, tyro.conf.arg(aliases=("--no-posture-optimization",))] = False
    """Simulate the fight as synthesised, without optimising both fighters' postures before."""

    gloves: bool = False
    """The fighters wear boxing gloves: hands are softer against the other's body."""

    no_pictures: bool = False
    """Draw no film strip and no time line, and write no report page."""

    yardstick: bool = False
    """Measure how long the yardstick takes afterwards (some seconds), for pair_yardsticks: computing time that compares
    between machines. Run nothing beside it."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = None
    """Folder for the results; default results/fight/MODE_SEED."""

    preset: Preset = "default"
    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        asked = self._checked()
        from simprep.duel.fight.default_model import fight_model
        from simprep.duel.fight.example_motions import ExampleMotions
        from simprep.duel.fight.live import LiveFight
        from simprep.duel.fight.modes import begin_fight
        from simprep.duel.model.fight_model import model_doubts
        from simprep.metrics.interaction.evaluate import (
            evaluate_fight,
            evaluate_live,
            fight_content,
            recorded_distributions,
            recorded_facing,
        )
        from simprep.physics.mpc_settings import MPC_PRESETS
        from simprep.physics.settings import SimulationSettings
        from simprep.physics.tracker import Tracker
        from simprep.physics.yardstick import Yardstick
        from simprep.report.fight.files import save_fight
        from simprep.report.fight.page import fight_page
        from simprep.report.fight.pictures import draw_fight
        from simprep.report.page import write_report
        from simprep.report.results import provenance, save_json
        from simprep.scene import SceneSettings

        with output.progress() as bar:
            task = bar.add_task("model", total=1.0)
            model = fight_model(self.model, lambda what, share: bar.update(task, description=what, completed=share))
            for doubt in model_doubts(model):
                output.warn(doubt)
            bar.update(task, description="examples", completed=0.0)
            examples = None if self.mode == "passive" else ExampleMotions.of(model.stream, model.model)
            made = begin_fight(model, self.mode, self.seed, "AB".index(self.player), asked, examples)
            bar.update(task, description="fight", completed=0.0)
            settings = SimulationSettings(SceneSettings(gloves=self.gloves), mpc=MPC_PRESETS[self.preset])

            def progress(share: float) -> None:
                bar.update(task, completed=share)

            if self.no_physics or self.no_feedback:
                begun = time.perf_counter()
                made.run(self.seconds, progress)
                fight = made.fight(self.seconds)
                wall_s = time.perf_counter() - begun
                bar.update(task, description="metrics" if self.no_physics else "simulation", completed=0.0)
                results = evaluate_fight(
                    fight,
                    recorded_distributions(model),
                    not self.no_physics,
                    not self.no_optimise,
                    self.seed,
                    progress,
                    len(fight.stream) / wall_s,
                    settings,
                )
            else:
                tracker = Tracker(made.bout.examples.bodies, None, self.seed, settings=settings)
                live = LiveFight(made, self.seed, tracker, optimise=not self.no_optimise)
                live.run(self.seconds, progress)
                bar.update(task, description="metrics", completed=0.0)
                results = evaluate_live(live, recorded_distributions(model))
                fight = results.fight
        results = replace(results, examples_facing_deg=recorded_facing(model))
        if self.yardstick and results.run is not None:
            results = replace(results, yardstick_s=Yardstick().seconds())
        folder = self.out or Path("results") / "fight" / f"{self.mode}_{self.seed}"
        content = results.headline()
        files = save_fight(results, folder)
        if not self.no_pictures:
            files += draw_fight(results, folder, PICTURES, output.warn)
            how = provenance(output_module.arguments)
            files += write_report(folder, lambda: fight_page(results, files, how, output.warnings), output.warn)
        files.append(folder / "metrics.json")
        whole = {**provenance(output_module.arguments), **fight_content(results)}
        save_json(
            files[-1],
            {**whole, "gloves": self.gloves, "warnings": output.warnings, "files": [path.name for path in files]},
        )
        output.say(
            f"{self.mode}, {fight.stream.duration:.1f} s, {len(fight.actions)} actions; model of {model.stream.name}"
        )
        if results.run is not None:
            output.say(f"simulated: {results.run.end} at {results.run.end_s:.2f} s ({results.run.end_reason})")
            for fall in results.falls:
                output.say(f"{fight.stream.names[fall.player]} falls at {fall.time_s:.2f} s: {fall.words}")
        parts = [(key, value if isinstance(value, dict) else {"": value}) for key, value in content.items()]
        output.say_metrics({f"{key} {name}".strip(): one for key, part in parts for name, one in part.items()})
        own = results.examples_facing_deg or {}
        output.say(
            "facing of the examples themselves: " + ", ".join(f"{part} {deg:.0f} deg" for part, deg in own.items())
        )
        output.say(f"written: {', '.join(map(str, files))}")
        return content

    def _checked(self) -> tuple[Any, ...]:
        from simprep.duel.fight.modes import LONGEST_S
        from simprep.duel.fight.requests import read_requests
        from simprep.errors import SettingError

        if not 0.1 <= self.seconds <= LONGEST_S:
            raise SettingError(f"--seconds {self.seconds:g}; valid: 0.1 to {LONGEST_S:g}")
        if self.gloves and self.no_physics:
            raise SettingError("--gloves with --no-physics; valid: with a simulation, in which hands touch")
        if self.yardstick and self.no_physics:
            raise SettingError("--yardstick with --no-physics; valid: with a simulation, whose time it measures")
        if self.mode != "interactive" and self.requests is not None:
            raise SettingError(f"--requests with --mode {self.mode}; valid: with --mode interactive")
        if self.mode == "interactive" and self.requests is None:
            raise SettingError("--mode interactive needs --requests CSV: columns time_s, action, x_m, y_m")
        return () if self.requests is None else read_requests(self.requests)
