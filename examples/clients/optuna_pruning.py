"""Optuna looks for a learning rate and stops runs that fall behind the others, from a callback after each update."""

import tempfile
from pathlib import Path

import optuna

import hierroom

SETTINGS = {"graph": "a", "size": 11, "num_envs": 16, "steps": 20_000, "evaluations": 2, "evaluation_episodes": 20}


def objective(trial: optuna.Trial) -> float:
    """Return the success rate after a run, or leave it early."""

    def is_behind(trainer) -> bool:
        trial.report(trainer.metrics()["success_rate"], trainer.steps)
        return trial.should_prune()

    rate = trial.suggest_float("learning_rate", 1e-5, 1e-2, log=True)
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        agent = hierroom.train(**SETTINGS, learning_rate=rate, out=run, log="none", callback=is_behind, quiet=True)
        if not agent.is_finished:
            raise optuna.TrialPruned
        episodes = list(hierroom.rollout(agent, episodes=50))
    return sum(episode.success for episode in episodes) / len(episodes)


if __name__ == "__main__":
    study = optuna.create_study(
        direction="maximize",
        sampler=optuna.samplers.TPESampler(seed=0),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=2),
    )
    study.optimize(objective, n_trials=5)
    pruned = sum(trial.state == optuna.trial.TrialState.PRUNED for trial in study.trials)
    print(f"best learning rate {study.best_params['learning_rate']:.1e}; {pruned} of {len(study.trials)} runs pruned")
