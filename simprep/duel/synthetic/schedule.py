"""Who does what when: an asynchronous clip, drawn action by action. Whoever's action ends first chooses the next.

Labels come from the generating model alone; steps follow from the distance. A waiting fighter's action ends a reaction
time after the opponent's attack began, so that the answer comes in time, but not before the attack can be seen.
"""

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.labels.labels import LEARNED_ASPECTS, Label
from simprep.duel.synthetic.generating_model import GeneratingModel
from simprep.duel.synthetic.kinds import KIND_OF, SIDES, attacks, context_of
from simprep.duel.synthetic.pieces import KICK_SHARES, KICKS, PUNCH_SHARES, PUNCHES, striking_distance
from simprep.duel.synthetic.planned import FPS, OFFSETS, TOES_OUT, Fighter, Planned, Step, turned
from simprep.duel.synthetic.presets import SyntheticSettings, duration_range
from simprep.motion.curves import minimum_jerk

GRID = 2
SHORTEST_S, LONGEST_S = 0.34, 1.25
"""To which a waiting action may be shortened and stretched when the opponent attacks [s]."""
SKIP_M = 0.12
"""A kick that would miss by more begins with a step of the standing foot [m]."""
STANCE_M = np.array([[0.24, 0.16], [0.56, 0.34]])
STRIDE_M = np.array([[-0.10, 0.14], [0.66, 0.40]])
"""Shortest and longest distance of the feet, along and across, where a step leads; the same between two steps [m]."""
PUNCH_LEAN_M, KICK_LEAN_M = -0.18, 0.10
"""How much nearer the roots are than the middles of the stances at a punch, than the standing foot at a kick [m]."""
NEAREST_M = 0.62, 0.85
"""Nobody steps nearer than this in an attack, and otherwise, middle of the stance to middle of the stance [m]."""
MISS_M = 0.08
"""Punches that would fall short by more than this are seldom chosen where a longer one would land [m]."""
FORWARD_M, BACKWARD_M, ONE_FOOT_M = 0.50, 0.40, 0.28
"""Longest step with both feet, and shift of the stance where one foot alone moves [m]."""


def draw_clip(
    settings: SyntheticSettings, generators: tuple[GeneratingModel, GeneratingModel], rng: np.random.Generator
) -> tuple[Fighter, Fighter]:
    """Draw one clip: both fighters with all their actions, which end together."""
    length = GRID * round(settings.clip_s * FPS / GRID)
    half = 0.5 * settings.distance_m * rng.uniform(0.95, 1.1)
    leads = ("left", "right" if rng.random() < 0.3 else "left")
    fighters = (Fighter(0, leads[0], np.array([-half, 0.0]), 0.0), Fighter(1, leads[1], np.array([half, 0.0]), np.pi))
    for fighter in fighters:
        _begin(settings, fighters, fighter, "neutral", "LR"[int(rng.random() < 0.5)], None, 0, length, rng)
    while True:
        ends = [fighter.now.end for fighter in fighters]
        who = int(np.argmin(ends))
        frame = ends[who]
        if frame >= length:
            return fighters
        own, other = fighters[who], fighters[1 - who]
        seen = other.at(frame - 1)
        code = _draw(generators[who], own.now.code, other.done[seen].code, rng)
        kind, last = code
        _begin(settings, fighters, own, kind, last, seen, frame, length, rng)
        if attacks(kind):
            _delay(settings, own, other, frame, length, rng)


def _draw(generator: GeneratingModel, own: int, opponent: int, rng: np.random.Generator) -> tuple[str, str]:
    """Kind and last foot of the next action."""
    chances = generator.distribution(own, opponent)
    label = Label.from_code(int(rng.choice(generator.candidates, p=chances / chances.sum())))
    return KIND_OF[label.indices[: len(LEARNED_ASPECTS)]], label.move[-1]


