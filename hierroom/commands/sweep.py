"""Train many runs: ``python -m hierroom sweep method=hippo,ppo-bonus --graphs a b c --seeds 5 --out OUT``."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from hierroom.goals.specs import plain_specs
from hierroom.lab.sweep.plan import Plan, PlannedRun, read_plan
from hierroom.lab.sweep.summary import summarise
from hierroom.lab.sweep.sweep import Shard, Sweep
from hierroom.runs.config.config import ENTRIES
from hierroom.runs.config.unread_entries import entries_without_effect
from hierroom.support.cli import Flag, given, read_arguments, shell_words
from hierroom.support.errors import InputError
from hierroom.support.output import warn
from hierroom.support.tables import named_table, print_table

if TYPE_CHECKING:
    import pandas as pd

    from hierroom.lab.sweep.search import Search

_ENTRY = re.compile(r"[A-Za-z_][\w.-]*=")
_FLAGS = ("--list", "--markdown", "--help", "-h")  # options without a value
_BEST = 5  # trials of a search that are shown
_OF_SEVERAL = ("--graphs", "--metas")  # options with all words up to the next option or entry; others take one value


@dataclass(frozen=True)
class SweepArguments:
    """Train every combination of some values, and gather the results in one table.

    Writes OUT/sweep.csv, with a row for each finished run, and OUT/runs/, with a complete folder for each run. Giving
    the same command again trains missing runs, and repeats a run if its config has changed, as with another gamma.

    Args:
        what: entries of training, each with the values to try (method=hippo,ppo-bonus gamma=0.9,0.99 steps=200_000),
            optionally after a TOML file of such entries. Give lists as 'features=[["view","goal"],["view"]]'.
        out: the folder to write to, new or of the same sweep.
        graphs: goal graphs or sets of them, such as a b rooms:4; each graph gets runs.
        seeds: seeds 0, 1, ... of each run.
        episodes: episodes of the evaluations at the end of each run; by default 1000, or as many as take a quarter of
            the steps of training together, but no fewer than 100.
        metas: further meta-controllers to evaluate the trained controllers with, if these see goals.
        processes: number of runs at a time; by default one for each core.
        shard: train only a part of the runs, such as 3/8 on the third of eight machines, with or without a shared OUT.
        ray: address of a Ray cluster that trains the runs: auto, HOST:6379 or ray://HOST:10001.
        list: list the runs and say which are done; train nothing.
        markdown: print the table of medians of the finished runs in Markdown; train nothing.
        search: instead of every combination, try so many chosen by Optuna, on all of the tasks and graphs together.
            Numbers may also have a range, such as learning_rate=1e-4..3e-3. Its seeds are counted from 1,000,000.
    """

    what: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="[PLAN.toml] [ENTRY=VALUES ...]")] = ()
    out: Path = Path("sweep")
    graphs: tuple[str, ...] = ()
    seeds: int | None = None
    episodes: int | None = None
    metas: tuple[str, ...] = ()
    processes: int | None = None
    shard: str = "1/1"
    ray: str | None = None
    list: Flag = False
    markdown: Flag = False
    search: int | None = None

    @property
    def _settings(self) -> dict[str, Any]:
        return given(self, "graphs", "seeds", "episodes", "metas")

    @property
    def _file_and_words(self) -> tuple[Path | None, tuple[str, ...]]:
        is_file = bool(self.what) and not _ENTRY.match(self.what[0])
        return Path(self.what[0]) if is_file else None, self.what[is_file:]

    def plan(self) -> Plan:
        """Return the plan of the file, the entries and the options."""
        return replace(read_plan(*self._file_and_words), **self._settings)

    def searched(self) -> Search:
        """Return the search of the file, the entries and the options."""
        if self.list or self.markdown or self.shard != "1/1":
            raise InputError("--search chooses each trial by those before it; leave out --list, --markdown and --shard")
        from hierroom.lab.sweep.search import Search  # imports torch

        return Search.read(*self._file_and_words, self.out, **self._settings)

    @property
    def command(self) -> str:
        """The command without options that do not change results (folder, processes); so it depends on no machine."""
        words = [Path(word).name if Path(word).is_absolute() else word for word in self.what]
        for name, value in self._settings.items():
            words += [f"--{name}", *map(str, value if isinstance(value, tuple) else (value,))]
        return shell_words("python", "-m", "hierroom", "sweep", *words)


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    arguments = read_arguments(SweepArguments, "sweep", _entries_first(argv))
    if not arguments.what and not arguments.graphs:
        entries = "entries with values to try such as method=hippo,ppo"
        raise InputError(f"say what to train: {entries}, a TOML file, or --graphs")
    if arguments.list and arguments.markdown:
        raise InputError("--list and --markdown print different things; choose one")
    if arguments.processes is not None and arguments.ray is not None:
        raise InputError("--processes is for this machine, and --ray trains on a cluster; leave one out")
    if arguments.search is not None:
        return _search(arguments.searched(), arguments, argv)
    shard = Shard.parse(arguments.shard)
    sweep = Sweep(arguments.plan(), arguments.out)
    planned = sweep.plan.runs()
    for note in _notes(sweep.plan, planned):
        warn(note)
    runs = shard.of(planned)
    if not runs:
        print(f"shard {arguments.shard} holds none of the {len(planned)} runs")
        return 0
    if arguments.list:
        done = {*sweep.table.read()["digest"]}
        sweep.check([run for run in runs if run.digest not in done], arguments.processes)
        for run in runs:
            state = "done" if run.digest in done else "begun" if (sweep.out / "runs" / run.name).exists() else "-"
            print(f"{state:<6}{run.name}")
        return 0
    if arguments.markdown:
        sweep.check((), arguments.processes)
        print(summarise(runs, sweep.table.of(runs), sweep.plan.metas).markdown())
        return 0
    table = sweep.table.path
    outcome = sweep.fill(processes=arguments.processes, ray=arguments.ray, shard=shard, command=arguments.command)
    rows = sweep.table.of(runs)
    print_table(summarise(runs, rows, sweep.plan.metas).table())
    for failed, reason in outcome.failures:
        print(f"failed: {failed.name}: {reason}")
    if replaced := [run.name for run in outcome.replaced]:
        both = "give both values of an entry together to keep a row of each"
        warn(f"the row of {_first_of(replaced)} stands in the place of one of another config; {both}")
    if sweep.plan.episodes is None and (note := _on_few_episodes(rows)):
        warn(note)
    if changed := sweep.made_with_other_code():
        again = f"to train again, delete the rows from {table}, and the folders in {sweep.out / 'runs'}"
        warn(f"own code has changed since {_first_of(changed)} was trained; {again}")
    if outcome.is_interrupted:
        return _stopped(argv)
    print(f"{len(rows)} of {len(runs)} runs are in {table}")
    return 1 if outcome.failures else 0


def _search(search: Search, arguments: SweepArguments, argv: Sequence[str]) -> int:
    first = search.plan_of(0, search.values(search.preset()))
    for note in _notes(first, first.runs()):
        warn(note)
    how = {"processes": arguments.processes, "ray": arguments.ray, "command": arguments.command}
    if search.fill(arguments.search or 0, lambda line: print(line, file=sys.stderr, flush=True), **how):
        return _stopped(argv)
    rows = search.rows()
    best = sorted((row for row in rows if row["state"] == "complete"), key=lambda row: -row["score"])[:_BEST]
    print_table(named_table([*rows[0]], [[str(value) for value in row.values()] for row in best], len(rows[0])))
    print(f"{len(rows)} trials are in {search.out / 'trials.csv'}")
    if best:
        entries = {name: values[0] for name, values in search.plan.values.items() if name != "seed"}
        graph = {"graph": plain_specs(search.plan.graphs)[0]} if search.plan.graphs else {}
        options = _options({**entries, **graph, **{name: best[0][name] for name in search.space}})
        print(f"the best again:\n{shell_words('python', '-m', 'hierroom', 'train', *options)}")
    return 0 if best else 1


def _options(entries: Mapping[str, Any]) -> Iterator[str]:
    for name, value in entries.items():
        part, dot, field = name.replace("_", "-").rpartition(".")
        if isinstance(value, bool):
            yield f"--{part}{dot}{'' if value else 'no-'}{field}"
        else:
            yield f"--{part}{dot}{field}"
            yield from map(str, value if isinstance(value, tuple) else (value,))


def _stopped(argv: Sequence[str]) -> int:
    print(f"stopped and saved; go on with:\n{shell_words('python', '-m', 'hierroom', 'sweep', *argv)}")
    return 130


def _on_few_episodes(rows: pd.DataFrame) -> str:
    import pandas as pd

    from hierroom.lab.sweep.job import MOST_EPISODES

    played = rows.filter(regex="evaluated_episodes$").apply(pd.to_numeric, errors="coerce")
    short = played[(played < MOST_EPISODES).any(axis=1)]
    if not len(short):
        return ""
    runs, fewest = f"{len(short)} of {len(rows)} runs", short.min(axis=None)
    why = f"{MOST_EPISODES} would take more than a quarter of the steps of training"
    more = "--episodes, given beforehand, or evaluate RUN plays more"
    return f"the evaluations at the end of {runs} have {fewest:.0f} episodes or more, as {why}; {more}"


def _first_of(names: Sequence[str]) -> str:
    return names[0] + (f" (and {len(names) - 1} more)" if len(names) > 1 else "")


def _entries_first(argv: Sequence[str]) -> list[str]:
    first, options, option = [], [], ""
    for n, word in enumerate(argv):
        flag, _, value = word.partition("=")
        if flag.startswith("--") and (name := flag[2:].replace("-", "_")) in ENTRIES:
            entry = f"{name}={value or ' '.join(argv[n + 1 : n + 2]) or 'VALUE,VALUE'}"
            raise InputError(f"a sweep takes entries of training as words: {entry}, not {flag}")
        if word.startswith("-"):
            option = "" if word in _FLAGS or "=" in word else word
            options.append(word)
        elif option and (options[-1] == option or (option in _OF_SEVERAL and not _ENTRY.match(word))):
            options.append(word)
        else:
            option = ""
            first.append(word)
    return [*first, *options]


def _notes(plan: Plan, runs: Sequence[PlannedRun]) -> list[str]:
    given = {name for values in (plan.values, *(plan.variants or {}).values()) for name in values}
    unread = given.intersection(*(entries_without_effect(run.config) for run in runs))
    if plan.metas and not any(run.config.resolved_method.sees_goal for run in runs):
        unread.add("metas")
    lines = [f"{name} is given, and has no effect on any run of the sweep" for name in sorted(unread)]
    if plan.graphs:
        from hierroom.complexity.graph_set import GraphSet  # imports scipy

        lines += GraphSet(plan.graphs).notes
    return lines
