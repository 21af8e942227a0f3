/// Model of the renderer: pictures whose samples follow from (seed, pixel, sample) alone, at almost
/// no cost. Everything around them is real: scenes, films, slices, barriers, checkpoints, units.
#pragma once

namespace simulation {

/// What renders in this process, and in those that it forks; the model, unless it is called.
void render_really();
/// Whether the real renderer renders.
bool renders_really();
/// Whether some scenes load until they are stopped, and some do not load; not with the real
/// renderer.
void fail_sometimes(bool is_failing);
/// What the failure of a job says whose scene did not load.
inline constexpr const char* kLoadFailure = "a machine with files of the scene did not answer";
/// Number of loads that wait to be stopped.
int hanging_loads();

}  // namespace simulation
