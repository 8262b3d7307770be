"""Labels: codes, text, refusals."""

import numpy as np
import pytest

from simprep.duel.labels.labels import ASPECTS, CODES, KICKS, QUALIFIERS, Label, attacking, decode, encode, neutral
from simprep.errors import SettingError, UnknownNameError


def test_codes_number_all_labels_and_round_trip():
    codes = np.arange(CODES)
    assert np.array_equal(encode(decode(codes)), codes)
    assert np.prod([len(choices) for choices in QUALIFIERS.values()]) == CODES == 5 * 5 * 4 * 4 * 3 * 3 * 9


def test_label_text_and_code_round_trip():
    label = Label(left_punch="fwdbwd", right_kick="downup", react="kick", move="F-R")
    assert Label.parse(str(label)) == Label.from_code(label.code) == label
    assert str(label) == "left_punch=fwdbwd right_kick=downup react=kick move=F-R"
    assert tuple(decode(label.code)) == label.indices
    assert str(Label(move="L-L")) == "move=L-L"


@pytest.mark.parametrize(
    ("label", "attacks"),
    [(Label(left_kick="down", move="L-L"), False), (Label(right_punch="bwdfwd", move="L-L"), True)],
)
def test_withdrawing_a_limb_is_no_attack(label, attacks):
    assert label.attacks is attacks


def test_kinds_of_label():
    labels = [
        Label(move="L-L"),
        Label(move="L-L", left_punch="fwd"),
        Label(move="R-R", right_kick="downup"),
        Label(move="L-L", left_punch="bwd"),
        Label(move="L-F", jump="up"),
        Label(move="L-L", left_punch="bwd", right_punch="fwd"),
    ]
    qualifiers = decode([label.code for label in labels])
    np.testing.assert_array_equal(attacking(qualifiers), [0, 1, 1, 0, 0, 1])
    np.testing.assert_array_equal(attacking(qualifiers), [label.attacks for label in labels])
    np.testing.assert_array_equal(attacking(qualifiers, KICKS), [0, 0, 1, 0, 0, 0])
    np.testing.assert_array_equal(neutral(qualifiers), [1, 0, 0, 0, 0, 0])


def test_bad_labels_are_refused_with_the_valid_choices():
    with pytest.raises(UnknownNameError, match="unknown qualifier of left_kick 'sideways'; valid: up, down, downup"):
        Label(left_kick="sideways", move="L-L")
    with pytest.raises(UnknownNameError, match=f"unknown motion aspect 'elbow'; valid: {', '.join(ASPECTS)}"):
        Label.parse("elbow=up move=L-L")
    with pytest.raises(SettingError, match="no 'move'; valid: L-L, L-R"):
        Label.parse("jump=up")
    with pytest.raises(SettingError, match="given twice"):
        Label.parse("jump=up jump=down move=L-L")
    with pytest.raises(SettingError, match="codes must lie in 0"):
        Label.from_code(CODES)
    with pytest.raises(SettingError, match="entries below"):
        encode([5, 0, 0, 0, 0, 0, 0])
