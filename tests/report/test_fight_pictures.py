"""Time lines and film strips of fights, and the drawing of the coupled graph: what is drawn is what happened."""

import csv
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from duel_cases import three_boxers

from simprep.duel.fight.falls import Fall
from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.fight.hits import judge
from simprep.duel.labels.labels import Label
from simprep.duel.model.structures import couple, link_actions
from simprep.duel.stream.store import read_stream
from simprep.duel.stream.stream import DuelStream
from simprep.errors import SettingError
from simprep.humanoid_model import humanoid
from simprep.metrics.interaction.evaluate import FightResults
from simprep.metrics.interaction.run import run_metrics
from simprep.metrics.interaction.stream import interaction_metrics
from simprep.motion.motion import Motion
from simprep.physics.simulate import simulate
from simprep.report.duel.label_text import COLOUR_OF, full_text, kind_of, short_text
from simprep.report.duel.structures import plot_structures
from simprep.report.fight.files import CONTACTS, save_fight
from simprep.report.fight.moments import strip_captions, strip_frames
from simprep.report.fight.page import fight_page, fight_replay
from simprep.report.fight.pictures import draw_fight
from simprep.report.fight.timeline import INTENDED, UNINTENDED, fight_timeline
from simprep.report.page import save_page

NEUTRAL = Label(move="L-L").code
KICK = Label(move="L-L", right_kick="up").code
JAB = Label(move="L-L", left_punch="fwdbwd").code


def make_fight(a, b, frames=600, fps=60.0):
    """A fight of standing people whose actions are (first frame, label) ..."""
    qpos = np.tile(humanoid().standing_qpos.copy(), (frames, 1))
    away = qpos + np.array([1.2] + [0.0] * (qpos.shape[-1] - 1))
    stream = DuelStream(tuple(Motion(poses, fps, np.ones((frames, 2), bool)) for poses in (qpos, away)))
    actions = []
    for player, own in enumerate((a, b)):
        ends = [start for start, _ in own[1:]] + [frames]
        actions += [FightAction(player, start, end, code, moment=start) for (start, code), end in zip(own, ends)]
    return Fight(stream, tuple(actions))


def pixels(path, colour):
    """How many pixels have a colour."""
    from PIL import Image

    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    with Image.open(path) as picture:
        return int((np.abs(np.asarray(picture.convert("RGB")).astype(int) - wanted).max(axis=-1) <= 1).sum())


def test_kinds_and_texts():
    label = Label(move="L-R", left_punch="bwd", right_punch="fwd", react="kick")
    assert kind_of(label) == "right punch"
    assert short_text(label) == "LP bwd, RP fwd"
    assert full_text(label) == "LP bwd, RP fwd | kick | L-R"
    assert kind_of(Label(move="F-F", left_kick="down", right_punch="fwd")) == "right punch"
    assert kind_of(Label(move="L-F", jump="up")) == "jump"
    neutral = Label(move="L-L")
    assert (kind_of(neutral), short_text(neutral), full_text(neutral)) == ("neutral", "", "neutral | L-L")


def test_bars_are_as_long_as_actions(tmp_path):
    pytest.importorskip("matplotlib")
    none = fight_timeline(make_fight([(0, NEUTRAL)], [(0, NEUTRAL)]), tmp_path / "none.png", row_s=10)
    short = fight_timeline(
        make_fight([(0, NEUTRAL), (300, KICK), (360, NEUTRAL)], [(0, NEUTRAL)]), tmp_path / "s.png", row_s=10
    )
    long = fight_timeline(
        make_fight([(0, NEUTRAL), (200, KICK), (500, NEUTRAL)], [(0, NEUTRAL)]), tmp_path / "l.png", row_s=10
    )
    kicks = [pixels(path, COLOUR_OF["right kick"]) for path in (none, short, long)]  # the legend's patch is in all
    assert (kicks[2] - kicks[0]) / (kicks[1] - kicks[0]) == pytest.approx(
        5, rel=0.1
    )  # 300 and 60 frames, less text and edges


def test_contacts_and_falls_are_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    fight = make_fight([(0, NEUTRAL)], [(0, NEUTRAL)])

    def contact(time, impulse, intended):
        return SimpleNamespace(start_s=time, impulse_ns=impulse, intended=intended)

    small = fight_timeline(fight, tmp_path / "a.png", [contact(4, 1, True), contact(6, 1, False)])
    large = fight_timeline(fight, tmp_path / "b.png", [contact(4, 30, True), contact(6, 1, False)])
    # marks are drawn a little transparent over white
    blended = [
        "#" + "".join(f"{round(0.75 * int(c[k : k + 2], 16) + 0.25 * 255):02x}" for k in (1, 3, 5))
        for c in (INTENDED, UNINTENDED)
    ]
    assert pixels(large, blended[0]) > 5 * pixels(small, blended[0]) > 0
    assert pixels(large, blended[1]) == pixels(small, blended[1]) > 0
    fallen = fight_timeline(fight, tmp_path / "c.png", falls=[(5.0, 1)])
    plain = fight_timeline(fight, tmp_path / "d.png")
    assert pixels(fallen, "#000000") > pixels(plain, "#000000") + 200  # a line and two words
    with pytest.raises(SettingError, match=r"rows of 0.5 s; valid: 1 to 60"):
        fight_timeline(fight, tmp_path / "e.png", row_s=0.5)


