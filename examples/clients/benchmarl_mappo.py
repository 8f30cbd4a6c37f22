"""BenchMARL: MAPPO for the two agents, as a custom task, in the box view of the parallel environment."""

import copy
import tempfile

from benchmarl.algorithms import MappoConfig
from benchmarl.environments import Task
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from torchrl.envs import PettingZooWrapper

import hierroom


class EscapeRoomClass(PettingZooClass):
    """BenchMARL's PettingZoo tasks, of our environment."""

    def get_env_fun(self, num_envs, continuous_actions, seed, device):
        """Return a function that makes one environment."""
        config = copy.deepcopy(self.config)
        return lambda: PettingZooWrapper(
            hierroom.box_view(hierroom.parallel_env(**config)), categorical_actions=True, seed=seed, device=device
        )

    def supports_discrete_actions(self):
        """Ours are."""
        return True

    def max_steps(self, env):
        """Of an episode."""
        return self.config["max_steps"]

    @staticmethod
    def env_name():
        """For logs."""
        return "hierroom"


class EscapeRoomTask(Task):
    """The tasks."""

    GRAPH_A = None

    @staticmethod
    def associated_class():
        """Return the class of the environments."""
        return EscapeRoomClass


config = ExperimentConfig.get_from_yaml()
config.loggers, config.evaluation, config.create_json, config.render = [], False, False, False
config.max_n_iters, config.max_n_frames = 2, None
config.on_policy_collected_frames_per_batch, config.on_policy_n_envs_per_worker = 240, 2
config.on_policy_n_minibatch_iters, config.on_policy_minibatch_size = 2, 120
config.save_folder = tempfile.mkdtemp()
experiment = Experiment(
    task=EscapeRoomTask.GRAPH_A.get_task({"graph": "a", "size": 11, "max_steps": 60, "subgoal_horizon": 20}),
    algorithm_config=MappoConfig.get_from_yaml(),
    model_config=MlpConfig.get_from_yaml(),
    critic_model_config=MlpConfig.get_from_yaml(),
    seed=0,
    config=config,
)
experiment.run()
print(f"{experiment.total_frames} steps in {experiment.n_iters_performed} iterations")
