#include "core/wave/lone_paths.h"

#include <cmath>

namespace core {
namespace {

/// Returns whether lanes can continue the path: they support neither enclosing solids nor
/// wavelengths. Outside of all solids eta_scale differs from 1 only by rounding: two roundings for
/// each of at most 16 boundaries.
bool is_for_lanes(const TracedPath& path) noexcept {
  constexpr float kRounding = 32 * 0x1p-24F;
  const Vec3 n = path.last.light_normal;
  const bool may_be_lit_from_behind = dot(n, n) == 0;
  return path.media.empty() && std::fabs(path.eta_scale - 1) <= kRounding &&
         path.wavelength_nm == 0 && path.null_scatterings == 0 && path.alpha_tests == 0 &&
         !(path.last.pdf_bsdf > 0 && may_be_lit_from_behind);
}

void add_waiting(Wave& wave, const TracedPath& path, std::int32_t slot) noexcept {
  wave.waiting.push_back({.depth = path.depth,
                          .slot = slot,
                          .base = path.sampler.base(),
                          .index_reversed = reverse_bits(path.sampler.index()),
                          .origin = path.ray.origin,
                          .direction = path.ray.direction,
                          .beta = {path.beta.r, path.beta.g, path.beta.b},
                          .pdf_bsdf = path.last.pdf_bsdf,
                          .last_origin = path.last.origin,
                          .last_normal = path.last.light_normal,
                          .cone_width_m = path.cone_width_m,
                          .cone_spread_rad = path.cone_spread_rad,
                          .is_sharp = path.is_sharp});
}

}  // namespace

void LonePaths::follow(Wave& wave, TracedPath& path, std::int32_t slot) const noexcept {
  PathVertex vertex;
  while (scalar_.next_vertex(path, vertex)) {
    const Surface bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    if (!scalar_.visit(path, vertex, bsdf)) {
      return;
    }
    if (split_count_ > 1 && path.depth == 0 && !scalar_.is_at_max_depth(path)) {
      split(wave, path, vertex, bsdf, slot);
      return;
    }
    if (!extend(path, vertex, bsdf)) {
      return;
    }
    if (!scalar_.sees_backdrop(path) && is_for_lanes(path)) {
      add_waiting(wave, path, slot);
      return;
    }
  }
}

bool LonePaths::extend(TracedPath& path, const PathVertex& vertex,
                       const Surface& bsdf) const noexcept {
  if (!scalar_.is_at_max_depth(path)) {
    scalar_.add_direct_light(path, vertex, bsdf);
  }
  return scalar_.extend(path, vertex, bsdf);
}

/// As PathTracer::split().
void LonePaths::split(Wave& wave, TracedPath& path, const PathVertex& vertex, const Surface& bsdf,
                      std::int32_t slot) const noexcept {
  const float share = 1 / static_cast<float>(split_count_);
  Rgb sum;
  for (int k = 0; k < split_count_; ++k) {
    TracedPath branch = path;
    branch.sampler = path.sampler.branch(k, split_count_);
    branch.branch_weight = share;
    branch.out.radiance = {};
    branch.out.alpha = 0;
    const std::int32_t branch_slot = slot + ((k + 1) << kContinuationShift);
    if (extend(branch, vertex, bsdf)) {
      if (!scalar_.sees_backdrop(branch) && is_for_lanes(branch)) {
        add_waiting(wave, branch, branch_slot);
      } else {
        follow(wave, branch, branch_slot);
      }
    }
    sum += branch.out.radiance;
    path.out.alpha += branch.out.alpha * share;
  }
  path.out.radiance += sum * share;
}

void LonePaths::take_back(Wave& wave, int depth) noexcept {
  WavePaths& paths = wave.paths;
  std::erase_if(wave.waiting, [&](const WaitingPath& path) {
    if (path.depth != depth) {
      return false;
    }
    const std::size_t i = paths.first + paths.count++;
    paths.origin.set(i, path.origin);
    paths.direction.set(i, path.direction);
    paths.beta.set(i, path.beta);
    paths.pdf_bsdf.at[i] = path.pdf_bsdf;
    paths.last_origin.set(i, path.last_origin);
    paths.last_normal.set(i, path.last_normal);
    paths.cone_width_m.at[i] = path.cone_width_m;
    paths.cone_spread_rad.at[i] = path.cone_spread_rad;
    paths.is_sharp.at[i] = path.is_sharp ? 1 : 0;
    paths.base.at[i] = path.base;
    paths.index_reversed.at[i] = path.index_reversed;
    paths.slot.at[i] = path.slot;
    return true;
  });
}

}  // namespace core
