#include "core/film/film.h"

#include <algorithm>
#include <span>
#include <utility>

#include "core/base/sha256.h"
#include "core/film/tile_planes.h"
#include "core/math/numbers.h"

namespace core {
namespace {

std::size_t area(const PixelRect& r) {
  return static_cast<std::size_t>(r.width) * static_cast<std::size_t>(r.height);
}

SampleCounts counts_of(const TileState& state, int replicates) {
  SampleCounts out;
  if (state.pixels.empty()) {
    return out;
  }
  out.min = ~0U;
  const auto r = static_cast<std::size_t>(replicates);
  for (std::size_t i = 0; i < state.pixels.size(); i += r) {
    std::uint32_t n = 0;
    for (std::size_t k = 0; k < r; ++k) {
      n += state.pixels[i + k].count;
    }
    out.min = std::min(out.min, n);
    out.max = std::max(out.max, n);
    out.sum += n;
  }
  out.mean = static_cast<double>(out.sum) / static_cast<double>(state.pixels.size() / r);
  return out;
}

}  // namespace

Film::Film(FilmShape shape) : FilmShape(std::move(shape)) {
  MutexLock lock(mutex_);
  tiles_.resize(tile_rects().size());
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    TileState empty;
    empty.rect = tile_rects()[i];
    tiles_[i].state = std::make_shared<const TileState>(std::move(empty));
  }
  if (has_splats()) {
    splats_.light_samples.resize(static_cast<std::size_t>(unit_count()));
    splats_.light_paths.resize(static_cast<std::size_t>(replicates()));
    splats_.tiles.resize(tiles_.size());
  }
  meter_.resize(static_cast<std::size_t>(meter_chunk_count()));
}

TileState Film::tile(int tile) const {
  TileState state = *tile_state(tile);
  if (state.pixels.empty()) {
    const TileShape shape = shape_of(*this);
    for_each_kept_plane([&](const auto& plane) {
      (state.*plane.values).resize(area(state.rect) * plane.per_pixel(shape));
    });
  }
  return state;
}

std::shared_ptr<const TileState> Film::tile_state(int tile) const {
  MutexLock lock(mutex_);
  return tiles_[static_cast<std::size_t>(tile)].state;
}

int Film::tile_samples(int tile) const { return tile_state(tile)->samples; }

std::uint32_t Film::tile_revision(int tile) const {
  MutexLock lock(mutex_);
  return tiles_[static_cast<std::size_t>(tile)].revision;
}

std::uint32_t Film::commit(int tile, TileState state) { return commit(tile, std::move(state), {}); }

std::uint32_t Film::commit(int tile, TileState state, const LightBatch& light) {
  const SampleCounts counts = counts_of(state, replicates());
  auto next = std::make_shared<const TileState>(std::move(state));
  MutexLock lock(mutex_);
  add_light(light);
  Slot& slot = tiles_[static_cast<std::size_t>(tile)];
  if (!has_splats()) {
    slot.light.reset();
  }
  std::swap(slot.state, next);
  cpu_seconds_beside_ += std::max(next->cpu_seconds - slot.state->cpu_seconds, 0.0);
  slot.counts = counts;
  slot.version = ++version_;
  slot.revision = ++revision_;
  return slot.revision;
}

void Film::commit_light(std::span<const LightBatch> light) {
  MutexLock lock(mutex_);
  for (const LightBatch& each : light) {
    add_light(each);
    cpu_seconds_beside_ += each.cpu_seconds;
  }
  ++revision_;
}

void Film::add_light(const LightBatch& light) {
  add_sums(splat_layout(), light.sums, splats_.tiles);
  if (light.last_sample == light.first_sample) {
    return;
  }
  add_splats(splat_layout(), light, splats_.tiles);
  for (int k = 0; k < replicates(); ++k) {
    splats_.light_paths[static_cast<std::size_t>(k)] +=
        area(unit_rect(light.unit)) * (samples_of_replicate(light.last_sample, replicates(), k) -
                                       samples_of_replicate(light.first_sample, replicates(), k));
  }
  splats_.light_samples[static_cast<std::size_t>(light.unit)] = light.last_sample;
  splats_.rejected_samples += light.rejected_samples;
  splats_.rays += light.rays;
  is_published_ = false;
}

std::size_t Film::splats_of(int tile) const noexcept {
  return splat_layout().size(static_cast<std::size_t>(tile));
}

