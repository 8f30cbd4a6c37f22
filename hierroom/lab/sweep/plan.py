"""The runs of a sweep: every combination of the values to try, with each seed."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

from hierroom.goals import NAMED_GRAPHS, GoalGraph, GraphSpecs
from hierroom.runs.config.config import CHANGED_WHEN_RESUMED, TrainConfig
from hierroom.runs.config.presets import start_config
from hierroom.runs.config.run_name import run_name
from hierroom.runs.folder.config_file import flat_entries, flat_entry_types, hint_of
from hierroom.support.cells import join_names
from hierroom.support.errors import InputError, require_number, shown, warn_once
from hierroom.support.files import read_toml, to_json, usable_path
from hierroom.support.output import said_in_turn
from hierroom.support.typed_value import typed_value
from hierroom.worlds.env_config import OF_ESCAPE_ROOMS
from hierroom.worlds.make import find_task, ships

RESULTS_VERSION = 1
"""Raise it when the same config gives other results ('Results change' in CHANGELOG.md) or a default changes."""

_FIRST_DEFAULTS = {"evaluation_episodes": 100}
"""First defaults of entries, which digests still use after a change, so that earlier rows stay valid."""
_OWN_KEYS = ("graphs", "seeds", "episodes", "metas", "variants")
_IDENTITY = ("variant", "preset", "method", "meta", "graph", "size", "seed")
_PLANNED_STEPS = "planned_steps"  # ``steps`` in a row are the steps taken

Values = Mapping[str, Sequence[Any]]
"""Entries of a run's config, named as on the command line, each with the values to try."""


@dataclass(frozen=True)
class PlannedRun:
    """A run of a sweep."""

    config: TrainConfig
    identity: Mapping[str, str]  # columns of the table that distinguish it from other runs of the sweep, with texts
    entries: Mapping[str, str]  # the same for every entry of its config
    digest: str  # the digest of everything that determines its row

    @property
    def name(self) -> str:
        """The name of its folder."""
        return f"{run_name(self.config)}-{self.digest[:6]}"


@dataclass(frozen=True)
class Plan:
    """The runs that a sweep trains, and the evaluation at the end of each."""

    values: Values
    graphs: GraphSpecs = ()  # graphs or sets of them, each graph with its own runs; (): ``graph`` of the values
    seeds: int | None = None  # each run has seeds 0, 1, ..., seeds - 1; None: ``seed`` of the values
    variants: Mapping[str, Values] | None = None  # more values by variant, each combined with all others
    episodes: int | None = None  # episodes of the evaluations at the end; None: see `job.Job`
    metas: tuple[str, ...] = ()  # other meta-controllers to evaluate a trained controller with, if it sees goals

    def __post_init__(self) -> None:
        if self.episodes is not None:
            require_number("episodes", self.episodes, 1, 10**7, is_whole=True)
        if self.seeds is not None:
            require_number("seeds", self.seeds, 1, 10**6, is_whole=True)
        if shared := {"greedy", "excluded"}.intersection(self.metas):
            raise InputError(f"a sweep's table has columns {shared.pop()}_...; name the meta-controller by its module")
        given = {name for values in (self.values, *(self.variants or {}).values()) for name in values}
        for one, several, is_given in (("seed", "seeds", self.seeds is not None), ("graph", "graphs", self.graphs)):
            if is_given and one in given:
                raise InputError(f"{one} and {several} are both given and mean the same; leave one out")

    def runs(self) -> tuple[PlannedRun, ...]:
        """Return all runs, first those of seed 0 and so on, so that an unfinished sweep is balanced."""
        return self._runs

    @cached_property
    def _runs(self) -> tuple[PlannedRun, ...]:
        runs: dict[str, PlannedRun] = {}
        named: dict[tuple[str, ...], PlannedRun] = {}
        seeds = [{}] if self.seeds is None else [{"seed": [seed]} for seed in range(self.seeds)]
        variants = self.variants or {"": {}}
        several = [name for name, values in self.values.items() if len(values) > 1]
        several += [name for values in variants.values() for name in values]
        columns = dict.fromkeys(_PLANNED_STEPS if name == "steps" else name for name in several)
        varied = [name for name in columns if name not in _IDENTITY]
        parts = [*product(seeds, variants.items(), self._graphs())]
        for seed, (variant, own), graph in said_in_turn("planning the runs of the sweep", parts):
            values = {**self.values, **own, **seed, **graph}
            for chosen in product(*values.values()):
                run = self._run(variant, dict(zip(values, chosen, strict=True)), varied)
                if run.digest in runs:
                    same = {name: one for name, one in run.identity.items() if one != runs[run.digest].identity[name]}
                    differing = ", ".join(f"{name} {text}" for name, text in same.items())
                    why = f"with {differing}" if same else "from a value that is given twice"
                    raise InputError(f"two runs of the sweep are the same: {run.name} {why}; leave one out")
                runs[run.digest] = run
                if named.setdefault(tuple(run.identity.values()), run) is not run:
                    both = f"two goal graphs or sets of them that are called alike: {run.identity['graph']}"
                    raise InputError(
                        f"two runs of the sweep would have the same row, on {both}; give one of the graphs another name"
                    )
        return tuple(runs.values())

    def _graphs(self) -> Iterator[Values]:
        if self.graphs in ((), []):
            yield {}
            return
        from hierroom.complexity.graph_set import GraphSet  # imports scipy

        for graph in GraphSet(self.graphs).graphs:
            yield {"graph": [graph.name if NAMED_GRAPHS.get(graph.name) == graph else graph]}

    def _run(self, variant: str, entries: dict[str, Any], varied: Sequence[str]) -> PlannedRun:
        start = start_config(entries.pop("preset", None), entries)
        config = start.changed(**{"threads": 1, **entries})  # processes run in parallel instead
        config.env.refuse_unread(entries)
        if ships(config.env.task):
            find_task(config.env.task)  # refuses a name without a task
        own = config.entries | {"meta": config.resolved_method.meta, "graph": config.env.names, "variant": variant}
        own[_PLANNED_STEPS] = own.pop("steps")
        texts = {name: _text(value) for name, value in own.items()}
        if config.env.task is not None:
            texts |= dict.fromkeys({*OF_ESCAPE_ROOMS} - {"graph"}, "")  # graph is the task
        identity = {name: texts[name] for name in (*_IDENTITY, *varied)}
        return PlannedRun(config, identity, texts, self._digest(config))

    def _digest(self, config: TrainConfig) -> str:
        usual = {**_flat(TrainConfig().to_dict()), **_FIRST_DEFAULTS}
        table = {name: value for name, value in _flat(config.to_dict()).items() if value != usual[name]}
        for name in CHANGED_WHEN_RESUMED - {"steps", "warm_start"}:
            table.pop(name, None)
        decides = [RESULTS_VERSION, table, self.episodes, list(self.metas)]
        if config.env.exclude:
            decides.append("evaluated on what is excluded, too")
        return hashlib.sha256(json.dumps(json.loads(to_json(decides)), sort_keys=True).encode()).hexdigest()[:16]


