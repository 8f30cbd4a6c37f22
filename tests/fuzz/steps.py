"""Random steps over all goal graphs of 2 to 7 rooms, after each of which the rules are looked at in plain numpy.

``python -m tests.fuzz.steps --count 100_000_000`` takes so many; the seed fixes them. What must hold is written anew
here, from the levels before and after a step; it shares no code with the kernels that take it.
"""

from __future__ import annotations

import argparse
from itertools import product

import numpy as np
from numpy.typing import NDArray
from rich.progress import Progress

from hierroom.goals import enumerate_graphs
from hierroom.turns.records import Step
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig, GoalMaskName
from hierroom.worlds.escape_room.layout import MARGIN, MEMORIES
from hierroom.worlds.escape_room.oracle import shortest_lengths
from hierroom.worlds.escape_room.state_check import check_state

GRAPHS = tuple(f"rooms:{n}" for n in range(2, 8))
N_GRAPHS = sum(len(enumerate_graphs(n)) for n in range(2, 8))
MASKS: tuple[GoalMaskName, ...] = ("reachable", "existing", "seen", "none")
MAX_STEPS = {11: 150, 19: 400, 63: 1500}
"""The sizes, and after how many steps an episode is truncated."""
CASES = [*product(MAX_STEPS, (False, True), (False, True))]
"""(size, drop_key, whether levels remember) of each batch."""
STATE_EVERY, STATES = 8, 64
"""Every so many steps, the whole state of so many environments is checked, and of one whether it can be solved."""

FIELDS = ("row", "col", "direction", "steps", "keys", "doors", "found", "seen", "bag_size", "episode", "has_ended")
FORWARD, LEFT, RIGHT, PICKUP, OPEN, DROP = range(6)
ACTIONS = np.repeat([FORWARD, LEFT, RIGHT, PICKUP, OPEN, DROP, -1, 6, 9], [118, 44, 44, 20, 20, 6, 2, 1, 1])
"""Of 256, so that a random byte is a random action, more often forward."""
SOUTH, EAST = np.array([0, 1, 0, -1]), np.array([1, 0, -1, 0])
KEY, OPEN_DOOR, LOCKED_DOOR, WALL = 3, 9, 15, 21
"""Tiles from which on there are keys, open and locked doors by colour; below are floor and the exit."""


