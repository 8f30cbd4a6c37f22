"""What more gradient steps and a smaller value loss change in the learning of PPO+Bonus, and of HiPPO.

    python -m hierroom sweep benchmarks/sweeps/brittle.toml --out OUT
    python -m benchmarks.study.brittle OUT      # adds the runs' rows to benchmarks/results/brittle/learning.csv
    python -m benchmarks.study.brittle          # prints the table

Explained variance is that of the value function in the first quarter of the run: 1 if it predicts every return, 0 if it
predicts no more than their mean. The others are of the second half: the policy's entropy in nats, its KL divergence
from the policy that collected the data, and the share of clipped ratios. A cell has the median of the runs on a graph.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import tyro

from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.support.tables import markdown_table

RESULTS = Path(__file__).parents[1] / "results" / "brittle"
CHANGED = ["minibatches", "epochs", "learning_rate", "value_weight", "entropy_weight", "normalize_advantages"]
RUN = ["variant", "graph", "seed"]
EARLY, LATE = ["explained_variance"], ["entropy", "approx_kl", "clip_fraction"]


def learned(out: Path) -> pd.DataFrame:
    """Return a row for each run of a sweep: its variant, and means over parts of its metrics."""
    rows = []
    sweep = pd.read_csv(out / "sweep.csv").set_index(["method", "graph", "seed", *CHANGED]).sort_index()
    for path in sorted((out / "runs").iterdir()):
        config = RunFolder.open(path).config()
        metrics = pd.read_csv(path / "metrics.csv").set_index("steps")
        if metrics.index[-1] < config.steps:
            continue
        settings = (
            config.agents.method,
            *config.env.names,
            config.seed,
            *(getattr(config.ppo, one) for one in CHANGED),
        )
        if settings not in sweep.index:
            raise InputError(f"{path.name} has no row in {out / 'sweep.csv'}; finish the sweep first")
        early, late = metrics.loc[: config.steps // 4, EARLY].mean(), metrics.loc[config.steps // 2 :, LATE].mean()
        rows.append((sweep.variant[settings], *config.env.names, config.seed, *early, *late))
    return pd.DataFrame(rows, columns=[*RUN, *EARLY, *LATE])


def table() -> str:
    """Return the medians of each variant over the seeds, on one graph and on the other."""
    success = pd.read_csv(RESULTS / "sweep.csv")[[*RUN, "success_rate"]]
    runs = success.merge(pd.read_csv(RESULTS / "learning.csv"), on=RUN)
    medians = runs.drop(columns="seed").groupby(["variant", "graph"], sort=False).median()
    forms = {"success_rate": "{:.0%}", **dict.fromkeys([*EARLY, *LATE], "{:.2f}"), "approx_kl": "{:.3f}"}
    cells = pd.DataFrame({name.replace("_", " "): medians[name].map(form.format) for name, form in forms.items()})
    both = cells.groupby("variant", sort=False).agg(", ".join).reset_index()
    return markdown_table([", ".join(runs.graph.unique()), *both.columns[1:]], both.to_numpy().tolist())


def main(out: tyro.conf.Positional[Path | None] = None) -> int:
    """Add the rows of a sweep's runs, or print the table.

    Args:
        out: the folder of the sweep.
    """
    if out is None:
        print(table())
        return 0
    path = RESULTS / "learning.csv"
    rows = [pd.read_csv(path)] if path.exists() else []
    pd.concat([*rows, learned(out)]).drop_duplicates(RUN, keep="last").to_csv(path, index=False, float_format="%.6g")
    return 0


if __name__ == "__main__":
    run(lambda: tyro.cli(main, description=__doc__))
