#include "tests/support/tasks.h"

#include "core/base/check.h"
#include "tests/support/scenes.h"

namespace test_support {

core::TaskOptions samples(int count, double slice_seconds) {
  core::TaskOptions options;
  options.stop.samples_per_pixel = count;
  options.slice_target_seconds = slice_seconds;
  return options;
}

std::shared_ptr<const core::Renderer> renderer_of(const core::View& view) {
  auto renderer = settled_renderer(view);
  CHECK(renderer);
  return *renderer;
}

void run_slices(core::RenderTask& task, int count) {
  for (int i = 0; i < count && !task.finished(); ++i) {
    if (const auto slice = task.take()) {
      task.run(*slice);
    }
  }
}

std::shared_ptr<core::Film> restored(const core::Film& film) {
  auto out = std::make_shared<core::Film>(core::FilmShape(film));
  for (int t = 0; t < film.tile_count(); ++t) {
    out->restore(t, film.tile(t), film.tile_revision(t));
  }
  if (film.has_splats()) {
    out->restore_splats(film.splats());
  }
  return out;
}

}  // namespace test_support
