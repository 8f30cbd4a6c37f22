"""Compare the best trial of the preset's search with the preset before it, on seeds that the search did not have.

    python -m benchmarks.preset_check

A cell has the mean difference over seeds of the areas under the learning curves of `preset_check.toml`, or of the
returns at their ends, in standard deviations of the preset's runs on that task. The last row is the mean over tasks,
with its 95% interval over seeds by Student's t. The rule that the areas decide is in docs/presets.md.
"""

from __future__ import annotations

import pandas as pd
import tyro
from scipy import stats

from benchmarks.committed import done_rows, plan_of
from hierroom.support.cli import run
from hierroom.support.tables import markdown_table

COLUMNS = ("area_under_curve", "return")


def differences(rows: pd.DataFrame, column: str) -> pd.Series:
    """Return a cell for each task, and one for their mean."""
    values = rows.astype({column: float}).pivot_table(index="seed", columns=["variant", "task"], values=column)
    each = (values["best trial"] - values["task"]) / values["task"].std()  # [seeds, tasks]
    means = each.mean(axis=1)
    low, high = stats.t.interval(0.95, len(means) - 1, means.mean(), means.sem())
    cells = {name.rpartition(":")[2]: f"{mean:.2f}" for name, mean in each.mean().items()}
    return pd.Series({**cells, "mean": f"{means.mean():.2f} [{low:.2f}, {high:.2f}]"})


def main() -> int:
    """Print the table."""
    rows = done_rows("preset_check", plan_of("preset_check").runs())
    cells = pd.DataFrame({column: differences(rows, column) for column in COLUMNS})
    print(markdown_table(["task", "area", "return"], [[*map(str, row)] for row in cells.itertuples()]))
    return 0


if __name__ == "__main__":
    run(lambda: tyro.cli(main, description=__doc__))
