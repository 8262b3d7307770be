import numpy as np
import pytest
from duel_cases import bout, standing_pair

from sbu.interactions import acting_found, classify_acting, read_sbu
from sbu.strikes import find_strike, stream_track
from sbu_study import ACTING
from simprep.duel.labels.segmentation import stream_kinematics
from simprep.motion.edit import move


def test_who_kicks_is_found_in_a_stream():
    stream, _, _ = bout(np.random.default_rng(2), 3)
    one = stream.part(0, 60)
    still = standing_pair(60, 1.0)
    for number in range(2):
        players = [still.players[0], still.players[1]]
        players[number] = one.players[number]
        pair = type(still)((players[0], move(players[1], (-0.2, 0.0)) if number else players[1]))
        strike = find_strike(stream_track(pair, stream_kinematics(pair)))
        assert strike.actor == number
        assert strike.distance_m == pytest.approx(1.0, abs=0.01)
        assert np.isnan(strike.delay_s)


def test_real_pairs_who_acts_and_what(data_dir):
    path = data_dir / "pairs" / "sbu_pairs.npz"
    if not path.is_file():
        pytest.skip(f"no {path}")
    pairs = read_sbu(path)
    found = acting_found(pairs, ACTING)
    assert {kind: total for kind, (_, total) in found.items()} == {
        kind: pairs.labels.count(kind) for kind in ("kick", "push", "punch")
    }
    assert all(right >= 0.85 * total for right, total in found.values())
    result, folds = classify_acting(pairs)
    assert result.accuracy >= 0.8
    assert folds.min() >= 0.8
    assert classify_acting(pairs, None)[0].accuracy >= 0.8
