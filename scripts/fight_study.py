"""Fights by the learned model against held-out data and baselines; passive and interactive modes against the truth.

The built-in stream is analysed, the model learns from its first two thirds, and everything is compared with the last third.

Example: python scripts/fight_study.py --bouts 10 --seconds 60 -o results/fights
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from measuring.fights import ATTACKS_ASKED_FOR, Setup, answered, reach_of, set_up, ways
from simprep.duel.fight.alertness import Alertness, run
from simprep.duel.fight.avatar import Avatar, Steering
from simprep.duel.fight.baselines import IndependentChooser, RandomChooser
from simprep.duel.fight.choice import Chooser, ModelChooser
from simprep.duel.fight.drawing import DrawingChooser
from simprep.duel.fight.fight import Fight
from simprep.duel.fight.passive import ReactingChooser, RecordedChooser
from simprep.duel.fight.synthesis import Bout
from simprep.duel.labels.labels import ATTACKING_QUALIFIERS, Label
from simprep.duel.model.held_out import held_out_actions
from simprep.duel.model.structures import REQUESTS
from simprep.duel.stream.stream import DuelStream, facing_error
from simprep.files import atomic_path
from simprep.metrics.interaction.distributions import KINDS, Distributions, distributions, js_distances, pooled
from simprep.metrics.interaction.stitches import Stitches, compare_stitches, stitches
from simprep.metrics.interaction.stream import interaction_metrics
from simprep.motion.edit import yaw
from simprep.motion.turns import turned
from simprep.report.duel.tables import markdown_table
from simprep.report.results import provenance, save_json

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]
PASSIVE = (
    "Eq. 6 and 12",
    "as drawn",
    "only reacting",
    "Eq. 6 and 12, alert",
    "as drawn, alert",
    "only reacting, alert (the mode)",
)
"""Who reacts: by the paper's choice, by the automatic mode's, by the passive mode's; actions end early when attacked or not."""
INF = float("inf")
GOALS: dict[str, Steering] = {
    "goal ignored": Steering(False, INF, 0.0),
    "Eq. 13": Steering(True, INF, 0.0),
    "where examples lead": Steering(False, 0.05, 0.0),
    "Eq. 13 and where examples lead": Steering(True, 0.05, 0.0),
    "both, and drift of 0.1 m (the mode)": Steering(),
    "both, and drift of 0.3 m": Steering(True, 0.05, 0.3),
}


def part_of(setup: Setup, first: int, after: int) -> tuple[Distributions, Stitches]:
    """The examples between two frames, as they were recorded and noise taken out."""
    stream, codes, table = setup.model.stream.part(first, after), setup.model.model.graph.actions.label, setup.table
    inside = (table[:, 1] >= first) & (table[:, 2] <= after)
    clips = table[inside, 3] - table[inside, 3].min()
    moved = np.column_stack([table[inside, 0], table[inside, 1:3] - first, clips])
    return distributions(stream, moved, codes[inside]), stitches(stream, moved)


