"""Sweeps of runs that take no time."""

from pathlib import Path

from evaluated_runs import rows

from hierroom.lab.sweep.plan import Plan, read_plan

TINY = ("num_envs=4", "steps=300", "sequence_length=16", "sequences_per_update=4", "evaluations=2", "size=11")


TIMES = ("seconds", "steps_per_second")


def tiny_words(*words: str) -> list[str]:
    given = {word.partition("=")[0] for word in words}
    return [word for word in (*TINY, "max_steps=40") if word.partition("=")[0] not in given] + [*words]


def plan(*words: str, **settings) -> Plan:
    return Plan(**{**vars(read_plan(None, tiny_words(*words))), "episodes": 4, **settings})


def results(path: Path) -> list[dict[str, str]]:
    """Return the rows without their times, sorted by digest."""
    kept = [{k: v for k, v in row.items() if not k.startswith(TIMES)} for row in rows(path)]
    return sorted(kept, key=lambda row: row["digest"])
