"""A fight measured as synthesised and, if wished, as simulated; shared by `simprep fight` and scripts."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from simprep.duel.fight.falls import Fall, blows
from simprep.duel.fight.fight import Fight
from simprep.duel.fight.hits import JudgedContact, judge
from simprep.duel.fight.live import LiveFight
from simprep.duel.fight.posture import PostureChange, optimise_fight_posture, posture_change, punching
from simprep.duel.model.fight_model import FightModel
from simprep.duel.stream.stream import DuelStream
from simprep.metrics.interaction.distributions import Distributions, distributions
from simprep.metrics.interaction.run import RunMetrics, falls_of_run, run_metrics, simulated_stream
from simprep.metrics.interaction.stream import InteractionMetrics, facings, interaction_metrics, plain
from simprep.physics.run import Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import simulate

SCHEMA = "simprep.fight/1"
STRIDE = 10
"""Of the examples' frames every so many are looked at for their facing."""


@dataclass(frozen=True)
class FightResults:
    """A fight and its measurements; without simulation the last seven may be None or empty.

    Attributes:
        fight: as synthesised.
        kinematic: its metrics.
        fps_kinematic: frames made per second of computing, all fighters at once; None where it was not timed.
        tracked: what was simulated: the fight, with its postures optimised where that was wished.
        posture: what the optimisation changed in each fighter; None where it was not wished.
        run: the simulation.
        contacts: between the fighters in it, judged.
        simulated: its metrics.
        falls: in it.
        examples_facing_deg: `recorded_facing`, to read `facing_error_deg` and `facing_head_deg` beside; None: not known.
        yardstick_s: what `simprep.physics.yardstick.Yardstick` takes beside it [s]; None: not measured.
    """

    fight: Fight
    kinematic: InteractionMetrics
    fps_kinematic: float | None = None
    tracked: Fight | None = None
    posture: tuple[PostureChange, ...] | None = None
    run: Run | None = None
    contacts: tuple[JudgedContact, ...] = ()
    simulated: RunMetrics | None = None
    falls: tuple[Fall, ...] = ()
    yardstick_s: float | None = None
    examples_facing_deg: dict[str, float] | None = None

    def headline(self) -> dict[str, Any]:
        """The numbers of `simprep fight --json`; None where one does not exist.

        Facing, answers and distances to the recorded stream are those of the fight as synthesised. Hits and how far
        strikes miss are those of the simulation, where there is one. Penetration of the poses is over the whole fight.
        `pair_yardsticks` is `s_per_s` in yardsticks, where one was measured (`yardstick_s`).
        """
        kinematic, run = self.kinematic, self.simulated
        simulated = None if run is None else run.simulated
        hits = kinematic.hits if simulated is None else simulated.hits
        miss = (simulated or kinematic).strike_miss_mm
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
            "falls_unprovoked_per_min": None if run is None else run.falls_unprovoked_per_min,
            "falls_after_collision_per_min": None if run is None else run.falls_after_collision_per_min,
            "knock_downs_per_min": None if run is None else run.knock_downs_per_min,
            "strike_miss_mm": miss and miss.median,
            "reacted_share": None if run is None else plain(run.reacted_share),
            "pair_yardsticks": None if run is None or not self.yardstick_s else run.s_per_s / self.yardstick_s,
            "facing_head_deg": kinematic.head_facing_error_deg.median,
        }

    @property
    def simulated_stream(self) -> DuelStream | None:
        """What was simulated, as a stream; None without simulation, or where it has no second frame."""
        if self.run is None or self.tracked is None or self.simulated is None or self.simulated.simulated is None:
            return None
        return simulated_stream(self.run, self.tracked)[0]


def recorded_distributions(model: FightModel) -> Distributions:
    """What a fight is compared with: the stream that its model has learned from."""
    actions = model.model.graph.actions
    return distributions(
        model.stream, np.stack([actions.player, actions.start, actions.end, actions.clip], axis=1), actions.label
    )


def recorded_facing(model: FightModel, first: int = 0) -> dict[str, float]:
    """How far pelvises and heads turn away from the other in the examples themselves: medians [deg].

    Args:
        model: with its examples.
        first: frame from which on they count.
    """
    stream = model.stream
    players = tuple(
        replace(one, qpos=one.qpos[first::STRIDE], contacts=one.contacts[first::STRIDE]) for one in stream.players
    )
    pelvis, head = facings(DuelStream(players))
    return {"pelvis": float(np.median(pelvis)), "head": float(np.median(head))}


def evaluate_fight(
    fight: Fight,
    recorded: Distributions | None = None,
    physics: bool = True,
    optimise: bool = True,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    fps_kinematic: float | None = None,
    settings: SimulationSettings | None = None,
) -> FightResults:
    """Measure a fight and simulate it.

    Args:
        fight: as synthesised.
        recorded: what to compare a fight of two with (`recorded_distributions`).
        physics: simulate it with `mpc`, all fighters planned jointly.
        optimise: optimise all fighters' postures before.
        seed: of the controller.
        progress: called with the share of the simulation that is done.
        fps_kinematic: how fast it was made, for the record.
        settings: scene and controller; None: the defaults.
    """
    kinematic = interaction_metrics(fight.stream, fight.table, fight.codes, recorded)
    made = FightResults(fight, kinematic, fps_kinematic)
    if not physics:
        return made
    tracked, posture = optimise_fight_posture(fight) if optimise else (fight, None)
    run = simulate(tracked.stream.players, "mpc", seed, settings, progress)
    contacts = judge(run.contacts, tracked)
    simulated = run_metrics(run, tracked, recorded)
    falls = falls_of_run(run, blows(contacts))
    return replace(made, tracked=tracked, posture=posture, run=run, contacts=contacts, simulated=simulated, falls=falls)


def evaluate_live(live: LiveFight, recorded: Distributions | None = None, meet: bool = True) -> FightResults:
    """Measure a fight that was simulated while it was drawn.

    Args:
        live: as far as it went.
        recorded: what to compare it with (`recorded_distributions`).
        meet: as of `run_metrics`.
    """
    found = live.result()
    fight, tracked = found.fight, found.tracked
    posture = None
    if live.optimised:
        pairs = zip(fight.stream.players, tracked.stream.players, strict=True)
        posture = tuple(posture_change(*pair, punching(fight, player)) for player, pair in enumerate(pairs))
    return FightResults(
        fight,
        interaction_metrics(fight.stream, fight.table, fight.codes, recorded),
        len(fight.stream) / live.drawing_s if live.drawing_s else None,
        tracked,
        posture,
        found.run,
        judge(found.run.contacts, tracked),
        run_metrics(found.run, tracked, recorded, found.falls, live.wall_s, found.resting, meet),
        found.falls,
    )


def fight_content(results: FightResults) -> dict[str, Any]:
    """Everything for `metrics.json`: the headline, all metrics, how the fight was made."""
    fight = results.fight
    return {
        "schema": SCHEMA,
        **results.headline(),
        "mode": fight.mode,
        "seed": fight.seed,
        "duration_s": fight.stream.duration,
        "yardstick_s": results.yardstick_s,
        "examples_facing_deg": results.examples_facing_deg,
        "record": dict(fight.record),
        "actions": len(fight.actions),
        "kinematic": results.kinematic.as_dict(),
        "posture": None if results.posture is None else [asdict(one) for one in results.posture],
        "falls": [
            {**asdict(one), "knock_down": one.knock_down, "after_collision": one.after_collision}
            for one in results.falls
        ],
        "simulation": None if results.simulated is None else results.simulated.as_dict(),
    }
