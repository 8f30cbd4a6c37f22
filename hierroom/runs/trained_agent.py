"""A trained agent, ready to play anywhere."""

from __future__ import annotations

import os
from copy import deepcopy
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from hierroom.agents.acting import TrainedGoals, act
from hierroom.agents.features import actions_in, offered
from hierroom.agents.player import Pair
from hierroom.agents.ppo_agent import PPOAgent
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.goals import graph_specs
from hierroom.learners.networks.actor_critic import OneTurn
from hierroom.learners.networks.initial_weights import plain_torch
from hierroom.learners.policy import Policy
from hierroom.meta import MetaController, make_meta
from hierroom.runs.assembly import derived_seed, freeze, make_agents, make_turns
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.run_name import run_name
from hierroom.runs.config.unread_entries import warn_of_unread
from hierroom.runs.folder.provenance import misfits_explained
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.folder.user_code import require_trust
from hierroom.runs.folder.weights import SHIPPED, SUFFIX, SavedAgent, weights_file
from hierroom.support.errors import InputError, require_number, shown, user_code
from hierroom.turns.records import CONTROLLER, META
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import MOST_ENVS, EnvConfig
from hierroom.worlds.make import world_spec


@dataclass(frozen=True, eq=False, repr=False)
class TrainedAgent:
    """A trained meta-controller and controller, as `load` and `hierroom.train` return them.

    It plays with `hierroom.rollout`, or step by step with `act`, and does not learn.

    Examples:
        >>> agent = hierroom.load("a")
        >>> [episode.success for episode in hierroom.rollout(agent, episodes=3, seed=1)]
        [True, True, True]
        >>> agent.env(graph="b", size=11).names
        ('b',)
        >>> turns, player = agent.turns(num_envs=2), agent.pair(num_envs=2)
        >>> player.step(turns).option_ended.tolist()
        [False, False]
        >>> agent.require_world(hierroom.EnvConfig("b"))
        >>> agent.save("mine.safetensors")
        >>> hierroom.load("mine.safetensors").config.env.names
        ('a',)
    """

    config: TrainConfig  # the config of its training
    meta: PPOAgent | ScriptedAgent  # the meta-controller, or another one that replaces it
    controller: PPOAgent
    steps: int  # primitive steps it was trained for
    is_greedy: bool = False  # whether the controller takes its most probable action instead of drawing one
    has_other_meta: bool = False  # whether the meta-controller is not the config's
    path: Path | None = None  # the folder of the run or the file of its weights

    def __repr__(self) -> str:
        meta = type(self.meta.meta).__name__ if isinstance(self.meta, ScriptedAgent) else "learned"
        actions, path = "greedy" if self.is_greedy else "sampled", f", from {self.path}" if self.path else ""
        return f"<TrainedAgent {run_name(self.config)}, {self.steps:,} steps, meta {meta}, {actions} actions{path}>"

    @property
    def is_finished(self) -> bool:
        """Return whether training took all steps of the config; False after an interrupt or a callback's stop."""
        return self.steps >= self.config.steps

    @cached_property
    def network(self) -> OneTurn:
        """Return a copy of the controller's network, in evaluation mode, as a torch module for one turn.

        See `OneTurn` for its inputs and outputs. The features [N, K] are those that `hierroom.add_features` puts into
        observations: numbers from 0 to ``controller.features.cardinalities[k] - 1``. The agent does not use the copy,
        so you can move it, change it or train it.
        """
        with user_code("the network", "cannot be copied"), plain_torch():
            return OneTurn(deepcopy(self.controller.learner.network)).eval()

    def act(
        self,
        observations: Any,
        state: Policy | None = None,
        *,
        begins: ArrayLike = False,
        greedy: bool | None = None,
        seed: int = 0,
    ) -> tuple[Any, Any]:
        """Return actions for the observations of one environment or of many, and the state for the next call.

        First wrap the environment, of any API of hierroom, by ``hierroom.add_features(env, agent)``. Arguments are not
        changed, except that a state and the states after it share one random generator.

        Args:
            observations: as the API gives them: the dict of one agent (AEC), of both agents by name (parallel), of one
                environment (Gymnasium) or of N (vector). Actions that ``action_mask`` forbids are never returned.
            state: the state from the last call; None at first. After a turn of the controller, ``state.decision`` has
                its logits, probabilities and values.
            begins: whether an episode begins, so that the agent forgets the last one: True or False, or [N] bool. In
                every API, the ``length`` in the info is 0 then, and after a ``reset_mask`` its ``_length`` is True.
            greedy: whether the controller takes its most probable action instead of drawing one; None: as loaded.
            seed: determines the random draws if the state is None.

        Returns:
            The action (int for one environment, [N] int64 for N, a dict for both agents; arrays if actions are so), and
            the next state.

        Examples:
            >>> agent = hierroom.load("a")
            >>> env = gymnasium.make("hierroom/EscapeRoom-a-v0", meta=agent.meta_controller())
            >>> env = hierroom.add_features(env, agent)
            >>> observation, info = env.reset(seed=0)
            >>> state, terminated, truncated = None, False, False
            >>> while not (terminated or truncated):
            ...     action, state = agent.act(observation, state, begins=info["length"] == 0)
            ...     observation, reward, terminated, truncated, info = env.step(action)
            >>> info["success"]
            True
        """
        is_greedy = self.is_greedy if greedy is None else bool(greedy)
        return act(self.controller, observations, state, begins=begins, is_greedy=is_greedy, seed=seed)

    def env(self, **entries: Any) -> EnvConfig:
        """Return the `EnvConfig` of the training, with some entries changed.

        A new ``graph`` or ``layout`` drops the run's ``exclude``; else ``exclude`` leaves out further graphs.
        """
        names = [entry.name for entry in fields(EnvConfig)]
        for name in sorted(entries.keys() - names - {*self.config.entries}):
            near = get_close_matches(name, names, n=1)
            raise InputError(f"environments have no entry {name}{f'; is it {near[0]}?' if near else ''}")
        if refused := entries.keys() - names | entries.keys() & {"curriculum_stages", "drop_key", "reward"}:
            raise InputError(f"a trained agent cannot be played with another {', '.join(sorted(refused))}")
        own = replace(self.config.env, levels=None)  # without its levels, as training has its own
        besides = () if "graph" in entries or entries.get("layout") else graph_specs(own.exclude)
        changed = own.changed(**{**entries, "exclude": (*besides, *graph_specs(entries.get("exclude", ())))})
        changed.refuse_unread(entries)
        warn_of_unread(self.config, entries)
        return changed

    def turns(self, num_envs: int, *, seed: int = 0, env: EnvConfig | None = None) -> Turns:
        """Return environments to play in, which know the shortest lengths of their episodes; see `Turns`.

        Args:
            num_envs: number of environments.
            seed: determines their first episodes.
            env: the config; None: that of training. A reward of None means that of training; levels of None mean those
                that training never uses.
        """
        own = self.config.env
        levels, env = (env and env.levels) or "evaluation", env or own
        if env.drop_key != own.drop_key:
            raise InputError("a trained agent cannot be played with another drop_key")
        self.require_world(env)
        env = replace(env, reward=own.reward if env.reward is None else env.reward, curriculum_stages=1)
        config = self.config.changed(env=env)
        return make_turns(config, num_envs, seed, levels=levels, measure_shortest=True)

    def require_world(self, config: EnvConfig) -> None:
        """Refuse environments with other actions or features than those of the training."""
        world = world_spec(config)
        known = offered(world)
        for agent in (self.meta, self.controller):
            if isinstance(agent, ScriptedAgent):
                continue
            features = tuple(c for name in agent.features.names if name in known for c in known[name].cardinalities)
            space = agent.learner.space
            here, trained = actions_in(world, agent.features.agent), agent.features.actions
            is_other = (here.kind, here.sizes) != (trained.kind, trained.sizes)
            differs = {"actions": is_other, "features": space.cardinalities != features}
            if other := [what for what, is_other in differs.items() if is_other]:
                where = f"{config.kind} {config.names[0]}"
                raise InputError(f"the agent was trained in environments with other {other[0]} than {where} has")

    def pair(self, num_envs: int, *, seed: int = 0) -> Pair:
        """Return the agents as a new `Player` for ``num_envs`` environments; the seed determines their actions."""
        _check(num_envs, seed)
        return freeze(self.meta, self.controller, num_envs, seed=seed, is_greedy=self.is_greedy)

    def meta_controller(self, num_envs: int = 1, *, seed: int = 0) -> MetaController:
        """Return the meta-controller alone: for Gymnasium's environments, or another agent (`load`'s ``meta``).

        It chooses goals in ``num_envs`` environments. Its seed and theirs determine its random choices.
        """
        _check(num_envs, seed)
        if isinstance(self.meta, PPOAgent):
            return TrainedGoals(self.meta, num_envs, derived_seed(seed, "meta"))
        return self.meta.frozen(num_envs, seed=derived_seed(seed, "meta")).meta

    def save(self, path: str | Path) -> None:
        """Write config and weights to a small ``.safetensors`` file for `load`; `is_greedy` is not saved."""
        file = Path(path)
        if self.has_other_meta:
            raise InputError(
                "the meta-controller is another than the agent was trained with; save the agent without it"
            )
        if file.suffix != SUFFIX:
            raise InputError(f"an agent is saved to a {SUFFIX} file, not {file}")
        agents = {CONTROLLER: self.controller.weights}
        if isinstance(self.meta, PPOAgent):
            agents[META] = self.meta.weights
        elif self.meta.state_dict():
            raise InputError(
                "a file of weights holds networks that PPO has trained, and no other meta-controller; share the run's "
                "folder instead"
            )
        SavedAgent(self.config, self.steps, agents).write(file)


