#include "core/render/units/unit_renderer.h"

#include <algorithm>
#include <new>
#include <utility>
#include <vector>

#include "core/base/cpu_time.h"
#include "core/integrators/registry.h"

namespace core {

struct UnitRenderer::Photons {
  std::shared_ptr<Prepass> pass;
  int parts = 0;
  int parts_out = 0;
  int parts_done = 0;
  bool is_built = false;
  bool is_given_up = false;
};

std::shared_ptr<const Prepass> UnitRenderer::photons(int sample, std::uint64_t& rays) {
  std::shared_ptr<Photons> mine;
  {
    const MutexLock lock(mutex_);
    if (photons_ == nullptr || !photons_->pass->serves(sample)) {
      photons_ = std::make_shared<Photons>(Photons{.pass = renderer_->start_prepass(sample)});
      photons_->parts = photons_->pass->part_count();
    }
    mine = photons_;
  }
  try {
    trace_parts(*mine, rays);
  } catch (const std::bad_alloc&) {
    const MutexLock lock(mutex_);
    mine->is_given_up = true;
    photons_.reset();
    built_.notify_all();
  }
  const MutexLock lock(mutex_);
  built_.wait(mutex_, [&mine] { return mine->is_built || mine->is_given_up; });
  if (mine->is_given_up) {
    throw std::bad_alloc();
  }
  return mine->pass;
}

void UnitRenderer::trace_parts(Photons& photons, std::uint64_t& rays) {
  while (true) {
    bool is_last = false;
    int part = 0;
    {
      const MutexLock lock(mutex_);
      if (photons.parts_out == photons.parts) {
        return;
      }
      part = photons.parts_out++;
    }
    renderer_->run_prepass(*photons.pass, part, rays);
    {
      const MutexLock lock(mutex_);
      is_last = ++photons.parts_done == photons.parts;
    }
    if (is_last) {
      // Further rounds, if any, run on this thread only.
      while (!photons.pass->build()) {
        for (int each = 0; each < photons.pass->part_count(); ++each) {
          renderer_->run_prepass(*photons.pass, each, rays);
        }
      }
      const MutexLock lock(mutex_);
      photons.is_built = true;
      built_.notify_all();
    }
  }
}

bool UnitRenderer::render_one(SliceWork& work, const std::stop_token& stop) {
  const bool has_pixels = work.chunk < 0 && !work.state.pixels.empty();
  if (!has_pixels || !integrator_has_prepass(renderer_->view().settings)) {
    return render_slice(*renderer_, work, stop);
  }
  const double cpu_start = thread_cpu_seconds();
  const auto from = photons(work.state.samples, work.state.rays);
  work.state.cpu_seconds += thread_cpu_seconds() - cpu_start;
  return renderer_->gather(work.state, *from, stop);
}

bool UnitRenderer::render_light(SliceWork& work, const SplatLayout& layout, SplatTiles& sums,
                                const std::stop_token& stop) const {
  // This many samples of a tile make a few megabytes of splats.
  constexpr int kPieceSamples = 16;
  LightBatch& light = work.light;
  for (int first = light.first_sample; first < light.last_sample; first += kPieceSamples) {
    LightBatch piece;
    piece.unit = light.unit;
    piece.first_sample = first;
    piece.last_sample = std::min(first + kPieceSamples, light.last_sample);
    piece.splats.resize(static_cast<std::size_t>(layout.replicates));
    if (!renderer_->render_light(work.unit, piece, stop)) {
      return false;
    }
    add_splats(layout, piece, sums);
    light.rejected_samples += piece.rejected_samples;
    light.rays += piece.rays;
    light.cpu_seconds += piece.cpu_seconds;
  }
  return true;
}

bool UnitRenderer::render(std::span<SliceWork> work, const std::stop_token& stop) {
  const RenderSettings& settings = renderer_->view().settings;
  const std::vector<PixelRect> tiles = tile_rects(settings.film.area());
  const SplatLayout layout = splat_layout(settings, tiles);
  SplatTiles sums(tiles.size());
  for (SliceWork& each : work) {
    LightBatch light = std::exchange(each.light, {});
    if (!render_one(each, stop)) {
      return false;
    }
    each.light = std::move(light);
    if (!render_light(each, layout, sums, stop)) {
      return false;
    }
  }
  work.front().light.sums = pack_sums(layout, sums);
  return true;
}

}  // namespace core