double Film::paths_per_pixel(std::size_t replicate) const {
  return static_cast<double>(splats_.light_paths[replicate]) /
         (static_cast<double>(full_width()) * full_height());
}

int Film::light_samples(int unit) const {
  MutexLock lock(mutex_);
  return splats_.light_samples[static_cast<std::size_t>(unit)];
}

std::vector<std::uint32_t> Film::publish_splats() {
  std::vector<std::uint32_t> revisions;
  {
    MutexLock lock(mutex_);
    if (is_published_) {
      return revisions;
    }
    is_published_ = true;
  }
  for (int tile = 0; tile < tile_count(); ++tile) {
    const auto state = shown_tile(tile);
    const TileLight light =
        tile_light(state->rect, state->pixels, replicates(), errors_over_white());
    MutexLock lock(mutex_);
    Slot& slot = tiles_[static_cast<std::size_t>(tile)];
    slot.light = light;
    slot.version = ++version_;
    slot.revision = ++revision_;
    revisions.push_back(slot.revision);
  }
  return revisions;
}

SplatState Film::splats() const {
  SplatState out;
  {
    MutexLock lock(mutex_);
    out = splats_;
  }
  for (std::size_t t = 0; t < out.tiles.size(); ++t) {
    out.tiles[t].resize(splats_of(static_cast<int>(t)));
  }
  return out;
}

void Film::restore_splats(SplatState state) {
  {
    MutexLock lock(mutex_);
    splats_ = std::move(state);
    splats_.light_samples.resize(static_cast<std::size_t>(unit_count()));
  }
  for (int tile = 0; tile < tile_count(); ++tile) {
    const auto shown = shown_tile(tile);
    const TileLight light =
        tile_light(shown->rect, shown->pixels, replicates(), errors_over_white());
    MutexLock lock(mutex_);
    tiles_[static_cast<std::size_t>(tile)].light = light;
  }
}

std::shared_ptr<const TileState> Film::shown_tile(int tile) const {
  if (!has_splats()) {
    return tile_state(tile);
  }
  TileState state = this->tile(tile);
  const auto r = static_cast<std::size_t>(replicates());
  MutexLock lock(mutex_);
  const std::vector<SplatPixel>& splats = splats_.tiles[static_cast<std::size_t>(tile)];
  for (std::size_t i = 0; !splats.empty() && i < state.pixels.size(); ++i) {
    fold_splats(state.pixels[i], splats[i], paths_per_pixel(i % r));
  }
  return std::make_shared<const TileState>(std::move(state));
}

void Film::keep(int tile, TileState state) {
  auto next = std::make_shared<const TileState>(std::move(state));
  MutexLock lock(mutex_);
  Slot& slot = tiles_[static_cast<std::size_t>(tile)];
  std::swap(slot.state, next);
  slot.version = ++version_;
}

void Film::install_plans(PlanSpan span, std::vector<std::vector<PixelPlan>> plans) {
  MutexLock lock(mutex_);
  ++plan_epoch_;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    TileState next = *tiles_[t].state;
    next.span = span;
    next.plan = std::move(plans[t]);
    tiles_[t].state = std::make_shared<const TileState>(std::move(next));
    tiles_[t].version = ++version_;
  }
}

std::uint32_t Film::plan_epoch() const {
  MutexLock lock(mutex_);
  return plan_epoch_;
}

std::uint64_t Film::tile_version(int tile) const {
  MutexLock lock(mutex_);
  return tiles_[static_cast<std::size_t>(tile)].version;
}

SampleCounts Film::sample_counts() const {
  MutexLock lock(mutex_);
  SampleCounts out = tiles_.front().counts;
  out.sum = 0;
  for (const Slot& slot : tiles_) {
    out.min = std::min(out.min, slot.counts.min);
    out.max = std::max(out.max, slot.counts.max);
    out.sum += slot.counts.sum;
  }
  out.mean = static_cast<double>(out.sum) / static_cast<double>(area(crop()));
  return out;
}

TileSums Film::sums_of(int tile, double floor) const {
  const auto shown = shown_tile(tile);
  return core::half_sums(shown->rect, shown->pixels, replicates(), floor, errors_over_white());
}

std::vector<TileSums> Film::half_sums() const {
  std::vector<TileSums> out;
  out.reserve(tile_rects().size());
  const double floor = error_floor();
  for (int tile = 0; tile < tile_count(); ++tile) {
    out.push_back(sums_of(tile, floor));
  }
  return out;
}

