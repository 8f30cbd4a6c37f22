"""Cost of a turn or a step in each API, next to PettingZoo's tictactoe, a MiniGrid room and the engine alone.

    python benchmarks/api_speed.py

CPU time of this process (`time.process_time`) per turn or step, random actions, episodes begun anew where they end.
Each repeat times each case once, one after another, so that a busy machine slows them all. The engine alone steps
the same levels and encodes a new view [N, 7, 7, 3] of each. The vector environments are compared with it at the same
number of environments. They also give six arrays of observations, rewards, ends and infos. If
episodes end after 60 steps, as those of trained agents do, their ends are spread evenly over the steps. `MAX_TIMES` and
the shares say what is wanted, as ratios to a peer in the same repeat.
"""

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable
from importlib.metadata import version
from itertools import cycle

import gymnasium
import minigrid  # noqa: F401 - registers its environments
import numpy as np
from pettingzoo.classic import tictactoe_v3

import hierroom
from hierroom.goals import GoalGraph
from hierroom.gym_env import EscapeRoom
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.tiles import encode

Run = Callable[[int], None]
BATCHES = (128, 8192)
SHORT = 60
TICTACTOE, MINIGRID = "tictactoe, raw", "MiniGrid, MultiRoom-N6"
MAX_TIMES = {"AEC, raw": (TICTACTOE, 1.25), "parallel": (TICTACTOE, 2.25), "Gymnasium": (MINIGRID, 0.07)}
"""Most CPU time of a turn or step, as a multiple of a peer's."""
MIN_SHARE, MIN_SHORT_SHARE = 0.8, 0.2
"""Of the engine's speed, for the vector environment, the second where episodes are short."""


def aec(env) -> Run:
    """Ask `last` and act at every turn, at random: what legal actions there are is not looked at."""
    env.reset(seed=0)
    draws = {
        agent: cycle(np.random.default_rng(0).integers(env.action_space(agent).n, size=1024).tolist())
        for agent in env.possible_agents
    }

    def run(turns: int) -> None:
        for _ in range(turns):
            agent = env.agent_selection
            _, _, terminated, truncated, _ = env.last()
            env.step(None if terminated or truncated else next(draws[agent]))
            if not env.agents:
                env.reset()

    return run


def tictactoe(env) -> Run:
    """Play with legal actions only: an illegal one ends the game."""
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    boards = cycle([rng.permutation(9).tolist() for _ in range(256)])
    moves = iter(next(boards))

    def run(turns: int) -> None:
        nonlocal moves
        for _ in range(turns):
            _, _, terminated, truncated, _ = env.last()
            env.step(None if terminated or truncated else next(moves))
            if not env.agents:
                env.reset()
                moves = iter(next(boards))

    return run


def parallel(env) -> Run:
    """Both agents act at every step."""
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = cycle([{"meta_0": int(rng.integers(14)), "controller_0": int(rng.integers(5))} for _ in range(1024)])

    def run(steps: int) -> None:
        for _ in range(steps):
            env.step(next(actions))
            if not env.agents:
                env.reset()

    return run


def gym(env) -> Run:
    """One environment of Gymnasium's API, without wrappers."""
    env = env.unwrapped
    env.reset(seed=0)
    actions = cycle(np.random.default_rng(0).integers(5, size=1024).tolist())

    def run(steps: int) -> None:
        for _ in range(steps):
            _, _, terminated, truncated, _ = env.step(next(actions))
            if terminated or truncated:
                env.reset()

    return run


def vector(env: EscapeRooms) -> Run:
    """N environments, which begin anew by themselves."""
    env.reset(seed=0)
    if env.config.max_steps == SHORT:
        env.turns.world.stagger_clocks()
    actions = cycle(list(np.random.default_rng(0).integers(5, size=(64, env.num_envs))))

    def run(steps: int) -> None:
        for _ in range(steps):
            env.step(next(actions))

    return run


def engine(num_envs: int, max_steps: int = 1000) -> Run:
    """Step the world alone, and write what its agents see."""
    world = Engine([GoalGraph.named("c")], num_envs, max_steps=max_steps)
    if max_steps == SHORT:
        world.stagger_clocks()
    actions = cycle(list(np.random.default_rng(0).integers(5, size=(64, num_envs))))

    def run(steps: int) -> None:
        for _ in range(steps):
            world.step(next(actions))
            encode(world.outcomes["tiles"])

    return run


