"""Groups of runs: those whose configs agree in the entries compared by, and what else they differ in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import pandas as pd

from hierroom.lab.compare.evaluated_run import EvaluatedRun
from hierroom.support.errors import InputError
from hierroom.support.tables import telling_columns

_NAMED_BY_VALUE = ("variant", "method", "meta", "reward", "preset", "network", "warm_start")
_NOT_THE_TREATMENT = ("seed", "graph", "threads", "device", "steps")
_SHOWN = 6


@dataclass(frozen=True)
class Group:
    """Runs that are compared as one."""

    choices: dict[str, str]  # what they agree in: for each entry compared by, its value as text
    runs: tuple[EvaluatedRun, ...]  # the runs

    @property
    def label(self) -> str:
        """A short name: ``hippo, random`` or ``gamma 0.95``."""
        named = [_named(name, value) for name, value in self.choices.items() if not self._says_nothing(name, value)]
        return ", ".join(named) or "no variant"

    def _says_nothing(self, name: str, value: str) -> bool:
        return (name, value) == ("variant", "") or (name == "meta" and value == "none" and "method" in self.choices)


def _named(name: str, value: str) -> str:
    if (name, value) == ("warm_start", "None"):
        return "no warm start"
    return value if name in _NAMED_BY_VALUE else f"{name} {value or 'none'}"


def differing_entries(runs: Sequence[EvaluatedRun]) -> tuple[str, ...]:
    """The entries that tell apart whatever is compared; ``method`` where nothing differs.

    They are taken one by one, those of `_NAMED_BY_VALUE` first, each that tells more runs apart. Seed, graph, steps,
    threads, device and the evaluations are not looked at. An entry that only differs where an earlier one does, as the
    reward does where the method does, is left out.
    """
    names = [name for name in runs[0].entries if _is_treatment(name)]
    first = [name for name in _NAMED_BY_VALUE if name in names]
    choices = {name: [run.choice(name) for run in runs] for name in [*first, *names]}
    return tuple(telling_columns(pd.DataFrame(choices))) or ("method",)


def entry_names(by: str) -> tuple[str, ...]:
    """Names of entries as the config has them: ``num-envs,gamma`` is ``num_envs`` and ``gamma``."""
    return tuple(dict.fromkeys(name.strip().lstrip("-").replace("-", "_") for name in by.split(",")))


def group_runs(runs: Sequence[EvaluatedRun], by: Sequence[str]) -> list[Group]:
    """Gather the runs by some entries of their configs.

    Groups are in the order of their first runs; where a single entry with numbers is compared by, in its order.
    """
    members: dict[tuple[str, ...], list[EvaluatedRun]] = {}
    for run in runs:
        members.setdefault(tuple(map(run.choice, by)), []).append(run)
    order = list(members)
    if all(len(values) == 1 and _is_number(values[0]) for values in order):
        order.sort(key=lambda values: float(values[0]))
    for same in members.values():
        _refuse_copies(same)
    return [Group(dict(zip(by, values, strict=True)), tuple(members[values])) for values in order]


def describe_differences(groups: Sequence[Group], by: Sequence[str]) -> list[str]:
    """Lines on what differs within and between groups besides what they are compared by."""
    lines = []
    all_mixed: set[str] = set()
    for group in groups:
        mixed = [name for name in _differing(group.runs) if name not in by]
        all_mixed.update(mixed)
        if mixed:
            values = [f"{name} ({', '.join(sorted({run.choice(name) for run in group.runs}))})" for name in mixed]
            lines.append(f"{group.label} mixes runs that differ in {shortened(values, _SHOWN)}")
    firsts = [group.runs[0] for group in groups]
    besides = [name for name in _differing(firsts) if name not in by and name not in all_mixed]
    if besides:
        lines.append(f"the groups differ also in {shortened(besides, _SHOWN)}")
    return lines


def _differing(runs: Sequence[EvaluatedRun]) -> list[str]:
    """Entries in which configs differ; a meta-controller or reward that follows from the method is not told again."""

    def chosen(run: EvaluatedRun, name: str) -> str:
        return str(run.entries[name]) if name in ("meta", "reward") else run.choice(name)

    return [name for name in runs[0].entries if _is_treatment(name) and len({chosen(run, name) for run in runs}) > 1]


def _is_treatment(name: str) -> bool:
    return name not in _NOT_THE_TREATMENT and not name.startswith("evaluation")


def _refuse_copies(runs: Iterable[EvaluatedRun]) -> None:
    """A run counted twice would make intervals too narrow; the same config and seed give the same run."""
    seen: dict[tuple[str, ...], EvaluatedRun] = {}
    for run in runs:
        names = [name for name in run.entries if _is_treatment(name) or name in ("seed", "graph")]
        key = tuple(str(run.entries[name]) for name in names if name not in ("preset", "variant"))
        key += (str(sorted(run.own_graphs.items())),)  # other graphs of the same name are for `Tasks.common` to refuse
        if key in seen:
            raise InputError(
                f"{seen[key].path} and {run.path} have the same seed, {run.seed}, and differ at most in steps, "
                "threads, device and evaluations, so that they count once; give one of them, or compare --by steps"
            )
        seen[key] = run


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def shortened(words: Sequence[str], n_shown: int) -> str:
    """The first words of a list, and how many more there are."""
    more = len(words) - n_shown
    return ", ".join(words[:n_shown]) + (f" and {more} more" if more > 0 else "")
