"""The ledger of the two agents' turns, slowly: numpy, whole arrays at a time, one rule a line."""

import numpy as np

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS, NO_GOAL
from hierroom.turns.records import OTHER, REACHED, TIMED_OUT, ledger_at_reset


class LedgerTwin:
    """As `ledger.Ledger`, a dict of arrays."""

    def __init__(self, num_envs, n_actions):
        self.n_actions = n_actions
        start = ledger_at_reset(n_actions)
        self.start = {name: start[name][0] for name in start.dtype.names or ()}
        self.values = {name: np.full(num_envs, value) for name, value in self.start.items()}

    def record(self, actions, outcomes, *, return_ends_with_option, subgoal_horizon, autoreset):
        """The entries of a `Step` by name; its rewards are none yet."""
        v = self.values
        v["option_steps"] += 1
        v["option_rewards"] += outcomes["reward"]
        is_illegal = (actions < 0) | (actions >= self.n_actions)
        v["illegal_actions"] += is_illegal
        v["previous_actions"] = np.where(is_illegal, self.n_actions, actions)
        goals, achieved = v["goals"].copy(), outcomes["achieved"].astype(np.int64)
        has_goal = achieved[:, None] >> np.arange(N_GOALS) & 1 > 0
        is_pursued = (goals != NO_GOAL) & has_goal[np.arange(len(goals)), goals]
        events = np.where(is_pursued, goals, np.where(achieved > 0, has_goal.argmax(axis=1), NO_GOAL))
        v["first_events"] = np.where(v["first_events"] == NO_GOAL, events, v["first_events"])
        terminated, truncated = outcomes["terminated"].copy(), outcomes["truncated"].copy()
        ended = terminated | truncated
        is_new = (outcomes["n_first"] > 0) | outcomes["is_discovery"]
        reached = np.where(goals == NO_GOAL, is_new, is_pursued)
        timed_out = (v["option_steps"] >= subgoal_horizon) & ~(reached | ended)
        option_ended = reached | timed_out | ended
        return_terminated = terminated | reached if return_ends_with_option else terminated
        return_truncated = truncated | timed_out if return_ends_with_option else truncated
        step = {"actions": v["previous_actions"].copy(), "goals": goals, "events": events, "achieved_bits": achieved}
        step |= {name: outcomes[name].copy() for name in ("is_discovery", "is_novel")}
        step |= {"n_first": outcomes["n_first"].astype(np.int64), "elapsed": np.ones(len(events), np.int64)}
        step |= {"extrinsic": outcomes["reward"].copy(), "lengths": outcomes["length"].astype(np.int64)}
        step |= {"reached": reached, "timed_out": timed_out, "option_ended": option_ended}
        step |= {
            "meta_rewards": np.where(option_ended, v["option_rewards"], 0.0),
            "meta_elapsed": v["option_steps"].copy(),
            "achieved_instead": np.where(option_ended & ~reached, v["first_events"], NO_GOAL),
            "success": terminated & (outcomes["achieved"] >> EXIT_GOAL & 1 == 1),
        }
        step |= {"terminated": terminated, "truncated": truncated, "episode_ended": ended}
        step |= {"return_terminated": return_terminated, "return_truncated": return_truncated & ~return_terminated}
        step |= {name: v[name].copy() for name in ("shortest", "illegal_actions")}
        outcome = np.where(reached, REACHED, np.where(timed_out, TIMED_OUT, OTHER))
        v["is_meta_turn"] = option_ended & ~ended
        for name, value in (("last_goals", goals), ("last_outcomes", outcome), ("goals", NO_GOAL)):
            v[name] = np.where(option_ended, value, v[name])
        for name, value in (("first_events", NO_GOAL), ("option_steps", 0), ("option_rewards", 0.0)):
            v[name] = np.where(option_ended, value, v[name])
        if autoreset:
            for name, value in self.start.items():
                v[name][ended] = value
        return step

    def choose(self, masks, actions):
        v = self.values
        for n, action in enumerate(actions):
            place = N_GOALS if action == NO_GOAL else action
            is_legal = 0 <= place <= N_GOALS and masks[n, place]
            v["illegal_goals"][n] += not is_legal
            if v["is_meta_turn"][n]:
                v["goals"][n] = place if is_legal and place < N_GOALS else NO_GOAL
                v["meta_turns"][n] += 1
                v["is_meta_turn"][n] = False


def legal_goals(situation, mask):
    m = len(situation)
    if mask == "none":
        return np.ones((m, N_GOALS), bool)
    levels, keys, doors = situation.levels, situation.keys, situation.doors
    closed = situation.exists & ~doors
    if mask == "reachable":
        is_open = np.concatenate([np.ones((m, 1), bool), doors], axis=1)
        in_reach = is_open[np.arange(m)[:, None], situation.key_rooms]
        exits = is_open[np.arange(m), levels["exit_room"]]
        return situation.by_goal(closed & ~keys & in_reach, closed & keys, exits)
    goals = situation.by_goal(closed & ~keys, closed, np.ones(m, bool))
    assert goals.shape == (m, EXIT_GOAL + 1) == (m, FIRST_DOOR_GOAL + N_COLOURS + 1)
    return goals if mask == "existing" else goals & (levels["seen"][:, None] >> np.arange(N_GOALS) & 1).astype(bool)
