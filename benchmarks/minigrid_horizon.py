"""The effective horizon of MiniGrid levels, next to the published values.

    python -m benchmarks.minigrid_horizon

The settings are those of BRIDGE (Laidlaw, Russell and Dragan, Bridging RL Theory and Practice with the Effective
Horizon, 2023). The level is that of seed 0, with actions 0 to 5, without "done". The mission gives 1 at any time; the
horizon is 100 steps. BRIDGE used MiniGrid 2.2. Its table of all MDPs is on Zenodo (record 8226192); the one level whose
numbers stand in the authors' repository, github.com/cassidylaidlaw/effective-horizon, is MiniGrid-KeyCorridorS3R1-v0.

In the table, k is the least for which the MDP is k-QVI-solvable, W the effective planning window, and bound that on the
effective horizon by theorem 5.4. H_1 and H_2 are by GORP's exact probability of success; what is published of H_1 is an
upper bound. samples is T^2 A^k m_k, the lesser for k = 1 and 2; random is the random policy's success; for least d see
`covering_length`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import minigrid  # noqa: F401 - it registers its environments
import tyro
from rich.console import Console
from rich.progress import track

from benchmarks.measures.covering import covering_length
from benchmarks.measures.effective_horizon import effective_horizon, effective_planning_window, minimum_k
from benchmarks.measures.gorp import Gorp
from benchmarks.measures.mdp import enumerate_env
from benchmarks.result_table import ResultTable

PUBLISHED = {
    "MiniGrid-KeyCorridorS3R1-v0": {
        "states": "169",
        "k": "1",
        "W": "15",
        "bound": "16.00",
        "H_1": "≤ 4.07",
        "least d": "3.625e-07",
    },
}
"""From data/mdps/MiniGrid-KeyCorridorS3R1-v0/, consolidated_analyzed.json and consolidated_gorp_bounds.json."""
LEVELS = (
    "MiniGrid-Empty-5x5-v0",
    "MiniGrid-Empty-6x6-v0",
    "MiniGrid-Empty-8x8-v0",
    "MiniGrid-DoorKey-5x5-v0",
    "MiniGrid-DoorKey-6x6-v0",
    "MiniGrid-KeyCorridorS3R1-v0",
    "MiniGrid-SimpleCrossingS9N1-v0",
    "MiniGrid-LavaCrossingS9N1-v0",
    "MiniGrid-MultiRoom-N2-S4-v0",
    "MiniGrid-Unlock-v0",
)
BRIDGE_HORIZON = 100
HEADINGS = ("states", "steps", "k", "W", "bound", "H_1", "H_2", "samples", "random", "least d")


@dataclass(frozen=True)
class Options:
    """Compute the effective horizon of MiniGrid levels.

    Args:
        levels: ids of environments.
        horizon: steps of an episode.
        out: a file that the table is written to as CSV.
    """

    levels: tuple[str, ...] = LEVELS
    horizon: int = BRIDGE_HORIZON
    out: Path | None = None


def state(env: gymnasium.Env) -> tuple:
    level: Any = env.unwrapped
    held = None if level.carrying is None else level.carrying.encode()
    return tuple(map(int, level.agent_pos)), int(level.agent_dir), level.grid.encode().tobytes(), held


def row(name: str, horizon: int) -> dict[str, str]:
    mdp = enumerate_env(gymnasium.make(name), state, actions=range(6), reward=lambda earned: float(earned > 0))
    bound = effective_horizon(mdp, horizon)
    first, second = (Gorp(mdp, horizon, k).rollouts() for k in (1, 2))
    return {
        "states": str(mdp.n_states),
        "steps": str(mdp.shortest_solution()),
        "k": str(minimum_k(mdp, horizon)),
        "W": str(effective_planning_window(mdp, horizon)),
        "bound": f"{bound.value:.2f}",
        "H_1": f"{first.effective_horizon:.2f}",
        "H_2": f"{second.effective_horizon:.2f}",
        "samples": f"{min(first.samples, second.samples):.2e}",
        "random": f"{mdp.random_success(horizon):.3g}",
        "least d": f"{covering_length(mdp, horizon).occupancy:.3e}",
    }


def main(options: Options) -> None:
    rows = []
    for name in track(options.levels, "measuring", console=Console(stderr=True), transient=True):
        measured, published = row(name, options.horizon), PUBLISHED.get(name, {})
        level = name.removeprefix("MiniGrid-").removesuffix("-v0")
        rows.append((level, *(measured[heading] for heading in HEADINGS)))
        if published and options.horizon == BRIDGE_HORIZON:
            rows.append(("the same, published", *(published.get(heading, "") for heading in HEADINGS)))
    ResultTable(("level", *HEADINGS), tuple(rows)).publish(options.out)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
