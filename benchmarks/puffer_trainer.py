"""PufferLib's trainer on EscapeRooms, as a peer for `train_speed`.

Needs pufferlib 3.0.0, which pins older versions of numpy and gymnasium, so install it without its dependencies:
``pip install --no-deps pufferlib==3.0.0 gym==0.23`` and whatever else its import asks for. Its setup downloads C
libraries for its own games.
"""

from __future__ import annotations

from collections.abc import Callable

import gymnasium
import numpy as np
import pufferlib.models
import pufferlib.pufferl
from gymnasium.vector import AutoresetMode

HIDDEN = 64
LEARNING = {
    "seed": 0,
    "torch_deterministic": True,
    "cpu_offload": False,
    "device": "cpu",
    "optimizer": "adam",
    "anneal_lr": True,
    "precision": "float32",
    "total_timesteps": 10**9,
    "learning_rate": 0.001,
    "gamma": 0.99,
    "gae_lambda": 0.95,
    "clip_coef": 0.2,
    "vf_coef": 0.5,
    "vf_clip_coef": 0.2,
    "max_grad_norm": 0.5,
    "ent_coef": 0.01,
    "adam_beta1": 0.9,
    "adam_beta2": 0.999,
    "adam_eps": 1e-8,
    "compile": False,
    "vtrace_rho_clip": 1.0,
    "vtrace_c_clip": 1.0,
    "prio_alpha": 0.8,
    "prio_beta0": 0.2,
    "use_rnn": True,
    "checkpoint_interval": 10**9,
    "env": "EscapeRoom",
}
"""Their settings of these names. None of them changes the work of an update."""


class PufferRooms(pufferlib.PufferEnv):
    """EscapeRooms as one of PufferLib's native environments, which step all their agents at once."""

    def __init__(self, graph: str, num_envs: int):
        mode = AutoresetMode.SAME_STEP
        self.envs = gymnasium.make_vec(f"hierroom/EscapeRoom-{graph}-v0", num_envs, autoreset_mode=mode, copy=False)
        view = self.envs.single_observation_space["observation"]
        self.single_observation_space = gymnasium.spaces.Box(0, 255, (int(np.prod(view.shape)),), np.uint8)
        self.single_action_space = self.envs.single_action_space
        self.num_agents = self.agents_per_batch = num_envs
        super().__init__()

    def reset(self, seed=None):
        """Begin all episodes."""
        self.observations[:] = self.envs.reset(seed=seed)[0]["observation"].reshape(self.num_agents, -1)
        return self.observations, []

    def step(self, actions):
        """Step all environments and write the results into PufferLib's arrays."""
        observations, self.rewards[:], self.terminals[:], self.truncations[:], _ = self.envs.step(actions)
        self.observations[:] = observations["observation"].reshape(self.num_agents, -1)
        return self.observations, self.rewards, self.terminals, self.truncations, []

    def close(self):
        """Close the environments."""
        self.envs.close()


class QuietTrainer(pufferlib.pufferl.PuffeRL):
    """Their trainer without the table that it prints four times a second."""

    def print_dashboard(self, *_, **__):
        """Print nothing."""


def pufferlib_update(graph: str, num_envs: int, length: int, epochs: int, minibatches: int) -> Callable[[], None]:
    """Return a function that collects a rollout and learns from it, as PufferLib's trainer does."""
    env = PufferRooms(graph, num_envs)
    policy = pufferlib.models.LSTMWrapper(env, pufferlib.models.Default(env, HIDDEN), HIDDEN, HIDDEN)
    batch = num_envs * length
    sizes = {"batch_size": batch, "minibatch_size": batch // minibatches, "max_minibatch_size": batch}
    trainer = QuietTrainer(LEARNING | sizes | {"bptt_horizon": length, "update_epochs": epochs}, env, policy)
    trainer.utilization.stop()  # a thread that reads the load for the table, and would keep the process alive

    def update() -> None:
        trainer.evaluate()
        trainer.train()

    return update
