/// Model of the renderer: pictures whose samples follow from (seed, pixel, sample) alone, at almost
/// no cost. Everything around them is real: scenes, films, slices, barriers, checkpoints, units.
#pragma once

namespace simulation {

/// What renders in this process, and in those that it forks; the model, unless it is called.
void render_really();
/// Whether the real renderer renders.
bool renders_really();
/// Whether some scenes load until they are stopped; not with the real renderer.
void get_stuck_sometimes(bool is_stuck);
/// Number of loads that wait to be stopped.
int hanging_loads();

}  // namespace simulation
