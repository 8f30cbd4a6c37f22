"""Recurrent PPO for any agent that acts in turns.

This list describes the implementation point by point with its sources. "37 details" is Huang et al., The 37
Implementation Details of Proximal Policy Optimization (2022); "Andrychowicz" is What Matters in On-Policy Reinforcement
Learning (2021).

1.  The clipped surrogate objective, value loss and entropy bonus form one loss (Schulman et al. 2017, equation 9) for
    several epochs of minibatches on each batch. `torch_backend.ppo_loss`.
2.  GAE estimates advantages (Schulman et al. 2016), once per update; the value target is the advantage plus the old
    value. `gae.generalized_advantages`.
3.  A turn of k primitive steps is discounted by ``gamma ** k`` (options: Sutton, Precup & Singh 1999).
4.  A truncated return, unlike a terminated one, bootstraps from V of its final observation (Pardo et al. 2018), which
    is computed from the recurrent state after the turn. A full sequence that continues bootstraps from V of the next
    observation; the next turn provides it, or before an update `Learner.bootstrap`.
5.  An achieved subgoal ends the return and its advantage estimate but not the episode, so the recurrent state remains.
6.  A sequence has T consecutive turns of one agent in one environment; turns of other agents in between do not matter.
    Nothing is padded.
7.  A sequence is replayed from the recurrent state stored at its first turn, with resets where episodes begin. Before
    the first gradient step this gives exactly the probabilities with which the actions were sampled (37 details, LSTM
    2-5; Kapturowski et al. 2019 on stored states), except in point 8. For later minibatches that state is stale.
8.  The first action after an update uses the new weights, because `act` is not called between the last `finish` and
    `update`. An agent that fills all its sequences together, as the controller does, thus learns from turns of one
    policy. Other agents began some sequences before the last update. A batch with such sequences gets new
    log-probabilities, values and recurrent states before advantages are estimated. Ratios then begin at 1, up to
    rounding. The clipped term is multiplied by min(1, p / q), with p the probability of the action when the update
    starts and q when it was sampled. (The decoupled objective of Hilton, Cobbe & Schulman 2022 has p / q; truncation is
    as in V-trace, Espeholt et al. 2018.) The states before the first and after the last turn of such a sequence remain
    from older weights, as do the bootstrap values there and of truncated turns. `Learner._renewed`.
9.  Minibatches consist of whole sequences in a new order every epoch (37 details, LSTM 4); without memory, of turns.
10. The softmax and its entropy are taken over the legal actions (Huang & Ontanon 2020). In arrays numbers are
    independent; real ones are normal (37 details, continuous 1 to 4), stored as drawn and clipped for the environment.
11. Advantages are normalised per minibatch (37 details, 7) by the population standard deviation, which has a lower
    bound so that noise is not amplified (`PPOConfig.min_advantage_std`).
12. The value loss is half the mean squared error and is not clipped (Andrychowicz, 3.4, advises against clipping it).
13. Weights start orthogonal, with gain sqrt 2, 0.01 for the policy head and 1 for the value head and the LSTM; biases
    start at 0 (37 details, 2 and LSTM 1). `networks.RecurrentActorCritic`.
14. One Adam optimiser updates all parameters, with epsilon 1e-5 (37 details, 3) and a constant or linearly annealed
    learning rate (37 details, 4).
15. The norm of the gradient of all parameters together is clipped to 0.5 (37 details, 11).
16. Policy and value function share the encoder and the recurrent core (37 details, 13), and without memory nothing.
17. Discrete actions are sampled by inverse transform with uniforms from the learner's generator; weights and shuffles
    have other generators. No global random state is read or written.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np
import torch
from numba.core import config as numba_config
from numpy.typing import NDArray
from torch import nn

from hierroom.learners.config import PPOConfig
from hierroom.learners.distributions import distribution_of
from hierroom.learners.fused.backend import FusedBackend, can_fuse
from hierroom.learners.gae import generalized_advantages
from hierroom.learners.health import check_batch, check_start, check_update
from hierroom.learners.learner_state import check_learner_state, weights_schema
from hierroom.learners.networks.actor_critic import AgentSpace, PolicyNetwork, RecurrentActorCritic
from hierroom.learners.networks.initial_weights import seeded_weights
from hierroom.learners.networks.input_layer import InputLayer
from hierroom.learners.policy import Policy
from hierroom.learners.return_scale import ReturnScale
from hierroom.learners.rollout import Batch, Rollout
from hierroom.learners.torch_backend import STATISTICS, TorchBackend
from hierroom.support.errors import InputError

UPDATE_STATISTICS = (*STATISTICS, "explained_variance", "learning_rate", "turns")
"""The keys that `Learner.update` returns: means over the minibatches, then three numbers of the whole update."""


class Learner:
    """Trains one agent in N environments on the agent's own turns.

    A turn begins with `act` and ends with `finish`; each call may concern any subset of the environments. When `ready`,
    call `bootstrap` and `update` before the next `act`.
    """

    def __init__(
        self,
        space: AgentSpace,
        num_envs: int,
        config: PPOConfig,
        *,
        seed: int,  # seed of the weights, actions and shuffles
        device: str = "cpu",  # torch device
        threads: int = 1,  # threads of the compiled kernels; they do not change the result
        network: Callable[[AgentSpace, int], nn.Module] | None = None,  # builds a `PolicyNetwork` of a hidden size
    ) -> None:
        self.space = space
        self.config = config
        self.num_envs = num_envs
        self.sequences_per_update = config.sequences_per_update or num_envs
        action_seed, shuffle_seed, weight_seed = np.random.SeedSequence(seed).spawn(3)
        self._action_random = np.random.default_rng(action_seed)
        self._shuffle_random = np.random.default_rng(shuffle_seed)
        with seeded_weights(weight_seed):
            self.network = (network or RecurrentActorCritic)(space, config.hidden_size)
        if not isinstance(self.network, PolicyNetwork):
            raise InputError(f"{type(self.network).__name__} lacks initial_state, step or sequence: see PolicyNetwork")
        check_start(self.network)
        encoder = getattr(self.network, "encoder", None)
        self._inputs = encoder if isinstance(encoder, InputLayer) else None
        self.outside: tuple[int, float] | None = None  # the first number that left its bounds, after its array's column
        self._returns = ReturnScale(num_envs, config.gamma) if config.scale_returns else None
        if self._returns is not None:
            self.network.return_scale = self._returns.scale  # so that it is saved and exported with the weights
        self._device = torch.device(device)
        is_interpreted = getattr(numba_config, "DISABLE_JIT", False)  # then the kernels would be too slow
        self._distribution = distribution_of(space)
        if can_fuse(self.network, space) and self._device.type == "cpu" and not is_interpreted:
            self._backend = FusedBackend(self.network, config, threads)
        else:
            self._backend = TorchBackend(self.network, config, device, space)
        self._states = self._backend.initial_states(num_envs)  # [N, S]
        # A custom network may remember, although the config asks for none.
        self._takes_single_turns = config.memory == "none" and self._states.shape[1] == 0
        parts = self.sequences_per_update * (config.sequence_length if self._takes_single_turns else 1)
        if parts < config.minibatches:
            each = "turn" if self._takes_single_turns else "sequence"
            raise InputError(f"each of the {config.minibatches} minibatches needs a {each}; there are {parts}")
        self._starts_episode = np.ones(num_envs, bool)
        # With one full sequence too few for an update, a single `finish` can still fill one for each environment.
        capacity = self.sequences_per_update + num_envs
        sizes = space.n_features, space.n_masked, self._states.shape[1]
        self._rollout = Rollout(num_envs, config.sequence_length, capacity, *sizes, self._distribution.zeros())

    @property
    def ready(self) -> bool:
        """Return whether there are enough full sequences for an `update`."""
        return len(self._rollout.full) >= self.sequences_per_update

    @property
    def has_begun(self) -> NDArray[np.bool_]:
        """Flags [N] of environments in the middle of a turn."""
        return self._rollout.is_open

    @property
    def n_rollout_bytes(self) -> int:
        """Memory of the stored turns in bytes, which is constant."""
        return sum(array.nbytes for array in vars(self._rollout.slots).values())

    def act(self, envs: NDArray[np.integer], features: NDArray[np.uint8], masks: NDArray[np.bool_]) -> NDArray:
        """Begin a turn: sample legal actions [M, ...], store the turns and update the recurrent states.

        The environments [M] must be distinct, without open turns; M may be 0. Features are [M, K], each below its
        cardinality, and masks [M, A], with at least one legal action per environment; [M, 0] if actions are arrays.
        """
        self.space.check_features(envs, features)
        self.space.check_masks(envs, masks)
        if self._rollout.is_open[envs].any():
            raise RuntimeError("act() was called before the environment's last turn had finished")
        if len(envs) == 0:
            return self._distribution.zeros(0)
        resets = self._starts_episode[envs]
        states = self._states[envs]
        if resets.any():
            states[resets] = self._backend.initial_states(1)  # a custom network may learn it
        logits, values, self._states[envs] = self._backend.step(features, states)
        noise = self._distribution.noise(self._action_random, len(envs))
        actions, log_probs = self._distribution.sample(logits, masks, noise)
        turn = {"resets": resets, "features": features, "masks": masks, "actions": actions, "log_probs": log_probs}
        self._rollout.begin(envs, states, values, **turn)
        self._starts_episode[envs] = False
        return actions

    def finish(
        self,
        envs: NDArray[np.integer],  # [M]
        rewards: NDArray[np.floating],  # [M]
        elapsed: NDArray[np.integer],  # [M] primitive steps of the turn, at least 1
        terminated: NDArray[np.bool_],  # [M] whether the return ends here, at the exit or the rewarded subgoal
        truncated: NDArray[np.bool_],  # [M] whether a time limit cuts the return off here
        episode_ended: NDArray[np.bool_],  # [M] whether the next turn starts from the initial recurrent state
        last_features: NDArray[np.uint8] | None = None,  # [C, K] the final observations of C turns
    ) -> None:
        """End open turns; ``last_features`` bootstrap the C returns that are truncated and not terminated."""
        if not self._rollout.is_open[envs].all():
            raise RuntimeError("finish() was called for an environment in which no turn has begun")
        if (episode_ended & ~(terminated | truncated)).any():
            raise InputError("an episode that ended must be terminated or truncated")
        next_values, cut = np.zeros(len(envs), np.float32), np.flatnonzero(truncated & ~terminated)
        if len(cut):
            if last_features is None:
                raise InputError(f"last_features must hold {len(cut)} rows, one per truncated turn, not None")
            self.space.check_features(envs[cut], last_features)
            next_values[cut] = self._backend.step(last_features, self._states[envs[cut]])[1]
        self._rollout.finish(envs, rewards, elapsed, terminated, truncated, next_values)
        if self._returns is not None:
            self._returns.add(envs, rewards, elapsed, terminated | truncated)
        self._starts_episode[envs[episode_ended]] = True

    def bootstrap(self, envs: NDArray[np.integer], features: NDArray[np.uint8]) -> None:
        """Store values of current observations [M, K] for full sequences that await them, as `act` does too."""
        lacking = np.flatnonzero(self._rollout.awaiting[envs] >= 0)
        envs, features = envs[lacking], features[lacking]
        if len(envs):
            self.space.check_features(envs, features)
            self._rollout.bootstrap(envs, self._backend.step(features, self._states[envs])[1])

    def update(self, progress: float) -> dict[str, float]:
        """Learn from all full sequences, discard them, and return `UPDATE_STATISTICS`.

        ``progress``, the fraction of training that is done, anneals the learning rate. A `DivergenceError` says that a
        turn, a loss, the gradient, a new weight or its output is not finite or far too large.
        """
        if not self.ready:
            raise RuntimeError("update() was called before enough sequences were full; check `ready` first")
        if (self._rollout.awaiting >= 0).any():
            raise RuntimeError("update() was called before bootstrap() for the environments without an open turn")
        config = self.config
        taken = self._rollout.take()
        check_batch(taken)
        begins_scales = self._inputs is not None and not self._inputs.has_scales
        batch, importance_weights = self._renewed(self._scaled(taken))
        known = batch.rewards, batch.values, batch.next_values, batch.elapsed, batch.terminated, batch.truncated
        advantages = generalized_advantages(*known, gamma=config.gamma, gae_lambda=config.gae_lambda)
        target_variance = np.var(advantages + batch.values)
        explained = float(1 - np.var(advantages) / target_variance) if target_variance > 0 else 0.0
        if self._takes_single_turns:
            batch, advantages, importance_weights = batch.single_turns(advantages, importance_weights)
        orders = (self._shuffle_random.permutation(batch.rewards.shape[1]) for _ in range(config.epochs))
        minibatches = [part for order in orders for part in np.array_split(order, config.minibatches)]
        learning_rate = config.learning_rate_at(progress)
        means = self._backend.train(batch, advantages, importance_weights, minibatches, learning_rate)
        check_update(means, self.network.named_parameters(), self._backend, batch, learning_rate)
        if self._inputs is not None:
            if not begins_scales:  # else `_scaled` has learned them
                self._inputs.learn(batch.features)
            self.outside = self.outside or self._inputs.outside(batch.features)
        return {
            **dict(zip(STATISTICS, means.tolist(), strict=True)),
            "explained_variance": explained,
            "learning_rate": learning_rate,
            "turns": float(batch.rewards.size),
        }

    def _scaled(self, batch: Batch) -> Batch:
        """Return the batch with scaled rewards; it must be renewed if observations have had no scale yet."""
        if self._returns is not None:
            batch = replace(batch, rewards=self._returns.scaled(batch.rewards))
        if self._inputs is not None and not self._inputs.has_scales:
            self._inputs.learn(batch.features)
            batch = replace(batch, spans_update=np.ones_like(batch.spans_update))
        return batch

    def _renewed(self, batch: Batch) -> tuple[Batch, NDArray[np.float32]]:
        """Return the batch recomputed with current weights, and the turns' loss weights [T, M]: see point 8 above."""
        weights = np.ones_like(batch.log_probs)
        if not batch.spans_update.any():
            return batch, weights
        with torch.no_grad():
            arrays = batch.features, batch.initial_states, batch.resets
            inputs = (torch.from_numpy(array).to(self._device) for array in arrays)
            outputs = cast(PolicyNetwork, self.network).sequence(*inputs)
        logits, values = (output.cpu().numpy() for output in outputs)
        turns = (part.reshape(values.size, *part.shape[2:]) for part in (logits, batch.masks, batch.actions))
        log_probs = self._distribution.log_probs(*turns).reshape(values.shape)
        goes_on = ~(batch.terminated | batch.truncated)[:-1]
        next_values = batch.next_values.copy()
        next_values[:-1][goes_on] = values[1:][goes_on]
        weights = np.minimum(np.exp(log_probs - batch.log_probs), 1)
        return replace(batch, log_probs=log_probs, values=values, next_values=next_values), weights

    def policy(self, num_envs: int, *, seed: int) -> Policy:
        """Return a policy for evaluation that acts with the learner's current weights."""
        return Policy(self._backend.stepper(), self.space, num_envs, seed, self._returns and self._returns.scale)

    def state_dict(self) -> dict:
        """Return the complete state as tensors and plain types, so that a resumed run equals an uninterrupted one."""
        return {
            **(self._returns.state_dict() if self._returns else {}),
            "backend": self._backend.state_dict(),
            "rollout": self._rollout.state_dict(),
            "states": torch.from_numpy(self._states.copy()),
            "starts_episode": torch.from_numpy(self._starts_episode.copy()),
            "action_random": self._action_random.bit_generator.state,
            "shuffle_random": self._shuffle_random.bit_generator.state,
        }

    def take_weights(self, state: dict) -> None:
        """Load only the weights from another learner's `state_dict`; moments, turns and generators stay as they are."""
        weights_schema(self.network).check(state, "learner")
        self.network.load_state_dict(state["backend"]["network"])

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` returned for a learner with the same space, environments and config."""
        check_learner_state(state, self.state_dict(), self.network, self.space)
        self._backend.load_state_dict(state["backend"])
        if self._returns is not None:
            self._returns.load_state_dict(state)
        self._rollout.load_state_dict(state["rollout"])
        self._states[...] = state["states"].numpy()
        self._starts_episode[...] = state["starts_episode"].numpy()
        self._action_random.bit_generator.state = state["action_random"]
        self._shuffle_random.bit_generator.state = state["shuffle_random"]
