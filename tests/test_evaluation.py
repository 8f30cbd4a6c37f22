"""What an evaluation counts."""

from hierroom.evaluate import evaluate
from hierroom.goals import NAMED_GRAPHS
from hierroom.turns import Turns
from hierroom.world.batch import Batch


class Turning:
    """Only ever turns, and notes how many rooms the levels have that it is put into."""

    def __init__(self):
        self.sizes = []

    def step(self, turns):
        self.sizes.append(int(turns.world.state.rooms["n_rooms"][0]))
        return turns.step([1])


def test_the_table_has_the_goals_of_every_level_that_was_played():
    graphs, player = [NAMED_GRAPHS["a"], NAMED_GRAPHS["g"]], Turning()
    tables = {}
    for seed in range(8):
        player.sizes.clear()
        turns = Turns(Batch(graphs, 1, size=11, max_steps=3, seed=seed), measure_shortest=True)
        table = evaluate(player, turns, 3).steps_to_goals
        largest = max(player.sizes)
        assert list(table) == [f"{kind} {r}" for kind in ("key", "door") for r in range(1, largest)] + ["exit"]
        tables[largest, int(turns.world.state.rooms["n_rooms"][0])] = table
    assert (4, 2) in tables  # a small level stands there at the end, and large ones were played
