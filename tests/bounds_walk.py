"""Uses every kernel that is compiled ahead; under ``NUMBA_BOUNDSCHECK=1`` an index outside of an array raises."""

from pathlib import Path

import numpy as np
import turns_trace
import world_trace
from escape_room import FEATURES, WORLD
from turns_helpers import well_or_wildly

import hierroom
from hierroom.agents.features import Features
from hierroom.commands.compile import compile_all
from hierroom.goals import NO_GOAL
from hierroom.learners.config import PPOConfig
from hierroom.runs.trainer import Trainer
from hierroom.support.kernel import kernel_folder
from hierroom.turns.records import AGENTS, CONTROLLER, META
from hierroom.turns.turns import Turns
from hierroom.worlds.escape_room.constants import MIN_SIZE
from hierroom.worlds.escape_room.goal_kernels import GOAL_MASKS
from hierroom.worlds.escape_room.layout import MEMORIES
from hierroom.worlds.escape_room.oracle import shortest_lengths

ALL_GRAPHS = tuple(f"rooms:{n}" for n in range(2, 8))
OF_BOTH = [name for name in FEATURES if name != "goal-outcome"]


def walk(mask: str, *, drop_key: bool, size: int, num_envs: int, n_steps: int) -> None:
    env = hierroom.EnvConfig(ALL_GRAPHS, goal_mask=mask, drop_key=drop_key, size=size, max_steps=60, subgoal_horizon=9)
    turns = Turns(env, num_envs, seed=size, measure_shortest=size == MIN_SIZE, memories=tuple(MEMORIES))
    rng = np.random.default_rng(size)
    features = {META: Features(WORLD, [*FEATURES], META), CONTROLLER: Features(WORLD, OF_BOTH)}
    for t in range(n_steps):
        turns.meta_masks()
        turns.choose_everywhere(rng.integers(NO_GOAL - 2, 17, size=num_envs))
        for name in AGENTS:
            features[name].encode(turns.observe(name, np.arange(num_envs)))
        actions = rng.integers(-2, 9, size=num_envs)
        actions[t % num_envs] = well_or_wildly(rng, turns.world, t % num_envs)
        turns.step(actions)
        if t % 40 == 0:
            for goal in range(13):
                shortest_lengths(turns.world.state, goal)


def learn(**entries) -> None:
    """Some updates, with sizes that no tile or minibatch divides."""
    preset = hierroom.find_preset("learned" if entries.get("meta") == "learned" else "default")
    sizes = {"num_envs": 7, "sequence_length": 9, "minibatches": 3, "hidden_size": 37, "meta_start_success": 0.0}
    meta_ppo = PPOConfig(sequence_length=3, sequences_per_update=5, minibatches=2, hidden_size=19)
    trainer = Trainer(preset.changed(graph=("a", "g"), max_steps=40, meta_ppo=meta_ppo, **sizes, **entries))
    for _ in range(12):
        trainer.advance()


def main() -> None:
    for i, mask in enumerate(GOAL_MASKS):
        walk(mask, drop_key=i % 2 == 0, size=(MIN_SIZE, 19, 33, 63)[i], num_envs=48, n_steps=120)
    world_trace.trace()
    turns_trace.trace()
    learn(features=tuple(OF_BOTH), drop_key=True)
    learn(meta="learned")
    learn(features=("view-ids", "goal"), method="ppo-rnd")
    compile_all(Path(kernel_folder()))  # each kernel is used once


if __name__ == "__main__":
    main()