class Play:
    """N environments that are played at random, and looked at after every step.

    Args:
        size: of the grids.
        drop_key: whether keys can be dropped.
        remembers: whether levels remember what they can.
        num_envs: N.
        seed: fixes everything.
    """

    def __init__(self, size: int, drop_key: bool, remembers: bool, num_envs: int, seed: int):
        mask = MASKS[seed % len(MASKS)]
        config = EnvConfig(
            GRAPHS, size=size, drop_key=drop_key, max_steps=MAX_STEPS[size], subgoal_horizon=40, goal_mask=mask
        )
        self.turns = Turns(config, num_envs, seed=seed, memories=tuple(MEMORIES) if remembers else ())
        self.name, self.rng, self.n_steps = (
            f"size {size}, drop_key {drop_key}, seed {seed}",
            np.random.default_rng(seed),
            0,
        )
        self.everywhere = np.arange(num_envs)
        self.before = self._fields()
        self.exits, self.escapes, self.events = self._exits(), 0, np.zeros(13, np.int64)
        self.graphs = set(self._graphs(self.everywhere))

    def step(self) -> None:
        """Take a step everywhere.

        Raises:
            AssertionError: if one of the rules does not hold somewhere.
        """
        turns, before, n = self.turns, self.before, self.everywhere
        front = self._tiles(before, 1)
        self._require(front == turns.world.outcomes["tiles"][:, 3, 5], "the view shows the cell in front of the agent")
        choices = self.rng.integers(-2, 16, len(n))
        self._choose(choices)
        actions = self._actions(front)
        illegal, option_steps = turns.ledger.illegal_actions.copy(), turns.ledger.option_steps.copy()
        goals = turns.ledger.goals.copy()
        step = turns.step(actions)
        self.n_steps += 1
        ended = np.flatnonzero(step.episode_ended)
        after = self._fields()
        begun = {name: values[ended] for name, values in after.items()}
        for name, values in after.items():
            values[ended] = turns.world.finals[name][ended]
        self.escapes += int(step.terminated.sum())
        self._check_move(before, after, actions, front)
        self._check_things(before, after, actions, front, step)
        self._check_end(before, after, begun, ended, step)
        self._check_ledger(step, actions, goals, illegal, option_steps)
        if len(ended):
            self.exits[ended] = turns.world.state.levels["exit_at"][ended]
            self.graphs.update(self._graphs(ended))
            for name, values in after.items():
                values[ended] = begun[name]
        self.before = after
        here = self._tiles(after, 0)
        self._require((here == 1) | (here >= OPEN_DOOR) & (here < LOCKED_DOOR), "the agent stands on floor")
        if self.n_steps % STATE_EVERY == 0:
            self._check_states()

    def _choose(self, choices: NDArray[np.int64]) -> None:
        """Let the meta-controllers pick goals, legal or not."""
        ledger, masks, are_turns = self.turns.ledger, self.turns.meta_masks(), self.turns.ledger.is_meta_turn.copy()
        places = np.where(choices == -1, 13, choices)
        is_legal = (places >= 0) & (places <= 13) & masks[self.everywhere, np.clip(places, 0, 13)]
        expected = np.where(are_turns, np.where(is_legal & (places < 13), places, -1), ledger.goals)
        illegal = ledger.illegal_goals + ~is_legal
        self.turns.choose_everywhere(choices)
        self._require(ledger.goals == expected, "a legal goal is pursued, and no other")
        self._require(ledger.illegal_goals == illegal, "illegal goals are counted")
        self._require(~ledger.is_meta_turn, "the controller's turn follows the meta-controller's")

    def _actions(self, front: NDArray[np.integer]) -> NDArray[np.int64]:
        """Random actions; half the agents in front of a key or a locked door pick it up or open it."""
        dice = self.rng.integers(0, 256, (2, len(front)), dtype=np.uint8)
        is_key, is_door = (front >= KEY) & (front < OPEN_DOOR), (front >= LOCKED_DOOR) & (front < WALL)
        useful = np.where(is_key, PICKUP, OPEN)
        return np.where((is_key | is_door) & (dice[1] < 128), useful, ACTIONS[dice[0]])

    def _check_move(self, before: dict, after: dict, actions: NDArray[np.int64], front: NDArray) -> None:
        walks = (actions == FORWARD) & ((front < KEY) | (front >= OPEN_DOOR) & (front < LOCKED_DOOR))
        heading = before["direction"]
        self._require(after["row"] == before["row"] + walks * SOUTH[heading], "the agent moves ahead, if it can")
        self._require(after["col"] == before["col"] + walks * EAST[heading], "the agent moves ahead, if it can")
        turned = (heading + (actions == RIGHT) - (actions == LEFT)) % 4
        self._require(after["direction"] == turned, "left and right turn the agent, and nothing else does")

    def _check_things(self, before: dict, after: dict, actions: NDArray[np.int64], front: NDArray, step: Step) -> None:
        picks = (actions == PICKUP) & (front >= KEY) & (front < OPEN_DOOR)
        gained, lost = after["keys"] & ~before["keys"], before["keys"] & ~after["keys"]
        self._require((gained != 0) == picks, "a key is held once it was picked up in front of the agent")
        self._require((gained & (gained - 1)) == 0, "one key is picked up at a time")
        can_drop = (actions == DROP) & (front == 1) & self.turns.config.drop_key
        to_drop = (before["keys"] & ~before["doors"]) != 0
        self._require((lost != 0) == (can_drop & to_drop), "a key is dropped on floor, if its door is locked")
        self._require((lost & (lost - 1) | lost & before["doors"]) == 0, "one key, of a locked door, is dropped")
        opened = after["doors"] ^ before["doors"]
        self._require((opened & before["doors"]) == 0, "an open door stays open")
        self._require((opened & ~(before["keys"] & after["keys"])) == 0, "a door is opened by its key, which is kept")
        self._require((opened & (opened - 1)) == 0, "one door is opened at a time")
        is_door = (actions == OPEN) & (front >= LOCKED_DOOR) & (front < WALL)
        self._require(is_door | (opened == 0), "a door is opened in front of the agent")
        self._require(after["found"] == before["found"] | after["keys"], "what was held once was found")
        self._require((before["seen"] & ~after["seen"]) == 0, "what was seen once was seen")
        self._require(np.bitwise_count(after["keys"]) == after["bag_size"], "the bag holds the keys that are held")
        event = np.where(picks, front - KEY, np.where(opened != 0, front - LOCKED_DOOR + 6, -1))
        event[step.terminated] = 12
        self._require(step.events == event, "an event is a key picked up, a door opened or the exit")
        n_new = np.bitwise_count(after["found"] ^ before["found"]) + (opened != 0) + step.terminated
        self._require(step.is_first == (n_new > 0), "an event is the first of its kind once")
        self.events += np.bincount(event[event >= 0], minlength=13)

    def _check_end(self, before: dict, after: dict, begun: dict, ended: NDArray[np.intp], step: Step) -> None:
        at_exit = (after["row"] == self.exits[:, 0]) & (after["col"] == self.exits[:, 1])
        self._require(step.terminated == at_exit, "an episode terminates at the exit, and nowhere else")
        self._require(step.extrinsic == at_exit, "there is a reward of 1 at the exit, and nowhere else")
        self._require(after["steps"] == before["steps"] + 1, "each step counts")
        self._require(step.lengths == after["steps"], "the length is the number of steps")
        self._require(step.truncated == (after["steps"] == self.turns.config.max_steps), "the last step truncates")
        self._require(step.episode_ended == step.terminated | step.truncated, "an episode ends in these two ways")
        self._require(after["has_ended"] == step.episode_ended, "the level knows its end")
        self._require(after["episode"] == before["episode"], "nothing else begins an episode")
        is_new = begun["episode"] == after["episode"][ended] + 1
        for name in ("steps", "keys", "doors", "found", "bag_size", "has_ended"):
            is_new &= begun[name] == 0
        self._require(is_new, "the next episode begins afresh")

    def _check_ledger(
        self, step: Step, actions: NDArray, goals: NDArray, illegal: NDArray, option_steps: NDArray
    ) -> None:
        ledger = self.turns.ledger
        new = step.is_first | step.is_discovery
        self._require(step.goals == goals, "the goal of the step is the one that was chosen")
        self._require(step.reached == np.where(goals < 0, new, step.events == goals), "a goal is reached by its event")
        self._require(step.rewards == step.reached, "the intrinsic reward is 1 where the goal is reached")
        timed_out = (option_steps + 1 == 40) & ~step.reached & ~step.episode_ended
        self._require(step.timed_out == timed_out, "an option ends with its horizon")
        option_ended = step.reached | timed_out | step.episode_ended
        self._require(ledger.is_meta_turn == option_ended, "the meta-controller's turn comes where the option ended")
        self._require(step.meta_elapsed == option_steps + 1, "an option counts its steps")
        self._require(ledger.option_steps == np.where(option_ended, 0, option_steps + 1), "and begins anew")
        self._require(step.meta_rewards == step.extrinsic, "no extrinsic reward is lost, or paid twice")
        illegal = illegal + ((actions < 0) | (actions >= self.turns.world.n_actions))
        self._require(step.illegal_actions == illegal, "illegal actions are counted")
        illegal[step.episode_ended] = 0
        self._require(ledger.illegal_actions == illegal, "illegal actions are counted in each episode")

    def _check_states(self) -> None:
        """The whole state of some environments, and whether one of them can be solved."""
        world, number = self.turns.world, self.n_steps // STATE_EVERY
        some = (number * STATES + np.arange(STATES)) % len(world)
        state = world.get_state(some)
        check_state(state)
        if number % STATE_EVERY == 0:
            length = int(shortest_lengths(state[:1])[0])
            assert length > 0, f"{self.name}: environment {some[0]} cannot be solved after step {self.n_steps}"

    def _fields(self) -> dict[str, NDArray]:
        return {name: self.turns.world.state.levels[name].copy() for name in FIELDS}

    def _exits(self) -> NDArray[np.integer]:
        return self.turns.world.state.levels["exit_at"].copy()

    def _tiles(self, fields: dict[str, NDArray], ahead: int) -> NDArray[np.int64]:
        """[N] the tiles so many cells ahead of the agents."""
        row = fields["row"] + ahead * SOUTH[fields["direction"]]
        col = fields["col"] + ahead * EAST[fields["direction"]]
        self._require((row >= MARGIN) & (col >= MARGIN), "the agent is inside the walls")
        return self.turns.world.state.grids[self.everywhere, row, col].astype(np.int64)

    def _graphs(self, envs: NDArray[np.intp]) -> list[bytes]:
        """The goal graphs that environments play."""
        levels = self.turns.world.state.levels[envs]
        numbers = np.column_stack([levels["n_rooms"], levels["exit_room"], levels["key_rooms"]])
        return [row.tobytes() for row in numbers.astype(np.int8)]

    def _require(self, holds: NDArray[np.bool_], rule: str) -> None:
        if not holds.all():
            env = int(np.argmin(holds))
            raise AssertionError(f"{self.name}: not so in environment {env} after step {self.n_steps}: {rule}")


def main() -> None:
    """Play, and say what was played."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10**7, help="steps of all environments together, at least")
    parser.add_argument("--num-envs", type=int, default=2048, help="environments of a batch")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    n_each = -(-options.count // (options.num_envs * len(CASES)))
    n_steps, episodes, escapes, events = 0, 0, 0, np.zeros(13, np.int64)
    with Progress() as progress:
        task = progress.add_task("stepping", total=n_each * len(CASES))
        for number, case in enumerate(CASES):
            play = Play(*case, options.num_envs, options.seed + number)
            for _ in range(n_each):
                play.step()
                progress.advance(task)
            n_steps += n_each * options.num_envs
            episodes += int(play.turns.world.state.levels["episode"].sum())
            escapes, events = escapes + play.escapes, events + play.events
            print(
                f"{play.name}: {n_each * options.num_envs:,} steps, {len(play.graphs)} of {N_GRAPHS} graphs", flush=True
            )
    print(
        f"{n_steps:,} steps in {episodes:,} episodes, {escapes:,} of them to the exit; {events[:6].sum():,} keys "
        f"picked up and {events[6:12].sum():,} doors opened; every rule held"
    )


if __name__ == "__main__":
    main()
