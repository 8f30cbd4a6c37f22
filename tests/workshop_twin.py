"""A workshop in plain Python, written from its contract alone, and rules to try it on."""

from collections import Counter

from splitmix import BITS, GOLDEN, key_of, mixed, shuffled

from hierroom import Rules

CRAFT = Rules(
    {
        "log": {"gives": {"wood": 2}},
        "stone": {"needs": "pick", "gives": "stone"},
        "gem": {"needs": "pick", "gives": "gem"},
        "stick": {"uses": "wood", "gives": {"stick": 2, "dust": 1}},
        "pick": [
            {"uses": {"stick": 1, "stone": 1}, "gives": "pick"},
            {"uses": {"stick": 2}, "gives": "pick"},
            {"needs": {"stick": 2}, "gives": "crown"},
        ],
        "crown": {"needs": {"gem": 1}, "uses": {"stick": 1}, "gives": "crown"},
        "ring": {"needs": {"gem": 2}, "uses": {"gem": 1}, "gives": {"crown": 1, "wood": 1}},
    },
    target="crown",
    capacity={"wood": 3, "stick": 3, "gem": 2},
    start={"wood": 1},
)
"""Sources. Alternatives; the last asks for the same as another, so that it never applies. Two rules that ask
for the same, one that needs and uses a thing, two that give the target."""
MELT = Rules(
    {
        "melt": {"uses": "ice", "gives": "water"},
        "freeze": {"uses": "water", "gives": "ice"},
        "slush": {"uses": {"ice": 1, "water": 1}, "gives": "slush"},
    },
    target="slush",
    capacity={"ice": 2, "water": 2},
    start={"ice": 2},
)
"""Requirements in a circle, and dead ends: none here, as nothing is lost."""


def random_rules(rng):
    """Rules of five facts; the last gives everything."""

    def counts(share):
        return {fact: int(rng.integers(1, 3)) for fact in "abcde" if rng.random() < share}

    def way():
        entries = {"needs": counts(0.2), "uses": counts(0.25), "gives": counts(0.35)}
        return {entry: facts for entry, facts in entries.items() if facts}

    rules = {f"rule {n}": [way() for _ in range(rng.integers(1, 3))] for n in range(rng.integers(2, 6))}
    rules["last"] = {"gives": [*"abcde"]}
    capacity = {fact: int(rng.integers(1, 4)) for fact in "abcde"}
    return Rules(rules, "e", capacity, {fact: int(rng.integers(0, min(2, capacity[fact]) + 1)) for fact in "abcd"})


class Twin:
    """One workshop: names of things instead of arrays of numbers."""

    def __init__(self, rules, seed, index, split, max_steps):
        self.rules, self.split, self.max_steps = rules, split, max_steps
        self.seed, self.index, self.episode = seed, index, -1
        ways = [(goal, dict(ask_of(way)), way) for goal, ways in rules.rules.items() for way in ways]
        self.ways, self.sources = [], {}
        for number, (goal, ask, way) in enumerate(ways):
            if any((name, other) == (goal, ask) for name, other, _ in ways[:number]):
                continue
            if not ask or any(other == ask and name != goal for name, other, _ in ways):
                self.sources[goal] = f"source of {goal}"
                ask = ask | {self.sources[goal]: 1}
            self.ways.append((goal, ask, way))
        self.things = [*rules.facts, *(self.sources[goal] for goal in rules.rules if goal in self.sources)]
        self.limits = dict(rules.capacity) | dict.fromkeys(self.sources.values(), 1)
        self.placed = [thing for thing in self.things if any(thing in ask for _, ask, _ in self.ways)]
        self.room = max(sum(ask.values()) for _, ask, _ in self.ways)
        self.begin()

    def begin(self):
        self.episode += 1
        key = key_of(self.seed, self.index, self.episode)
        order, n_drawn = shuffled(key, 0, [self.things.index(thing) for thing in self.placed])
        while self.split and len(order) >= 5 and is_held_out(order) != (self.split == "evaluation"):
            order, n_drawn = shuffled(key, n_drawn, order)
        self.places = [self.things[number] for number in order]
        self.shelf = Counter(dict(self.rules.start) | dict.fromkeys(self.sources.values(), 1))
        self.bench = Counter()
        self.achieved, self.steps = set(), 0

    def after(self, way):
        """Count the things of each kind after a way is applied."""
        counts = self.shelf + self.bench
        change = Counter(way.gives)
        change.subtract(way.uses)
        return Counter({thing: min(counts[thing] + change[thing], self.limits[thing]) for thing in self.things})

    def makes(self, ask, way):
        counts = self.shelf + self.bench
        return all(counts[thing] >= n for thing, n in ask.items()) and +self.after(way) != +counts

    def reachable(self):
        return {goal for goal, ask, way in self.ways if self.makes(ask, way)}

    def work(self):
        for goal, ask, way in self.ways:
            if +self.bench == Counter(ask):
                if not self.makes(ask, way):
                    return set()
                self.shelf, self.bench = self.after(way), Counter()
                of_target = [goal for goal, _, way in self.ways if self.rules.target in way.gives]
                return {goal, of_target[0]} if self.shelf[self.rules.target] else {goal}
        return set()

    def step(self, action):
        """Act, and return the fields of an outcome; where the episode ends the next one begins."""
        done = set()
        if 0 <= action < len(self.places):
            thing = self.places[action]
            if self.shelf[thing] and self.bench.total() < self.room:
                self.shelf[thing] -= 1
                self.bench[thing] += 1
        elif action == len(self.places):
            done = self.work()
        elif action == len(self.places) + 1:
            self.shelf, self.bench = self.shelf + self.bench, Counter()
        first = done - self.achieved
        self.achieved |= done
        self.steps += 1
        terminated, truncated = self.shelf[self.rules.target] > 0, self.steps >= self.max_steps
        goals = sum(1 << self.rules.names.index(goal) for goal in done)
        outcome = goals, len(first), False, False, float(terminated), terminated, truncated, self.steps
        if terminated or truncated:
            self.begin()
        return outcome

    def observation(self):
        return [[self.things.index(thing), self.shelf[thing], self.bench[thing]] for thing in self.places]


def ask_of(way):
    return Counter(way.needs) | Counter(way.uses)


def is_held_out(order):
    digest = 0
    for thing in order:
        digest = mixed((digest + thing + GOLDEN) & BITS)
    return digest >> 61 == 0
