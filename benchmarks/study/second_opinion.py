"""sb3-contrib's RecurrentPPO in EscapeRooms with PPO+Bonus's rewards and inputs: is the flat learner of hierroom weak?

    python -m benchmarks.study.second_opinion

Each row of `benchmarks/results/second_opinion.csv` is a run of 600,000 steps: its settings, and the share of its last
100 episodes that reached the exit. ``as ours`` has our values of everything that both have. Rows that are lacking are
trained, one after the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pandas as pd
import tyro

import hierroom
from hierroom.runs.config.presets import find_preset
from hierroom.support.cli import run
from hierroom.support.tables import markdown_table

ROWS = Path(__file__).parents[1] / "results" / "second_opinion.csv"
GRAPHS = ("g", "keys-0-0-1-3-4-exit-4")
SETTINGS: Mapping[str, Mapping[str, Any]] = {
    "as ours": {},
    "16 minibatches": {"batch_size": 128},
    "learning rate 0.0003": {"learning_rate": 3e-4},
}
STEPS, SEEDS = 600_000, 1
ENVS, LAST = 64, 100


def train(graph: str, settings: Mapping[str, Any], seed: int) -> float:
    """Return the share of the last episodes that reached the exit."""
    import torch
    from sb3_contrib import RecurrentPPO
    from stable_baselines3.common.torch_layers import FlattenExtractor
    from stable_baselines3.common.vec_env import VecExtractDictObs

    class Inputs(FlattenExtractor):
        features_dim = property(lambda self: int(self._features_dim))  # torch.nn.LSTM refuses NumPy's numbers

    torch.set_num_threads(1)
    ppo = find_preset("default").ppo
    features = [name for name in find_preset("default").agents.features or () if not name.startswith("goal")]
    envs = gymnasium.make_vec("hierroom/EscapeRoom-v0", ENVS, graph=graph, meta="none", reward="bonus")
    envs = VecExtractDictObs(hierroom.sb3_view(hierroom.add_features(envs, features)), "features")  # one-hot in SB3
    settings = {
        **{"n_steps": ppo.sequence_length, "batch_size": ENVS * ppo.sequence_length // ppo.minibatches},
        **{"n_epochs": ppo.epochs, "learning_rate": ppo.learning_rate, "gamma": 0.98, "gae_lambda": ppo.gae_lambda},
        **{"ent_coef": ppo.entropy_weight, "clip_range": ppo.clip, "max_grad_norm": ppo.max_gradient_norm},
        **{"policy_kwargs": {"lstm_hidden_size": ppo.hidden_size, "features_extractor_class": Inputs}},
        **settings,
    }
    model = RecurrentPPO("MlpLstmPolicy", envs, seed=seed, device="cpu", **settings)
    successes = []

    def collect(local: Mapping[str, Any], _: Any) -> bool:
        ended = np.flatnonzero(local["dones"])
        successes.extend(bool(local["infos"][n]["is_success"]) for n in ended)
        return True

    model.learn(STEPS, callback=collect)
    return float(np.mean(successes[-LAST:]))


def main(graphs: tuple[str, ...] = GRAPHS) -> int:
    """Train what is lacking, and print the rows.

    Args:
        graphs: some of the goal graphs to train on, so that several processes share the work.
    """
    for seed, graph, name in product(range(SEEDS), graphs, SETTINGS):
        done = pd.read_csv(ROWS) if ROWS.exists() else pd.DataFrame(columns=["graph", "settings", "seed"])
        if not ((done.graph == graph) & (done.settings == name) & (done.seed == seed)).any():
            row = {"graph": graph, "settings": name, "seed": seed, "success": train(graph, SETTINGS[name], seed)}
            pd.DataFrame([row]).to_csv(ROWS, mode="a", header=not ROWS.exists(), index=False)
    rows = pd.read_csv(ROWS)
    print(markdown_table([*rows], [[*map(str, row)] for row in rows.itertuples(index=False)]))
    return 0


if __name__ == "__main__":
    run(lambda: tyro.cli(main, description=__doc__))
