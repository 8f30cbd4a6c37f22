"""Groups of runs with configs that agree in some entries, and other differences between the runs."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import pandas as pd

from hierroom.lab.compare.evaluated_run import EvaluatedRun
from hierroom.lab.compare.style import MAX_GROUPS
from hierroom.runs.folder.config_file import hint_of
from hierroom.support.errors import InputError, one_line
from hierroom.support.tables import telling_columns

_NAMED_BY_VALUE = ("variant", "method", "meta", "reward", "preset", "network", "warm_start")
_NOT_THE_TREATMENT = ("seed", "graph", "layout", "threads", "device", "steps", "film")
_SHOWN = 6


@dataclass(frozen=True)
class Group:
    """Runs that are compared as one group, and the values, as text, that they have in common."""

    choices: dict[str, str]
    runs: tuple[EvaluatedRun, ...]

    @property
    def label(self) -> str:
        """A short name: ``hippo, random`` or ``gamma 0.95``."""
        names = []
        for name, value in self.choices.items():
            if (name, value) == ("variant", "") or ((name, value) == ("meta", "none") and "method" in self.choices):
                continue
            text = value if name in _NAMED_BY_VALUE else f"{name} {value or 'none'}"
            names.append("no warm start" if (name, value) == ("warm_start", "None") else text)
        return ", ".join(names) or "no variant"


def choose_groups(runs: Sequence[EvaluatedRun], by: str | None) -> list[Group]:
    """Group the runs by the named entries, or by those that differ; refuse more groups than a figure can show."""
    names = differing_entries(runs) if by is None else entries_named(by, runs[0].entries)
    groups = group_runs(runs, names)
    if len(groups) > MAX_GROUPS:
        raise InputError(f"by {', '.join(names)} there are {len(groups)} groups; at most {MAX_GROUPS} can be compared")
    return groups


def entries_named(by: str, entries: Collection[str]) -> tuple[str, ...]:
    """Return the entries that ``--by`` names, of those of a run's config; --num-envs means num_envs."""
    names = dict.fromkeys(name.strip().lstrip("-").replace("-", "_") for name in by.split(","))
    for name in names:
        if name not in entries:
            hint = hint_of(name, entries)
            raise InputError(f"--by takes entries of a run's config, joined by commas, not {name!r}; {hint}")
    return tuple(names)


def differing_entries(runs: Sequence[EvaluatedRun]) -> tuple[str, ...]:
    """Return the entries that differ between runs, without those that split no group further; if none, ``method``."""
    names = [name for name in runs[0].entries if _is_treatment(name)]
    first = [name for name in _NAMED_BY_VALUE if name in names]
    choices = {name: [run.choice(name) for run in runs] for name in [*first, *names]}
    return tuple(telling_columns(pd.DataFrame(choices))) or ("method",)


def group_runs(runs: Sequence[EvaluatedRun], by: Sequence[str]) -> list[Group]:
    """Group the runs by some entries. Groups are in the order of their first runs, or of a single entry's numbers."""
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
    """Return notes on differences within and between groups besides the entries that they are compared by."""
    lines = []
    all_mixed: set[str] = set()
    for group in groups:
        mixed = [name for name in _differing(group.runs) if name not in by]
        all_mixed.update(mixed)
        if mixed:
            values = [f"{name} ({', '.join(sorted({run.choice(name) for run in group.runs}))})" for name in mixed]
            lines.append(f"{group.label} mixes runs that differ in {shortened(values, _SHOWN)}")
        if code := _different_code(group.runs):
            lines.append(f"{group.label} was trained with different code: {shortened(code, _SHOWN)}")
    runs = [run for group in groups for run in group.runs]
    if not any(_different_code(group.runs) for group in groups) and (code := _different_code(runs)):
        lines.append(f"the groups were trained with different code: {shortened(code, _SHOWN)}")
    unknown = [one_line(str(run.path)) for run in runs if not run.code]
    if 0 < len(unknown) < len(runs):
        lines.append(f"provenance.json does not say with which code these were trained: {shortened(unknown, _SHOWN)}")
    firsts = [group.runs[0] for group in groups]
    besides = [name for name in _differing(firsts) if name not in by and name not in all_mixed]
    if besides:
        lines.append(f"the groups differ also in {shortened(besides, _SHOWN)}")
    return lines


def _different_code(runs: Sequence[EvaluatedRun]) -> list[str]:
    names = dict.fromkeys(name for run in runs for name in run.code)
    versions = {name: sorted(set().union(*(run.code.get(name, ()) for run in runs))) for name in names}
    short = {one: one_line(one)[: 8 if len(one) == 64 else 60] for ones in versions.values() for one in ones}  # SHA-256
    several = {name: ones for name, ones in versions.items() if len(ones) > 1}
    return [f"{one_line(name)} ({', '.join(short[one] for one in ones)})" for name, ones in several.items()]


def _differing(runs: Sequence[EvaluatedRun]) -> list[str]:
    """Return the entries in which configs differ; a meta-controller or reward counts only if the config names it."""

    def chosen(run: EvaluatedRun, name: str) -> str:
        return str(run.entries[name]) if name in ("meta", "reward") else run.choice(name)

    return [name for name in runs[0].entries if _is_treatment(name) and len({chosen(run, name) for run in runs}) > 1]


def _is_treatment(name: str) -> bool:
    return name not in _NOT_THE_TREATMENT and not name.startswith("evaluation")


def _refuse_copies(runs: Iterable[EvaluatedRun]) -> None:
    seen: dict[tuple[str, ...], EvaluatedRun] = {}
    for run in runs:
        names = [name for name in run.entries if _is_treatment(name) or name in ("seed", "graph")]
        key = tuple(str(run.entries[name]) for name in names if name not in ("preset", "variant"))
        key += (str(sorted(run.user_graphs.items())),)  # `Tasks.common` refuses other graphs of the same name
        if key in seen:
            both = f"{seen[key].path} and {run.path} have the same seed, {run.entries['seed']}"
            raise InputError(
                f"{both}, and differ at most in steps, threads, device and evaluations: a repeated run; give "
                "one of them, or compare --by steps"
            )
        seen[key] = run


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def shortened(words: Sequence[str], n_shown: int) -> str:
    """Return the first words of a list, and the number of the others."""
    more = len(words) - n_shown
    return ", ".join(words[:n_shown]) + (f" and {more} more" if more > 0 else "")
