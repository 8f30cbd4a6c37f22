"""The command ``compare`` in an empty folder, runs for it, a run for ``play``, and a report in a browser."""

import pytest
from evaluated_runs import line, make_run, rise
from report_reader import Reader, open_browser

import hierroom
from hierroom.commands import compare as command
from hierroom.commands.report import main as write_report
from hierroom.lab.compare import figure
from hierroom.support.errors import InputError


@pytest.fixture
def runs(tmp_path):
    """Eight runs on graph c; their success rates rise in straight lines from 0 to these, after a million steps."""
    for meta, ends in {"fixed-dfs": (0.7, 0.8, 0.9, 1.0), "random": (0.2, 0.4, 0.6, 0.8)}.items():
        for seed, end in enumerate(ends):
            make_run(tmp_path / "runs" / f"{meta}-{seed}", {"c": line(end)}, meta=meta, seed=seed)
    return tmp_path / "runs"


@pytest.fixture
def compare(tmp_path, monkeypatch, capsys):
    """Run the command in an empty folder; returns the text it prints. It draws no figure by default: that is slow."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("COLUMNS", "120")

    def run(*arguments, draws=False, **options):
        options = {"out": "compare", "resamples": 200, **options}
        flags = [text for name, value in options.items() if value is not None for text in (f"--{name}", str(value))]
        with monkeypatch.context() as patch:
            if not draws:
                patch.setattr(figure, "draw_comparison", lambda comparison, folder: [])
            assert command.main([*map(str, arguments), *flags]) == 0
        return capsys.readouterr().out

    return run


@pytest.fixture
def refused(compare):
    """Check that the command raises an `InputError` of one line that matches a pattern."""

    def check(match, *arguments, **options):
        with pytest.raises(InputError, match=match) as caught:
            compare(*arguments, **options)
        assert "\n" not in str(caught.value)

    return check


@pytest.fixture(scope="session")
def played(tmp_path_factory):
    """A run that has learned little."""
    out = tmp_path_factory.mktemp("played") / "run"
    small = {"graph": "a", "size": 11, "max_steps": 60, "num_envs": 8, "minibatches": 2, "steps": 256}
    hierroom.train(**small, meta="fixed-dfs", evaluations=0, out=out)
    return out


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """A report on a run that has learned a little, and on two with curves only."""
    folder = tmp_path_factory.mktemp("browsed")
    named = {"graph": "a", "size": 11, "max_steps": 80, "num_envs": 16, "minibatches": 2, "steps": 4096}
    hierroom.train(**named, meta="fixed-dfs", evaluations=3, evaluation_episodes=10, out=folder / "runs" / "a0")
    for seed in (0, 1):
        make_run(folder / "runs" / f"b{seed}", {"b": rise(1e5 * (1 + seed))}, meta="random", seed=seed)
    write_report([str(folder), "--out", str(folder / "report.html"), "--played", "20"])
    return folder / "report.html"


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    with open_browser(tmp_path_factory.mktemp("chromium")) as driver:
        yield driver


@pytest.fixture
def reader(browser, report):
    """A reader of the report, which logs nothing and loads nothing."""
    reader = Reader(browser, report)
    yield reader
    reader.assert_quiet()
