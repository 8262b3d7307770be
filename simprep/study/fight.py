"""A fight from synthesis to numbers, files and pictures: what `simprep fight` and scripts share."""

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from simprep.duel.fight import Fight
from simprep.duel.fight_model import FightModel
from simprep.duel.hits import JudgedContact, judge
from simprep.duel.labels import ASPECTS, Label
from simprep.duel.posture import PostureChange, optimise_fight_posture
from simprep.duel.stream import PLAYERS, DuelStream
from simprep.duel.stream_store import save_stream
from simprep.errors import MissingExtraError
from simprep.files import atomic_path
from simprep.metrics.interaction import InteractionMetrics, interaction_metrics
from simprep.metrics.interaction_distributions import Distributions, distributions
from simprep.metrics.interaction_run import RunMetrics, fight_so_far, run_metrics, simulated_stream
from simprep.physics.run import Run
from simprep.physics.simulate import simulate
from simprep.physics.store import RUN_FILE, save_run

SCHEMA = "simprep.fight/1"
TIMELINE_S = 300.0
"""Longer fights get no time line [s]."""


@dataclass(frozen=True)
class FightResults:
    """A fight with all that was found out about it.

    Attributes:
        fight: as synthesised.
        kinematic: its metrics.
        fps_kinematic: frames made per second of computing, both fighters at once; None where it was not timed.
        tracked: what was simulated: the fight, its postures optimised where that was wished; None without simulation.
        posture: what the optimisation changed in A and B; None without.
        run: the simulation; None without.
        contacts: between the fighters in it, judged.
        simulated: its metrics; None without.
    """

    fight: Fight
    kinematic: InteractionMetrics
    fps_kinematic: float | None = None
    tracked: Fight | None = None
    posture: tuple[PostureChange, PostureChange] | None = None
    run: Run | None = None
    contacts: tuple[JudgedContact, ...] = ()
    simulated: RunMetrics | None = None

    def headline(self) -> dict[str, Any]:
        """The numbers of `simprep fight --json`; None where one does not exist.

        Facing, answers and distances to the example are those of the fight as synthesised; hits are those of the simulation,
        where there is one. Penetration of the poses is over the whole fight.
        """
        kinematic, run = self.kinematic, self.simulated
        simulated = None if run is None else run.simulated
        hits = kinematic.hits if simulated is None else simulated.hits
        return {
            "fps_kinematic": self.fps_kinematic,
            "s_per_s": None if run is None else run.s_per_s,
            "falls_per_min": None if run is None else run.falls_per_min,
            "mpjpe_mm": None if simulated is None else simulated.mpjpe_mm,
            "penetration_mm": {
                "kinematic_mean": kinematic.penetration.mean_mm,
                "simulated_mean": None if simulated is None else simulated.penetration.mean_mm,
                "simulated_max": None if simulated is None else simulated.penetration.max_mm,
            },
            "foot_slip_ratio": None if run is None else run.foot_slip_ratio,
            "facing_error_deg": kinematic.facing_error_deg.median,
            "answered_share": kinematic.reactions.answered_share,
            "hits": {"intended": hits.intended, "unintended": hits.unintended},
            "js": {name: kinematic.js.get(name) for name in ("bigram", "distance", "facing")},
            "assist_n": None if run is None else run.assist_n,
        }


def example_distributions(model: FightModel) -> Distributions:
    """What a fight is compared with: the model's own example stream."""
    actions = model.model.graph.actions
    return distributions(
        model.stream, np.stack([actions.player, actions.start, actions.end, actions.clip], axis=1), actions.label
    )


def evaluate_fight(
    fight: Fight,
    example: Distributions | None = None,
    physics: bool = True,
    optimise: bool = True,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    fps_kinematic: float | None = None,
) -> FightResults:
    """Measure a fight and simulate it.

    Args:
        fight: as synthesised.
        example: what to compare it with (`example_distributions`).
        physics: simulate it with `mpc`, both fighters planned jointly.
        optimise: optimise both fighters' postures before.
        seed: of the controller.
        progress: called with the share of the simulation that is done.
        fps_kinematic: how fast it was made, for the record.
    """
    kinematic = interaction_metrics(fight.stream, fight.table, fight.codes, example)
    made = FightResults(fight, kinematic, fps_kinematic)
    if not physics:
        return made
    tracked, posture = optimise_fight_posture(fight) if optimise else (fight, None)
    run = simulate(tracked.stream.players, "mpc", seed, progress=progress)
    contacts = judge(run.contacts, tracked)
    simulated = run_metrics(run, tracked, example)
    return replace(made, tracked=tracked, posture=posture, run=run, contacts=contacts, simulated=simulated)


def save_fight(results: FightResults, folder: str | Path) -> list[Path]:
    """Write motions, actions and, of a simulation, the run, simulated motions and contacts.

    Args:
        results: what to write.
        folder: is made where missing.

    Returns:
        `fight.npz` and `actions.csv`; with physics `tracked.npz`, `run.npz`, `contacts.csv`, and `simulated.npz` where the run
        has a second frame.
    """
    folder = Path(folder)
    files = [
        save_stream(results.fight.stream, folder / "fight.npz"),
        save_actions(results.fight, folder / "actions.csv"),
    ]
    if results.run is None or results.tracked is None:
        return files
    files.append(save_stream(results.tracked.stream, folder / "tracked.npz"))
    files.append(save_run(results.run, folder / RUN_FILE))
    files.append(_save_csv(folder / "contacts.csv", [_contact(one) for one in results.contacts], CONTACTS))
    if simulated := _simulated(results):
        files.append(save_stream(simulated, folder / "simulated.npz"))
    return files