def test_strips_show_attacks():
    fight = make_fight([(0, NEUTRAL), (100, KICK), (140, NEUTRAL)], [(0, NEUTRAL), (400, JAB), (420, NEUTRAL)])
    frames = strip_frames(fight, 3)
    assert frames == (139, 300, 410)  # where the leg, and the fist, is out; nothing happens in the middle third
    assert strip_captions(fight, frames) == (
        "A: RK up, B: neutral",
        "A: neutral, B: neutral",
        "A: neutral, B: LP fwdbwd",
    )
    assert strip_captions(fight, (0, 599))[0] == "A: neutral, B: neutral"
    assert strip_frames(fight, 5000) == tuple(range(600))
    with pytest.raises(SettingError, match="0 pictures"):
        strip_frames(fight, 0)


def test_structures_show_what_is_frequent(tmp_path):
    pytest.importorskip("matplotlib")
    # A kicks every fourth time, B only stands; 40 actions each
    player, start = np.repeat([0, 1], 40), np.tile(np.arange(40) * 10, 2)
    label = np.where((player == 0) & (start % 40 == 0), KICK, NEUTRAL)
    graph = couple(link_actions(player, start, start + 10, label, np.zeros(80, dtype=int)))
    with_edges = plot_structures(graph, tmp_path / "a.png")
    without = plot_structures(graph, tmp_path / "b.png", crosses=0)
    one = plot_structures(graph, tmp_path / "c.png", nodes=1)
    assert pixels(with_edges, COLOUR_OF["right kick"]) > pixels(one, COLOUR_OF["right kick"]) > 0  # legend only
    from PIL import Image

    with Image.open(with_edges) as a, Image.open(without) as b:
        assert np.any(np.asarray(a) != np.asarray(b), axis=-1).sum() > 500


@pytest.fixture(scope="module")
def fight_of_three():
    """Three who box for two thirds of a second, simulated."""
    stream = three_boxers()
    actions = [FightAction(player, 0, 5 + player, NEUTRAL) for player in range(3)]
    actions += [FightAction(player, 5 + player, len(stream), JAB) for player in range(3)]
    fight = Fight(stream, tuple(actions))
    run = simulate(stream.players, "pd")
    kinematic = interaction_metrics(stream, fight.table, fight.codes)
    contacts = judge(run.contacts, fight)
    falls = (Fall(2, 0.6, "made up"),)
    return FightResults(
        fight, kinematic, tracked=fight, run=run, contacts=contacts, simulated=run_metrics(run, fight), falls=falls
    )


def test_files_of_three_say_who(fight_of_three, tmp_path):
    files = save_fight(fight_of_three, tmp_path)
    assert [path.name for path in files] == [
        "fight.npz", "actions.csv", "tracked.npz", "run.npz", "contacts.csv", "simulated.npz"
    ]  # fmt: skip
    assert all(len(read_stream(tmp_path / name).players) == 3 for name in ("fight.npz", "tracked.npz", "simulated.npz"))
    with (tmp_path / "actions.csv").open() as file:
        assert [row["player"] for row in csv.DictReader(file)] == list("AABBCC")
    with (tmp_path / "contacts.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row, contact in zip(rows, fight_of_three.contacts, strict=True):
        assert (row["fighter_a"], row["fighter_b"]) == tuple("ABC"[body] for body in contact.bodies)
        assert row["attacker"] == ("" if contact.attacker < 0 else "ABC"[contact.attacker])
    assert {row["fighter_b"] for row in rows} == {"B", "C"}
    # of two the columns are those that they always were
    two = replace(fight_of_three.fight.stream, players=fight_of_three.fight.stream.players[:2])
    fight = Fight(two, tuple(one for one in fight_of_three.fight.actions if one.player < 2))
    save_fight(replace(fight_of_three, fight=fight, contacts=(), simulated=None), tmp_path / "two")
    assert tuple((tmp_path / "two" / "contacts.csv").read_text().strip().split(",")) == CONTACTS


def test_the_page_of_three_shows_and_names_all(fight_of_three, tmp_path):
    pytest.importorskip("matplotlib")
    said = []
    files = draw_fight(fight_of_three, tmp_path, 3, said.append)
    assert tmp_path / "timeline.png" in files
    page = fight_page(fight_of_three, files, {})
    assert "Blue is A, red is B, green is C, pale grey what" in page.legend
    actors = page.replays[0].actors
    assert [one.label for one in actors] == ["A", "B", "C"]
    assert len({one.colour for one in actors}) == 3
    html = save_page(page, tmp_path / "page.html").read_text(encoding="utf-8")
    assert "green is C" in html
    assert strip_captions(fight_of_three.fight, (0, 39))[1] == "A: LP fwdbwd, B: LP fwdbwd, C: LP fwdbwd"
    kinematic = fight_replay(replace(fight_of_three, run=None))
    assert [(one.label, one.reference) for one in kinematic.actors] == [("A", None), ("B", None), ("C", None)]
    # a bar more for each fighter
    alone = [replace(one, label=NEUTRAL) if one.player == 2 else one for one in fight_of_three.fight.actions]
    fewer = fight_timeline(replace(fight_of_three.fight, actions=tuple(alone)), tmp_path / "fewer.png")
    assert pixels(tmp_path / "timeline.png", COLOUR_OF["left punch"]) > 1.2 * pixels(fewer, COLOUR_OF["left punch"])
    if not said:  # all three are drawn, each in its colour
        from PIL import Image

        with Image.open(tmp_path / "strip.png") as picture:
            shown = np.asarray(picture.convert("RGB")).astype(int)
        others = [shown[..., [k for k in range(3) if k != channel]].max(axis=-1) for channel in range(3)]
        assert min(int((shown[..., channel] - others[channel] > 12).sum()) for channel in range(3)) > 1000