def load(
    run: str | Path, *, checkpoint: int | None = None, meta: Any = None, greedy: bool = False, trust: bool = False
) -> TrainedAgent:
    """Load the agents that a run has trained, or built-in trained agents, onto the CPU.

    Args:
        run: the run's folder; or a ``.safetensors`` file that `TrainedAgent.save` wrote; or the name of a built-in
            agent: ``"a"`` to ``"g"``, trained with the default preset on that graph, or ``"learned-g"``.
        checkpoint: steps of an earlier checkpoint; None: the newest.
        meta: another meta-controller for the trained controller: ``"fixed-dfs"``, ``"random"``, ``"oracle"``,
            ``"none"``, ``"package.module:Class"``, ``"package.module:function"``, or a meta-controller or function
            itself.
        greedy: whether the controller takes its most probable action; such a policy may turn in one place for ever.
        trust: whether to run user-defined code that the folder's config names; a ``meta`` given here needs no trust.

    Examples:
        >>> agent = hierroom.load("c", meta="random", greedy=True)
        >>> agent.config.env.names, agent.is_greedy
        (('c',), True)
    """
    if not isinstance(run, (str, os.PathLike)):
        raise InputError(f"a run is named by its folder, a file or a shipped agent's name, not {shown(run)}")
    path, has_other_meta = weights_file(run), meta is not None

    def trusted(config: TrainConfig) -> TrainConfig:
        require_trust(Path(path or run), config.changed(meta=None) if has_other_meta else config, trust=trust)
        return config.changed(device="cpu")

    if path is not None:
        if checkpoint is not None:
            raise InputError(f"{path} holds one agent, and no checkpoints")
        saved = SavedAgent.read(path)
        config, misfit = trusted(saved.config), f"{path} does not fit its config"
    elif Path(run).exists():
        folder = RunFolder.open(run)
        path, config = folder.path, trusted(folder.config())
        state = folder.load_checkpoint(checkpoint)
        folder.require_same_config(config, state, ignored=("meta",) if has_other_meta else ())
        saved = SavedAgent(config, state["steps"], state["agents"])
        misfit = f"the checkpoint of {path} does not fit its config.json"
    else:
        raise InputError(f"there is no run {run}, and the agents that ship with hierroom are {', '.join(SHIPPED)}")
    meta_agent, controller = make_agents(config if meta is None else config.changed(meta="none"))
    if meta is not None:
        meta_agent = ScriptedAgent(make_meta(meta))
    with misfits_explained(Path(path), config, misfit):
        controller.take_weights(saved.agents.get(CONTROLLER, {}))
        if isinstance(meta_agent, PPOAgent):
            meta_agent.take_weights(saved.agents.get(META, {}))
        elif meta is None and META in saved.agents:
            meta_agent.load_state_dict(saved.agents[META])
    if isinstance(meta, str):
        warn_of_unread(config.changed(meta=meta), ("meta",))
    agents = meta_agent, controller
    return TrainedAgent(config, *agents, saved.steps, is_greedy=greedy, has_other_meta=has_other_meta, path=path)


def _check(num_envs: int, seed: int) -> None:
    require_number("num_envs", num_envs, 1, MOST_ENVS, is_whole=True)
    require_number("seed", seed, 0, 2**63 - 1, is_whole=True)