ACTIONS = ("player", "start_s", "end_s", "moment_s", *ASPECTS, "example", "request")
CONTACTS = (
    "start_s", "duration_s", "part_a", "part_b", "impulse_ns", "impulse_x_ns", "impulse_y_ns", "impulse_z_ns",
    "peak_force_n", "closing_speed_m_s", "depth_mm", "x_m", "y_m", "z_m", "verdict", "attacker",
)  # fmt: skip


def save_actions(fight: Fight, path: str | Path) -> Path:
    """Write the actions of a fight as CSV, a line each.

    Args:
        fight: whose.
        path: the file.
    """
    fps = fight.stream.fps
    rows = []
    for one in fight.actions:
        label = Label.from_code(one.label)
        rows.append(
            {
                "player": PLAYERS[one.player],
                "start_s": round(one.start / fps, 4),
                "end_s": round(one.end / fps, 4),
                "moment_s": "" if one.moment < 0 else round(one.moment / fps, 4),
                **{aspect: getattr(label, aspect) for aspect in ASPECTS},
                "example": "" if one.example < 0 else one.example,
                "request": one.request,
            }
        )
    return _save_csv(Path(path), rows, ACTIONS)


def draw_fight(
    results: FightResults, folder: str | Path, pictures: int = 12, warn: Callable[[str], None] | None = None
) -> list[Path]:
    """Draw a film strip (of the simulation where there is one) and the time line.

    Args:
        results: what to draw.
        folder: to write to.
        pictures: in the strip.
        warn: called with a sentence where something cannot be drawn here.

    Returns:
        The files written.
    """
    from simprep.report.fight_strip import strip_captions, strip_frames
    from simprep.report.fight_timeline import fight_timeline
    from simprep.report.gl import NoGlError
    from simprep.report.pair_strip import save_pair_strip

    folder, files = Path(folder), []
    stream = _simulated(results) or results.fight.stream
    shown = results.fight if len(stream) == len(results.fight.stream) else _so_far(results.fight, stream)
    say = warn or (lambda text: None)
    try:
        frames = strip_frames(replace(shown, stream=stream), pictures)
        files.append(save_pair_strip(stream, frames, folder / "strip.png", strip_captions(shown, frames)))
    except (NoGlError, MissingExtraError) as problem:
        say(f"no film strip: {problem}")
    if results.fight.stream.duration > TIMELINE_S:
        say(f"no time line: the fight is longer than {TIMELINE_S:g} s")
        return files
    run = results.run
    falls = [] if run is None or run.fallen is None else [(run.end_s, run.fallen)]
    try:
        files.append(fight_timeline(results.fight, folder / "timeline.png", results.contacts, falls))
    except MissingExtraError as problem:
        say(f"no time line: {problem}")
    return files


def fight_content(results: FightResults) -> dict[str, Any]:
    """Everything for `metrics.json`: the headline, all metrics, how the fight was made."""
    fight = results.fight
    return {
        "schema": SCHEMA,
        **results.headline(),
        "mode": fight.mode,
        "seed": fight.seed,
        "duration_s": fight.stream.duration,
        "record": dict(fight.record),
        "actions": len(fight.actions),
        "kinematic": results.kinematic.as_dict(),
        "posture": None if results.posture is None else [asdict(one) for one in results.posture],
        "simulation": None if results.simulated is None else results.simulated.as_dict(),
    }


def _simulated(results: FightResults) -> DuelStream | None:
    if results.run is None or results.tracked is None or results.simulated is None:
        return None
    if results.simulated.simulated is None:
        return None
    return simulated_stream(results.run, results.tracked)[0]


def _so_far(fight: Fight, stream: DuelStream) -> Fight:
    """The fight cut off where its simulation ended."""
    frames = len(stream)
    table, _ = fight_so_far(fight, frames)
    kept = [one for one in fight.actions if one.start < frames]
    actions = tuple(
        replace(one, end=int(row[2]), moment=one.moment if one.moment < frames else -1) for one, row in zip(kept, table)
    )
    return replace(fight, stream=stream, actions=actions)


def _contact(one: JudgedContact) -> dict[str, Any]:
    return {
        "start_s": round(one.start_s, 5),
        "duration_s": round(one.duration_s, 5),
        "part_a": one.parts[0],
        "part_b": one.parts[1],
        "impulse_ns": round(one.impulse_ns, 4),
        **{f"impulse_{axis}_ns": round(value, 4) for axis, value in zip("xyz", one.impulse)},
        "peak_force_n": round(one.peak_force_n, 2),
        "closing_speed_m_s": round(one.closing_speed, 3),
        "depth_mm": round(1e3 * one.depth, 3),
        **{f"{axis}_m": round(value, 4) for axis, value in zip("xyz", one.position)},
        "verdict": one.verdict,
        "attacker": "" if one.attacker < 0 else PLAYERS[one.attacker],
    }


def _save_csv(path: Path, rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> Path:
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return path