def _begin(
    settings: SyntheticSettings,
    fighters: tuple[Fighter, Fighter],
    own: Fighter,
    kind: str,
    last: str,
    seen: int | None,
    frame: int,
    length: int,
    rng: np.random.Generator,
) -> None:
    other = fighters[1 - own.player]
    first = own.now.last if own.done else last
    context = "neutral" if seen is None else context_of(other.done[seen].kind)
    react = context if context in ("kick", "punch") else "others"
    low, high = duration_range(kind)
    seconds = float(rng.triangular(low, 0.5 * (low + high), high))
    variant = _variant(settings, own, other, kind, first != last, frame + round(seconds * FPS), rng)
    kicks = kind.endswith("_up") and "jump" not in kind
    skips = (
        kicks
        and _support(kind) == first
        and abs(_kick_gap(own, other, kind, variant, frame + round(seconds * FPS))) > SKIP_M
    )
    if kicks and (skips or _support(kind) != first):
        seconds += 0.22 if skips else 0.14  # the standing foot steps first
    end = frame + GRID * round(seconds * FPS / GRID)
    # nobody is cut off in the middle: what would end shortly before the clip does, or after it, ends with it
    if end > length - round(0.36 * FPS):
        end = length
    action = Planned(
        own.player, frame, end, kind, first, last, react,
        -1 if seen is None or react == "others" else seen, _role(kind, react, other, frame, rng),
        strength=float(rng.uniform(0.26, 0.46)), skips=skips, variant=variant,
    )  # fmt: skip
    if kind.endswith("jump_up"):
        action.flight = float(rng.uniform(0.26, 0.36))
    if kind.endswith("jump_down") and own.now.end == frame:
        action.strength = float(rng.uniform(0.2, 0.35))
    own.done.append(action)
    own.adapted = False
    _place(settings, own, other, action, rng)


def _aim(other: Fighter, frame: int) -> FloatArray:
    """Where the middle of the opponent's feet is expected in a frame."""
    if not other.done:
        return other.centre
    now = other.now
    share = minimum_jerk(np.array((frame - now.start) / (now.end - now.start)))
    return np.asarray(other.before + share * (other.centre - other.before))


def _variant(
    settings: SyntheticSettings,
    own: Fighter,
    other: Fighter,
    kind: str,
    both: bool,
    frame: int,
    rng: np.random.Generator,
) -> str:
    """Which punch or kick an attack is made from: one that reaches the opponent, by a step where need be."""
    side = kind.partition("_")[0]
    names: tuple[str, ...]
    if context_of(kind) not in ("kick", "punch") or kind.endswith("_downup"):
        return own.now.variant if own.done else ""
    if context_of(kind) == "kick":
        shares = np.array(KICK_SHARES[settings.name])
        names = KICKS[side]
        if "jump" in kind:
            shares[-1] = 0.0  # no low kick out of a jump
    else:
        hand = kind.rpartition("_")[2] if "_to_" in kind else side
        where = "lead" if hand == own.lead else "rear"
        names, shares = PUNCHES[hand, where], np.array(PUNCH_SHARES[where])
        distance = float(np.hypot(*(_aim(other, frame) - own.centre)))
        step = distance - PUNCH_LEAN_M - np.array([striking_distance(name) for name in names])
        farthest = FORWARD_M if both else ONE_FOOT_M
        short = np.maximum(step - farthest, 0) + np.maximum(-step - BACKWARD_M, 0)
        shares = shares * np.exp(-0.5 * ((short - short.min()) / MISS_M) ** 2)
    return str(rng.choice(names, p=shares / shares.sum()))


def _kick_gap(own: Fighter, other: Fighter, kind: str, variant: str, frame: int) -> float:
    """How far the stance must move so that a kick reaches [m]."""
    support = 1 if kind.startswith("left") else 0
    distance = float(np.hypot(*(_aim(other, frame) - own.centre)))
    return distance - striking_distance(variant) - KICK_LEAN_M - float(OFFSETS[own.lead][support, 0])


