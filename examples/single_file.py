"""After the paper's Algorithm 1, in one file: a meta-controller and a controller, which both learn by recurrent PPO.

python single_file.py                     # the meta-controller learns to choose goals, the controller to reach them
python single_file.py --meta fixed-dfs    # goals along a depth-first path; only the controller learns

For those who want to change everything: all that learns stands here, in plain torch, to be read from top to bottom. The
package does more, and faster; the list in `hierroom/learners/ppo.py` names the source of each point.
"""

from __future__ import annotations

import argparse
from collections import deque
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.distributions import Categorical

from hierroom.agents.features import Features
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.controller import Observation
from hierroom.goals import N_GOALS
from hierroom.meta import make_meta
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER, META, Step
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig, LevelsName
from hierroom.worlds.make import world_spec


@dataclass(frozen=True)
class PPO:
    """Hyperparameters of one agent."""

    gamma: float  # discount per primitive step: a turn of k steps is discounted by gamma ** k
    sequence_length: int  # T turns in one environment; gradients are propagated back through as many
    sequences: int  # M of them make an update
    min_advantage_std: float  # advantages are divided by their deviation, or by this, so that noise is not amplified
    gae_lambda: float = 0.95
    learning_rate: float = 1e-3  # falls linearly to a tenth
    epochs: int = 4
    minibatches: int = 4
    clip: float = 0.2
    value_weight: float = 1.0
    entropy_weight: float = 0.01
    max_gradient_norm: float = 0.5


CONTROLLER_PPO = PPO(gamma=0.95, sequence_length=32, sequences=64, min_advantage_std=0.1)
# Its turns are options, and few. The exit has to count hundreds of steps ahead: so many it takes at first.
META_PPO = PPO(gamma=0.998, sequence_length=8, sequences=32, min_advantage_std=0.05)
NUM_ENVS = 64  # to train in, side by side
H = 64  # hidden units of either network
WORLD = world_spec(EnvConfig())
SEEN = "view goal goal-in-view goal-place direction keys previous-action doorway-places frontier-places"
CONTROLLER_FEATURES = Features(WORLD, SEEN.split())
META_FEATURES = Features(WORLD, ("goal-status", "goal-outcome"), META)  # each a number below 4 for every goal


def make_turns(settings: argparse.Namespace, num_envs: int, levels: LevelsName) -> Turns:
    """N environments, and the turns that the two agents take in them."""
    # Who learns to choose can choose wrongly: any goal of the level, in reach or not, until 50 steps have passed.
    learned = {"goal_mask": "existing", "subgoal_horizon": 50} if settings.meta == "learned" else {}
    config = EnvConfig(settings.graph, reward="intrinsic", levels=levels, **learned)
    return Turns(config, num_envs, seed=settings.seed, memories=CONTROLLER_FEATURES.memories)


