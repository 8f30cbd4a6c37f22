"""The command `play` and the rules of its game."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pygame
import pytest

from hierroom.commands.play import PlayArguments, main, make_game
from hierroom.lab.play import App
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.constants import FORWARD, LEFT, OPEN, PICKUP
from hierroom.worlds.escape_room.oracle import shortest_actions


def new_game(**arguments):
    return make_game(PlayArguments(**arguments))


def plan_of(game):
    return shortest_actions(game.state).tolist()


@pytest.mark.parametrize("graph", ["a", "d", "f"])
def test_shortest_plan_reaches_each_goal_and_the_exit(graph):
    game = new_game(graph=(graph,), seed=3)
    plan, said = plan_of(game), []
    assert len(plan) == game.shortest
    for action in plan:
        assert (
            game.hint == f"{['forward', 'left', 'right', 'pick up', 'open'][action]} ({len(plan_of(game))} to the exit)"
        )
        game.step(action)
        said.append(game.message)
    assert game.has_escaped
    assert said[-1] == f"escaped in {len(plan)} steps"
    colours, is_goal = game.state.levels["colours"][0].tolist(), [name.endswith("!") for name in said]
    names = {f"{game.name_of(goal)}!" for colour in colours for goal in (colour, 6 + colour)}
    assert {*np.array(said)[is_goal].tolist()} <= names
    assert sum(is_goal) == game.graph.exit_depth
    assert game.hint == "none, the level has ended"
    before = game.state
    game.step(FORWARD)  # nothing more happens
    np.testing.assert_array_equal(game.state.levels, before.levels)
    assert game.message.startswith("the level has ended")


def test_game_ends_at_max_steps():
    game = new_game(max_steps=4)
    for _ in range(4):
        game.step(LEFT)
    assert game.has_ended
    assert not game.has_escaped
    assert game.message == "the limit of 4 steps is reached"


def test_use_picks_up_opens_or_says_why_not():
    game = new_game(graph=("a",), seed=0)
    messages = set()
    for n_steps, action in enumerate(plan_of(game)):
        level = game.state.levels[0]
        if action in (PICKUP, OPEN):
            game.use()
        else:
            if not int(level.keys):
                game.use()  # no key yet: nothing to use in front of the agent
                messages.add(game.message)
                assert int(game.state.levels[0].steps) == n_steps
            game.step(action)
        assert int(game.state.levels[0].steps) == n_steps + 1
    assert game.has_escaped
    assert messages == {"there is neither a key nor a locked door in front"}
    game.begin(game.seed)
    stand_before_door(game)
    game.use()
    assert game.message == f"this door needs {game.name_of(int(game.state.levels[0].colours[0]))}"
    assert int(game.state.levels[0].steps) == 0


def stand_before_door(game):
    turns = game._env.unwrapped.single.turns
    state = turns.get_state()
    level = state["levels"][0]
    top, left, bottom, right = level.rectangles[0]
    row, col = level.doors_at[0]
    level.row, level.col = np.clip(row, top, bottom), np.clip(col, left, right)
    facing = {(0, 1): 0, (1, 0): 1, (0, -1): 2, (-1, 0): 3}
    level.direction = facing[row - level.row, col - level.col]
    turns.set_state(state)


@pytest.fixture(scope="module")
def of_the_agent(played):
    """The goals and states of a level that the agent plays alone, and the actions that it took."""
    game, goals, states, actions = new_game(agent=played, seed=4), [], [], []
    step = game._env.step
    game._env.step = lambda action: (actions.append(action), step(action))[1]
    while not game.has_ended:
        goals.append(game.goal)
        game.step()
        states.append(game.state.grids)
    return goals, states, actions


@pytest.mark.parametrize("taken_over_after", [1, 7, 60])
def test_agent_taking_over_remembers_earlier_steps(played, of_the_agent, taken_over_after):
    game = new_game(agent=played, seed=4)
    for number, (goal, grids, action) in enumerate(zip(*of_the_agent, strict=True)):
        assert (game.goal, game.has_ended) == (goal, False)
        game.step(action if number < taken_over_after else None)
        np.testing.assert_array_equal(game.state.grids, grids)
    assert game.has_ended


def test_play_command_starts_the_game(played, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    opened = []

    def note(self):
        opened.append(self.game)
        pygame.display.quit()

    monkeypatch.setattr(App, "run", note)
    assert main(["--graph", "f", "--seed", "7"]) == 0
    (game,) = opened
    assert (game.graph.name, game.agent) == ("f", None)
    assert main(["--agent", str(played)]) == 0
    assert opened[1].agent is not None


def test_workshop_agent_raises_input_error(monkeypatch):
    agent = SimpleNamespace(config=SimpleNamespace(env=EnvConfig(task="workshop:2")))
    monkeypatch.setattr("hierroom.runs.trained_agent.load", lambda *_, **__: agent)
    with pytest.raises(InputError, match="play shows levels of EscapeRooms, and the agent of mine plays workshop:2"):
        new_game(agent=Path("mine"))


def test_invalid_options_or_missing_screen_raise_input_error(played, monkeypatch, tmp_path, capfd):
    for argv, message in (
        (["--size", "5"], "size must be a whole number from 11 to 63, not 5"),
        (["--agent", str(tmp_path)], "is not a run folder"),
        (["--agent", str(played), "--drop-key"], "was trained without --drop-key"),
        (["--greedy"], "--greedy goes with --agent, which is missing"),
        (["--trust-run"], "--trust-run goes with --agent, which is missing"),
    ):
        with pytest.raises(InputError, match=message):
            main(argv)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match="play needs a screen, and there is none here"):
        main(["--graph", "a"])
    assert capfd.readouterr().err == ""  # nothing of SDL's own
    monkeypatch.setenv("DISPLAY", ":99")  # a screen that is no longer there
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    with pytest.raises(InputError, match="play needs a screen, and there is none here"):
        main(["--graph", "a"])
    monkeypatch.undo()
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    with pytest.raises(InputError, match=r"cannot open a window .*: it needs a screen"):
        main(["--graph", "a"])
