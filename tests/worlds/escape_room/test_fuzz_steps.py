"""The short form of the random steps with invariants, and that a broken rule is noticed."""

import pytest
from fuzz.steps import CASES, N_GRAPHS, Play

from hierroom import InputError


def step_often(play, n_steps):
    for _ in range(n_steps):
        play.step()


@pytest.mark.parametrize(("number", "case"), [*enumerate(CASES)], ids=str)
def test_every_rule_holds_after_every_step(number, case):
    play = Play(*case, num_envs=256, seed=number)
    step_often(play, 200)
    assert play.events.sum() > (30 if case[0] == 63 else 300)
    assert len(play.graphs) > N_GRAPHS / 3


BREAKS = {
    "a key appears": ("keys", lambda keys: keys | 1, "the bag holds|a key is held once"),
    "a door opens": ("doors", lambda doors: doors | 1, "a door is opened"),
    "what was seen is forgotten": ("seen", lambda seen: 0 * seen, "what was seen once"),
    "what was found is forgotten": ("found", lambda found: 0 * found, "what was held once was found"),
    "the agent is turned": ("direction", lambda direction: (direction + 1) % 4, "the agent moves ahead|turn the agent"),
    "time goes back": ("steps", lambda steps: steps - 1, "each step counts"),
    "a key is carried": ("carried", lambda carried: 0 * carried, "the key to drop"),
    "an episode is left out": ("episode", lambda episode: episode + 1, "nothing else begins"),
}


@pytest.mark.parametrize("name", BREAKS)
def test_a_broken_rule_is_noticed(name):
    field, change, rule = BREAKS[name]
    play = Play(11, False, False, num_envs=256, seed=0)
    step_often(play, 60)
    levels = play.turns.world.state.levels
    levels[field] = change(levels[field])
    with pytest.raises((AssertionError, InputError), match=rule):  # the latter from the check of whole states
        step_often(play, 9)
