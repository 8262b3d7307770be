"""`simprep train`: learn a controller that chooses motion and level of preparation."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from simprep.cli import output as output_module
from simprep.cli.output import BaseCommand, Json, Output, Quiet

if TYPE_CHECKING:
    from simprep.controller.policy import Policy
    from simprep.controller.training import Training

HEADLINE = ("steps", "wall_s", "states", "mean_return", "optimal_share")
"""Keys of `--json` that other tools rely on."""


@dataclass(frozen=True)
class Train(BaseCommand):
    """Learn a controller by SARSA: it walks to a goal, and raises the level of preparation towards what comes next.

    Its displacements are measured on the prepared motions. Writes policy.npz (for simprep approach --policy), training.npz (to
    go on with --resume), metrics.json and learning_curve.png. Needs the extra `learn`.

    Example: simprep train --steps 20000000 -o out/controller
    """

    target: Annotated[str, tyro.conf.arg(metavar="MOTION", help_behavior_hint="")] = "punch_right"
    """Target motion that is prepared for; controllers differ only where the blending curve of the root does."""

    steps: int = 30_000_000
    """Training steps, altogether."""

    seed: int = 0
    """Seed of the random numbers."""

    discount: float = 0.9
    """Weight of the next action's return; 0.3 for the paper's, with which standing still is the best policy nearly everywhere."""

    curvature_lower: float = 1.0
    """C of the lower body's blending curve (1: a straight line), for a controller of another curve."""

    starts: int = 1000
    """Random starts on the continuous floor, to measure the level of preparation at the source of influence."""

    resume: bool = False
    """Go on with the training saved in the folder; the other options must be those it began with."""

    no_pictures: bool = False
    """Draw no learning curve."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = Path("results/train")
    """Folder for the results."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        import dataclasses

        import numpy as np

        from simprep.controller.assess import assess, random_approaches
        from simprep.controller.policy import save_policy
        from simprep.errors import SettingError
        from simprep.report.results import provenance, save_json

        if not 1 <= self.starts <= 1_000_000:
            raise SettingError(f"--starts {self.starts}; valid: 1 to 1000000")
        training, policy = self._train(output)
        assessment = assess(policy)
        content = {
            "schema": "simprep.train/1",
            **provenance(output_module.arguments),
            "steps": training.learner.steps,
            "wall_s": training.wall_s,
            **dataclasses.asdict(assessment),
            "episodes": training.learner.episodes,
            "settled": training.settled(),
            "target": self.target,
            "random_starts": random_approaches(policy, self.starts, np.random.default_rng(self.seed)),
            "learning_curve": [dataclasses.asdict(point) for point in training.curve],
            "controller": dataclasses.asdict(policy.settings),
            "learning": dataclasses.asdict(training.learning),
        }
        files = [save_policy(policy, self.out / "policy.npz"), self.out / "training.npz"]
        if not self.no_pictures:
            files += self._draw(training, assessment.best_return, output)
        content["warnings"] = output.warnings
        files.append(self.out / "metrics.json")
        content["files"] = [path.name for path in files]
        save_json(self.out / "metrics.json", content)
        _say(output, content)
        output.say(f"written: {', '.join(map(str, files))}")
        return content

    def _train(self, output: Output) -> tuple["Training", "Policy"]:
        from simprep.cli.resolve import resolve_motion
        from simprep.controller.best import measure
        from simprep.controller.settings import ControllerSettings, LearningSettings, RewardSettings
        from simprep.controller.training import resume, run, save_training, start
        from simprep.preparation.settings import PreparationSettings

        settings = ControllerSettings(
            rewards=RewardSettings(discount=self.discount),
            preparation=PreparationSettings(curvature_lower=self.curvature_lower),
        )
        learning = LearningSettings(steps=self.steps, seed=self.seed)
        table = measure(settings, resolve_motion(self.target, output.warn))
        saved = self.out / "training.npz"
        training = resume(saved, table, settings, learning) if self.resume else start(table, settings, learning)
        save_training(training, saved)  # a folder that cannot be written to is known before the work
        with output.progress() as bar:
            task = bar.add_task("sarsa", total=self.steps, completed=training.learner.steps)
            try:
                policy = run(
                    training,
                    progress=lambda steps: bar.update(task, completed=steps),
                    checkpoint=lambda current: save_training(current, saved),
                )
            except KeyboardInterrupt:
                raise KeyboardInterrupt(f"{saved} holds the last full round; go on with --resume") from None
        return training, policy

    def _draw(self, training: "Training", best: float, output: Output) -> list[Path]:
        from simprep.report.gl import pictures_or_warning
        from simprep.report.learning_curve import plot_learning_curve

        steps = [point.steps for point in training.curve]
        returns = [point.mean_return for point in training.curve]
        with pictures_or_warning("no learning curve", output.warn):
            return [plot_learning_curve(steps, returns, best, self.out / "learning_curve.png")]
        return []


def _say(output: Output, content: dict[str, Any]) -> None:
    starts = content["random_starts"]
    output.say(
        f"{content['steps']:,} steps in {content['wall_s']:.1f} s; mean return {content['mean_return']:.3f}, "
        f"{100 * content['optimal_share']:.2f} % of the best possible"
    )
    output.say(
        f"surely reaches the goal from {100 * content['arrival_share']:.2f} % of the states from which it can be reached "
        f"({content['unreached']} are missing); from {100 * starts['reached_share']:.1f} % of {starts['starts']} random starts on the continuous floor"
    )
    least = starts["alpha_at_influence_min"]
    output.say(
        "the source of influence was never met"
        if least is None
        else f"alpha at the source of influence at least {least:.2f} ({starts['alpha_on_crossing_min']:.2f} on coming within "
        f"reach), largest jump {starts['max_alpha_jump']:.2f}"
    )
