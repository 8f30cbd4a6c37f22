"""Play a level yourself: ``python -m hierroom play --graph f``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from hierroom.goals import GraphSpecs
from hierroom.support.cli import Flag, given, read_arguments, refuse_without
from hierroom.support.errors import InputError, require_number
from hierroom.worlds.env_config import GRAPHS, LAYOUTS, NOVELTY_BONUS, EnvConfig

if TYPE_CHECKING:
    from hierroom.lab.play import Game


@dataclass(frozen=True)
class PlayArguments:
    """Play levels yourself in a window, next to a goal graph that lights up as you reach goals.

    Keys: arrows or wasd move, space picks up or opens what is in front, o shows the oracle's next action. t lets a
        trained agent take over, x drops a key, n begins the next level, r this one again, q quits.

    Args:
        graph: goal graphs, given as in training; each level samples one. By default c, or the agent's own.
        layout: your own levels, as paths of text maps: see train.
        size: cells of the grid's side; by default 13, or the agent's own.
        max_steps: steps after which a level ends; by default 1000, or the agent's own.
        drop_key: whether keys can be dropped; with --agent, as in the agent's training.
        agent: a run's folder, an agent's .safetensors file, or a built-in agent (a to g, learned-g). The agent can take
            over, and its subgoals are shown.
        trust_run: run custom code that the agent's config names.
        greedy: let the agent take its most probable action instead of drawing one.
        seed: determines the levels and the agent's actions.
    """

    graph: Annotated[GraphSpecs, GRAPHS] = ()
    layout: Annotated[Any, LAYOUTS] = ()
    size: int | None = None
    max_steps: int | None = None
    drop_key: Flag = False
    agent: Path | None = None
    trust_run: Flag = False
    greedy: Flag = False
    seed: int = 0


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    arguments = read_arguments(PlayArguments, "play", argv)
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    from hierroom.lab.play import App

    require_number("seed", arguments.seed, 0, 2**63 - 1, is_whole=True)
    App(make_game(arguments)).run()
    return 0


def make_game(arguments: PlayArguments) -> Game:
    """Return the game that the options describe."""
    from hierroom.gym_env import EscapeRoom  # imports torch, which --help does not need
    from hierroom.lab.play import Game
    from hierroom.runs.trained_agent import load
    from hierroom.wrappers.features import add_features

    chosen, seed = given(arguments, "graph", "layout", "size", "max_steps"), arguments.seed
    if arguments.agent is None:
        refuse_without(arguments, "agent", "greedy", "trust_run")
        usual = {} if arguments.layout else {"graph": "c", "size": 13}
        entries: dict[str, Any] = {**usual, "drop_key": arguments.drop_key, **chosen}
        EnvConfig(**entries).refuse_unread(chosen)
        return Game(lambda: EscapeRoom(**entries), None, seed)
    agent = load(arguments.agent, greedy=arguments.greedy, trust=arguments.trust_run)
    if agent.config.env.task is not None:
        name = agent.config.env.names[0]
        raise InputError(
            f"play shows levels of EscapeRooms, and the agent of {arguments.agent} plays {name}; use watch"
        )
    if arguments.drop_key and not agent.config.env.drop_key:
        raise InputError(f"the agent of {arguments.agent} was trained without --drop-key, so keys cannot be dropped")
    usual = {"reward": "extrinsic", "novelty_bonus": NOVELTY_BONUS, "curriculum_stages": 1}
    config = agent.env(**chosen).changed(levels="evaluation", **usual)

    def make() -> Any:
        return add_features(EscapeRoom(**vars(config), meta=agent.meta_controller(seed=seed)), agent)

    return Game(make, agent, seed)
