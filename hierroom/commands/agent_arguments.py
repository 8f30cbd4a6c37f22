"""The arguments that evaluate and watch share: which trained agent plays, and where."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from hierroom.goals import GraphSpecs
from hierroom.support.cli import Flag, given
from hierroom.worlds.env_config import GRAPHS, LAYOUTS, EnvConfig

if TYPE_CHECKING:
    from hierroom.runs.trained_agent import TrainedAgent


@dataclass(frozen=True)
class AgentArguments:
    """A trained agent, and the environments it plays in.

    Args:
        run: the run's folder, an agent's .safetensors file, or a built-in agent (a to g, learned-g); give it before
            --graph, --exclude and --layout, which take all words up to the next option.
        checkpoint: steps of an earlier checkpoint; by default the newest is loaded.
        trust_run: run custom code that the run's config names (a network, a reward, a meta-controller).
        graph: goal graphs other than those trained on, given as in training.
        exclude: goal graphs to leave out; without --graph, in addition to those left out in training.
        layout: layouts other than those trained on, as paths of text maps: see train.
        size: a grid size other than the one trained on.
        meta: another meta-controller for the trained controller: fixed-dfs, random, oracle, none,
            package.module:Class or package.module:function.
        goal_mask: other goals that may be chosen: reachable, existing, seen or none.
        seed: determines the levels and the actions; training never uses these levels, whatever its seed.
    """

    run: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    checkpoint: int | None = None
    trust_run: Flag = False
    graph: Annotated[GraphSpecs, GRAPHS] = ()
    exclude: Annotated[GraphSpecs, GRAPHS] = ()
    layout: Annotated[Any, LAYOUTS] = ()
    size: int | None = None
    meta: str | None = None
    goal_mask: str | None = None
    seed: int = 0

    def load(self, greedy: bool = False) -> TrainedAgent:
        """Return the agent, and make torch use one thread, as in training."""
        import torch  # slow to load, and --help does not need it

        from hierroom.complexity.graph_set import GraphSet
        from hierroom.runs.trained_agent import load
        from hierroom.support.output import warn

        torch.set_num_threads(1)
        agent = load(self.run, checkpoint=self.checkpoint, meta=self.meta, greedy=greedy, trust=self.trust_run)
        if self.graph:
            for note in GraphSet(self.graph, self.exclude, agent.config.env.drop_key).notes:
                warn(note)
        return agent

    def env(self, agent: TrainedAgent) -> EnvConfig:
        """Return the config of the environments in which the agent plays."""
        return agent.env(**given(self, "graph", "exclude", "layout", "size", "goal_mask"))

    def warn_of_changes(self, agent: TrainedAgent) -> None:
        """Warn of custom code that has changed since training; call it after the environments have imported theirs."""
        from hierroom.runs.folder.provenance import warn_of_changed_modules

        warn_of_changed_modules(self.run, agent.config.changed(meta=None) if self.meta else agent.config)
