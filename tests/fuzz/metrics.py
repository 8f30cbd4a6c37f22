"""Fuzzing of a run's tables: each damage ends in one line, and no row is lost without a word.

``python -m tests.fuzz.metrics --count 5000`` tries so many; the seed fixes them. Half of the runs are as a crash leaves
them, without the last checkpoint. After a run is resumed each of its tables can be read and goes on. Each undamaged row
up to the checkpoint is in the table, unless the command said how many rows are lost.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

from hierroom.runs.folder.csv_table import CSVTable
from hierroom.support.errors import InputError

from .commands import TEXTS, end_of, report, wrong_end

TABLES = ("metrics.csv", "evaluations.csv", "episodes.csv")
COMMANDS = [("train", ["--resume", "run"])] * 4
COMMANDS += [("report", ["run", "--out", "report.html"]), ("compare", ["run", "other"])]


def damaged(content: bytes, rng: random.Random) -> bytes:
    at, lines = rng.randrange(len(content)), content.splitlines(keepends=True)
    n, text = rng.randrange(len(lines)), rng.choice(TEXTS).encode(errors="surrogatepass")
    entries = lines[n].rstrip().split(b",")
    entries[rng.randrange(len(entries))] = text
    return rng.choice(
        [
            *(b"", content[:at], content[:at] + text, content[:at] + b"\0" * rng.randrange(1, 5000)),
            content[:at] + bytes([rng.randrange(256)]) + content[at + 1 :],
            content[:at] + b"\0" * 8 + content[at + 8 :],
            b"".join(lines[:n] + lines[n + 1 :]),  # a line that is gone; the first is the one with the names
            b"".join([*lines[:n], b",".join(entries) + b"\r\n", *lines[n + 1 :]]),
            b"".join([*lines[:n], text + b"\r\n", *lines[n:]]),
            b"".join([*lines[:n], lines[n][:-4] + b"\r\n", *lines[n + 1 :]]),
            b"".join([*lines[:n], lines[n].replace(b",", b';"'), *lines[n + 1 :]]),
            b"".join([*lines[:n], b"9" + lines[n], *lines[n + 1 :]]),  # more steps than were taken
            b"".join(rng.sample(lines, len(lines))),
            content + content,
            content.replace(b"\r\n", b"\n"),
            b"\xef\xbb\xbf" + content,
        ]
    )


def lost(path: Path, right: bytes, wrong: bytes, steps: int, output: str) -> str | None:
    """Return the rows of a table that a resumed run has lost without a word, or None.

    The table was `right` before the damage and `wrong` after it; `output` is what the command printed.
    """
    held = {*path.read_bytes().splitlines()}
    rows = {row for row in right.splitlines()[1:] if int(row.split(b",")[0]) <= steps}
    gone = [line for line in wrong.splitlines() if line in rows and line not in held]
    if gone and f"{path.name} has lost" not in output:
        return f"lost without a word: {gone[:3]}"
    try:
        CSVTable(path).append([{"steps": steps + 1}])
        numbers = [int(float(row["steps"])) for row in CSVTable(path).read()]
    except InputError as error:
        return f"it cannot go on: {error}"
    if numbers[-1] != steps + 1 or max(numbers) > steps + 1:
        return f"after it went on it holds {numbers}"
    return None


def attempts(seed: int) -> Iterator[tuple[bytes, str | None]]:
    rng = random.Random(seed)
    while True:
        table = rng.choice(TABLES)
        right, path = Path("kept", table).read_bytes(), Path("run", table)
        wrong = damaged(right, rng)
        path.write_bytes(wrong)
        checkpoints = sorted(Path("run/checkpoints").glob("*.pt"))
        if rng.random() < 0.5:
            checkpoints.pop().unlink()
        name, words = rng.choice(COMMANDS)
        code, output = end_of(name, words)
        went_on = code == 0 and name == "train"
        problem = wrong_end(code, output)
        problem = problem or (lost(path, right, wrong, int(checkpoints[-1].stem), output) if went_on else None)
        yield wrong[-300:], f"{name} of {table}: {problem}" if problem else None


if __name__ == "__main__":
    raise SystemExit(report(__doc__, "damaged tables", attempts))
