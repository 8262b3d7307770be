"""Label models: exact small cases, limits, and a policy that is known."""

import numpy as np
import pytest
from synthetic_bout import LABELS, bout, policy

from simprep.duel.labels.labels import CODES, QUALIFIERS, Label, decode
from simprep.duel.model.estimates import LABEL_MODELS, fit_label_model, fit_log_linear
from simprep.duel.model.label_model import LabelModel, LabelTriples, Tabulated, total_variation
from simprep.duel.model.succession import may_follow
from simprep.duel.model.transition_model import label_triples
from simprep.errors import SettingError, UnknownNameError

A, B, C = (Label(left_punch=qualifier, move="L-L").code for qualifier in ("fwd", "bwd", "others"))


def triples(*rows):
    return LabelTriples(*(np.array(column, dtype=np.int64) for column in zip(*rows, strict=True)))


def average_log_prob(model: LabelModel, of: LabelTriples) -> float:
    """Mean log P(next | own, opponent) [nats]; higher is better."""
    return float(np.mean(model.log_prob(of.own, of.opponent, of.next)))


SEEN = triples((A, C, B), (A, C, B), (A, A, C), (B, C, A))


def test_eq9_by_hand():
    model = fit_label_model(SEEN, np.array([A, B, C]), np.array([A, C]))
    order = [int(np.flatnonzero(model.candidates == code)[0]) for code in (A, B, C)]
    # After A: B twice, C once; with one of each added 1, 3, 2 of 6. Against C: B twice, A once: 2, 3, 1 of 6.
    assert model.distribution(A, C)[order] == pytest.approx(np.array([2, 9, 2]) / 13)
    # The opponent was never seen doing B, so only the own label counts.
    assert model.distribution(A, B)[order] == pytest.approx(np.array([1, 3, 2]) / 6)


def test_eq7_by_hand():
    model = fit_label_model(SEEN, np.array([A, B, C]), np.array([A, C]), "eq7")
    order = [int(np.flatnonzero(model.candidates == code)[0]) for code in (A, B, C)]
    assert model.distribution(A, C)[order] == pytest.approx(np.array([1, 3, 1]) / 5)
    assert model.distribution(B, A) == pytest.approx(np.full(3, 1 / 3))


def test_eq8_by_hand():
    model = fit_label_model(SEEN, np.array([A, B, C]), np.array([A, C]), "eq8")

    def factor(given_column, given_label, label):
        """Product over both players' seven aspects and the next label's seven of (N + 1) / sum (N + 1)."""
        product = 1.0
        names = list(QUALIFIERS)
        given = [Label.from_code(int(code)) for code in (SEEN.own, SEEN.opponent)[given_column]]
        following = [Label.from_code(int(code)) for code in SEEN.next]
        for m in names:
            for k in names:
                condition = getattr(Label.from_code(given_label), m)
                pairs = [getattr(f, k) for g, f in zip(given, following, strict=True) if getattr(g, m) == condition]
                product *= (pairs.count(getattr(Label.from_code(label), k)) + 1) / (len(pairs) + len(QUALIFIERS[k]))
        return product

    weight = np.array([factor(0, A, label) * factor(1, C, label) for label in model.candidates])
    np.testing.assert_allclose(model.distribution(A, C), weight / weight.sum(), rtol=1e-9)


@pytest.mark.parametrize("kind", LABEL_MODELS)
def test_distributions_sum_to_one_and_match_the_log_probabilities(kind):
    rng = np.random.default_rng(1)
    rows = LabelTriples(*rng.choice(LABELS, size=(3, 300)))
    model = fit_label_model(rows, LABELS, LABELS, kind)
    own, opponent = rng.choice(LABELS, size=(2, 5, 4))
    distribution = model.distribution(own, opponent)
    assert distribution.shape == (5, 4, len(LABELS))
    np.testing.assert_allclose(distribution.sum(axis=-1), 1)
    assert distribution.min() > 0
    pick = rng.integers(0, len(LABELS), size=(5, 4))
    np.testing.assert_allclose(
        np.exp(model.log_prob(own, opponent, LABELS[pick])),
        np.take_along_axis(distribution, pick[..., None], axis=-1)[..., 0],
    )
    assert model.log_prob(LABELS[0], LABELS[1], CODES - 1) == -np.inf


def test_eq9_finds_a_policy_of_its_own_form_and_leads_the_alternatives():
    rng = np.random.default_rng(2)
    truth = policy(rng, sharpness=0.6)
    made = [bout(rng, 16, truth=truth) for _ in range(2)]
    train, held_out = (label_triples(one.graph, one.actions.transitions(0)) for one in made)
    models = {kind: fit_label_model(train, LABELS, LABELS, kind) for kind in LABEL_MODELS}
    score = {kind: average_log_prob(model, held_out) for kind, model in models.items()}
    ceiling = average_log_prob(truth, held_out)
    assert ceiling > score["eq9"] > score["eq7"]
    assert score["eq9"] > score["eq8"]
    distance = {
        kind: total_variation(model, truth, held_out.own, held_out.opponent).mean() for kind, model in models.items()
    }
    assert distance["eq9"] < min(distance["eq7"], distance["eq8"])


