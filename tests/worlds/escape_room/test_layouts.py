"""Levels from text maps: reading, errors, play, training and resuming."""

import os
import signal

import numpy as np
import pytest
from exhaustive_search import steps_to_goals
from same_run import differences
from stopped_run import stop_at_update

import hierroom
from hierroom.goals import EXIT_GOAL, NAMED_GRAPHS
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.run_name import run_name
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.features import nearest_frontiers
from hierroom.worlds.escape_room.layout import State, map_arrays
from hierroom.worlds.escape_room.level_map import LevelMap
from hierroom.worlds.escape_room.oracle import shortest_lengths

IN_A_ROW = """
############
#@ #  b#   #
#  R   B g #
#r #   #   #
####   ###G#
#      #  E#
############
"""
"""Rooms in a row; the second room is bent."""
FORK = """
    ###########
    #   #     #
    # E #    ##
    ##W###Y####
    #.. w  y..#
    #.<       #
    #  .. g ..#
    ###G#######
    #     #####
    ###########
"""
HUB = """
#########
#   Rr  #
# E #  ##
#####@ ##
#   Bb  #
#########
"""
LEAST = "######\n#@rRE#\n######"
CORRIDOR = "##########\n#@rR bB E#\n##########"
MAPS = {"in a row": IN_A_ROW, "fork": FORK, "hub": HUB, "corridor": CORRIDOR, "least": LEAST}
SMALL = {"max_steps": 60, "num_envs": 8, "sequence_length": 16, "minibatches": 2, "epochs": 1, "hidden_size": 8}


def world_of(*maps: str, n: int = 1, seed: int = 0, **settings) -> Engine:
    drawn = [LevelMap.of(one) for one in maps]
    size = max(one.size for one in drawn)
    return Engine([one.graph for one in drawn], n, size=size, seed=seed, maps=map_arrays(drawn, size), **settings)


@pytest.mark.parametrize(
    ("drawn", "door_rooms", "colours", "letter"),
    [(IN_A_ROW, (0, 1, 2), (0, 2, 1), "g"), (HUB, (0, 0), (0, 2), "b"), (LEAST, (0,), (0,), "a")],
)
def test_goal_graph_is_read_from_the_map(drawn, door_rooms, colours, letter):
    one = LevelMap.of(drawn)
    assert (one.rooms.door_rooms, one.rooms.colours) == (door_rooms, colours)
    assert one.graph == NAMED_GRAPHS[letter].canonical()
    report = hierroom.env(layout=drawn).unwrapped.complexity
    assert report.hitting_time == pytest.approx(hierroom.complexity.analyze(letter).hitting_time)


WALLED = "#########\n#{}#\n#########"
REFUSED = [
    ("", "it is empty; a map has # wall"),
    ("#@#", "a map has 3 to 63 rows and columns, not 1 rows and 3 columns"),
    ("\n".join(["#" * 64] * 3), "a map has 3 to 63 rows and columns, not 3 rows and 64 columns"),
    ("\n\n" + WALLED.format("@ rRx E"), "row 4, column 6: 'x' means nothing; a map has # wall"),
    ("  #########\n  #@ rR\t E#\n  #########", "row 2, column 8: '.t' means nothing"),
    (WALLED.format("@ rR E"), "row 2, column 9: the row has 8 cells, but the first has 9"),
    (WALLED.format("@ rR  E#"), "row 2, column 10: the row has 10 cells, but the first has 9"),
    ("##### ###\n#@ rR  E#\n#########", "row 1, column 6: the border must be wall, #, all around"),
    (WALLED.format("  rR  E"), "there is no start"),
    (WALLED.format("@ rR   "), "there is no exit"),
    (WALLED.format("@ rR> E"), "row 2, column 6: a second start; the first is at row 2, column 2"),
    (WALLED.format("@ rR EE"), "row 2, column 8: a second exit"),
    (WALLED.format("@rrR  E"), "row 2, column 4: a second red key"),
    (WALLED.format("@rRE RR"), "row 2, column 7: a second red door"),
    (WALLED.format("@ rRb E"), "row 2, column 6: the blue key has no door: there is no B"),
    (WALLED.format("@  R  E"), "row 2, column 5: the red door has no key: there is no r"),
    (WALLED.format("@ E rR "), "row 2, column 7: the red door cannot be reached: no way leads to it"),
    (WALLED.format("@  R Er"), "row 2, column 8: the red key cannot be reached: no way leads to it"),
    (WALLED.format("E@ rR  "), "row 2, column 2: the exit can be reached before any door is open"),
    (WALLED.format("@ rR #E"), "row 2, column 8: the exit cannot be reached: no way leads to it"),
    (WALLED.format("@  R rE"), "row 2, column 8: the exit cannot be reached in any order: it is behind the red door"),
    (WALLED.format("@brRB E"), "row 2, column 5: the red door touches the blue door"),
    ("######\n#@r#E#\n##R# #\n######", "row 3, column 3: the red door opens nothing"),
    ("#######\n#@rR  #\n#  # E#\n#b B  #\n#######", "row 4, column 4: the blue door is in a loop"),
    ("#########\n#@br    #\n##R###B##\n#   E   #\n#########", "row 4, column 5: the exit is entered from behind"),
    ("##########\n#@rb R BE#\n##########", "row 2, column 8: the blue door stands behind the red door, but its key"),
]


