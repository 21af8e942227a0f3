#include "core/wave/scalar_paths.h"

#include <cmath>

#include "core/wave/lane_surfaces.h"

namespace core {
namespace {

/// Returns whether lanes can continue the path: they support neither nested solids nor a wavelength
/// of its own. Those out of scattering solids, at depths of their own, would be alone there.
/// eta_scale differs from that of lanes only by rounding: two roundings for each of at most 16
/// boundaries. has_solids: as LaneSurfaces.
bool is_for_lanes(const SceneData& scene, const TracedPath& path, bool has_solids) noexcept {
  constexpr float kRounding = 32 * 0x1p-24F;
  const Solid* within = path.media.top();
  const float scale = within != nullptr ? eta_scale_within(*within) : 1;
  return path.media.size() <= 1 &&
         (within == nullptr || (has_solids && lanes_support(scene, *within))) &&
         std::fabs(path.eta_scale - scale) <= kRounding * scale && path.wavelength_nm == 0 &&
         (path.medium_scatterings == 0 || path.fog != nullptr);
}

/// Calls move(member of WavePath, the same one of PathState) for what both have.
template <typename Path, typename State, typename Move>
void for_each_pair(Path& path, State& state, Move&& move) {
  move(path.origin, state.ray.origin);
  move(path.direction, state.ray.direction);
  move(path.beta, state.beta);
  move(path.pdf_bsdf, state.last.pdf_bsdf);
  move(path.last_origin, state.last.origin);
  move(path.last_normal, state.last.light_normal);
  move(path.cone_width_m, state.cone_width_m);
  move(path.cone_spread_rad, state.cone_spread_rad);
  move(path.is_sharp, state.is_sharp);
  move(path.medium_scatterings, state.medium_scatterings);
  move(path.null_scatterings, state.null_scatterings);
}

template <typename T>
void copy(const T& from, T& to) {
  to = from;
}
void copy(Vec3 from, Rgb& to) { to = {from.x, from.y, from.z}; }
void copy(Rgb from, Vec3& to) { to = {from.r, from.g, from.b}; }
void copy(std::int32_t from, bool& to) { to = from != 0; }
void copy(bool from, std::int32_t& to) { to = from ? 1 : 0; }

void add_waiting(const SceneData& scene, Wave& wave, const TracedPath& path,
                 std::int32_t slot) noexcept {
  WavePath& back = wave.waiting.emplace_back(ReturnedPath{path.depth, {}}).path;
  for_each_pair(back, path, [](auto& to, const auto& from) { copy(from, to); });
  back.base = path.sampler.base();
  back.index_reversed = reverse_bits(path.sampler.index());
  back.slot = slot;
  const Solid* within = path.media.top();
  back.medium = within != nullptr ? static_cast<std::int32_t>(within - scene.solids.data()) + 1 : 0;
}

}  // namespace

template <typename Options>
void ScalarPaths<Options>::follow(Wave& wave, TracedPath& path, std::int32_t slot) const noexcept {
  PathVertex vertex;
  while (scalar_.next_vertex(path, vertex)) {
    if (catcher_ != nullptr && catcher_->catches(path, vertex)) {
      const auto i = sample_of(slot);
      catcher_->catch_light(path, vertex,
                            {wave.caught->film_x_px.at[i], wave.caught->film_y_px.at[i]});
      return;
    }
    const Surface bsdf = scalar_.surface(path, vertex);
    if (!scalar_.visit(path, vertex, bsdf)) {
      return;
    }
    const bool may_split = catcher_ == nullptr || catcher_->may_split(vertex);
    if (split_count_ > 1 && path.depth == 0 && may_split && !scalar_.is_at_max_depth(path)) {
      split(wave, path, vertex, bsdf, slot);
      return;
    }
    if (!extend(path, vertex, bsdf)) {
      return;
    }
    if (!scalar_.sees_backdrop(path) && is_for_lanes(scalar_.scene(), path, has_solids())) {
      add_waiting(scalar_.scene(), wave, path, slot);
      return;
    }
  }
}

template <typename Options>
bool ScalarPaths<Options>::extend(TracedPath& path, const PathVertex& vertex,
                                  const Surface& bsdf) const noexcept {
  if (!scalar_.is_at_max_depth(path)) {
    scalar_.add_direct_light(path, vertex, bsdf);
  }
  return scalar_.extend(path, vertex, bsdf);
}

/// As PathTracer::split().
template <typename Options>
void ScalarPaths<Options>::split(Wave& wave, TracedPath& path, const PathVertex& vertex,
                                 const Surface& bsdf, std::int32_t slot) const noexcept {
  const float share = 1 / static_cast<float>(split_count_);
  Rgb sum;
  for (int k = 0; k < split_count_; ++k) {
    TracedPath branch = path;
    branch.sampler = path.sampler.branch(k, split_count_);
    branch.branch_weight = share;
    branch.out.radiance = {};
    branch.out.alpha = 0;
    const std::int32_t branch_slot = slot + slot_of_branch(k, split_count_);
    if (extend(branch, vertex, bsdf)) {
      if (!scalar_.sees_backdrop(branch) && is_for_lanes(scalar_.scene(), branch, has_solids())) {
        add_waiting(scalar_.scene(), wave, branch, branch_slot);
      } else {
        follow(wave, branch, branch_slot);
      }
    }
    sum += branch.out.radiance;
    path.out.alpha += branch.out.alpha * share;
  }
  path.out.radiance += sum * share;
}

template <typename Options>
void ScalarPaths<Options>::take_back(Wave& wave, int depth) const noexcept {
  std::erase_if(wave.waiting, [&](const ReturnedPath& back) {
    if (back.depth == depth) {
      wave.paths.add<Options::has_media>(back.path, scalar_.scene().has_clear);
    }
    return back.depth == depth;
  });
}

template <typename Options>
TracedPath ScalarPaths<Options>::handed_over(const WavePath& from, const PathSampler& sampler,
                                             std::uint64_t& rays) const noexcept {
  TracedPath path{PathState{.sampler = sampler, .rays = rays}};
  for_each_pair(from, path, [](const auto& wave, auto& to) { copy(wave, to); });
  if constexpr (Options::has_media) {
    path.fog = scalar_.fog();
  }
  path.last.light_samples = static_cast<float>(scalar_.options().candidates);
  if (from.medium > 0) {
    const Solid& within = scalar_.scene().solids[static_cast<std::size_t>(from.medium) - 1];
    path.media.enter(within);
    path.eta_scale = eta_scale_within(within);
  }
  return path;
}

template class ScalarPaths<DefaultOptions>;
template class ScalarPaths<WholeOptions>;
template class ScalarPaths<SpectralOptions>;

}  // namespace core
