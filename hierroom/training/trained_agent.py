"""A trained agent, ready to play anywhere."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from hierroom.agents.player import Pair
from hierroom.agents.ppo_agent import PPOAgent
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.env_config import EnvConfig
from hierroom.errors import InputError
from hierroom.training.assembly import freeze, load_agents, make_turns
from hierroom.training.config import TrainConfig
from hierroom.training.run_folder import RunFolder
from hierroom.training.run_name import run_name
from hierroom.turns import Turns


@dataclass(frozen=True, eq=False, repr=False)
class TrainedAgent:
    """A meta-controller and a controller that were trained together: what `load` and `hierroom.train` give.

    It plays and learns no more; `hierroom.rollout` lets it play.

    Args:
        config: what was trained.
        meta: the meta-controller, or another one that was given in its place.
        controller: the controller.
        steps: primitive steps it was trained for.
        is_greedy: whether the controller takes its most probable action instead of drawing one.
        path: the folder of the run, or None.
    """

    config: TrainConfig
    meta: PPOAgent | ScriptedAgent
    controller: PPOAgent
    steps: int
    is_greedy: bool = False
    path: Path | None = None

    def __repr__(self) -> str:
        meta = type(self.meta.meta).__name__ if isinstance(self.meta, ScriptedAgent) else "learned"
        actions, path = "greedy" if self.is_greedy else "sampled", f", from {self.path}" if self.path else ""
        return f"<TrainedAgent {run_name(self.config)}, {self.steps:,} steps, meta {meta}, {actions} actions{path}>"

    def env(self, **entries: Any) -> EnvConfig:
        """What the environments it was trained in are made of, but for some entries.

        Args:
            **entries: entries of the `EnvConfig` that are to be others, such as ``size`` or ``graph``, which comes
                without the run's ``exclude``.

        Raises:
            InputError: if an entry is unknown or cannot be changed: ``drop_key`` and ``reward`` are the agent's own.
        """
        refused = entries.keys() - {entry.name for entry in fields(EnvConfig)} | entries.keys() & {"drop_key", "reward"}
        if refused:
            raise InputError(f"a trained agent cannot be played with another {', '.join(sorted(refused))}")
        return replace(self.config.env, **({"exclude": (), **entries} if "graph" in entries else entries))

    def turns(self, num_envs: int, *, seed: int = 0, env: EnvConfig | None = None, autoreset: bool = True) -> Turns:
        """Environments it can play in, whose shortest lengths are measured.

        Args:
            num_envs: how many.
            seed: of their first episodes.
            env: what they are made of; None: as those it was trained in. Where its reward is None, it is the one it was
                trained with; where its levels are None, they are those that training never uses.
            autoreset: whether an environment whose episode ends begins its next one in the same step.

        Raises:
            InputError: if their ``drop_key`` is another than the agent was trained with.
        """
        config = self.config if env is None else self.config.changed(env=env)
        if config.env.drop_key != self.config.env.drop_key:
            raise InputError("a trained agent cannot be played with another drop_key")
        levels = (env and env.levels) or "evaluation"
        settings = {"whole_interval": True, "measure_shortest": True, "autoreset": autoreset}
        return make_turns(config, num_envs, seed, levels=levels, **settings)

    def pair(self, num_envs: int, *, seed: int = 0) -> Pair:
        """The agents as a `Player` in a number of environments; a new one for each use.

        Args:
            num_envs: how many environments.
            seed: fixes the actions.
        """
        return freeze(self.meta, self.controller, num_envs, seed=seed, is_greedy=self.is_greedy)


def load(
    run: str | Path, *, checkpoint: int | None = None, meta: Any = None, greedy: bool = False, trust: bool = False
) -> TrainedAgent:
    """Load the agents that a run has trained.

    Args:
        run: the run's folder.
        checkpoint: the steps of an earlier checkpoint than the newest.
        meta: another meta-controller for the trained controller: ``"fixed-dfs"``, ``"random"``, ``"oracle"``,
            ``"none"``, ``"package.module:Class"``, ``"package.module:function"``, or a meta-controller or function
            itself.
        greedy: whether the controller takes its most probable action instead of drawing one. A policy that escapes
            whenever it draws can turn on the spot for ever when it is greedy.
        trust: whether to run what the folder's config names besides what ships with hierroom: a network, a reward or a
            meta-controller of somebody's own, which is code. A ``meta`` that is given here needs no trust.

    Raises:
        InputError: if there is no such run, checkpoint or meta-controller, or it names code and is not trusted.
    """
    folder = RunFolder.open(run)
    config, meta_agent, controller, steps = load_agents(folder, meta=meta, steps=checkpoint, trust=trust)
    return TrainedAgent(config, meta_agent, controller, steps, is_greedy=greedy, path=folder.path)
