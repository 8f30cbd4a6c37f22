"""Speed of the learner without a world: turns per second, compiled against plain torch.

    python benchmarks/learner_speed.py

Observations are made-up: 62 features, 49 of them cells with 22 tiles of which every second is unseen. Each figure is
the median of the repeats, with the lowest and highest; the first repeat compiles and is left out.
"""

import argparse
import time

import numpy as np
import torch

from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.ppo import Learner
from hierroom.runs.folder.provenance import cpu_name

SPACE = AgentSpace((22,) * 49 + (4, 7, 50, 14, 14, 4) + (2,) * 6 + (6,), 5)
N_ENVS = 128


class PlainTorchNetwork(RecurrentActorCritic):
    """The same network under another name, so that the learner takes its path for users' networks."""


class Run:
    """A learner and a supply of made-up turns."""

    def __init__(self, network, sequence_length, threads):
        random = np.random.default_rng(0)
        cardinalities = np.array(SPACE.cardinalities)
        shape = N_ENVS, SPACE.n_features
        self.features = [
            (random.random(shape) * cardinalities * (random.random(shape) < 0.5)).astype(np.uint8) for _ in range(8)
        ]
        self.ends = [random.random(N_ENVS) < 0.02 for _ in range(8)]
        config = PPOConfig(sequence_length=sequence_length)
        self.learner = Learner(SPACE, N_ENVS, config, seed=0, network=network, threads=threads)

    def seconds(self):
        """Time of one rollout and update, in seconds per turn: acting, finishing, updating."""
        envs, masks = np.arange(N_ENVS), np.ones((N_ENVS, 5), bool)
        none, once = np.zeros(N_ENVS, bool), np.ones(N_ENVS, int)
        spent = np.zeros(3)
        turns = 0
        while not self.learner.ready:
            start = time.perf_counter()
            self.learner.act(envs, self.features[turns % 8], masks)
            acted = time.perf_counter()
            ends = self.ends[turns % 8]
            self.learner.finish(envs, ends.astype(float), once, ends, none, ends)
            spent += acted - start, time.perf_counter() - acted, 0
            turns += 1
        start = time.perf_counter()
        self.learner.bootstrap(envs, self.features[turns % 8])
        self.learner.update(0.0)
        spent[2] = time.perf_counter() - start
        return spent / (turns * N_ENVS)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=9)
    repeats = parser.parse_args().repeats
    torch.set_num_threads(1)
    print(f"{cpu_name()}, torch {torch.__version__}, {N_ENVS} environments, LSTM 64,")
    print(f"4 epochs x 4 minibatches, {repeats} repeats after 1 to warm up\n")
    print(f"{'path':9} {'threads':>7} {'T':>4} {'turns/s':>9} {'lowest':>9} {'highest':>9}    us: act finish update")
    for sequence_length in (128, 32):
        paths = {
            ("torch", 1): Run(PlainTorchNetwork, sequence_length, 1),
            ("compiled", 1): Run(None, sequence_length, 1),
            ("compiled", 2): Run(None, sequence_length, 2),
        }
        times = {path: [] for path in paths}
        for _ in range(repeats + 1):  # in turns, so that a busy moment of the machine hits all alike
            for path, run in paths.items():
                times[path].append(run.seconds())
        for (name, threads), rows in times.items():
            rows = np.array(rows[1:])
            speeds = 1 / rows.sum(1)
            split = " ".join(f"{1e6 * part:6.2f}" for part in np.median(rows, axis=0))
            print(
                f"{name:9} {threads:7} {sequence_length:4} {np.median(speeds):9.0f} {speeds.min():9.0f} "
                f"{speeds.max():9.0f}    {split}"
            )


if __name__ == "__main__":
    main()