@pytest.mark.parametrize(("drawn", "said"), REFUSED)
def test_invalid_map_raises_input_error_with_the_cell(drawn, said):
    with pytest.raises(InputError, match=f"^layout maze: {said}"):
        LevelMap.of({"name": "maze", "map": drawn})


def test_invalid_map_file_raises_input_error(tmp_path):
    (tmp_path / "latin.txt").write_bytes(b"#\xe9#")
    (tmp_path / "large.txt").write_bytes(b"#" * (2**20 + 1))
    (tmp_path / "empty.txt").write_bytes(b"")
    os.mkfifo(tmp_path / "pipe.txt")
    said = {"latin": "no text in UTF-8", "large": "larger than 1 MiB", "empty": "is empty", "pipe": "no regular file"}
    for name, why in {**said, "missing": "No such file"}.items():
        with pytest.raises(InputError, match=why):
            EnvConfig(layout=tmp_path / f"{name}.txt")
    for wrong in (3, "", {"map": [LEAST]}, {"name": "a", "map": LEAST}, [LEAST, LEAST]):
        with pytest.raises(InputError, match=r"layout"):
            EnvConfig(layout=wrong)


def test_map_name_is_its_file_name(tmp_path):
    for name in ("maze.txt", "a.txt"):
        (tmp_path / name).write_text(f"\ufeff{LEAST}\r\n", encoding="utf-8")
    config = EnvConfig(layout=[tmp_path / "maze.txt", str(tmp_path / "a.txt")])
    assert config.names == ("maze", "a.txt")
    assert EnvConfig(layout=LEAST).names != EnvConfig(layout=HUB).names


@pytest.mark.slow
@pytest.mark.parametrize(("name", "drop_key"), [*((name, False) for name in MAPS), ("corridor", True), ("least", True)])
def test_shortest_lengths_on_maps_equal_exhaustive_search(name, drop_key):
    """From states of a walk that picks up, opens and drops, in rooms and in doorways."""
    world, rng, doorways = world_of(MAPS[name], n=8, max_steps=10**6, drop_key=drop_key), np.random.default_rng(3), 0
    for _ in range(8):
        for _ in range(30):
            world.step(rng.choice(6, 8, p=[0.4, 0.1, 0.1, 0.19, 0.2, 0.01]))
        state = world.get_state()
        doorways += int((state.levels["doors"] != 0).sum())
        n = int(rng.integers(8))
        assert steps_to_goals(state[n], drop_key)[EXIT_GOAL] == shortest_lengths(state)[n]
    assert doorways > 0


@pytest.mark.parametrize("name", MAPS)
def test_oracle_solves_each_map_in_the_shortest_length(name):
    config = EnvConfig(layout=MAPS[name], max_steps=200)
    for episode in hierroom.rollout("oracle", config, 4, num_envs=2):
        assert (episode.success, len(episode)) == (True, episode.shortest)
    turns = Turns(config, 4, seed=1)
    legal = turns.world.legal_goals("reachable", np.ones(4, bool))
    graph = turns.world.rules
    assert graph is not None
    assert legal[0].sum() == graph.key_rooms.count(0)


def test_map_frontiers_are_split_by_the_agents_room():
    """In rooms that are not rectangles, with a tenth of all cells not seen."""
    maps, rng = world_of(IN_A_ROW).state.maps, np.random.default_rng(5)
    cells = np.argwhere(maps.rooms[0] >= 0)
    levels = np.repeat(maps.levels, len(cells))
    levels["row"], levels["col"] = cells.T
    seen = rng.random((len(cells), 63, 12)) < 0.9  # a state from a file may have seen lines outside its grid
    levels["explored"] = (seen * 2 ** np.arange(12, dtype=np.uint64)).sum(axis=2, dtype=np.uint64)
    for at, lit, found in zip(cells, seen, nearest_frontiers(levels, maps), strict=True):
        beside = lit[:-2, 1:-1] & lit[2:, 1:-1] & lit[1:-1, :-2] & lit[1:-1, 2:]
        frontier = [cell for cell in cells if lit[tuple(cell - 5)] and not beside[tuple(cell - 6)]]
        for is_here, nearest in zip((True, False), found, strict=True):
            there = [cell for cell in frontier if (maps.rooms[0][*cell] == maps.rooms[0][*at]) == is_here]
            expected = min(((abs(cell - at).sum(), *cell) for cell in there), default=(0, 0, 0))
            assert nearest.tolist() == [*expected[1:]]


