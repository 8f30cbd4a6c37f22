"""The controller of benchmarks/searching.py: it escapes, knows just what it saw, and goes straight."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.informed import Informed
from benchmarks.result_table import ResultTable
from benchmarks.search_cost import HEADINGS, row_of
from benchmarks.searching import Searching
from hierroom.meta import make_meta, take_turn
from hierroom.runs.assembly import make_turns
from hierroom.runs.config.presets import find_preset
from hierroom.runs.evaluation import evaluate
from hierroom.worlds.escape_room.constants import UNSEEN
from hierroom.worlds.escape_room.oracle import shortest_lengths

ROOT = Path(__file__).parents[2]
BENCHMARKS = ROOT / "benchmarks"

CHAIN = str(BENCHMARKS / "graphs" / "chain.toml")


def config_of(graph, **changes):
    preset = find_preset("default")
    return preset.changed(graph=graph, **changes, threads=1)


def turns_in(graph, n, **changes):
    return make_turns(config_of(graph, **changes), n, 0, levels="evaluation")


def window(view, level):
    """The cells of the view in the grid's own orientation, and the (row, col) of their first: east, then turned."""
    row, col, direction = int(level.row), int(level.col), int(level.direction)
    first = [(row - 3, col), (row, col - 3), (row - 3, col - 6), (row - 6, col - 3)][direction]
    return np.rot90(view[:, ::-1], -direction), first


@pytest.mark.parametrize(("graph", "size"), [("a", 19), ("f", 19), ("g", 11), ("d", 31), (CHAIN, 19)])
def test_it_always_escapes_and_is_no_shorter_than_the_informed(graph, size):
    n = 25
    turns = turns_in(graph, n, size=size)
    searching = evaluate(Searching(make_meta("fixed-dfs"), turns), turns, 2 * n)
    informed = evaluate(Informed(make_meta("fixed-dfs"), n), turns_in(graph, n, size=size), 2 * n)
    assert searching.success_rate == 1.0
    assert informed.length <= searching.length < 1.5 * informed.length


@pytest.mark.parametrize("graph", ["c", "e"])
def test_its_map_holds_exactly_what_was_shown_this_episode(graph):
    n = 4
    turns = turns_in(graph, n)
    searching = Searching(make_meta("fixed-dfs"), turns)
    shown, grids, levels = np.zeros(searching.known.shape, bool), turns.world.state.grids, turns.world.state.levels
    episode_ended = np.zeros(n, int)
    while episode_ended.min() < 3:
        searching.look(turns)
        for i in range(n):
            view, (top, left) = window(turns.world.outcomes["tiles"][i], levels[i])
            shown[i, top : top + 7, left : left + 7] |= view != UNSEEN
        assert (searching.known != UNSEEN).tolist() == shown.tolist()
        assert (searching.known[shown] == grids[shown]).all()
        assert 0 < shown.mean() < 0.5
        step = searching.step(turns)
        shown[step.episode_ended] = False
        episode_ended += step.episode_ended


def test_it_goes_the_shortest_way_to_goals_it_saw():
    """With a map of the whole level, each goal takes as many steps as the oracle says, keys in the way or not."""
    n = 50
    turns = turns_in("f", n, size=11)
    searching = Searching(make_meta("fixed-dfs"), turns)
    searching.known[:] = turns.world.state.grids
    take_turn(make_meta("fixed-dfs"), turns)
    shortest, reached = shortest_lengths(turns.world.get_state(), turns.goals), 0
    is_first_episode = np.ones(n, bool)
    while is_first_episode.any():
        step = searching.step(turns)
        done = step.reached & is_first_episode
        assert (step.meta_elapsed[done] == shortest[done]).all()
        reached += done.sum()
        is_first_episode &= ~step.episode_ended
        take_turn(make_meta("fixed-dfs"), turns)
        shortest[done] = shortest_lengths(turns.world.get_state(), turns.goals)[done]
    assert reached >= 5 * n


def test_a_row_of_the_table_is_that_of_the_results_page():
    table = ResultTable.read(BENCHMARKS / "results" / "search_cost.csv")
    assert table.headings == HEADINGS
    row = row_of(config_of("a"), 1000)
    assert row == table.rows[0]
    shortest, informed, searched, ratio = map(float, row[1:5])
    assert shortest <= informed <= searched
    assert ratio == pytest.approx(searched / informed, abs=0.02)