def test_log_linear_learns_what_holds_for_aspects_from_few_examples():
    rng = np.random.default_rng(7)
    indices = decode(LABELS)
    own, opponent = (
        sum(rng.normal(size=(9, 9))[indices[:, m]][:, indices[:, k]] for m, k in ((0, 0), (3, 3), (6, 6), (3, 5)))
        for _ in range(2)
    )
    weight = np.exp(own[:, None] + opponent[None])
    truth = Tabulated(LABELS, LABELS, weight / weight.sum(axis=-1, keepdims=True))
    given = rng.choice(LABELS, size=(2, 4000))
    after = np.array([rng.choice(LABELS, p=p) for p in truth.distribution(*given)])
    train, held_out = (LabelTriples(*given[:, part], after[part]) for part in (slice(400), slice(400, None)))
    models = {kind: fit_label_model(train, LABELS, LABELS, kind) for kind in LABEL_MODELS}
    lost = {
        kind: average_log_prob(truth, held_out) - average_log_prob(model, held_out) for kind, model in models.items()
    }
    assert 0 < lost["log_linear"] < 0.5 * min(lost[kind] for kind in ("eq7", "eq8", "eq9"))


def test_log_linear_meets_the_conditions_of_a_maximum():
    rng = np.random.default_rng(3)
    rows = LabelTriples(*rng.choice(LABELS, size=(3, 3000)))
    free = fit_log_linear(rows, LABELS, LABELS, 1e-3, 1e-3)
    strict = fit_log_linear(rows, LABELS, LABELS, 1e7, 1e7)
    assert average_log_prob(free, rows) > average_log_prob(fit_label_model(rows, LABELS, LABELS), rows)
    np.testing.assert_allclose(strict.distribution(LABELS[0], LABELS[1]), 1 / len(LABELS), rtol=1e-2)
    # At a maximum with hardly a prior, each label follows each other as often as the model expects.
    following = rows.next[:, None] == LABELS
    excess = free.distribution(rows.own, rows.opponent) - following
    for given in (rows.own, rows.opponent):
        pairs = (given[:, None] == LABELS).astype(float).T @ excess
        assert np.abs(pairs).max() < 0.2
        eq9 = fit_label_model(rows, LABELS, LABELS).distribution(rows.own, rows.opponent) - following
        assert np.abs((given[:, None] == LABELS).astype(float).T @ eq9).max() > 2


def test_total_variation_of_models_with_different_candidates():
    one = Tabulated(np.array([1, 2]), np.array([1]), np.tile([0.25, 0.75], (2, 1, 1)))
    two = Tabulated(np.array([2, 3]), np.array([1]), np.tile([0.75, 0.25], (2, 1, 1)))
    assert total_variation(one, two, [2, 2], [1, 1]) == pytest.approx([0.25, 0.25])
    assert total_variation(one, one, 2, 1) == 0


def test_bad_models_are_refused():
    with pytest.raises(UnknownNameError, match="unknown label model 'eq10'; valid: eq9, eq7, eq8"):
        fit_label_model(SEEN, LABELS, LABELS, "eq10")
    with pytest.raises(SettingError, match="follows in the data but is no candidate"):
        fit_label_model(SEEN, np.array([A, B]), LABELS)
    with pytest.raises(SettingError, match="rows of probabilities"):
        Tabulated(np.array([1, 2]), np.array([1]), np.ones((2, 1, 2)))
    with pytest.raises(SettingError, match="does not cover"):
        policy(np.random.default_rng(0)).distribution(LABELS[0], CODES - 1)


def test_rules_say_on_which_foot_and_against_what_an_action_begins():
    own = Label(left_punch="fwd", move="L-R").code
    kicks = Label(right_kick="up", move="L-L").code
    fits, wrong_foot, no_answer = (
        Label(left_punch="bwd", react=react, move=move).code
        for react, move in (("kick", "R-R"), ("kick", "L-R"), ("others", "R-R"))
    )
    order = np.array([fits, wrong_foot, no_answer])
    assert may_follow(own, kicks, order).tolist() == [True, False, False]
    assert may_follow([own], [own], order).tolist() == [[False, False, False]]  # the other one punches
    known = triples((own, kicks, fits), (own, kicks, wrong_foot))
    candidates = np.unique([own, fits, wrong_foot, no_answer])
    ruled = fit_label_model(known, candidates, np.array([kicks, own]), "rules")
    chances = dict(zip(ruled.candidates.tolist(), ruled.distribution(own, kicks), strict=True))
    assert chances[fits] > 0.98
    assert 0 < chances[wrong_foot] < 0.01
    # where nothing agrees with the rules they are silent
    np.testing.assert_allclose(ruled.distribution(own, own), ruled.base.distribution(own, own))