TileSums Film::half_sums(int tile) const { return sums_of(tile, error_floor()); }

double Film::error_floor() const {
  std::vector<TileLight> lights(tile_rects().size());
  std::vector<std::pair<std::size_t, std::shared_ptr<const TileState>>> due;
  {
    MutexLock lock(mutex_);
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      if (tiles_[t].light) {
        lights[t] = *tiles_[t].light;
      } else if (!has_splats()) {
        due.emplace_back(t, tiles_[t].state);
      }
    }
  }
  for (const auto& [t, state] : due) {
    lights[t] = tile_light(state->rect, state->pixels, replicates(), errors_over_white());
  }
  if (!due.empty()) {
    MutexLock lock(mutex_);
    for (const auto& [t, state] : due) {
      if (tiles_[t].state == state) {
        tiles_[t].light = lights[t];
      }
    }
  }
  double roots = 0;
  double pixels = 0;
  for (const TileLight& light : lights) {
    roots += light.roots;
    pixels += light.pixels;
  }
  return pixels > 0 ? core::error_floor(roots / pixels) : 0;
}

double Film::tile_samples_mean(int tile) const {
  MutexLock lock(mutex_);
  return tiles_[static_cast<std::size_t>(tile)].counts.mean;
}

std::uint32_t Film::revision() const {
  MutexLock lock(mutex_);
  return revision_;
}

void Film::restore(int tile, TileState state, std::uint32_t tile_revision) {
  const SampleCounts counts = counts_of(state, replicates());
  MutexLock lock(mutex_);
  Slot& slot = tiles_[static_cast<std::size_t>(tile)];
  if (!has_splats()) {
    slot.light.reset();
  }
  slot.state = std::make_shared<const TileState>(std::move(state));
  slot.counts = counts;
  slot.version = ++version_;
  slot.revision = tile_revision;
  revision_ = std::max(revision_, tile_revision);
}

std::uint64_t Film::rejected_samples() const {
  MutexLock lock(mutex_);
  std::uint64_t sum = splats_.rejected_samples;
  for (const MeterChunk& chunk : meter_) {
    sum += chunk.rejected_samples;
  }
  for (const Slot& slot : tiles_) {
    sum += slot.state->rejected_samples;
  }
  return sum;
}

std::uint64_t Film::rays() const {
  MutexLock lock(mutex_);
  std::uint64_t sum = splats_.rays;
  for (const MeterChunk& chunk : meter_) {
    sum += chunk.rays;
  }
  for (const Slot& slot : tiles_) {
    sum += slot.state->rays;
  }
  return sum;
}

double Film::cpu_seconds() const {
  MutexLock lock(mutex_);
  double sum = cpu_seconds_beside_;
  for (const MeterChunk& chunk : meter_) {
    sum += chunk.cpu_seconds;
  }
  for (const Slot& slot : tiles_) {
    sum += slot.state->cpu_seconds;
  }
  return sum;
}

void Film::add_cpu_seconds(double seconds) {
  MutexLock lock(mutex_);
  cpu_seconds_beside_ += seconds;
}

double Film::cpu_seconds_beside() const {
  MutexLock lock(mutex_);
  return cpu_seconds_beside_;
}

std::string Film::digest() const {
  Sha256 hash;
  const std::int32_t header[] = {crop().x,     crop().y,      crop().width, crop().height,
                                 full_width(), full_height(), replicates(), has_aux() ? 1 : 0};
  hash.add(header, sizeof(header));
  MutexLock lock(mutex_);
  for (const Slot& slot : tiles_) {
    const std::int32_t tile[] = {slot.state->rect.x, slot.state->rect.y, slot.state->samples};
    hash.add(tile, sizeof(tile));
    for_each_kept_plane([&](const auto& plane) {
      const std::span values(*slot.state.*plane.values);
      hash.add(values.data(), values.size_bytes());
    });
  }
  hash.add(splats_.light_paths.data(), splats_.light_paths.size() * sizeof(std::uint64_t));
  for (std::size_t t = 0; t < splats_.tiles.size(); ++t) {
    std::vector<SplatPixel> none(splats_.tiles[t].empty() ? splats_of(static_cast<int>(t)) : 0);
    const std::vector<SplatPixel>& sums = none.empty() ? splats_.tiles[t] : none;
    hash.add(sums.data(), sums.size() * sizeof(SplatPixel));
  }
  return hash.hex();
}

}  // namespace core
