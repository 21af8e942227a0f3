/// Tasks that stop, and films that are restored, in the middle of a job.
#pragma once

#include <memory>

#include "core/render/task/render_task.h"

namespace test_support {

/// A task that ends at so many samples a pixel.
core::TaskOptions samples(int count,
                          double slice_seconds = core::TaskOptions().slice_target_seconds);

/// As settled_renderer(); aborts the test program on errors.
std::shared_ptr<const core::Renderer> renderer_of(const core::View& view);

/// Renders so many slices, fewer if the task ends.
void run_slices(core::RenderTask& task, int count);

/// Restores the content of a checkpoint: every tile, and splats. Pre: no slice is in progress.
std::shared_ptr<core::Film> restored(const core::Film& film);

}  // namespace test_support
