"""The learner's arithmetic in plain torch, for any network and device; the reference for the compiled kernels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from copy import copy, deepcopy
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from hierroom.learners.config import PPOConfig
from hierroom.learners.distributions import Categorical, distribution_of
from hierroom.learners.networks.actor_critic import AgentSpace, PolicyNetwork
from hierroom.learners.networks.initial_weights import plain_torch
from hierroom.learners.networks.input_layer import reads_pictures
from hierroom.learners.networks.scale import RunningScale
from hierroom.learners.rollout import Batch
from hierroom.support.errors import InputError, user_code

STATISTICS = ("policy_loss", "value_loss", "entropy", "approx_kl", "clip_fraction", "gradient_norm")
"""Names of the values that a backend's ``train`` averages over the minibatches of an update, in this order."""
_MOMENTS = {"means": "exp_avg", "squares": "exp_avg_sq"}  # names of Adam's moments in checkpoints, and in torch


class TorchBackend:
    """Forward passes, loss, gradients and Adam in torch, for a module that implements `PolicyNetwork`."""

    def __init__(self, network: nn.Module, config: PPOConfig, device: str, space: AgentSpace) -> None:
        self._n_actions, self._distribution = space.n_actions, distribution_of(space)
        self._module = network.to(device)
        self._network = cast(PolicyNetwork, network)
        self._config = config
        self._device = torch.device(device)
        # A fused step takes a third of the time; without pictures, compiled kernels train discrete actions.
        is_fused = (
            True if self._device.type == "cpu" and (space.kind != "discrete" or reads_pictures(network)) else None
        )
        rate, epsilon = config.learning_rate, config.adam_epsilon
        self._adam = torch.optim.Adam(network.parameters(), lr=rate, eps=epsilon, fused=is_fused)

    def initial_states(self, n: int) -> NDArray[np.float32]:
        """Return the recurrent states [n, S] at the start of an episode."""
        with torch.no_grad(), self._user_code():
            # Copy, because the result is written to, and may be one expanded row or the weights themselves.
            return self._network.initial_state(n).cpu().numpy().copy()

    def step(self, features: NDArray[np.uint8], states: NDArray[np.float32]) -> tuple[NDArray, NDArray, NDArray]:
        """Compute one turn: logits [M, A], values [M] and new states [M, S] from features [M, K] and states [M, S]."""
        with torch.no_grad(), self._user_code():
            # Copy, because a custom network may write to its inputs, and the arrays are kept for the update.
            outputs = self._network.step(self._tensor(features.copy()), self._tensor(states.copy()))
            # And these, because users keep the results, and a network may return its weights or a buffer.
            logits, values, new_states = (output.cpu().numpy().copy() for output in outputs)
        found, n = (logits.shape, values.shape, new_states.shape), len(features)
        self._require("logits, values and state of step", found, ((n, self._n_actions), (n,), states.shape))
        return logits, values, new_states

    def evaluate(self, features: NDArray[np.uint8], states: NDArray[np.float32]) -> tuple[NDArray, NDArray, NDArray]:
        """Compute a turn that is not learned from, with the network in evaluation mode."""
        modes = [(module, module.training) for module in self._module.modules()]
        self._module.eval()
        is_plain = not torch.is_autocast_enabled("cpu")
        try:
            with nullcontext() if is_plain else plain_torch():
                return self.step(features, states)
        finally:
            for module, is_training in modes:
                module.training = is_training

    def stepper(self) -> TorchBackend:
        """Return a backend for one policy: a copy of the network that shares the weights.

        Modes and other attributes of the copy belong to the policy, so several threads can act with the same weights. A
        network that cannot be copied is shared.
        """
        shared = (*self._module.parameters(), *(one for one in self._module.modules() if isinstance(one, RunningScale)))
        one, weights = copy(self), {id(part): part for part in shared}
        with suppress(Exception):  # a custom network may hold anything
            one._module = deepcopy(self._module, weights)
            one._network = cast(PolicyNetwork, one._module)
        return one

    def train(
        self,
        batch: Batch,  # M sequences of T turns
        advantages: NDArray[np.float32],  # [T, M] not normalised
        importance_weights: NDArray[np.float32],  # [T, M] factors of the normalised advantages
        minibatches: Iterable[NDArray[np.integer]],  # indices of each minibatch's sequences, 0 to M - 1
        learning_rate: float,  # Adam's step size
    ) -> NDArray[np.float64]:
        """Take one gradient step per minibatch; return the means [6] of `STATISTICS`."""
        for group in self._adam.param_groups:
            group["lr"] = learning_rate
        tensors = {name: self._tensor(array) for name, array in vars(batch).items()}
        advantage, weight = self._tensor(advantages), self._tensor(importance_weights)
        rows = [self._minibatch(tensors, advantage, weight, self._tensor(part)) for part in minibatches]
        return torch.stack(rows).mean(0).cpu().numpy().astype(np.float64)

    def _minibatch(self, data: dict[str, Tensor], advantages: Tensor, weights: Tensor, part: Tensor) -> Tensor:
        with self._user_code():
            logits, values = self._network.sequence(
                data["features"].index_select(1, part), data["initial_states"][part], data["resets"][:, part]
            )
        turns = data["masks"][:, part], data["actions"][:, part], data["log_probs"][:, part]
        found, wanted = (logits.shape, values.shape), ((*turns[2].shape, self._n_actions), turns[2].shape)
        self._require("logits and values of sequence", found, wanted)
        scores = normalized(advantages[:, part], self._config) * weights[:, part]
        targets = (advantages + data["values"])[:, part]
        loss, statistics = ppo_loss(logits, values, *turns, scores, targets, self._config, self._distribution)
        self._adam.zero_grad()
        loss.backward()
        for parameter in self._module.parameters():  # Adam would skip those without one, and count fewer steps
            if parameter.requires_grad and parameter.grad is None:
                parameter.grad = torch.zeros_like(parameter)
        norm = nn.utils.clip_grad_norm_(self._module.parameters(), self._config.max_gradient_norm)
        self._adam.step()
        return torch.stack([*statistics, norm.detach()])

    def _require(self, what: str, found: tuple[tuple[int, ...], ...], wanted: tuple[tuple[int, ...], ...]) -> None:
        if found != wanted:  # although its first turns were right: see `agents.networks.try_network`
            given, right = (", ".join(str(tuple(shape)) for shape in shapes) for shapes in (found, wanted))
            raise InputError(f"the network {type(self._module).__name__} gives {what} of shapes {given}, not {right}")

    @contextmanager
    def _user_code(self) -> Iterator[None]:
        is_plain = torch.get_default_device().type == "cpu"  # another default of the user is not for this network
        with user_code(f"the network {type(self._module).__name__}"), nullcontext() if is_plain else self._device:
            yield

    def _tensor(self, array: NDArray) -> Tensor:
        return torch.from_numpy(array).to(self._device)

    def state_dict(self) -> dict:
        """Return copies on the CPU in the format of `FusedBackend.state_dict`."""
        network = {name: tensor.detach().cpu().clone() for name, tensor in self._module.state_dict().items()}
        states = [(self._adam.state.get(p, {}), torch.zeros_like(p)) for p in self._module.parameters()]
        moments = {
            name: torch.cat([state.get(key, zeros).detach().cpu().ravel() for state, zeros in states])
            for name, key in _MOMENTS.items()
        }
        return {"network": network, **moments, "n_steps": max(int(state.get("step", 0)) for state, _ in states)}

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` returned."""
        self._module.load_state_dict(state["network"])
        self._adam.state.clear()
        if state["n_steps"] == 0:
            return
        parameters = list(self._module.parameters())
        sizes = [parameter.numel() for parameter in parameters]
        for name, key in _MOMENTS.items():
            for parameter, part in zip(parameters, state[name].split(sizes), strict=True):
                self._adam.state[parameter][key] = part.clone().view_as(parameter).to(parameter)  # also its type
        for parameter in parameters:
            self._adam.state[parameter]["step"] = torch.tensor(state["n_steps"], dtype=torch.float32, device="cpu")


def normalized(advantages: Tensor, config: PPOConfig) -> Tensor:
    """Scale advantages to mean 0 and population standard deviation 1; see `PPOConfig.min_advantage_std`."""
    if not config.normalize_advantages:
        return advantages
    deviation = advantages.std(correction=0).clamp(min=config.min_advantage_std)
    return (advantages - advantages.mean()) / deviation


def ppo_loss(
    logits: Tensor,  # [T, M, A] of all actions
    values: Tensor,  # [T, M] V
    masks: Tensor,  # [T, M, A] the legal actions
    actions: Tensor,  # [T, M, ...]
    log_probs: Tensor,  # [T, M] of the actions when they were taken; r is the ratio of new to old probability
    advantages: Tensor,  # [T, M] A, already normalised
    targets: Tensor,  # [T, M] the value targets G
    config: PPOConfig,  # the clip range :math:`\epsilon` and the weights
    distribution: Categorical,
) -> tuple[Tensor, list[Tensor]]:
    r"""Return the loss of Schulman et al. (2017), equations 7 and 9, and the first five of `STATISTICS`.

    .. math::
        L = \overline{-\min(r A, \mathrm{clip}(r, 1 - \epsilon, 1 + \epsilon) A)}
            + w_v \overline{\tfrac12 (V - G)^2} - w_e \overline{H}
    """
    log_policy, entropies = distribution.evaluate(logits, masks, actions)  # [T, M] each
    log_ratio = log_policy - log_probs
    ratio = log_ratio.exp()
    clipped = ratio.clamp(1 - config.clip, 1 + config.clip)
    policy_loss = -torch.minimum(ratio * advantages, clipped * advantages).mean()
    value_loss = 0.5 * (values - targets).square().mean()
    entropy = entropies.mean()
    loss = policy_loss + config.value_weight * value_loss - config.entropy_weight * entropy
    # Schulman's low-variance estimator of the KL divergence: the mean of (r - 1) - log r.
    approx_kl = (ratio - 1 - log_ratio).mean()
    clip_fraction = ((ratio - 1).abs() > config.clip).to(values.dtype).mean()
    return loss, [s.detach() for s in (policy_loss, value_loss, entropy, approx_kl, clip_fraction)]
