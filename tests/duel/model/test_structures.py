"""Action list, graphs, cross edges and action table, against a bout small enough to check by eye."""

import time

import numpy as np
import pytest
from synthetic_bout import bout

from simprep.duel.labels.labels import Label
from simprep.duel.model.structures import couple, link_actions
from simprep.errors import MotionError, UnknownNameError

STAND = Label(move="L-L").code
PUNCH = Label(left_punch="fwd", move="L-L").code
BACK = Label(left_punch="bwd", move="L-L").code
KICK = Label(right_kick="downup", react="kick", move="L-L").code

# player, first frame, end, label, clip; frames   0....5....10...15...20 | 20...25...30
ROWS = [
    (0, 0, 8, STAND, 0),
    (0, 8, 15, PUNCH, 0),
    (0, 15, 20, BACK, 0),
    (0, 20, 30, STAND, 1),
    (1, 0, 8, STAND, 0),
    (1, 8, 20, KICK, 0),
    (1, 20, 24, PUNCH, 1),
    (1, 24, 30, BACK, 1),
]


def small():
    return couple(link_actions(*np.array(ROWS).T))


def test_links_follow_time_and_stop_at_the_seam():
    actions = small().actions
    assert actions.next.tolist() == [1, 2, -1, -1, 5, -1, 7, -1]
    # Ends of both at frame 8: each sees what the other was still doing. Nothing of the other clip is ever seen.
    assert actions.concurrent.tolist() == [4, 5, 5, 7, 0, 2, 3, 3]
    first, second = actions.transitions(0), actions.transitions(1)
    assert np.column_stack([first.current, first.opponent, first.next]).tolist() == [[0, 4, 1], [1, 5, 2]]
    assert np.column_stack([second.current, second.opponent, second.next]).tolist() == [[4, 0, 5], [6, 3, 7]]


def test_order_of_the_rows_does_not_matter():
    shuffled = np.random.default_rng(0).permutation(ROWS)
    for name in ("player", "start", "label", "next", "concurrent"):
        assert np.array_equal(getattr(link_actions(*shuffled.T), name), getattr(small().actions, name))


def test_graphs_group_equal_labels_and_count_edges():
    graph = small()
    first = graph.graphs[0]
    assert sorted(first.labels) == sorted({STAND, PUNCH, BACK})
    stand, punch, back = (int(np.flatnonzero(first.labels == code)[0]) for code in (STAND, PUNCH, BACK))
    assert first.members(stand).tolist() == [0, 3]
    assert first.counts.sum() == 2
    assert first.counts[stand, punch] == first.counts[punch, back] == 1
    other = graph.graphs[1]
    assert graph.cross_counts[0][other.node[5], back] == 1
    assert graph.cross_counts[0].sum() == 2


def test_action_table_finds_nodes_by_qualifier_and_by_request():
    graph = small()
    table = graph.table
    assert [graph.graphs[1].labels[node] for node in table.nodes[1, "right_kick", "downup"]] == [KICK]
    assert [graph.graphs[0].labels[node] for node in table.answering(0, "punch")] == [PUNCH]
    assert [graph.graphs[1].labels[node] for node in table.answering(1, "right kick")] == [KICK]
    assert len(table.answering(0, "kick")) == 0
    with pytest.raises(UnknownNameError, match="unknown requested action 'elbow'; valid: punch, kick, left punch"):
        table.answering(0, "elbow")


def test_links_of_a_long_bout_agree_with_plain_search_and_are_quick():
    made = bout(np.random.default_rng(3), 4, clips=3)
    a = made.actions
    for i in range(0, len(a), 7):
        same = (a.player == a.player[i]) & (a.clip == a.clip[i]) & (a.start == a.end[i])
        assert a.next[i] == (np.flatnonzero(same)[0] if same.any() else -1)
        other = (a.player != a.player[i]) & (a.start < a.end[i]) & (a.end >= a.end[i])
        assert a.concurrent[i] == (np.flatnonzero(other)[0] if other.any() else -1)
    begin = time.process_time()
    couple(link_actions(a.player, a.start, a.end, a.label, a.clip))
    assert time.process_time() - begin < 0.5


@pytest.mark.parametrize(
    ("row", "change", "message"),
    [
        (1, (0, 7, 15, PUNCH, 0), "player 0 that begins at frame 0: it overlaps"),
        (1, (0, 8, 8, PUNCH, 0), "player 0 that begins at frame 8: it must end after it begins"),
        (1, (2, 8, 15, PUNCH, 0), "player 2 that begins at frame 8: unknown player"),
        (1, (0, 8, 15, -1, 0), "label codes must lie in 0"),
        (0, (0, 0, 8, STAND, 1), "clip numbers fall after it"),
    ],
)
def test_bad_segments_are_named(row, change, message):
    rows = list(ROWS)
    rows[row] = change
    with pytest.raises(MotionError, match=message):
        link_actions(*np.array(rows).T)


def test_one_player_is_no_duel():
    with pytest.raises(MotionError, match="none of player 1; valid: actions of both players"):
        link_actions(*np.array(ROWS[:4]).T)
    with pytest.raises(MotionError, match="equal lengths"):
        link_actions([0, 1], [0], [5, 5], [STAND, STAND], [0, 0])
