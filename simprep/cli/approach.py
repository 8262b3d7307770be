"""`simprep approach`: walk to a goal, prepare on the way, launch a target."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from simprep.cli import output as output_module
from simprep.cli.output import BaseCommand, Json, Output, Preset, Quiet

if TYPE_CHECKING:
    from simprep.controller.influence import Influence
    from simprep.controller.runtime.approach import Approach as Result
    from simprep.controller.runtime.task import Task

HEADLINE = ("reached", "time_s", "alpha_at_influence", "max_alpha_jump", "fps")
"""Keys of `--json` that other tools rely on."""
PICTURES = 10
"""In the film strip."""


@dataclass(frozen=True)
class Approach(BaseCommand):
    """Walk to a goal under the controller, prepare for what is near, launch the target there, and simulate it all.

    Writes approach.npz (the motion), metrics.json, plan.png (seen from above), strip.png and report.html (a page with a replay that
    opens from disk), and run.npz where it is simulated.

    Example: simprep approach --goal 3,1 --influence 3,1 --target punch_right -o out/approach
    """

    goal: Annotated[str, tyro.conf.arg(metavar="X,Y")]
    """Where to go [m]; the character starts at 0,0 and faces along x. Write --goal=-1,2 where it begins with a minus."""

    influence: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="X,Y[,TARGET[,P]]", help_behavior_hint="")
    ] = ()
    """A source of influence [m], default the goal: with a target of its own (default --target) and the probability of that
    target (default 1). Give it several times for several sources; the same place twice for one that is uncertain."""

    target: Annotated[str, tyro.conf.arg(metavar="NAME", help_behavior_hint="")] = "punch_right"
    """Target motion launched at the goal; a wrong name lists them."""

    policy: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Controller written by `simprep train`, or its folder; default: the best one for the same model, by value iteration."""

    no_prepare: bool = False
    """Walk there unprepared: the plain motion graph."""

    no_optimise: bool = False
    """Leave out the posture optimisation."""

    seed: int = 0
    """Seed of the tracking controller's random numbers."""

    no_physics: bool = False
    """Synthesise only; do not simulate."""

    no_pictures: bool = False
    """Draw no pictures and write no report page."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = Path(
        "results/approach"
    )
    """Folder for the results."""

    preset: Preset = "default"
    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        goal = parse_point(self.goal, "--goal")
        sources = parse_influences(self.influence or (self.goal,), self.target)

        from simprep.controller.policy import read_policy
        from simprep.controller.runtime.approach import approach
        from simprep.controller.runtime.performer import RuntimeSettings
        from simprep.controller.runtime.task import Task
        from simprep.controller.runtime.world import library_world
        from simprep.metrics.evaluate import evaluate_motion
        from simprep.motion.store import save_motion
        from simprep.report.approach_page import approach_page
        from simprep.report.page import write_report
        from simprep.report.results import provenance, save_json

        names = [self.target, *(name for source in sources for name in source.targets)]
        policy = None if self.policy is None else read_policy(self.policy)
        world = library_world(names, RuntimeSettings(optimise=not self.no_optimise), policy, not self.no_prepare)
        task = Task(goal, self.target, tuple(sources))
        result = approach(world, [task])
        motion = result.motion
        content = {
            "schema": "simprep.approach/1",
            **provenance(output_module.arguments),
            "reached": result.reached,
            "time_s": result.time_s,
            "alpha_at_influence": result.alpha_at_influence,
            "max_alpha_jump": result.max_alpha_jump,
            "fps": result.fps,
            "duration_s": motion.duration,
            "launch_s": [frame / motion.fps for frame in result.launches],
            "actions": [
                {"time_s": a.frame / motion.fps, "node": a.node, "alpha": a.alpha, "forced": a.forced,
                 "goal_distance_m": a.goal_distance, "weights": a.weights}
                for a in result.actions
            ],
            "influences": [{"position_m": source.position, "targets": dict(source.targets)} for source in sources],
            "motion": evaluate_motion(motion),
        }  # fmt: skip
        files = [save_motion(motion, self.out / "approach.npz")]
        run = None
        if not self.no_physics:
            run = self._track(motion, output)
            content["simulated"] = run[1]
            files.append(run[2])
        if not self.no_pictures:
            files += self._draw(result, task, None if run is None else run[0], output)
            details = {name: content[name] for name in ("command", "created_utc", "versions", "platform")}
            files += write_report(
                self.out,
                lambda: approach_page(result, task, None if run is None else run[:2], files, details, output.warnings),
                output.warn,
            )
        content["warnings"] = output.warnings
        files.append(self.out / "metrics.json")
        content["files"] = [path.name for path in files]
        save_json(self.out / "metrics.json", content)
        where = "not reached" if result.time_s is None else f"reached after {result.time_s:.2f} s"
        output.say(f"goal {where}, {len(result.actions)} actions; launch at {content['launch_s']} s")
        at = (
            "no source of influence reached"
            if result.alpha_at_influence is None
            else f"{result.alpha_at_influence:.2f}"
        )
        output.say(f"alpha at the influence: {at}; largest jump {result.max_alpha_jump:.2f}; {result.fps:.0f} frames/s")
        if run is not None:
            output.say(f"simulated with mpc: {run[0].end} at {run[0].end_s:.2f} s ({run[0].end_reason})")
        output.say(f"written: {', '.join(map(str, files))}")
        return content

    def _track(self, motion: Any, output: Output) -> tuple[Any, dict[str, Any], Path]:
        from simprep.metrics.evaluate import evaluate_run
        from simprep.physics.mpc_settings import MPC_PRESETS
        from simprep.physics.settings import SimulationSettings
        from simprep.physics.simulate import track
        from simprep.physics.store import RUN_FILE, save_run

        with output.simulating("mpc", motion) as progress:
            run = track(motion, "mpc", self.seed, SimulationSettings(mpc=MPC_PRESETS[self.preset]), progress)
        return run, evaluate_run(run), save_run(run, self.out / RUN_FILE)

    def _draw(self, result: "Result", task: "Task", run: Any, output: Output) -> list[Path]:
        from simprep.report.approach_figure import plot_approach
        from simprep.report.approach_page import place_marks
        from simprep.report.contact_sheet import picture_times
        from simprep.report.film_strip import Row, StripSettings, save_film_strip
        from simprep.report.gl import pictures_or_warning
        from simprep.scene import SceneSettings

        files = []
        motion = result.motion
        rows = [Row("synthesised", motion)]
        if run is not None:
            note = "" if run.end == "done" else f"{run.end} at {run.end_s:.2f} s"
            rows.append(Row("simulated, mpc", run.simulated_motion(), note))
        marks = {} if not result.launches else {"launch": result.launches[0] / motion.fps}
        with pictures_or_warning("pictures are missing", output.warn):
            title = f"approach, {self.target}"
            files.append(plot_approach(result, [task], self.out / "plan.png", title))
            times = tuple(float(time) for time in picture_times(motion, PICTURES))
            strip = StripSettings(times_s=times, marks=marks, scene=SceneSettings(obstacles=place_marks(task)))
            files.append(save_film_strip(rows, self.out / "strip.png", strip))
        return files


def parse_point(text: str, option: str) -> tuple[float, float]:
    """Read `x,y`.

    Args:
        text: two finite numbers within 100 m.
        option: named in the error.

    Raises:
        SettingError: anything else.
    """
    from math import isfinite

    from simprep.errors import SettingError

    try:
        x, y = (float(part) for part in text.split(","))
        if not (isfinite(x) and isfinite(y) and max(abs(x), abs(y)) <= 100):
            raise ValueError
    except ValueError:
        raise SettingError(f"{option} {text!r}; valid: x,y in metres, such as 3,-0.5, at most 100 m away") from None
    return x, y


def parse_influences(texts: Sequence[str], target: str) -> "list[Influence]":
    """Read `x,y[,target[,probability]]`; the same place several times is one source with several targets.

    Args:
        texts: one each.
        target: of those that name none.

    Raises:
        SettingError: malformed, or probabilities that cannot be.
    """
    from simprep.controller.influence import Influence
    from simprep.errors import SettingError

    places: dict[tuple[float, float], dict[str, float]] = {}
    for text in texts:
        parts = text.split(",")
        if not 2 <= len(parts) <= 4:
            raise SettingError(f"--influence {text!r}; valid: x,y or x,y,target or x,y,target,probability")
        point = parse_point(",".join(parts[:2]), "--influence")
        name = parts[2].strip() if len(parts) > 2 else target
        try:
            probability = float(parts[3]) if len(parts) > 3 else 1.0
        except ValueError:
            raise SettingError(f"--influence {text!r}: probability {parts[3]!r}; valid: above 0, at most 1") from None
        if name in places.setdefault(point, {}):
            raise SettingError(f"--influence {text!r}: {name} is given twice for the same place; valid: once")
        places[point][name] = probability
    return [Influence(point, targets) for point, targets in places.items()]
