"""Thin kernels that apply the rules of the world to a batch of levels."""

from hierroom.support.kernel import copy_matrix, njit
from hierroom.worlds.escape_room.generation_kernels import generate, generate_of_maps
from hierroom.worlds.escape_room.step_kernels import advance_and_look
from hierroom.worlds.escape_room.view_kernels import look_and_remember


@njit(cache=True, nogil=True)
def reset_levels(levels, grids, graphs, outcomes, envs):
    """Begin the next episode in environments [M]."""
    for n in envs:
        generate(levels[n], grids[n], graphs)
        look_and_remember(levels[n], grids[n], outcomes[n].tiles)


@njit(cache=True, nogil=True)
def reset_levels_of_maps(levels, grids, maps, map_grids, outcomes, envs):
    """Begin the next episode in environments [M] on one of the maps."""
    for n in envs:
        generate_of_maps(levels[n], grids[n], maps, map_grids)
        look_and_remember(levels[n], grids[n], outcomes[n].tiles)


@njit(cache=True, nogil=True)
def look_levels(levels, grids, outcomes, envs):
    """Write the current view of environments [M], for example after a state was restored; each must have begun."""
    for n in envs:
        look_and_remember(levels[n], grids[n], outcomes[n].tiles)


@njit(cache=True, nogil=True)
def step_levels(levels, grids, actions, outcomes):
    """Step every environment that has not ended; the flags of the others do not change."""
    for n in range(levels.shape[0]):
        if levels[n].has_ended:
            outcomes[n].achieved, outcomes[n].n_first, outcomes[n].reward = 0, 0, 0.0
            outcomes[n].is_novel, outcomes[n].is_discovery = False, False
        else:
            advance_and_look(levels[n], grids[n], actions[n], outcomes[n])
            if levels[n].has_ended:
                copy_matrix(outcomes[n].tiles, outcomes[n].final_tiles)


@njit(cache=True, nogil=True)
def step_and_reset_levels(levels, grids, graphs, outcomes, finals, actions):
    """Step every environment; where the episode ends, store its final view and level and begin the next one."""
    for n in range(levels.shape[0]):
        advance_and_look(levels[n], grids[n], actions[n], outcomes[n])
        if levels[n].has_ended:
            copy_matrix(outcomes[n].tiles, outcomes[n].final_tiles)
            finals[n] = levels[n]
            generate(levels[n], grids[n], graphs)
            look_and_remember(levels[n], grids[n], outcomes[n].tiles)


@njit(cache=True, nogil=True)
def step_and_reset_levels_of_maps(levels, grids, maps, map_grids, outcomes, finals, actions):
    """Step as `step_and_reset_levels` does, with the next episode on one of the maps.

    It is a separate kernel because each argument takes time: a quarter of a step of one environment.
    """
    for n in range(levels.shape[0]):
        advance_and_look(levels[n], grids[n], actions[n], outcomes[n])
        if levels[n].has_ended:
            copy_matrix(outcomes[n].tiles, outcomes[n].final_tiles)
            finals[n] = levels[n]
            generate_of_maps(levels[n], grids[n], maps, map_grids)
            look_and_remember(levels[n], grids[n], outcomes[n].tiles)
