"""The study in words. Every sentence with a number is made from the data, and can say yes, no and the contrary."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from posture_optimization.compared import LABELS, MIN_CLUSTERS, SATURATED, STABILITY, Comparison
from simprep.metrics.effects import HARMS, HELPS, MEAN, NO_EFFECT, UNDECIDED
from simprep.study.plan import ARM_LABELS, BEFORE_PHYSICS

QUESTION = "Does posture optimisation make the motion more stable?"
FEW_PAIRS = 10


def answer(comparisons: Sequence[Comparison]) -> str:
    """The answer to the question, for simulated motions, in a few sentences.

    Args:
        comparisons: over all cases of a controller and a disturbance (`compared`).
    """
    stability = {outcome.name for outcome in STABILITY}
    simulated = [one for one in comparisons if one.outcome.name in stability and one.controller != BEFORE_PHYSICS]
    asked = [one for one in simulated if one.says != SATURATED and one.effect.n]
    if not asked:
        return "Nothing was simulated that could tell the arms apart, so there is no answer."
    says = Counter(one.says for one in asked)
    of = f"of {len(asked)} comparisons ({_controllers(asked)}, each under each disturbance, in {len(stability)} metrics of stability)"
    helps, harms, equal, open_ = (says[name] for name in (HELPS, HARMS, NO_EFFECT, UNDECIDED))
    if helps and not harms:
        first = f"Yes, in part: it helps in {helps} {of}, and is harmful in none."
        if helps == len(asked):
            first = f"Yes: it helps in all {of.removeprefix('of ')}."
    elif harms and not helps:
        first = f"No, it is harmful: the motion gets less stable in {harms} {of}, and more stable in none."
    elif helps and harms:
        first = f"Sometimes, and it is harmful elsewhere: it helps in {helps} {of}, and is harmful in {harms}."
    elif equal == len(asked):
        first = f"No effect: in all {of.removeprefix('of ')} the whole interval is smaller than what matters."
    else:
        first = f"No effect can be shown: it helps in none {of}, and is harmful in none."
    saturated = sum(one.says == SATURATED for one in simulated)
    rest = [
        f"In {equal} there is no effect as large as what matters." if equal and equal < len(asked) else "",
        f"{open_} are undecided: their intervals hold both 0 and effects that matter, or the test does not bear them out."
        if open_
        else "",
        f"In {saturated} more, success cannot tell: all runs of both arms succeed, or none." if saturated else "",
        *(sentence(one) for one in asked if one.says in (HELPS, HARMS)),
    ]
    return " ".join(part for part in (first, *rest) if part)


def sentence(one: Comparison) -> str:
    """One effect in words."""
    effect, name = one.effect, LABELS[one.outcome.name]
    where = f"`{one.controller}`, {one.disturbance.replace('_', ' ')}" + "".join(
        f", {_key(key)} {_value(value)}" for key, value in one.where.items()
    )
    if effect.estimate is None or effect.low is None or effect.worse is None or effect.p_holm is None:
        return f"{where}: {name}: {effect.n} pairs, too few to say anything."
    verb = {HELPS: "it helps", HARMS: "it is harmful", NO_EFFECT: "no effect", UNDECIDED: "undecided"}.get(
        one.says, one.says
    )
    return (
        f"{where}: {name} {_signed(one, effect.estimate)} ({_signed(one, effect.low)} to {_signed(one, effect.high)}), "
        f"p = {effect.p_holm:.2g}: {verb}; worse in {100 * effect.worse:.0f} % of {effect.n} pairs."
    )


def report_text(content: Mapping[str, Any], parts: Mapping[str, Sequence[Comparison]], figures: Sequence[str]) -> str:
    """The report, in Markdown.

    Args:
        content: `n_cases`, `n_simulated`, `ends`, `arms`, `by_target`, `command`, `seeds` ... of summary.json.
        parts: comparisons: `whole`, `strata`, and against other arms by their names.
        figures: files to show.
    """
    return "\n".join(_lines(content, parts, figures)) + "\n"


def _lines(
    content: Mapping[str, Any], parts: Mapping[str, Sequence[Comparison]], figures: Sequence[str]
) -> Iterator[str]:
    whole = parts["whole"]
    yield from (f"# {QUESTION}", "", answer(whole), "")
    clusters = max((one.effect.clusters for one in whole), default=0)
    if clusters < MIN_CLUSTERS:
        yield from (
            f"**These are {clusters} targets: too few for any conclusion; {MIN_CLUSTERS} at least are needed.**",
            "",
        )
    failed = ", ".join(
        f"{content['ends'].get(end, 0)} {end.replace('_', ' ')}" for end in ("fell", "diverged", "bad_input", "error")
    )
    yield from (
        f"{content['n_cases']} of {content['n_planned']} cases, {content['n_simulated']} of them simulated ({failed}); the others are motions before physics. "
        f"Command: `{content['command']}`.",
        "",
        "## What was simulated",
        "",
        "| controller | disturbance | arm | cases | success | median time survived [s] |",
        "| --- | --- | --- | --- | --- | --- |",
    )
    for row in content["arms"]:
        yield (
            f"| `{row['controller']}` | {row['disturbance'].replace('_', ' ')} | {ARM_LABELS[row['arm']]} | {row['n']} | "
            f"{row['n_success']} ({100 * row['n_success'] / row['n']:.0f} %) | {row['median_survived_s']:.2f} |"
        )
    yield from ("", "## Effect, with minus without posture optimisation", "")
    yield from (f"![effects]({name})" for name in figures)
    for controller in dict.fromkeys(one.controller for one in whole):
        title = "Motions before physics" if controller == BEFORE_PHYSICS else f"Simulated with `{controller}`"
        yield from ("", f"### {title}", "", *_table([one for one in whole if one.controller == controller]))
    yield from ("", "## Where it helps, and where it is harmful", "")
    told = [one for one in parts["strata"] if one.says in (HELPS, HARMS)]
    places = len(parts["strata"])
    if told:
        yield f"By level, stature and locomotion, {len(told)} of {places} comparisons say something:"
        yield ""
        yield from (f"- {sentence(one)}" for one in told)
    else:
        yield f"By level, stature and locomotion, none of {places} comparisons shows that it helps or is harmful."
    yield from ("", "## Target by target", "", *_targets(content["by_target"]))
    for against in [name for name in parts if name not in ("whole", "strata")]:
        yield from (
            "",
            f"## Against {ARM_LABELS[against]}",
            "",
            "The whole preparation with posture optimisation, minus that arm.",
            "",
        )
        yield from _table(
            [one for one in parts[against] if one.outcome.name in {o.name for o in STABILITY}], named=True
        )
    yield from ("", "## Method", "", *_method(content))


def _table(comparisons: Sequence[Comparison], named: bool = False) -> Iterator[str]:
    head = "| controller " if named else ""
    yield f"{head}| disturbance | metric | effect | 95 % interval | p (Holm) | effect size | worse | detectable | pairs | says |"
    yield "| --- " * (11 if named else 10) + "|"
    for one in comparisons:
        effect = one.effect
        if effect.estimate is None:
            continue
        interval = "-" if effect.low is None else f"{_signed(one, effect.low)} to {_signed(one, effect.high)}"
        p = "-" if effect.p_holm is None else f"{effect.p_holm:.2g}"
        seen = "-" if effect.detectable is None else _number(one, effect.detectable)
        few = " (few)" if effect.n < FEW_PAIRS else ""
        statistic = " (mean)" if one.outcome.statistic == MEAN else ""
        yield (
            (f"| `{one.controller}` " if named else "")
            + f"| {one.disturbance.replace('_', ' ')} | {LABELS[one.outcome.name]}{statistic} | {_signed(one, effect.estimate)} | "
            f"{interval} | {p} | {effect.rank_biserial:+.2f} | {100 * (effect.worse or 0):.0f} % | {seen} | {effect.n}{few} | {one.says} |"
        )


def _targets(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    controllers = list(dict.fromkeys(row["controller"] for row in rows))
    yield "Median effect on the margin of stability [mm], and share of pairs in which it got worse:"
    yield ""
    yield (
        "| target | "
        + " | ".join("before physics" if name == BEFORE_PHYSICS else f"`{name}`" for name in controllers)
        + " |"
    )
    yield "| --- " * (1 + len(controllers)) + "|"
    for target in dict.fromkeys(row["target"] for row in rows):
        cells = []
        for controller in controllers:
            (row,) = [row for row in rows if (row["controller"], row["target"]) == (controller, target)]
            cells.append("-" if row["estimate"] is None else f"{row['estimate']:+.1f}, {100 * row['worse']:.0f} %")
        yield f"| {target} | " + " | ".join(cells) + " |"


def _method(content: Mapping[str, Any]) -> Iterator[str]:
    yield (
        "Pairs agree in locomotion, target, level, stature, controller, disturbance and seed. Time survived and success are compared "
        "over all pairs, other metrics where both succeeded. Effects are medians, or means where the table says so. Intervals draw "
        "whole targets with replacement (2000 samples, seed 2013), since cases that share a target are not independent. The test is "
        "Wilcoxon's, of one number for each target, corrected after Holm over all tests of a controller in a section, those of stability apart. The effect size is the "
        "rank-biserial correlation. *Detectable* is the effect that four of five such studies would find."
    )
    yield ""
    yield (
        "*Helps* and *harmful*: interval and corrected test both exclude 0. *No effect*: the whole interval is smaller than what "
        "matters, which was set beforehand: "
        + ", ".join(f"{LABELS[name]} {value:g}" for name, value in content["smallest"].items())
        + ". "
        "*Saturated*: all runs of both arms succeed, or none. All else is *undecided*."
    )
    yield ""
    yield (
        f"Preset of `mpc`: {content['preset']}. Seeds of random controllers: {content['seeds']}. `none` has no level; its runs count "
        "once for every level. Pushes are 2 N/kg on the pelvis to the left for 0.2 s at the launch; low friction is 0.5 (believed: 1); "
        "weak motors have 0.7 of their torque limits. The controller knows of none of this."
    )


def _controllers(comparisons: Sequence[Comparison]) -> str:
    return ", ".join(f"`{name}`" for name in dict.fromkeys(one.controller for one in comparisons))


def _key(key: str) -> str:
    return {"alpha": "level", "height_m": "stature [m]", "locomotion": "after"}[key]


def _value(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _digits(one: Comparison) -> int:
    return 3 if one.outcome.smallest < 0.5 else 1


def _number(one: Comparison, value: float) -> str:
    return f"{value:.{_digits(one)}f}"


def _signed(one: Comparison, value: float | None) -> str:
    return "-" if value is None else f"{value:+.{_digits(one)}f}"
