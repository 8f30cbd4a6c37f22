"""Names that are hard to write to files, and a task with such names."""

import gymnasium
from gymnasium import spaces
from hypothesis import strategies as st

import hierroom

_AWKWARD = (
    "a/b",
    "a > b",
    "a",
    "b",
    ".",
    "..",
    "a,b",
    "a=b",
    'a "b"',
    "a\nb",
    "a\0b",
    "=1+1",
    "none",
    "ключ",
    "\ud800",
)
ODD_NAMES = st.sampled_from(_AWKWARD) | st.text(max_size=8) | st.just("long " * 60)


class Counter(gymnasium.Env):
    """Counts steps to six, and shows the count as an entry of any name."""

    action_space = spaces.Discrete(2)

    def __init__(self, entry="count"):
        self.entry, self.observation_space = entry, spaces.Dict({entry: spaces.Discrete(7)})

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.count = 0
        return {self.entry: 0}, {}

    def step(self, action):
        self.count += 1
        return {self.entry: self.count}, 0.0, self.count == 6, False, {}


def counter_task(goals=("end",), entry="count"):
    """A task whose first goal is the target, and whose other goals are never achieved."""
    functions = {name: lambda env, info, n=n: env.unwrapped.count == 6 + n for n, name in enumerate(goals)}
    return hierroom.Task(lambda: Counter(entry), functions, target=goals[0])


counter, joined = counter_task(), counter_task(("a > b", "a", "b"))
