"""The whole of Algorithm 1 of the paper in one file: a meta-controller and a controller, both learned by recurrent PPO.

python single_file.py                     # the meta-controller learns to choose goals, the controller to reach them
python single_file.py --meta fixed-dfs    # goals along a depth-first path; the controller alone learns

For those who want to change everything: only the environment is imported, and all that learns stands here, in plain
torch, from top to bottom. The package computes the same with compiled kernels, faster; `hierroom/learners/ppo.py` lists
the points of the algorithm and their sources.
"""

from __future__ import annotations

import argparse
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields

import numpy as np
import torch
from torch import Tensor, nn
from torch.distributions import Categorical

from hierroom.agents.features import Features
from hierroom.cli import run
from hierroom.controller import Observation
from hierroom.env_config import EnvConfig
from hierroom.errors import InputError
from hierroom.goals import N_GOALS
from hierroom.meta import choose_goals, make_meta
from hierroom.options import CONTROLLER, META, Transition
from hierroom.turns import N_META_ACTIONS, Turns


@dataclass(frozen=True)
class PPO:
    """Hyperparameters of one agent."""

    gamma: float  # discount of a primitive step; a turn of k steps is discounted by gamma ** k
    sequence_length: int  # T turns of one environment, through which gradients are propagated back
    sequences: int  # M of them make an update
    min_advantage_std: float  # advantages are divided by their deviation, or by this, so that noise is not amplified
    gae_lambda: float = 0.95
    learning_rate: float = 1e-3  # falls linearly
    final_learning_rate: float = 1e-4
    epochs: int = 4
    minibatches: int = 4
    clip: float = 0.2
    value_weight: float = 1.0
    entropy_weight: float = 0.01
    max_gradient_norm: float = 0.5
    hidden_size: int = 64


@dataclass(frozen=True)
class Settings:
    """What the command line sets."""

    meta: str = "learned"  # or fixed-dfs, random, oracle
    graph: str = "c"
    steps: int = 400_000
    seed: int = 0
    num_envs: int = 64
    episodes: int = 1000


CONTROLLER_PPO = PPO(gamma=0.95, sequence_length=32, sequences=64, min_advantage_std=0.1)
# A turn is an option, so there are few: the exit has to count hundreds of steps before it, as long as they take so long.
META_PPO = PPO(gamma=0.998, sequence_length=8, sequences=32, min_advantage_std=0.05)

CONTROLLER_FEATURES = Features(
    (
        *("view", "goal", "goal-in-view", "goal-place", "direction", "keys", "previous-action"),
        *("doorway-places", "frontier-places"),
    ),
    n_actions=5,
)
META_FEATURES = Features(("goal-status", "goal-outcome"), n_actions=5, agent=META)


def make_turns(settings: Settings, num_envs: int, seed: int) -> Turns:
    """N environments and the two agents' turns in them."""
    if settings.meta == "learned":  # it has to find out which goals can be reached, and gives up after 50 steps
        config = EnvConfig(settings.graph, goal_mask="existing", subgoal_horizon=50, reward="intrinsic")
    else:
        config = EnvConfig(settings.graph, reward="intrinsic")
    return Turns(config, num_envs, seed=seed, memories=CONTROLLER_FEATURES.memories)


class Encoder(nn.Module):
    """[..., K] whole numbers to [..., H]: ReLU of the sum of one learned row for the value of each."""

    def __init__(self, cardinalities: tuple[int, ...], hidden_size: int) -> None:
        super().__init__()
        self.register_buffer("offsets", torch.tensor([0, *cardinalities[:-1]]).cumsum(0))
        self.table = nn.EmbeddingBag(sum(cardinalities), hidden_size, mode="sum")
        self.bias = nn.Parameter(torch.zeros(hidden_size))
        nn.init.orthogonal_(self.table.weight, 2**0.5)

    def forward(self, features: Tensor) -> Tensor:
        rows = self.table((features + self.offsets).flatten(0, -2))
        return torch.relu(rows + self.bias).unflatten(0, features.shape[:-1])


