"""Gymnasium's own tools: the checker, wrappers, collected frames, copies, other processes, keys, and the spec."""

import copy
import pickle

import gymnasium
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FlattenObservation, RecordEpisodeStatistics, TimeLimit

import hierroom  # noqa: F401 - registers the ids

ID = "hierroom/EscapeRoom-b-v0"


def main() -> None:
    """Each in a line or two."""
    env = gymnasium.make(ID, size=11, max_steps=50, render_mode="rgb_array_list")
    print(f"step limit in the spec: {env.spec.max_episode_steps}; keys: {env.get_wrapper_attr('get_keys_to_action')()}")
    env.reset(seed=0)
    twins = pickle.loads(pickle.dumps(env)), copy.deepcopy(env)
    for one in (env, *twins):
        one.step(2)
    print(f"{[len(one.render()) for one in (env, *twins)]} frames collected, by it and by its copies")

    check_env(gymnasium.make(ID, size=11).unwrapped, skip_render_check=True)
    env = RecordEpisodeStatistics(TimeLimit(FlattenObservation(gymnasium.make(ID, size=11)), 20))
    env.reset(seed=0)
    while True:
        observation, _, terminated, truncated, info = env.step(1)
        if terminated or truncated:
            break
    print(f"flat observations {observation.shape}, an episode of {info['episode']['l']} steps")

    envs = gymnasium.make_vec(ID, 2, vectorization_mode="async", vector_kwargs={"context": "spawn"}, size=11)
    observations, _ = envs.reset(seed=0)
    envs.close()
    print(f"two other processes: {observations['observation'].shape}")


if __name__ == "__main__":
    main()