def read_plan(path: Path | None, words: Sequence[str] = ()) -> Plan:
    """Return the plan of a TOML file and of words ``entry=value,value,...``, which override the file.

    The file has entries of a run's config by flat names, with lists of values to try. It may also have ``graphs``,
    ``seeds``, ``episodes``, ``metas``, and tables ``[[variants]]``, each with a ``name`` and more entries.
    """
    if path is not None and usable_path(path).is_dir():
        raise InputError(f"{path} is a folder; a sweep takes entries or a TOML file of them, and its folder as --out")
    table = {} if path is None else read_toml(path, "sweep", or_any=True)
    if path is not None and not table:
        warn_once(f'{path} has no entries, such as method = ["hippo", "ppo"]')
    where = "" if path is None else f"{path}: "
    variants = {}
    own = {name: table.pop(name) for name in _OWN_KEYS if name in table}
    several = own.pop("variants", [])
    if not isinstance(several, list):
        raise InputError(f"{where}variants are tables, [[variants]], not {shown(several)}")
    for one in several:
        if not isinstance(one, dict) or not isinstance(one.get("name"), str) or not one["name"].isprintable():
            name = shown(one.get("name", "none") if isinstance(one, dict) else one)
            raise InputError(f'{where}each of [[variants]] needs a name = "..." of one line, not {name}')
        name = one.pop("name")
        variants[name] = _typed(one, f"{where}variant {name}: ")
    if len(variants) < len(several):
        raise InputError(f"{where}two variants have the same name")
    named: dict[str, list[Any]] = {}
    for name, values in map(_assignment, words):
        if name in named:
            raise InputError(f"{name} is given twice; several values to try are joined by commas, {name}=value,value")
        named[name] = values
    for one, several in (("seed", "seeds"), ("graph", "graphs")):
        if one in named:
            own.pop(several, None)
    overriding = _typed(named, "")
    values = {**_typed(table, where), **overriding}
    variants = {name: {entry: one[entry] for entry in one if entry not in overriding} for name, one in variants.items()}
    kinds = {"graphs": str | tuple[str, ...], "seeds": int, "episodes": int, "metas": tuple[str, ...]}
    settings: dict[str, Any] = {name: typed_value(f"{where}{name}", kinds[name], own[name]) for name in own}
    return Plan(values, variants=variants, **settings)


def _assignment(word: str) -> tuple[str, list[Any]]:
    name, _, text = word.partition("=")
    if not text:
        raise InputError(f"a sweep takes entry=value,value,... such as method=hippo,ppo, not {shown(word)}")
    if not text.startswith("[") and any(part.startswith(('"', "'")) for part in text.split(",")):
        text = f"[{text}]"  # names in quotes may have commas
    values = _value(text) if text.startswith("[") else [_value(part) for part in text.split(",")]
    if values == text:
        raise InputError(f'values in quotes or brackets are TOML, such as warm_start="a,b","c", not {shown(word)}')
    return name.lstrip("-").replace("-", "_"), values if isinstance(values, list) else [values]


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def _typed(table: Mapping[str, Any], where: str) -> dict[str, list[Any]]:
    types, typed = flat_entry_types(), {}
    for name, values in flat_entries(table, where).items():
        if name in _OWN_KEYS:
            place = "in a file, under [[variants]]" if name == "variants" else f"as --{name}, or at the head of a file"
            raise InputError(f"{where}{name} is no entry of a run; it is given {place}")
        if name not in types:
            raise InputError(f"{where}there is no entry {name!r}; {hint_of(name, [*types, *_OWN_KEYS])}")
        several = values if isinstance(values, list) else [values]
        if not several:
            raise InputError(f"{where}{name} needs at least one value")
        typed[name] = [typed_value(f"{where}{name}", types[name], value) for value in several]
    return typed


def _flat(table: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in table.items():
        flat |= _flat(value, f"{name}.") if isinstance(value, dict) else {f"{before}{name}": value}
    return flat


def _text(value: Any) -> str:
    if isinstance(value, (tuple, list)):
        return join_names(map(_text, value), " ")
    return value.name if isinstance(value, GoalGraph) else str(value)