def cases() -> dict[str, tuple[Run, int]]:
    """From a name to what is timed, and how many environments one step of it steps."""
    found: dict[str, tuple[Run, int]] = {
        "AEC, raw": (aec(hierroom.raw_env()), 1),
        "AEC, with PettingZoo's wrappers": (aec(hierroom.env()), 1),
        TICTACTOE: (tictactoe(tictactoe_v3.raw_env()), 1),
        "tictactoe, with PettingZoo's wrappers": (tictactoe(tictactoe_v3.env()), 1),
        "parallel": (parallel(hierroom.parallel_env()), 1),
        "Gymnasium": (gym(EscapeRoom()), 1),
        "Gymnasium, meta fixed-dfs": (gym(EscapeRoom(meta="fixed-dfs")), 1),
        MINIGRID: (gym(gymnasium.make("MiniGrid-MultiRoom-N6-v0", max_steps=1000)), 1),
    }
    for n in BATCHES:
        found[f"engine, {n}"] = engine(n), n
        found[f"vector, {n}"] = vector(EscapeRooms(n)), n
        found[f"vector, not copied, {n}"] = vector(EscapeRooms(n, copy=False)), n
    n, short = BATCHES[0], f"{BATCHES[0]}, episodes of {SHORT}"
    found[f"engine, {short}"] = engine(n, SHORT), n
    found[f"vector, {short}"] = vector(EscapeRooms(n, max_steps=SHORT)), n
    return found


def microseconds(run: Run, num_envs: int, seconds: float) -> float:
    """CPU time per environment and step."""
    steps, elapsed, chunk = 0, 0.0, max(1, 1_000 // num_envs)
    start = time.process_time()
    while elapsed < seconds:
        run(chunk)
        steps += chunk
        elapsed = time.process_time() - start
    return 1e6 * elapsed / steps / num_envs


def ratio(values: list[float], others: list[float], form: str) -> tuple[float, str]:
    """Return the median ratio of the same repeats, and in words the quartiles and that of the fastest repeats."""
    low, median, high = statistics.quantiles([a / b for a, b in zip(values, others, strict=True)], n=4)
    fastest = min(values) / min(others)  # other processes only ever add to it
    return median, f"{median:{form}} ({low:{form}} to {high:{form}}; of the fastest repeats {fastest:{form}})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=21)
    parser.add_argument("--seconds", type=float, default=0.1, help="of each case in each repeat")
    options = parser.parse_args()
    timed = cases()
    for run, num_envs in timed.values():
        run(max(3, 3_000 // num_envs))
    taken = {name: [] for name in timed}
    for _ in range(options.repeats):
        for name, (run, num_envs) in timed.items():
            taken[name].append(microseconds(run, num_envs, options.seconds))
    print(
        f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; Python {platform.python_version()}, "
        + ", ".join(f"{name} {version(name)}" for name in ("numba", "numpy", "pettingzoo", "gymnasium", "minigrid"))
    )
    print(f"graph c, size 19; CPU time, median (quartiles) of {options.repeats} repeats of {options.seconds} s")
    for name, values in taken.items():
        low, median, high = statistics.quantiles(values, n=4)
        print(f"{name:40}{median:9.3f} us ({low:.3f} to {high:.3f})   {1 / median:9.3f} million a second")
    for name, (peer, limit) in MAX_TIMES.items():
        times, spread = ratio(taken[name], taken[peer], ".2f")
        print(f"{name}: {spread} times {peer}, wanted {limit} or less: {'met' if times <= limit else 'MISSED'}")
    for name in timed:
        if name.startswith("vector"):
            engine_name = name.replace("vector", "engine").replace(", not copied", "")
            share, spread = ratio(taken[engine_name], taken[name], ".0%")
            least = MIN_SHORT_SHARE if "episodes" in name else MIN_SHARE
            verdict = "met" if share >= least else "MISSED"
            print(f"{name}: {spread} of the engine's speed, wanted {least:.0%} or more: {verdict}")


if __name__ == "__main__":
    main()
