"""The study's text tells numbers that its tables and statistics hold, rounded."""

import csv
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NUMBER = r"-?(?:\d+(?:\.\d+)?|∞)"
ESTIMATE = re.compile(rf"({NUMBER})\s+\[({NUMBER}),\s+({NUMBER})\]")
TABLE = re.compile(r"<!-- (\w+) [^>]*-->\n.*?<!-- end of \1 -->\n", re.DOTALL)
Estimate = tuple[tuple[float, int], ...]


def estimates(text: str) -> list[Estimate]:
    """Each value with its interval, and how many places each number has."""
    return [
        tuple((float(number.replace("∞", "inf")), len(number.partition(".")[2])) for number in found)
        for found in ESTIMATE.findall(text)
    ]


def agree(told: Estimate, known: Estimate) -> bool:
    """Check that two estimates agree to the digits that both give."""
    return all(
        one == other or (places < other_places and abs(one - other) <= 0.5 * (10**-places + 10**-other_places))
        for (one, places), (other, other_places) in zip(told, known, strict=True)
    )


@pytest.fixture(scope="module")
def known() -> list[Estimate]:
    """Return the estimates in the study's tables and statistics; differences also with the other sign."""
    tables = [
        table[0]
        for page in ("study.md", "study-tables.md")
        for table in TABLE.finditer((ROOT / "docs" / page).read_text())
    ]
    found = [estimate for table in tables for estimate in estimates(table)]
    for path in sorted((ROOT / "benchmarks" / "results").glob("study*/correlations*.csv")):
        with path.open(newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["low"]]
        for row in rows:
            value, low, high = ((float(row[name]), 6) for name in ("value", "low", "high"))
            found.append((value, low, high))
            if row["statistic"].startswith("minus "):  # the text may say by how much the other one is ahead
                found.append(tuple((-number, places) for number, places in (value, high, low)))
    return found


def test_each_estimate_of_the_text_stands_in_a_table(known):
    """But for paragraphs that name the option with which a command prints their numbers."""
    text = TABLE.sub("", (ROOT / "docs" / "study.md").read_text())
    paragraphs = [one for one in re.split(r"\n\n|\n- ", text) if "`--rooms" not in one]
    told = [(estimate, one) for one in paragraphs for estimate in estimates(one)]
    assert len(told) > 30
    for estimate, paragraph in told:
        assert any(agree(estimate, one) for one in known), (estimate, paragraph)