def _support(kind: str) -> str:
    return {"left": "R", "right": "L"}.get(kind.partition("_")[0], "")


def _role(kind: str, react: str, other: Fighter, frame: int, rng: np.random.Generator) -> str:
    """What a neutral action is for; labels do not tell."""
    if kind != "neutral":
        return kind
    if react == "others":
        return str(rng.choice(["guard", "step", "feint", "knee_feint"], p=[0.25, 0.6, 0.1, 0.05]))
    late = other.done and (other.now.end - frame) / FPS < 0.12
    if late and rng.random() < 0.5:
        return "hit"
    if react == "kick":
        return str(rng.choice(["block", "dodge", "retreat"], p=[0.45, 0.1, 0.45]))
    return str(rng.choice(["block", "dodge", "retreat"], p=[0.35, 0.4, 0.25]))


def _place(
    settings: SyntheticSettings, own: Fighter, other: Fighter, action: Planned, rng: np.random.Generator
) -> None:
    """Steps of the feet and where to face."""
    struck = (action.start + action.end) // 2 if action.kind.endswith("fwdbwd") else action.end
    aim = _aim(other, struck)
    gap = aim - own.centre
    distance = float(np.hypot(*gap))
    ahead = gap / max(distance, 1e-6)
    across = np.array([-ahead[1], ahead[0]])
    kind, context = action.kind, context_of(action.kind)
    wanted = settings.distance_m + rng.normal(0, 0.08)
    if kind == "neutral" and action.role in ("retreat", "hit"):
        wanted = distance + rng.uniform(0.12, 0.35)
    elif kind == "neutral" and action.role in ("block", "dodge", "feint", "knee_feint"):
        wanted = distance + rng.normal(0.02, 0.05)
    elif kind in ("jump_up", "jump_down"):
        wanted = distance + 0.15 if action.react != "others" else wanted
    elif context == "punch":
        wanted = striking_distance(action.variant) + PUNCH_LEAN_M + rng.normal(0, 0.04)
    elif context == "kick":
        wanted = distance - _kick_gap(own, other, kind, action.variant, struck) + rng.normal(0, 0.05)
    elif context == "recovering":
        wanted = max(distance, 0.5 * (distance + settings.distance_m)) + rng.normal(0, 0.05)
    free = _free_feet(action)
    both = len(free) == 2
    radial = float(np.clip(distance - wanted, -BACKWARD_M, FORWARD_M))
    if not both:
        radial = float(np.clip(radial, -ONE_FOOT_M, ONE_FOOT_M))
    # wherever the opponent steps meanwhile
    nearest = NEAREST_M[0 if attacks(kind) else 1]
    radial = min(radial, float(np.hypot(*(other.centre - own.centre))) - nearest)
    sideways = rng.normal(0, 0.10 if kind == "neutral" else 0.04) * (1.0 if both else 0.5)
    own.before = own.centre
    centre = own.centre + radial * ahead + sideways * across
    facing = aim - centre
    heading = float(np.arctan2(facing[1], facing[0]) + rng.normal(0, np.radians(4)))
    heading = own.heading + (heading - own.heading + np.pi) % (2 * np.pi) - np.pi
    action.heading = own.heading = heading
    places = centre + turned(OFFSETS[own.lead], heading) + rng.normal(0, 0.015, (2, 2))
    toes = heading + np.array([1.0, -1.0]) * TOES_OUT[own.lead]
    for number, (foot, lift, land) in enumerate(_times(action, rng)):
        place = places[foot]
        if action.skips and number == 0:
            place = own.feet[foot]  # put down where it was; it moves with the kick
        elif not kind.startswith("jump") and "_jump_" not in kind:
            limits = STANCE_M if number or not both else STRIDE_M
            place = _reachable(place, own.feet[1 - foot], foot, own.lead, heading, limits)
        own.feet[foot] = place
        action.steps.append(Step(foot, lift, land, own.feet[foot].copy(), float(toes[foot])))


