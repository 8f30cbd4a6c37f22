"""The example that asks in words which goal comes next, with scripted answers."""

from pathlib import Path

import chest_task
import pytest
from turns_helpers import make as make_rooms

from hierroom.meta import take_turn
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def asking(monkeypatch):
    """Return a function that makes a meta-controller that keeps its questions and gets the same answer to each."""
    monkeypatch.syspath_prepend(EXAMPLES)
    from asking_meta import AskingMeta

    def make(answer):
        questions = []
        return AskingMeta(lambda question: questions.append(question) or answer), questions

    return make


@pytest.mark.parametrize(
    ("answer", "goal", "not_understood"),
    [("I'd take the KEY.", 1, 0), ("a boat", 0, 1), ("coin or key", 0, 1), ("", 0, 1), ("the chest", 0, 1)],
)
def test_only_an_answer_naming_one_legal_goal_counts(answer, goal, not_understood, asking):
    turns, (meta, questions) = Turns(EnvConfig(task=chest_task.chest), 1, seed=0), asking(answer)
    take_turn(meta, turns)
    assert turns.goals.tolist() == [goal]
    assert questions[0].splitlines()[1:3] == ["Achieved so far: nothing.", "Goals that can be chosen: coin, key."]
    assert meta.statistics == {"asked": 1, "not_understood": not_understood}


def test_single_goal_is_not_asked_for_and_names_within_names_are_told_apart(asking):
    rooms, (meta, questions) = make_rooms("a", n=3), asking("?")
    take_turn(meta, rooms)
    assert (questions, (rooms.goals >= 0).all()) == ([], True)
    names = {1: "key 1", 12: "key 12", 2: "key 2"}
    assert [meta.named(text, names) for text in ("Key 12, please", "key 2", "key")] == [[12], [2], []]
