"""Plays recorded from a batch of turns, to be replayed through every API."""

from dataclasses import dataclass, field

import numpy as np

from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.oracle import shortest_actions

META_NONSENSE, NONSENSE = (-7, 14, 99), (-1, 6, 77)  # no action of either agent


@dataclass
class Moment:
    choice: int  # the choice of meta_0, which counts on its turn only
    action: int
    meta: dict | None  # the observation of meta_0, where it is its turn
    controller: dict
    rewards: dict = field(default_factory=dict)
    ends: tuple = ()
    infos: dict = field(default_factory=dict)
    finals: dict = field(default_factory=dict)  # the last observations, where the episode ended


class Script:
    def __init__(self, plays):
        self.choices = {}
        for env, moments in enumerate(plays):
            episode, steps = 0, 0
            for moment in moments:
                self.choices[env, episode, steps] = moment.choice
                episode, steps = (episode + 1, 0) if any(moment.ends) else (episode, steps + 1)

    def choose(self, observations, legal, situation):
        levels = situation.state.levels
        when = zip(levels["index"].tolist(), levels["episode"].tolist(), levels["steps"].tolist(), strict=True)
        return np.array([self.choices.get(moment, -1) for moment in when])


def row(observations, m):
    return {name: values[m] for name, values in observations.items()}


def record(config: EnvConfig, num_envs=2, n_steps=160, seed=5):
    """Return moments [N][T] of environments played half well, half wildly, with nonsense in between."""
    rng = np.random.default_rng(seed)
    turns = Turns(config, num_envs, measure_shortest=True)
    turns.reset(seed)
    everywhere = np.arange(num_envs)
    plays = [[] for _ in range(num_envs)]
    for _ in range(n_steps):
        is_turn = turns.ledger.is_meta_turn.copy()
        situation = turns.situation(everywhere)
        meta = situation.as_dict()
        choices = [choice(rng, mask) for mask in situation.masks]
        turns.choose(situation, choices)
        illegal_goals = turns.ledger.illegal_goals.copy()
        controller = turns.observe("controller_0", everywhere).as_dict()
        actions = [action(rng, turns.world.get_state([n])) for n in everywhere]
        step = turns.step(actions)
        last_controller = turns.final_observation("controller_0", step, everywhere).as_dict()
        last_meta = turns.final_observation("meta_0", step, everywhere).as_dict() | {"outcome": step.outcomes}
        np.testing.assert_array_equal(last_meta["action_mask"], np.tile(np.arange(14) == 13, (num_envs, 1)))
        for n in everywhere:
            moment = Moment(choices[n], actions[n], row(meta, n) if is_turn[n] else None, row(controller, n))
            moment.rewards = {"meta_0": step.extrinsic[n], "controller_0": step.rewards[n]}
            moment.ends = (bool(step.terminated[n]), bool(step.truncated[n]))
            if step.episode_ended[n]:
                moment.finals = {"meta_0": row(last_meta, n), "controller_0": row(last_controller, n)}
            common = {"goal_event": step.events[n], "success": moment.ends[0]}
            common |= {"length": step.lengths[n], "shortest_length": step.shortest[n]}
            moment.infos = {
                "meta_0": {"elapsed": step.meta_elapsed[n], "illegal_actions": illegal_goals[n], **common},
                "controller_0": {"elapsed": 1, "illegal_actions": step.illegal_actions[n], **common},
            }
            plays[n].append(moment)
    return plays


def same(one, other):
    assert one.keys() == other.keys()
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name, strict=isinstance(one[name], np.ndarray))


def choice(rng, mask):
    if rng.random() < 0.7:
        return int(rng.choice(np.flatnonzero(mask)))
    return int(rng.choice([*range(-1, 14), *META_NONSENSE]))


def action(rng, state):
    if rng.random() < 0.7:
        return int(shortest_actions(state)[0])
    return int(rng.choice([*range(6), *NONSENSE]))
