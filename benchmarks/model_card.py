"""Write the model card of the agents that ship: ``python -m benchmarks.model_card``.

Each plays 1000 episodes on levels that training never used. The card is next to the weights.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import tyro

import hierroom
from hierroom.agents.evaluation import Score, evaluate
from hierroom.runs.folder.weights import FOLDER, SHIPPED
from hierroom.support.cli import run
from hierroom.support.files import write_atomically
from hierroom.support.tables import markdown_table

HEAD = """# Agents that ship with hierroom

- **What they are**: recurrent PPO agents of 64 hidden units that escape from EscapeRooms of one goal graph, on grids
  of 19 cells with at most 1000 steps. `hierroom.load("c")` loads one, `python -m hierroom watch c` shows it. The
  licence is the package's.
- **Data**: levels that the package generates, and no other data. Trained by `python -m benchmarks.weights`, seed 0:
  presets `default` (a to g) and `learned` (learned-g); `hierroom.load(name).config` holds their settings.
- **What they are given that they do not see**: the depth-first meta-controller of a to g reads the exact state, so
  their goals can always be reached. Each controller gets a memory of where its goal, doors and unexplored cells are
  (`hierroom.load(name).config.agents`). The controller's own view is 7 x 7 cells. The meta-controller of learned-g
  sees which goals came into view or were achieved.
- **Limits**: other graphs, grids and time limits than those they were trained on, and people's own mazes, are not
  covered by these numbers. They are for research and teaching.

Success and length are of 1000 episodes on levels that training never used, with 95% intervals (`python -m
benchmarks.model_card`):

"""


@dataclass(frozen=True)
class Options:
    """Evaluate the agents that ship, and write their card.

    Args:
        episodes: of each agent, with actions that are sampled and with greedy ones.
        out: the card.
    """

    episodes: int = 1000
    out: Path = FOLDER / "README.md"


def card(episodes: int) -> str:
    """Return the card."""
    rows = []
    for name in SHIPPED:
        agent = hierroom.load(name)
        sampled, greedy = (_score(replace(agent, is_greedy=is_greedy), episodes) for is_greedy in (False, True))
        length = f"{sampled.length:.1f}"
        rows.append([name, f"{agent.steps:,}", _success(sampled), length, _success(greedy)])
    return HEAD + markdown_table(["agent", "training steps", "success", "length", "success, greedy"], rows) + "\n"


def _score(agent: hierroom.TrainedAgent, episodes: int) -> Score:
    return evaluate(agent.pair(100, seed=1), agent.turns(100, seed=1), episodes)


def _success(score: Score) -> str:
    low, high = score.success_interval
    return f"{score.success_rate:.1%} [{low:.1%}, {high:.1%}]"


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    write_atomically(options.out, card(options.episodes).encode())
    print(f"the card is in {options.out}")
    return 0


if __name__ == "__main__":
    run(main)