class Memory(nn.Module):
    """An LSTM that forgets where an episode begins."""

    def __init__(self, input_size: int, hidden_size: int) -> None:
        super().__init__()
        self.cell = nn.LSTMCell(input_size, hidden_size)
        for name, parameter in self.cell.named_parameters():
            nn.init.orthogonal_(parameter) if name.startswith("weight") else nn.init.zeros_(parameter)

    def forward(self, inputs: Tensor, state: Tensor, begins: Tensor) -> tuple[Tensor, Tensor]:
        """Inputs [T, M, X], the state before them [M, 2 H], where an episode begins [T, M]: outputs and state."""
        outputs = []
        for x, keep in zip(inputs, (~begins).float().unsqueeze(-1), strict=True):
            hidden, cell = self.cell(x, (state * keep).chunk(2, dim=-1))
            state = torch.cat([hidden, cell], dim=-1)
            outputs.append(hidden)
        return torch.stack(outputs), state


def head(n_inputs: int, n_outputs: int, gain: float) -> nn.Linear:
    """A linear layer; with a small gain the first policy is nearly uniform."""
    layer = nn.Linear(n_inputs, n_outputs)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer


class ControllerNetwork(nn.Module):
    """Encoder, memory, and two heads: logits [T, M, A], values [T, M] and the state after them [M, S]."""

    def __init__(self, hidden_size: int) -> None:
        super().__init__()
        self.encoder = Encoder(CONTROLLER_FEATURES.cardinalities, hidden_size)
        self.memory = Memory(hidden_size, hidden_size)
        self.policy = head(hidden_size, CONTROLLER_FEATURES.n_actions, 0.01)
        self.value = head(hidden_size, 1, 1.0)
        self.state_size = 2 * hidden_size

    def forward(self, features: Tensor, state: Tensor, begins: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        hidden, state = self.memory(self.encoder(features), state, begins)
        return self.policy(hidden), self.value(hidden).squeeze(-1), state


class MetaNetwork(nn.Module):
    """The same for each of 7 parts of a level, six colours and the exit, each of which sees the mean of all besides.

    Colours are drawn anew for each episode; as they share weights, what is learned of one holds for all.
    """

    def __init__(self, hidden_size: int) -> None:
        super().__init__()
        of_goal = META_FEATURES.cardinalities[::N_GOALS]  # two features, with a number for each of 13 goals
        self.colours = Encoder((*of_goal, *of_goal), hidden_size)  # of key and door
        self.exit = Encoder(of_goal, hidden_size)
        self.memory = Memory(2 * hidden_size, hidden_size)
        self.colour_policy = head(2 * hidden_size, 2, 0.01)  # key and door
        self.exit_policy = head(hidden_size, 2, 0.01)  # exit and no goal
        self.value = head(hidden_size, 1, 1.0)
        self.state_size = 7 * 2 * hidden_size

    def forward(self, features: Tensor, state: Tensor, begins: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        by_goal = features.unflatten(-1, (-1, N_GOALS)).transpose(-1, -2)  # [T, M, 13, 2]
        keys, doors, exits = by_goal.split((6, 6, 1), dim=-2)
        parts = torch.cat([self.colours(torch.cat([keys, doors], dim=-1)), self.exit(exits)], dim=-2)  # [T, M, 7, H]
        parts = torch.cat([parts, parts.mean(-2, keepdim=True).expand_as(parts)], dim=-1)
        n = len(state)
        hidden, state = self.memory(parts.flatten(1, 2), state.reshape(7 * n, -1), begins.repeat_interleave(7, dim=1))
        hidden = hidden.unflatten(1, (n, 7))
        mean = hidden.mean(-2)
        colours = torch.cat([hidden[..., :6, :], mean.unsqueeze(-2).expand_as(hidden[..., :6, :])], dim=-1)
        logits = [self.colour_policy(colours).transpose(-1, -2).flatten(-2), self.exit_policy(hidden[..., 6, :])]
        return torch.cat(logits, dim=-1), self.value(mean).squeeze(-1), state.reshape(n, -1)


class Actor:
    """A network that acts; its recurrent states move at its own turns only, whatever happens in between."""

    def __init__(self, network: nn.Module, features: Features, num_envs: int) -> None:
        self.network, self.features = network, features
        self.states = torch.zeros(num_envs, network.state_size)

    @torch.no_grad()
    def look(self, observation: Observation) -> tuple[Tensor, Categorical, Tensor, Tensor]:
        """Features, policy, values and next states in the M environments of an observation."""
        features = torch.from_numpy(self.features.encode(observation))
        begins = torch.zeros(1, len(features), dtype=torch.bool)  # states are zeroed where an episode ends
        logits, values, states = self.network(features[None], self.states[observation.envs], begins)
        return features, masked(logits[0], torch.from_numpy(observation.masks)), values[0], states

    def act(self, observation: Observation) -> np.ndarray:
        """[M] actions."""
        _, policy, _, self.states[observation.envs] = self.look(observation)
        return policy.sample().numpy()

    def record(self, transition: Transition) -> None:
        """Take note of the turns that a primitive step ended."""
        self.states[transition.envs[transition.episode_ended]] = 0


def masked(logits: Tensor, masks: Tensor) -> Categorical:
    """The policy over legal actions."""
    return Categorical(logits=logits.masked_fill(~masks, -1e9), validate_args=False)


class Learner(Actor):
    """Learns by PPO from sequences of its own turns: primitive steps for the controller, options for the meta."""

    def __init__(self, network: nn.Module, features: Features, n_actions: int, num_envs: int, ppo: PPO) -> None:
        super().__init__(network, features, num_envs)
        self.ppo, self.progress = ppo, 0.0
        self.adam = torch.optim.Adam(network.parameters(), eps=1e-5)
        turn = np.dtype(
            [
                *[("features", np.uint8, len(features.cardinalities)), ("mask", bool, n_actions), ("action", np.int64)],
                *[(name, np.float32) for name in ("log_prob", "value", "reward", "elapsed", "final_value")],
                *[(name, bool) for name in ("terminated", "truncated", "episode_ended")],
            ]
        )
        # One turn more than a sequence has: its value is what the last turn is followed by.
        self.turns = np.zeros((num_envs, ppo.sequence_length + 1), turn)
        self.n_turns = np.zeros(num_envs, np.int64)
        self.first_states = self.states.clone()
        self.sequences: list[tuple[np.ndarray, Tensor]] = []

    def act(self, observation: Observation) -> np.ndarray:
        """[M] actions; before that it learns, if sequences enough are full."""
        envs = observation.envs
        features, policy, values, states = self.look(observation)
        full = self.n_turns[envs] == self.ppo.sequence_length
        self.turns["value"][envs[full], -1] = values[full]
        self.sequences += [(self.turns[env].copy(), self.first_states[env].clone()) for env in envs[full]]
        self.n_turns[envs[full]] = 0
        if len(self.sequences) >= self.ppo.sequences:
            self.learn()
            features, policy, values, states = self.look(observation)
        first = envs[self.n_turns[envs] == 0]
        self.first_states[first], self.states[envs] = self.states[first], states
        actions = policy.sample()
        self.store(
            envs,
            features=features,
            mask=observation.masks,
            action=actions,
            log_prob=policy.log_prob(actions),
            value=values,
        )
        return actions.numpy()

    def record(self, transition: Transition) -> None:
        """Store what came of the turns that a primitive step ended; those cut off are followed by what was seen last."""
        envs, cut = transition.envs, np.flatnonzero(transition.truncated)
        self.store(
            envs,
            reward=transition.rewards,
            elapsed=transition.elapsed,
            terminated=transition.terminated,
            truncated=transition.truncated,
            episode_ended=transition.episode_ended,
        )
        if len(cut):
            self.store(envs[cut], final_value=self.look(transition.last_observation(cut))[2])
        self.n_turns[envs] += 1
        super().record(transition)

    def store(self, envs: np.ndarray, **values) -> None:
        for name, of_envs in values.items():
            self.turns[name][envs, self.n_turns[envs]] = of_envs

    def advantages(self, turns: Mapping[str, Tensor]) -> Tensor:
        """[T, M] generalised advantages; a termination is followed by nothing, a truncation by its final value."""
        discounts = self.ppo.gamma ** turns["elapsed"]
        advantages = torch.zeros_like(turns["value"])
        for t in reversed(range(len(advantages) - 1)):
            following = torch.where(turns["truncated"][t], turns["final_value"][t], turns["value"][t + 1])
            delta = turns["reward"][t] + discounts[t] * ~turns["terminated"][t] * following - turns["value"][t]
            goes_on = ~(turns["terminated"][t] | turns["truncated"][t])
            advantages[t] = delta + discounts[t] * self.ppo.gae_lambda * goes_on * advantages[t + 1]
        return advantages[:-1]

    def learn(self) -> None:
        """Some epochs of the clipped surrogate loss on all full sequences."""
        ppo = self.ppo
        stored, states = np.stack([turns for turns, _ in self.sequences], axis=1), [s for _, s in self.sequences]
        turns = {name: torch.from_numpy(stored[name].copy()) for name in stored.dtype.names}  # [T + 1, M, ...]
        first_states = torch.stack(states)
        self.sequences.clear()
        advantages = self.advantages(turns)
        targets = advantages + turns["value"][:-1]
        begins = turns["episode_ended"].roll(1, dims=0)
        begins[0] = False
        for group in self.adam.param_groups:
            group["lr"] = ppo.learning_rate + self.progress * (ppo.final_learning_rate - ppo.learning_rate)
        for _ in range(ppo.epochs):
            for part in torch.randperm(len(first_states)).chunk(ppo.minibatches):
                data = {name: values[:-1, part] for name, values in turns.items()}
                logits, values, _ = self.network(data["features"], first_states[part], begins[:-1, part])
                policy, advantage = masked(logits, data["mask"]), advantages[:, part]
                advantage = (advantage - advantage.mean()) / advantage.std().clamp(min=ppo.min_advantage_std)
                ratio = (policy.log_prob(data["action"]) - data["log_prob"]).exp()
                clipped = ratio.clamp(1 - ppo.clip, 1 + ppo.clip)
                policy_loss = -torch.minimum(ratio * advantage, clipped * advantage).mean()
                value_loss = 0.5 * (values - targets[:, part]).square().mean()
                loss = policy_loss + ppo.value_weight * value_loss - ppo.entropy_weight * policy.entropy().mean()
                self.adam.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.network.parameters(), ppo.max_gradient_norm)
                self.adam.step()


class Scripted:
    """A meta-controller that learns nothing."""

    def __init__(self, name: str) -> None:
        self.meta = make_meta(name)

    def act(self, situation):
        return choose_goals(self.meta, situation)

    def record(self, transition: Transition) -> None:
        pass


def play(turns: Turns, agents: Mapping[str, Actor | Scripted]):
    """One primitive step in all environments; the meta-controller goes first, where its option has ended."""
    for name, agent in agents.items():
        due = turns.due(name)
        if len(due):
            observation = turns.observe(name, due)
            turns.act(name, observation, agent.act(observation))
    transitions = turns.advance()
    for name, agent in agents.items():
        agent.record(transitions[name])
    return transitions[CONTROLLER].step


def train(settings: Settings, report: Callable[[str], None] = print):
    torch.manual_seed(settings.seed)
    turns = make_turns(settings, settings.num_envs, settings.seed)
    turns.world.stagger_clocks()  # or all of the first episodes would be truncated together
    n = settings.num_envs
    agents = {
        META: Learner(MetaNetwork(64), META_FEATURES, N_META_ACTIONS, n, META_PPO)
        if settings.meta == "learned"
        else Scripted(settings.meta),
        CONTROLLER: Learner(ControllerNetwork(64), CONTROLLER_FEATURES, 5, n, CONTROLLER_PPO),
    }
    log, started = deque(maxlen=500), time.perf_counter()
    for steps in range(0, settings.steps, n):
        for a in agents.values():
            a.progress = steps / settings.steps
        step = play(turns, agents)
        ended = step.episode_ended
        log.extend(zip(step.terminated[ended], step.lengths[ended]))
        if steps % (n * 320) == 0 and log:
            s, l = np.mean(log, axis=0)
            report(f"{steps:>9,} {s:.1%} {l:.0f} {time.perf_counter() - started:.0f}s")
    return agents


def evaluate(settings, agents):
    n = 100
    turns = make_turns(settings, n, settings.seed + 10_000)
    players = {
        name: Actor(a.network, a.features, n) if isinstance(a, Learner) else a for name, a in agents.items()
    }
    played, results = np.zeros(n, int), []
    while (played < settings.episodes // n).any():
        step = play(turns, players)
        c = np.flatnonzero(step.episode_ended & (played < settings.episodes // n))
        played[c] += 1
        results += zip(step.terminated[c], step.lengths[c])
    return np.mean(results, axis=0)


def main():
    parser = argparse.ArgumentParser()
    for f in fields(Settings):
        parser.add_argument("--" + f.name, type=type(f.default), default=f.default)
    settings = Settings(**vars(parser.parse_args()))
    torch.set_num_threads(1)
    t = time.perf_counter()
    agents = train(settings)
    print("trained", time.perf_counter() - t)
    print("evaluated", evaluate(settings, agents), time.perf_counter() - t)


if __name__ == "__main__":
    main()
