"""The specification of agents in EscapeRooms."""

from hierroom.agents.features import offered
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.make import world_spec

WORLD = world_spec(EnvConfig())
FEATURES = offered(WORLD)
