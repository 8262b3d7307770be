import json
from dataclasses import replace

import numpy as np
import pytest

from simprep.controller.cores import core_motions
from simprep.controller.graph import GraphSettings, build_graph, pair_distances
from simprep.controller.graph_store import GraphFileError, check_motions, read_graph, save_graph
from simprep.controller.settings import ControllerSettings
from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.library import library_motion
from simprep.motion.edit import move, repeat

TARGETS = ("punch_right", "kick_front", "crawl", "duck", "jump")


@pytest.fixture(scope="module")
def motions():
    return {motion.name: motion for motion in (*core_motions(ControllerSettings()), *map(library_motion, TARGETS))}


@pytest.fixture(scope="module")
def graph(motions):
    return build_graph(core_motions(ControllerSettings()), map(library_motion, TARGETS))


def test_a_piece_of_the_walk_placed_elsewhere_is_found_frame_by_frame():
    walk = library_motion("walk")
    piece = move(replace(repeat(walk, 3), loop=False, name="piece"), (3.0, -7.0), 2.1)
    piece = replace(piece, events={"target": 100})
    distance = pair_distances(walk, piece)
    inner = np.arange(1, len(piece) - 1)  # at the ends a clip has no central velocity
    np.testing.assert_allclose(distance[inner % len(walk), inner], 0.0, atol=1e-5)
    found = build_graph([walk], [piece], GraphSettings(threshold=1e-4)).between("walk", "piece", "entry")
    assert found
    assert {(t.target_frame - t.source_frame) % len(walk) for t in found} == {0}


def test_transitions_keep_the_supporting_feet_and_are_local_minima_under_the_threshold(graph, motions):
    apart = round(graph.settings.apart * graph.settings.fps)
    pairs = {(t.source, t.target) for t in graph.transitions}
    distances = {pair: pair_distances(*(motions[name] for name in pair)) for pair in pairs}
    for t in graph.transitions:
        source, target = motions[t.source], motions[t.target]
        assert (source.contacts[t.source_frame] == target.contacts[t.target_frame]).all()
        distance = distances[t.source, t.target]
        assert t.distance == pytest.approx(distance[t.source_frame, t.target_frame])
        if t.kind == "prepared":
            assert t.target_frame == graph.node(t.target).reference_frame
            continue
        assert t.distance <= graph.settings.threshold
        node = graph.node(t.target if t.kind == "entry" else t.source)
        rows = np.arange(t.source_frame - apart, t.source_frame + apart + 1)
        columns = np.arange(t.target_frame - apart, t.target_frame + apart + 1)
        rows = rows % len(source) if source.loop else rows[(rows >= 0) & (rows < len(source))]
        columns = columns % len(target) if target.loop else columns[(columns >= 0) & (columns < len(target))]
        if t.kind == "entry":
            columns = columns[columns <= node.target_frame]
        if t.kind == "exit":
            rows = rows[rows >= node.exit_frame]
        assert distance[np.ix_(rows, columns)].min() >= t.distance - 1e-12


def test_every_target_can_be_entered_and_left(graph):
    assert len(graph.core) == 4
    assert graph.targets == TARGETS
    assert graph.unreachable() == ()
    assert graph.dead_ends() == ()
    for target in graph.targets:
        assert all(graph.between(core, target, "prepared") for core in graph.core)


def test_a_tight_threshold_leaves_targets_unreachable(motions):
    tight = build_graph([motions["walk"]], [motions["punch_right"]], GraphSettings(threshold=0.01))
    assert tight.unreachable() == ("punch_right",)
    assert tight.dead_ends() == ("punch_right",)


def test_a_saved_graph_comes_back_and_the_bytes_repeat(graph, motions, tmp_path):
    first = save_graph(graph, tmp_path / "a.json")
    again = build_graph(core_motions(ControllerSettings()), map(library_motion, TARGETS))
    second = save_graph(again, tmp_path / "b.json")
    assert first.read_bytes() == second.read_bytes()
    assert read_graph(first) == graph
    check_motions(graph, motions)


def _broken(content, key, value):
    content = json.loads(json.dumps(content))
    content["transitions"][0][key] = value
    return content


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: {**c, "schema": "other/1"}, "schema 'other/1'; this version reads 'simprep.motion_graph/1'"),
        (lambda c: {**c, "model_version": 99}, "version 99; valid: 'simprep_humanoid' version 1"),
        (lambda c: _broken(c, "source_frame", 10**6), "frame 1000000 of .*; valid: 0 to"),
        (lambda c: _broken(c, "target", "nobody"), "no motion 'nobody' in the graph; valid: walk"),
        (lambda c: _broken(c, "kind", "magic"), "kind 'magic'; valid: core, entry, prepared, exit"),
        (lambda c: {k: v for k, v in c.items() if k != "nodes"}, "not a motion graph"),
        (lambda c: {**c, "settings": {"threshold": -1.0}}, "threshold -1.0; valid: above 0"),
        (lambda c: [1], "schema 'list'"),
    ],
)
def test_a_damaged_file_is_refused(graph, tmp_path, change, message):
    path = save_graph(graph, tmp_path / "graph.json")
    path.write_text(json.dumps(change(json.loads(path.read_text()))))
    with pytest.raises(GraphFileError, match=message) as caught:
        read_graph(path)
    assert str(path) in str(caught.value)


def test_no_file_and_no_json(tmp_path):
    with pytest.raises(GraphFileError, match="no such file"):
        read_graph(tmp_path / "none.json")
    (tmp_path / "x.json").write_text("{")
    with pytest.raises(GraphFileError, match="not a readable JSON file"):
        read_graph(tmp_path / "x.json")


def test_motions_other_than_the_graphs_are_refused(graph, motions):
    with pytest.raises(MotionError, match="needs 'walk'"):
        check_motions(graph, {})
    changed = {**motions, "duck": replace(motions["duck"], events={"target": 50})}
    with pytest.raises(MotionError, match="duck has 169 frames and its target movement at 50"):
        check_motions(graph, changed)


def test_bad_input_names_itself(graph, motions):
    with pytest.raises(MotionError, match="punch_right is no loop"):
        build_graph([motions["punch_right"]], [])
    with pytest.raises(MotionError, match="without core nodes"):
        build_graph([], [motions["duck"]])
    with pytest.raises(MotionError, match="duck is in the motion graph twice"):
        build_graph([motions["walk"]], [motions["duck"]] * 2)
    with pytest.raises(
        MotionError, match=r"movement is not marked; .* its fastest part is the right hand, at frame 1[0-9]+"
    ):
        build_graph([motions["walk"]], [replace(motions["duck"], events={})])
    with pytest.raises(SettingError, match="apart 0"):
        GraphSettings(apart=0)
    with pytest.raises(UnknownNameError, match="unknown motion of the graph 'x'; valid: walk"):
        graph.between("x", "walk")
    with pytest.raises(UnknownNameError, match="unknown kind of transition 'x'; valid: core, entry, prepared, exit"):
        graph.between("walk", "duck", "x")