def _reachable(
    place: FloatArray, other: FloatArray, foot: int, lead: str, heading: float, limits: FloatArray
) -> FloatArray:
    """A foothold near a wanted one with a stance neither too long nor crossed, within limits (2, 2) [m]."""
    sign = np.array([1.0 if SIDES[foot] == lead else -1.0, 1.0 if foot == 0 else -1.0])
    apart = turned(place - other, -heading) * sign
    return np.asarray(other + turned(np.clip(apart, *limits) * sign, heading))


def _free_feet(action: Planned) -> set[int]:
    return {foot for foot, _, _ in _times(action, None)}


def _times(action: Planned, rng: np.random.Generator | None) -> list[tuple[int, float, float]]:
    """(foot, share at lift, share at touch-down) of the steps that make the first and last foot what they should be.

    While both feet stand, the nearer single stance counts: the first step of an action lifts the foot that it does not
    begin on, its last step the one it does not end on.
    """
    kind, first, last = action.kind, action.first, action.last

    def jitter(spread: float) -> float:
        return 0.0 if rng is None else float(rng.uniform(-spread, spread))

    foot = {"L": 0, "R": 1}
    if kind.endswith("jump_up"):
        # the leg that kicks (or the one it does not begin on) leaves first; both land in the next action
        lead = 1 - foot[first]
        return [(lead, 0.50, 2.0), (1 - lead, 0.0, 2.0)]
    if kind.endswith("jump_down"):
        landing = foot[last]
        return [(landing, -1.0, 0.0), (1 - landing, -1.0, 0.52 + jitter(0.04))]
    if kind.endswith("_up"):
        kicking = SIDES.index(kind.partition("_")[0])
        if foot[first] == kicking:
            return [(1 - kicking, 0.06, 0.30 + jitter(0.02)), (kicking, 0.40 + jitter(0.02), 2.0)]
        if action.skips:
            return [(kicking, 0.04, 0.17), (1 - kicking, 0.21, 0.38), (kicking, 0.46 + jitter(0.02), 2.0)]
        return [(kicking, 0.22 + jitter(0.05), 2.0)]
    if kind.endswith("downup"):
        return []
    if kind.endswith("_down"):
        kicking = SIDES.index(kind.partition("_")[0])
        if first == last:
            return [(kicking, -1.0, 0.62 + jitter(0.04))]
        return [(kicking, -1.0, 0.52), (1 - kicking, 0.62, 0.92)]
    if first != last:
        # a punch is carried by the step
        spans = ((0.04, 0.32), (0.44, 0.74)) if _strikes(kind) else ((0.08, 0.40), (0.56, 0.90))
        (lift, land), (next_lift, next_land) = spans
        return [
            (1 - foot[first], lift + jitter(0.03), land + jitter(0.04)),
            (1 - foot[last], next_lift + jitter(0.04), next_land),
        ]
    if action.role in ("guard", "block", "dodge", "feint") or kind.endswith("bwdfwd"):
        return []
    lift, land = (0.12, 0.50) if _strikes(kind) else (0.26, 0.68)
    return [(1 - foot[first], lift + jitter(0.08), land + jitter(0.08))]


def _strikes(kind: str) -> bool:
    return context_of(kind) == "punch"


def _delay(
    settings: SyntheticSettings, own: Fighter, other: Fighter, frame: int, length: int, rng: np.random.Generator
) -> None:
    """Let a waiting opponent answer the attack that begins now, a reaction time from now."""
    waiting = other.now
    if waiting.kind != "neutral" or other.adapted or not frame < waiting.end < length:
        return
    mean, spread = settings.reaction_s[1 if context_of(own.now.kind) == "kick" else 0]
    answer = frame + GRID * round(max(0.12, rng.normal(mean, spread)) * FPS / GRID)
    if answer >= own.now.end or answer > length - round(0.4 * FPS):
        return
    if SHORTEST_S <= (answer - waiting.start) / FPS <= LONGEST_S:
        waiting.end = answer
        other.adapted = True