def automatic(setup: Setup, bouts: int, seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Bouts of the automatic mode and the baselines against the held-out third."""
    model = setup.model.model
    frames = round(seconds * model.fps)
    until = setup.model.learned_until
    assert until is not None
    held_out, jolts = part_of(setup, until, len(setup.model.stream))
    learned, _ = part_of(setup, 0, until)
    players = model.players
    drawing = (DrawingChooser(players[0]), DrawingChooser(players[1]))
    variants: dict[str, tuple[tuple[Chooser, Chooser], Alertness | None]] = {
        "automatic mode": (drawing, setup.alertness),
        "not alert": (drawing, None),
        "Eq. 6 and 12": ((ModelChooser(players[0]), ModelChooser(players[1])), None),
        "independent graphs": ((IndependentChooser.of(model, 0), IndependentChooser.of(model, 1)), None),
        "random walk": ((RandomChooser(players[0]), RandomChooser(players[1])), None),
    }
    result: dict[str, Any] = {
        "bouts": bouts,
        "seconds": seconds,
        "learned_part_js": js_distances(learned, held_out),
        "held_out_s": (len(setup.model.stream) - until) / model.fps,
        "held_out_facing_deg": facing_of(setup.model.stream.part(until, len(setup.model.stream))),
        "variants": {},
    }
    for name, (choosers, alertness) in variants.items():
        parts, one_by_one, fight_stitches, cpu = [], [], [], 0.0
        for seed in range(bouts):
            begun = time.process_time()
            bout = Bout(setup.examples, choosers, np.random.default_rng(seed))
            run(bout, frames, alertness)
            fight = bout.fight(frames, name, seed)
            cpu += time.process_time() - begun
            parts.append(distributions(fight.stream, fight.table, fight.codes))
            one_by_one.append(interaction_metrics(fight.stream, fight.table, fight.codes, held_out).as_dict())
            fight_stitches.append(stitches(fight.stream, fight.table, stitched(fight)))
            tell(f"{name}, bout {seed}")
        joined = Stitches(
            *(np.concatenate([getattr(s, key) for s in fight_stitches]) for key in ("linear", "angular", "hinge"))
        )
        result["variants"][name] = {
            "js": js_distances(pooled(parts), held_out),
            "fps": bouts * frames / cpu,
            "stitches": compare_stitches(joined, jolts),
            "spread": {key: spread(values) for key, values in flat(one_by_one).items()},
        }
    return result


def facing_of(stream: DuelStream) -> float:
    """Median facing error [deg]."""
    return float(np.degrees(np.median(np.abs(facing_error(stream)))))


def stitched(fight: Fight) -> NDArray[np.bool_]:
    """(S,) whether an action's beginning is a stitch: not the fight's, and not an example after its own predecessor."""
    actions = fight.actions
    return np.array(
        [
            k > 0 and one.player == actions[k - 1].player and one.example != actions[k - 1].example + 1
            for k, one in enumerate(actions)
        ]
    )


def passive(setup: Setup, bouts: int, seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Held-out attacks of either fighter against the passive mode and variants of it."""
    model, frames = setup.model.model, round(seconds * setup.model.model.fps)
    result: dict[str, Any] = {}
    for name in PASSIVE:
        counts = []
        for seed in range(bouts):
            attacker = seed % 2
            recorded = held_out_actions(setup.model, attacker)
            # other bouts begin elsewhere in the recording
            first = (seed // 2) * len(recorded) // max(-(-bouts // 2), 1)
            own = model.players[1 - attacker]
            reacting: Chooser = DrawingChooser(own)
            if name.startswith("Eq. 6"):
                reacting = ModelChooser(own)
            elif name.startswith("only reacting"):
                reacting = ReactingChooser(own)
            pair: list[Chooser] = [reacting, reacting]
            pair[attacker] = RecordedChooser(np.roll(recorded, -first).tolist())
            bout = Bout(setup.examples, (pair[0], pair[1]), np.random.default_rng(seed))
            run(bout, frames, replace(setup.alertness, players=(1 - attacker,)) if "alert" in name else None)
            counts.append(answered(setup, bout.fight(frames, "passive", seed), attacker))
            tell(f"passive, {name}, bout {seed}")
        rows = np.array(counts)
        total = rows.sum(axis=0)
        result[name] = {
            "attacks": int(total[0]),
            "answered_share": float(total[1] / total[0]),
            "answered_by_bout": spread((rows[:, 1] / rows[:, 0]).tolist()),
            "any_react_share": float(total[2] / total[0]),
            "within_half_a_second_share": float(total[3] / total[0]),
            "not_judged": int(total[4]),
        }
    return result


def interactive(setup: Setup, bouts: int, seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Requests for kinds of attack, for places within reach, for both; at random times of bouts."""
    wishes = [("actions", "both, and drift of 0.1 m (the mode)", True, False)]
    wishes += [("goals within reach", name, False, True) for name in GOALS]
    wishes += [("both at once", name, True, True) for name in ("Eq. 13", "both, and drift of 0.1 m (the mode)")]
    result: dict[str, Any] = {}
    for what, name, acting, placing in wishes:
        rows, slips, asked = [], [], 0
        for seed in range(bouts):
            found, slip, number = one_interactive(setup, seed, GOALS[name], acting, placing, seconds)
            rows += found
            slips.append(slip)
            asked += number
            tell(f"interactive, {what}, {name}, bout {seed}")
        table = np.array(rows, dtype=np.float64).reshape(-1, 4)
        reach = reach_of(setup)
        inside = np.isfinite(table[:, 2]) & (table[:, 3] <= reach)
        entry: dict[str, Any] = {"asked": asked, "answered": len(rows), "slip_p95_mm": spread(slips)}
        if acting:
            judged = np.isfinite(table[:, 1])
            entry |= {
                "next_action_share": float(np.mean(table[:, 0] == 1)),
                "within_one_action_share": float(np.mean((table[:, 0] >= 1) & (table[:, 0] <= 2))),
                "right_by_truth_share": float(table[judged, 1].mean()),
                "judged": int(judged.sum()),
            }
        if placing:
            entry |= {
                "reach_m": reach,
                "within_reach": int(inside.sum()),
                "way_to_goal_m": percentiles(table[inside, 3]),
                "goal_error_m": percentiles(table[inside, 2]),
            }
        result[f"{what}: {name}"] = entry
    return result


def one_interactive(
    setup: Setup, seed: int, steering: Steering, acting: bool, placing: bool, seconds: float
) -> tuple[list[tuple[float, float, float, float]], float, int]:
    """(choices until answered, right by the truth, goal error, way to the goal) of all answered requests; 95th percentile of
    the slip of a stance [mm]; number of requests.

    A goal is where an example drawn at random would lead from where the avatar is when it is asked.
    """
    model, rng = setup.model.model, np.random.default_rng([seed, 1])
    frames, delay = round(seconds * model.fps), round(model.goal_delay * model.fps)
    avatar = Avatar(setup.model, 0, steering)
    bout = Bout(setup.examples, (avatar, DrawingChooser(model.players[1])), np.random.default_rng(seed))
    kinds, reached = ATTACKS_ASKED_FOR, ways(setup)
    clock = {"next": 1.0, "asked": 0}

    def ask(bout: Bout) -> None:
        while bout.time >= clock["next"]:
            pose = bout.pose(0, int(clock["next"] * model.fps))
            way = turned(reached[rng.integers(len(reached))], float(yaw(pose[3:7])))
            goal = (float(pose[0] + way[0]), float(pose[1] + way[1])) if placing else None
            avatar.request(kinds[rng.integers(len(kinds))] if acting else "", goal, clock["next"])
            clock["asked"] += 1
            clock["next"] += rng.uniform(1.8, 3.2)

    run(bout, frames, setup.alertness, before=ask)
    fight = bout.fight(frames, "interactive", seed)
    root = fight.stream.players[0].qpos[:, :2]
    rows = []
    for answer in avatar.answers:
        begin = round(answer.begins * model.fps)
        if answer.choices == 0 or begin + delay >= frames:
            continue
        goal, right = answer.request.goal, np.nan
        if answer.request.action and setup.match[answer.example] >= 0:
            label = Label.from_code(int(setup.truth.codes[setup.match[answer.example]]))
            right = any(
                getattr(label, aspect) in ATTACKING_QUALIFIERS[aspect] for aspect in REQUESTS[answer.request.action]
            )
        error, way_to = (np.nan, np.nan) if goal is None else (
            float(np.linalg.norm(root[begin + delay] - goal)), float(np.linalg.norm(root[begin] - goal))
        )  # fmt: skip
        rows.append((float(answer.choices), float(right), error, way_to))
    slip = interaction_metrics(fight.stream, fight.table, fight.codes).feet.p95_mm
    return rows, slip, int(clock["asked"])


def percentiles(values: FloatArray) -> dict[str, float]:
    """Some percentiles."""
    return {str(share): float(np.percentile(values, share)) for share in (50, 75, 90, 99)} if len(values) else {}


def spread(values: Sequence[float]) -> dict[str, float]:
    """Mean, smallest, largest, and how many."""
    known = [one for one in values if one is not None and np.isfinite(one)]
    if not known:
        return {"n": 0}
    return {"mean": float(np.mean(known)), "min": float(min(known)), "max": float(max(known)), "n": len(known)}


def flat(dictionaries: list[dict[str, Any]], before: str = "") -> dict[str, list[float]]:
    """Numbers of nested dictionaries by joined keys; where some have None instead of a dictionary, of the others."""
    out: dict[str, list[float]] = {}
    for key in dictionaries[0]:
        values = [one[key] for one in dictionaries]
        inside = [one for one in values if isinstance(one, dict)]
        if inside:
            out |= flat(inside, f"{before}{key}.")
        elif not isinstance(values[0], list):
            out[f"{before}{key}"] = values
    return out


def report(study: dict[str, Any], command: str) -> str:
    """Markdown of the parts that were run."""
    parts = [f"# Fights against held-out examples\n\nSynthetic stream {study['stream']}; `{command}`."]
    parts[0] += " Learned from the first two thirds; mean and range over bouts."
    for part, write in (
        ("automatic", report_automatic),
        ("passive", report_passive),
        ("interactive", report_interactive),
    ):
        if part in study:
            parts.append(write(study[part]))
    return "\n\n".join(parts) + "\n"


def report_automatic(auto: dict[str, Any]) -> str:
    """Automatic mode and baselines."""
    names = list(auto["variants"])
    rows = [
        (f"JS distance of {kind}", f"{auto['learned_part_js'][kind]:.3f}", *(f"{auto['variants'][n]['js'][kind]:.3f}" for n in names))
        for kind in KINDS
    ]  # fmt: skip
    shown = {
        "facing error of the pelvis, median [deg]": "facing_error_deg.median",
        "facing error of the head, median [deg]": "head_facing_error_deg.median",
        "root distance, median [m]": "distance_m.median",
        "slip of a stance, mean [mm]": "feet.mm_per_stance", "slip, 95th percentile [mm]": "feet.p95_mm",
        "slip, worst [mm]": "feet.max_mm", "stances that skate (10 mm)": "feet.skating_share",
        "drift of a stance, worst [mm]": "feet.drift_max_mm",
        "attacks answered within 0.5 s": "reactions.answered_share", "the same by chance": "reactions.chance_share",
        "penetration, mean [mm]": "penetration.mean_mm",
    }  # fmt: skip
    own = auto["held_out_facing_deg"]
    for title, key in shown.items():
        first = f"{own:.1f} (held out)" if key.startswith("facing") else ""
        rows.append((title, first, *(cell(auto["variants"][n]["spread"][key]) for n in names)))
    for key in ("linear_median_ratio", "linear_p95_ratio", "hinge_median_ratio", "hinge_p95_ratio"):
        values = (f"{auto['variants'][n]['stitches'][key]:.2f}" for n in names)
        rows.append((f"stitches to examples: {key}", "", *values))
    rows.append(("frames per second of processor time", "", *(f"{auto['variants'][n]['fps']:.0f}" for n in names)))
    about = (
        f"## Automatic mode\n\n{auto['bouts']} bouts of {auto['seconds']:g} s each. JS distances: all bouts together, to the "
        f"held-out {auto['held_out_s']:.0f} s; the learned part's own distance is in its column."
    )
    return f"{about}\n\n{markdown_table(('', 'learned part', *names), rows)}"


def report_passive(found: dict[str, Any]) -> str:
    """Passive mode and variants."""
    rows = [
        (name, str(one["attacks"]), f"{one['answered_share']:.3f}", cell(one["answered_by_bout"]),
         f"{one['any_react_share']:.3f}", f"{one['within_half_a_second_share']:.3f}")
        for name, one in found.items()
    ]  # fmt: skip
    head = ("", "attacks", "answered", "by bout", "with any react", "within 0.5 s")
    about = "## Passive mode\n\nHeld-out attacks answered by actions that the truth counts as fitting."
    return f"{about}\n\n{markdown_table(head, rows)}"


def report_interactive(found: dict[str, Any]) -> str:
    """Interactive mode and ways of steering."""
    rows = [
        (name, str(one["answered"]), number(one.get("next_action_share")), number(one.get("within_one_action_share")),
         number(one.get("right_by_truth_share")), number(one.get("goal_error_m", {}).get("50")),
         number(one.get("goal_error_m", {}).get("90")), number(one.get("way_to_goal_m", {}).get("50")),
         cell(one["slip_p95_mm"]))
        for name, one in found.items()
    ]  # fmt: skip
    head = (
        "", "requests", "by the next action", "or the one after", "right by the truth", "goal error, median [m]",
        "90th percentile", "way to the goal, median [m]", "slip of a stance, 95th percentile [mm]",
    )  # fmt: skip
    return f"## Interactive mode\n\n{markdown_table(head, rows)}"


def cell(one: dict[str, float]) -> str:
    """Mean and range."""
    return "" if not one["n"] else f"{one['mean']:.3g} ({one['min']:.3g} to {one['max']:.3g})"


def number(value: float | None) -> str:
    """Three digits, or nothing."""
    return "" if value is None else f"{value:.3f}"


PARTS = {"automatic": automatic, "passive": passive, "interactive": interactive}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="kickboxing", choices=["kickboxing", "taekwondo"])
    parser.add_argument("--stream-seed", type=int, default=0)
    parser.add_argument("--bouts", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--parts", nargs="+", default=list(PARTS), choices=list(PARTS))
    parser.add_argument("-o", "--out", type=Path, default=Path("results/fights"))
    given = parser.parse_args()

    def tell(what: str) -> None:
        print(what, file=sys.stderr, flush=True)

    setup = set_up(given.preset, given.stream_seed)
    content = provenance(["scripts/fight_study.py", *sys.argv[1:]])
    study: dict[str, Any] = {"schema": "simprep.fight-study/1", **content, "stream": setup.model.stream.name}
    for part in given.parts:
        study[part] = PARTS[part](setup, given.bouts, given.seconds, tell)
    given.out.mkdir(parents=True, exist_ok=True)
    save_json(given.out / "study.json", study)
    with atomic_path(given.out / "study.md") as temporary:
        temporary.write_text(report(study, content["command"]), encoding="utf-8")
    print(given.out / "study.md")


if __name__ == "__main__":
    main()
