"""Chains on named nodes: invalid input raises an InputError of one line."""

import numpy as np
import pytest
import scipy.sparse as sp

from hierroom.complexity import Chain, analyze
from hierroom.support.errors import InputError

W = sp.csr_array(np.array([[0.0, 0.5, 0.0], [0.1, 0.0, 0.2], [0.0, 0.0, 0.0]]))


@pytest.mark.parametrize(
    ("labels", "source", "goals", "message"),
    [
        (("a", "b"), 0, {"exit": (2,)}, "a chain of 3 nodes needs 3 labels, not 2"),
        (("a", "b", "a"), 0, {"exit": (2,)}, "nodes need different names, but two of them are called 'a'"),
        (("a", "b", "c"), 3, {"exit": (2,)}, "a node must be a whole number from 0 to 2, not 3"),
        (("a", "b", "c"), 0, {"key 1": (1,)}, "a chain needs a goal 'exit'; there is 'key 1'"),
        (("a", "b", "c"), 0, {}, "a chain needs a goal 'exit'; there is none"),
        (("a", "b", "c"), 0, {"exit": 2}, "the nodes of a goal must be a list of whole numbers, not 2"),
        (("a", "b", "c"), 0, {"exit": ()}, "the goal 'exit' of a chain must be one node, not 0"),
    ],
)
def test_invalid_chains_raise_input_error(labels, source, goals, message):
    with pytest.raises(InputError, match=message) as caught:
        Chain(W, labels, source, goals)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("label", ["key 9", "room 1", 3, None, ["exit"]])
def test_unknown_label_raises_input_error(label):
    chain = analyze("c").chain
    for ask in (
        chain.expected_steps_to, chain.hitting_time_to,
        lambda goal: chain.reach_probability([1, 2], goal),
    ):  # fmt: skip
        with pytest.raises(InputError, match=r"the goals are key 1, .*'start', .*; there is no") as caught:
            ask(label)
        assert "\n" not in str(caught.value)


def test_weights_of_any_form_give_the_same_chain():
    expected = Chain(W, ("a", "b", "c"), 0, {"exit": (2,)}).expected_steps
    for weights in (W.toarray(), sp.coo_array(W), sp.csc_array(W)):
        assert Chain(weights, ("a", "b", "c"), 0, {"exit": (2,)}).expected_steps == expected


def test_stored_zeros_are_no_edges():
    weights = sp.csr_array((np.array([0.0, 0.5, 0.5]), ([0, 0, 1], [2, 1, 0])), shape=(3, 3))
    chain = Chain(weights, ("a", "b", "c"), 0, {"exit": (1,)})
    assert not chain.is_one_way()
    assert chain.hitting_time == pytest.approx(2)


def test_rows_above_one_raise_input_error():
    with pytest.raises(InputError, match="row 0 of W sums to 2"):
        Chain(4 * W, ("a", "b", "c"), 0, {"exit": (2,)})
