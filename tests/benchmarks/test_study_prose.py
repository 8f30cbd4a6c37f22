"""The numbers in the texts of the study and the conjecture are those of their tables and statistics, rounded."""

import re
from itertools import chain
from pathlib import Path

import pytest

from benchmarks.study.correlations import ceiling
from benchmarks.study.page_tables import factors_table, hierarchy_table
from benchmarks.study.result import HALVES, results_of
from benchmarks.study.tables import read_rows
from benchmarks.tables import FILE

ROOT = Path(__file__).parents[2]
NUMBER = r"-?(?:\d+(?:\.\d+)?|∞)"
ESTIMATE = re.compile(rf"({NUMBER})%?\s+\[({NUMBER})%?,\s+({NUMBER})%?\]")
TABLE = re.compile(r"<!-- (\w+) [^>]*-->\n.*?<!-- end of \1 -->\n", re.DOTALL)
Estimate = tuple[tuple[float, int], ...]
PRINTED = {
    "study": lambda: (
        hierarchy_table("study_paper_features", "3"),
        factors_table("study_factors_crossed", "3", "steps_to_50", "hippo", "as", "it", "is"),
    ),
    "conjecture": tuple,
}
"""Output of the commands that a page names."""


def estimates(text: str) -> list[Estimate]:
    """Each value with its interval, and how many places each number has."""
    return [
        tuple((float(number.replace("∞", "inf")), len(number.partition(".")[2])) for number in found)
        for found in ESTIMATE.findall(text)
    ]


def agree(stated: Estimate, known: Estimate) -> bool:
    """Check that two estimates agree to the digits that both give."""
    return all(
        one == other or (places < other_places and abs(one - other) <= 0.5 * (10**-places + 10**-other_places))
        for (one, places), (other, other_places) in zip(stated, known, strict=True)
    )


def known(page: str) -> list[Estimate]:
    """Return the estimates in the tables, files and statistics of a page; differences also with the other sign."""
    shown = [table[0] for table in TABLE.finditer((ROOT / "docs" / f"{page}.md").read_text())]
    links = [link for link, _, _ in FILE.findall((ROOT / "docs" / "tables.md").read_text()) if f"/{page}" in link]
    files = [(ROOT / "docs" / link).read_text() for link in links]
    found = [estimate for text in (*shown, *files, *PRINTED[page]()) for estimate in estimates(text)]
    for path in sorted((ROOT / "benchmarks" / "results").glob(f"{page}*/correlations*.csv")):
        rows = read_rows(path)
        for one in results_of(rows):
            found.append(tuple((number, 6) for number in ceiling(one.estimates[HALVES])))
        for row in rows:
            if not row["low"]:
                continue
            value, low, high = ((float(row[name]), 6) for name in ("value", "low", "high"))
            found.append((value, low, high))
            if row["statistic"].startswith("minus "):  # the text may say by how much the other one is ahead
                found.append(tuple((-number, places) for number, places in (value, high, low)))
    return found


@pytest.mark.parametrize(("page", "fewest"), [("study", 30), ("conjecture", 5)])
def test_each_estimate_in_the_text_is_in_a_table(page, fewest):
    """Leave out paragraphs that name the option with which a command prints their numbers."""
    known_estimates = known(page)
    text = TABLE.sub("", (ROOT / "docs" / f"{page}.md").read_text())
    paragraphs = [one for one in re.split(r"\n\n|\n- ", text) if "`--rooms" not in one]
    stated = [(estimate, one) for one in paragraphs for estimate in estimates(one)]
    assert len(stated) > fewest
    for estimate, paragraph in stated:
        assert any(agree(estimate, one) for one in known_estimates), (estimate, paragraph)


def counts_in_conjecture(pattern: str) -> list[int]:
    """Return the groups of a pattern that the text of the conjecture has, in one line, as whole numbers."""
    found = re.search(pattern, " ".join((ROOT / "docs" / "conjecture.md").read_text().split()))
    assert found
    return [*map(int, found.groups())]


def test_conjecture_tree_counts_equal_the_factor_table():
    stated = counts_in_conjecture(
        r"ends above 50% success on (\d+) of .* If .* on (\d+)\. Rewarded .* on (\d+) .* "
        r"With goals .* on (\d+) each\. PPO\+Bonus does so on (\d+)",
    )
    rows = read_rows(ROOT / "benchmarks" / "results" / "conjecture_factors" / "factors.csv")
    counted = {row["method"].removeprefix("hippo "): int(row["above 50% on"].removesuffix(" of 12")) for row in rows}
    assert counted["random goals"] == counted["learned goals"]
    variants = ("as it is", "goal not observed", "reward for any event", "learned goals", "ppo-bonus")
    assert stated == [counted[variant] for variant in variants]


def test_conjecture_tree_counts_equal_the_width_tables():
    stated = counts_in_conjecture(
        r"on (\d+) of (\d+) trees of width 1, on (\d+) of (\d+) of width 2 and on (\d+) of (\d+) of width 3 or 4\. "
        r"HiPPO with learned goals does so on (\d+), (\d+) and (\d+), PPO\+Bonus on (\d+), (\d+) and (\d+)\.",
    )
    folder = ROOT / "benchmarks" / "results" / "conjecture"
    tables = [read_rows(folder / name) for name in ("hierarchy.csv", "hierarchy_learned.csv")]
    rows = [one | other for one, other in zip(*tables, strict=True)]
    assert [row["width"] for row in rows] == ["1", "2", "3", "4"]
    columns = ("hippo HiPPO: reached on", "graphs", "hippo HiPPO learned: reached on", "ppo-bonus: reached on")
    counted = [[int(row[column]) for row in rows] for column in columns]
    scripted, trees, learned, bonus = ([one, two, sum(more)] for one, two, *more in counted)
    assert stated == [*chain(*zip(scripted, trees, strict=True)), *learned, *bonus]


def test_seed_ranges_in_the_text_are_in_a_file():
    text = TABLE.sub("", (ROOT / "docs" / "study.md").read_text())
    ranges = re.findall(r"(\d+\.\d) to (\d+\.\d)%", text)
    links = FILE.findall((ROOT / "docs" / "tables.md").read_text())
    files = "".join((ROOT / "docs" / link).read_text() for link, *_ in links if "study_unseen" in link)
    assert len(ranges) == 8
    for low, high in ranges:
        assert f"({low}% to {high}%)" in files, (low, high)


def test_conjecture_successes_equal_the_rows_of_the_runs():
    lines = (ROOT / "docs" / "conjecture.md").read_text().splitlines()
    start = next(n for n, line in enumerate(lines) if line.startswith("| success (%)"))
    (_, *headings), _, *rows = (
        [cell.strip(" `") for cell in line.split("|")[1:-1]] for line in lines[start : start + 4]
    )
    folder = ROOT / "benchmarks" / "results"
    runs = [run for name in ("chains", "rooms") for run in read_rows(folder / f"conjecture_{name}" / "sweep.csv")]
    for (method, *cells), variant in zip(rows, ("HiPPO", "PPO+Bonus"), strict=True):
        assert method.startswith(variant)
        for heading, cell in zip(headings, cells, strict=True):
            graph = heading if heading.startswith("keys") else f"benchmarks.chains:chain_{heading.split()[0]}"
            found = [run for run in runs if (run["variant"], run["graph"]) == (variant, graph)]
            found.sort(key=lambda run: int(run["seed"]))
            assert cell == " / ".join(f"{100 * float(run['success_rate']):g}" for run in found), (variant, graph)