def test_map_of_an_episode_depends_only_on_its_seed():
    together, names = world_of(HUB, IN_A_ROW, n=32, seed=5, max_steps=3), ("map", "direction", "key")
    for episode in range(2):
        levels = together.get_state().levels
        alone = [world_of(HUB, IN_A_ROW, seed=5, first_index=n, max_steps=3) for n in (0, 7, 31)]
        for world, n in zip(alone, (0, 7, 31), strict=True):
            for _ in range(3 * episode):
                world.step([1])
            assert [world.state.levels[name][0] for name in names] == [levels[name][n] for name in names]
        assert {*levels["map"].tolist()} == {1, 2}
        assert {*levels["direction"].tolist()} == {0, 1, 2, 3}
        for _ in range(3):
            together.step(np.ones(32, int))
    assert (world_of(FORK, n=9).state.levels["direction"] == 2).all()


def test_state_of_other_layouts_raises_input_error():
    world, other = world_of(HUB, n=2), world_of(IN_A_ROW, n=2)
    with pytest.raises(InputError, match=r"of other layouts"):
        world.set_state(other.get_state())
    for name, number in {"map": 2, "door_rooms": 1, "exit_room": 2, "keys_at": 7, "divider": 1}.items():
        state = world.get_state()
        state.levels[name][1] = number
        with pytest.raises(InputError, match=f"levels.{name} (must|differs)"):
            world.set_state(state)
    state = world.get_state()
    state.grids[1, 6, 6] = 21
    with pytest.raises(InputError, match=r"walls in grids differ from those of the layouts"):
        world.set_state(state)
    drawn = Engine([NAMED_GRAPHS["a"]], size=11).get_state()
    with pytest.raises(InputError, match=r"levels.map must be at most 0, not 1"):
        Engine([NAMED_GRAPHS["a"]], size=11).set_state(State(drawn.grids, world.get_state().levels[:1]))
    assert world.get_state().maps is world.state.maps


def test_layout_and_graph_options_replace_each_other():
    config = TrainConfig().changed(layout=[{"name": "hub", "map": HUB}, {"name": "row", "map": IN_A_ROW}])
    assert (config.env.size, config.env.names, "layout hub, row" in config.title) == (12, ("hub", "row"), True)
    assert "hub-row" in run_name(config)
    assert "size" not in run_name(config)
    assert TrainConfig.from_dict(config.to_dict()) == config
    assert config.changed(max_steps=50).env.size == 12
    assert config.changed(graph="g") == TrainConfig().changed(graph="g")
    assert TrainConfig().changed(graph="g", size=31).changed(layout=LEAST).env.size == 11
    for entries in ({"graph": "g"}, {"size": 13}, {"exclude": "a"}, {"curriculum_stages": 2}):
        with pytest.raises(InputError, match=rf"^{next(iter(entries))} is for levels that are drawn"):
            TrainConfig().changed(layout=LEAST, **entries)
    with pytest.raises(InputError, match=r"layout is for EscapeRooms"):
        EnvConfig(task="workshop:2", layout=LEAST)
    with pytest.raises(InputError, match=r"layouts must be given by content"):
        TrainConfig.from_dict({**config.to_dict(), "env": {**config.to_dict()["env"], "layout": "/etc/hosts"}})


@pytest.mark.slow
def test_resume_works_without_the_layout_files(tmp_path, monkeypatch):
    """The run keeps the maps, so it resumes although their files are gone."""
    options = [f"--{name.replace('_', '-')}={value}" for name, value in SMALL.items()]
    options += ["--evaluations=0", "--evaluation-episodes=8", "--threads=1", "--steps=512"]
    for name, drawn in (("hub", HUB), ("row", IN_A_ROW)):
        (tmp_path / f"{name}.txt").write_text(drawn, encoding="utf-8")
    options += ["--layout", str(tmp_path / "hub.txt"), str(tmp_path / "row.txt")]
    whole, stopped = (tmp_path / name / "run" for name in ("whole", "stopped"))
    assert train([*options, "--out", str(whole)]) == 0
    stop_at_update(monkeypatch, signal.SIGINT, 2)
    assert train([*options, "--out", str(stopped)]) == 130
    for name in ("hub", "row"):
        (tmp_path / f"{name}.txt").unlink()
    assert train(["--resume", str(stopped)]) == 0
    assert differences(whole, stopped) == []
    agent = hierroom.load(stopped)
    assert {episode.variant for episode in hierroom.rollout(agent, episodes=16)} == {"hub", "row"}
    assert agent.env(layout=LEAST).size == 11
    assert agent.env(graph="c") == EnvConfig("c", max_steps=60)