class ActorCritic(nn.Module):
    """One learned row for each value of each feature, ReLU of their sum, an LSTM, and two linear heads."""

    parts = 1  # LSTM states of an environment

    def __init__(self, cardinalities: tuple[int, ...], n_logits: int, head_inputs: int = H) -> None:
        super().__init__()
        self.register_buffer("offsets", torch.tensor([0, *cardinalities[:-1]]).cumsum(0))
        self.rows, self.bias = nn.EmbeddingBag(sum(cardinalities), H, mode="sum"), nn.Parameter(torch.zeros(H))
        self.cell, self.policy, self.value = nn.LSTMCell(H, H), nn.Linear(head_inputs, n_logits), nn.Linear(H, 1)
        gains = {"rows.weight": 2**0.5, "policy.weight": 0.01}  # at first the policy is nearly uniform
        for name, parameter in self.named_parameters():
            nn.init.orthogonal_(parameter, gains.get(name, 1.0)) if parameter.dim() > 1 else nn.init.zeros_(parameter)

    def remember(self, features: Tensor, state: Tensor, begins: Tensor) -> tuple[Tensor, Tensor]:
        """Return the LSTM's outputs [T, M, H] and last state [M, 2 H]; for the arguments see `forward`."""
        inputs, outputs = torch.relu(self.rows((features + self.offsets).flatten(0, 1)) + self.bias), []
        for x, keeps in zip(inputs.unflatten(0, begins.shape), (~begins).float().unsqueeze(-1), strict=True):
            hidden, cell = self.cell(x, (state * keeps).chunk(2, dim=-1))
            state = torch.cat([hidden, cell], dim=-1)
            outputs.append(hidden)
        return torch.stack(outputs), state

    def forward(self, features: Tensor, state: Tensor, begins: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Logits [T, M, A], values [T, M] and the state after T turns; it is forgotten where one begins an episode."""
        hidden, state = self.remember(features, state, begins)
        return self.policy(hidden), self.value(hidden).squeeze(-1), state


class MetaActorCritic(ActorCritic):
    """The same for pairs of goals, a state for each. They share weights: colours are drawn anew for each episode."""

    parts = 7
    pairs = torch.tensor([*([colour, 6 + colour] for colour in range(6)), [12, 13]])  # key and door; exit and no goal

    def forward(self, features: Tensor, state: Tensor, begins: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """See `ActorCritic.forward`."""
        n = len(state)
        by_goal = nn.functional.pad(features.unflatten(-1, (2, N_GOALS)), (0, 1), value=3)  # 3: only 'no goal' has it
        rows = by_goal[..., self.pairs].transpose(2, 3).reshape(len(begins), n * 7, 4)
        hidden, state = self.remember(rows, state.reshape(n * 7, -1), begins.repeat_interleave(7, dim=1))
        hidden = hidden.unflatten(1, (n, 7))  # [T, M, 7, H]
        mean = hidden.mean(2, keepdim=True)
        logits = self.policy(torch.cat([hidden, mean.expand_as(hidden)], dim=-1)).flatten(2)  # [T, M, 14], by pair
        return logits[..., self.pairs.flatten().argsort()], self.value(mean)[..., 0, 0], state.reshape(n, -1)


def masked(logits: Tensor, masks: Tensor) -> Categorical:
    """Return the policy over the legal actions."""
    return Categorical(logits=logits.masked_fill(~masks, -1e9), validate_args=False)


class Actor:
    """A network that acts in N environments. Its state moves at its own turns only, whatever happens in between."""

    def __init__(self, network: ActorCritic, features: Features, num_envs: int) -> None:
        self.network, self.features = network, features
        self.states = np.zeros((num_envs, network.parts * 2 * H), np.float32)  # zero where an episode begins

    @torch.no_grad()
    def look(self, observation: Observation) -> tuple[Tensor, Categorical, Tensor, Tensor]:
        """Features, policy, values and next states in M environments."""
        features, masks = torch.from_numpy(self.features.encode(observation)), torch.tensor(observation.masks)
        begins = torch.zeros(1, len(features), dtype=torch.bool)
        states = torch.from_numpy(self.states[observation.envs])
        logits, values, states = self.network(features[None], states, begins)
        return features, masked(logits[0], masks), values[0], states

    def act(self, observation: Observation) -> np.ndarray:
        """Return legal actions [M]."""
        _, policy, _, self.states[observation.envs] = self.look(observation)
        return policy.sample().numpy()

    def record(self, step: Step, turns: Turns) -> None:
        """Take note of its turns that a primitive step ended."""
        self.states[step.episode_ended] = 0


class Learner(Actor):
    """Learns by PPO from sequences of its own turns: the controller from steps, the meta-controller from options."""

    def __init__(self, network: ActorCritic, features: Features, num_envs: int, n_actions: int, ppo: PPO) -> None:
        super().__init__(network, features, num_envs)
        self.ppo, self.progress = ppo, 0.0
        self.adam = torch.optim.Adam(network.parameters(), eps=1e-5)
        turn = [("features", np.uint8, len(features.cardinalities)), ("mask", bool, n_actions), ("action", np.int64)]
        turn += [(name, np.float32) for name in ("log_prob", "value", "reward", "elapsed", "final_value")]
        turn += [(name, bool) for name in ("terminated", "truncated", "episode_ended")]
        # One turn more than is learned from: its value is the last one's next value.
        self.turns = np.zeros((num_envs, ppo.sequence_length + 1), turn)
        self.n_turns = np.zeros(num_envs, np.int64)  # finished in the sequence under way
        self.first_states = self.states.copy()  # before that sequence
        self.sequences: list[tuple[np.ndarray, np.ndarray]] = []

    def act(self, observation: Observation) -> np.ndarray:
        """Learn, if enough sequences are complete; return legal actions [M]."""
        envs = observation.envs
        features, policy, values, states = self.look(observation)
        complete = envs[self.n_turns[envs] == self.ppo.sequence_length]
        self.store(envs, value=values)
        self.sequences += [(self.turns[env].copy(), self.first_states[env].copy()) for env in complete]
        self.n_turns[complete] = 0
        if len(self.sequences) >= self.ppo.sequences:
            self.learn()
            features, policy, values, states = self.look(observation)
        first = envs[self.n_turns[envs] == 0]
        self.first_states[first], self.states[envs] = self.states[first], states
        actions = policy.sample()
        self.store(envs, features=features, mask=observation.masks, action=actions, value=values)
        self.store(envs, log_prob=policy.log_prob(actions))
        return actions.numpy()

    def record(self, step: Step, turns: Turns) -> None:
        """Store what came of its turns that a primitive step ended."""
        envs, rewards, elapsed, terminated, truncated = step.ended_turns(self.features.agent)
        self.store(envs, reward=rewards, elapsed=elapsed, terminated=terminated, truncated=truncated)
        self.store(envs, episode_ended=step.episode_ended[envs])
        if truncated.any():  # more would have come: the value of what was observed last, before a reset or next goal
            cut = envs[truncated]
            self.store(cut, final_value=self.look(turns.final_observation(self.features.agent, step, cut))[2])
        self.n_turns[envs] += 1
        super().record(step, turns)

    def store(self, envs: np.ndarray, **values: Any) -> None:
        """Write entries of the turns under way."""
        for name, of_envs in values.items():
            self.turns[name][envs, self.n_turns[envs]] = of_envs

    def advantages(self, turns: dict[str, Tensor]) -> Tensor:
        """Return generalised advantages [T, M] (Schulman et al. 2016); a turn is discounted by its length in steps."""
        advantages, discounts = torch.zeros_like(turns["value"]), self.ppo.gamma ** turns["elapsed"]
        for t in reversed(range(self.ppo.sequence_length)):
            terminated, truncated = turns["terminated"][t], turns["truncated"][t]
            next_value = torch.where(truncated, turns["final_value"][t], turns["value"][t + 1])
            delta = turns["reward"][t] + discounts[t] * ~terminated * next_value - turns["value"][t]
            advantages[t] = delta + discounts[t] * self.ppo.gae_lambda * ~(terminated | truncated) * advantages[t + 1]
        return advantages[:-1]

    def learn(self) -> None:
        """Learn from all complete sequences (Schulman et al. 2017), then forget them."""
        ppo, first_states = self.ppo, torch.from_numpy(np.stack([state for _, state in self.sequences]))  # [M, S]
        stored = np.stack([turns for turns, _ in self.sequences], axis=1)
        self.sequences.clear()
        turns = {name: torch.from_numpy(stored[name].copy()) for name in stored.dtype.names}  # [T + 1, M, ...]
        advantages = self.advantages(turns)
        targets = advantages + turns["value"][:-1]
        begins = torch.cat([torch.zeros(1, len(first_states), dtype=torch.bool), turns["episode_ended"][:-2]])
        self.adam.param_groups[0]["lr"] = ppo.learning_rate * (1 - 0.9 * self.progress)
        for part in (p for _ in range(ppo.epochs) for p in torch.randperm(len(first_states)).chunk(ppo.minibatches)):
            data, advantage = {name: entries[:-1, part] for name, entries in turns.items()}, advantages[:, part]
            logits, values, _ = self.network(data["features"], first_states[part], begins[:, part])
            policy = masked(logits, data["mask"])
            advantage = (advantage - advantage.mean()) / advantage.std().clamp(min=ppo.min_advantage_std)
            ratio = (policy.log_prob(data["action"]) - data["log_prob"]).exp()
            policy_loss = -torch.min(ratio * advantage, ratio.clamp(1 - ppo.clip, 1 + ppo.clip) * advantage).mean()
            value_loss = 0.5 * (values - targets[:, part]).square().mean()
            loss = policy_loss + ppo.value_weight * value_loss - ppo.entropy_weight * policy.entropy().mean()
            self.adam.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(self.network.parameters(), ppo.max_gradient_norm)
            self.adam.step()


def play(turns: Turns, agents: dict[str, Any]) -> Step:
    """One primitive step in every environment, the body of Algorithm 1."""
    for name, agent in agents.items():  # g <- pi_M(s), where an option has ended; then a <- pi_C({s, g})
        if len(due := turns.due(name)):
            observation = turns.observe(name, due)
            turns.act(name, observation, agent.act(observation))
    step = turns.step()  # s', f <- Env(a); r <- Critic(s', g); F <- F + f
    for agent in agents.values():
        agent.record(step, turns)  # the controller's (s, a, s', r), the meta-controller's (s_0, g, s', F)
    return step


def train(settings: argparse.Namespace) -> dict[str, Any]:
    """Both agents, the meta-controller first; prints how the last 500 episodes went."""
    if settings.steps < NUM_ENVS:
        raise InputError(f"steps must be at least {NUM_ENVS}, one in each environment, not {settings.steps}")
    torch.manual_seed(settings.seed)
    turns = make_turns(settings, NUM_ENVS, "training")
    turns.world.stagger_clocks()  # or all first episodes would be truncated at the same step
    network = ActorCritic(CONTROLLER_FEATURES.cardinalities, WORLD.actions.n)
    controller = Learner(network, CONTROLLER_FEATURES, NUM_ENVS, WORLD.actions.n, CONTROLLER_PPO)
    if settings.meta == "learned":
        meta = Learner(MetaActorCritic((4,) * 4, 2, 2 * H), META_FEATURES, NUM_ENVS, WORLD.goals.n_choices, META_PPO)
    else:
        meta = ScriptedAgent(make_meta(settings.meta))
    agents, episodes, started = {META: meta, CONTROLLER: controller}, deque(maxlen=500), perf_counter()
    for steps in range(NUM_ENVS, settings.steps + 1, NUM_ENVS):
        controller.progress = meta.progress = steps / settings.steps
        step = play(turns, agents)
        episodes.extend(zip(step.terminated[step.episode_ended], step.lengths[step.episode_ended], strict=True))
        if steps % (1000 * NUM_ENVS) == 0:
            success, length = np.mean(episodes, axis=0)
            print(f"{steps:>9,} steps {perf_counter() - started:5.0f} s  success {success:6.1%}  length {length:5.0f}")
    return agents


def evaluate(settings: argparse.Namespace, agents: dict[str, Any]) -> tuple[float, float]:
    """Success rate and mean length apart from training: the first two episodes of each of 500 environments."""
    turns = make_turns(settings, 500, "evaluation")
    left, results = np.full(500, 2), []
    actors = {name: Actor(a.network, a.features, 500) if isinstance(a, Learner) else a for name, a in agents.items()}
    while left.any():
        step = play(turns, actors)
        ended = step.episode_ended & (left > 0)
        results += zip(step.terminated[ended], step.lengths[ended], strict=True)
        left -= ended
    return tuple(np.mean(results, axis=0).tolist())


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0], usage=argparse.SUPPRESS)
    parser.add_argument("--meta", default="learned", help="who picks the goals: learned, fixed-dfs, random or oracle")
    parser.add_argument("--graph", default="c", help="the goal graph, a letter from a to g")
    parser.add_argument("--steps", type=int, default=600_000, help="primitive steps over all environments")
    parser.add_argument("--seed", type=int, default=0, help="fixes levels, weights and actions")
    settings = parser.parse_args()
    torch.set_num_threads(1)  # more gain nothing at these sizes
    success, length = evaluate(settings, train(settings))
    print(f"evaluated over 1000 episodes of other levels: success {success:.1%}, mean length {length:.1f}")
    return 0


if __name__ == "__main__":
    run(main)
