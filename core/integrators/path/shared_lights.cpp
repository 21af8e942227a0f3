// Light samples of first surfaces, shared by the paths of a group (ReSTIR).
//
// Each path i draws M_i candidates from the light tree at its own first surface and keeps one, y_i,
// by resampled importance sampling; its contribution weight W_i replaces 1 / p (E[W_i | y_i] is one
// over the density of y_i). Path c then uses the samples of all paths with surfaces like its own,
// N_c, and adds
//
//   V(y_k) g_c(y_k) / s_c(y_k) * sum_j m_j s_c(y_j) W_j,    k chosen with probability proportional
//   to m_k s_c(y_k) W_k, m_j = M_j t_j(y_j) / sum_{i in N_c} M_i t_i(y_j).
//
// g_c = w_c f L is the unshadowed light times the MIS weight of sum M / H light samples with the
// tree's density at c against one BSDF sample, which gets 1 - w_c; V is visibility from c; s_c is
// the expected value of g_c. The mean over the choice of k is sum_j m_j(y_j) W_j V g_c(y_j). The
// m_j sum to 1 wherever light can come from, and t_j is positive only where path j can draw, so the
// mean is the integral of V g_c for any occlusion. No target includes shadows, so no path lacks
// samples that its neighbour needs, and only the shadow ray to y_k is traced. The paths of a group
// belong to a square of pixels, in one pass or several: earlier samples of a pixel are used like
// those of its neighbours. A pixel with H of the paths shares all light samples among H BSDF
// samples, so w weighs a fraction 1 / H of the light samples against one BSDF sample. t is the
// density of the light tree up to a factor that is similar for all of N_c: the geometric factor of
// the emitter, by distance and both cosines. Which paths are in N_c depends only on surfaces, never
// on light samples.
//
// Sources: Bitterli et al., Spatiotemporal reservoir resampling, 2020; Lin et al., Generalized
// resampled importance sampling, 2022; reuse within squares of pixels with shared weights: cf.
// Bekaert, Sbert and Halton, Accelerating path tracing by re-using paths, 2002.
#include <array>
#include <cmath>
#include <optional>

#include "core/integrators/path/light_candidates.h"
#include "core/integrators/path/pair_fit.h"
#include "core/integrators/path/path_tracer.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/reservoir.h"
#include "core/sampling/shared_samples.h"

namespace core {
namespace {

/// Surfaces are alike if their normals are at most 25 degrees apart and, relative to the larger
/// distance from the camera, their distances differ by at most a tenth and neither is farther than
/// 0.02 from the other's plane.
constexpr float kCosNormals = 0.906F;
constexpr float kDepthShare = 0.1F;
constexpr float kPlaneShare = 0.02F;
/// One candidate is selected by its contribution plus a small fraction of its contribution to a
/// diffuse surface, so that every candidate can be selected.
constexpr float kFloor = 0.02F;
/// Probability of evaluating the light tree's density for a neighbour's sample.
constexpr float kAsked = 0.25F;

}  // namespace

class SharedLightsTracer final : public GroupTracer {
 public:
  explicit SharedLightsTracer(const StudyTracer& owner)
      : owner_(owner),
        expected_rule_(owner.options().mis.type == MisType::kPower &&
                               owner.options().mis.exponent <= 2
                           ? owner.options().mis
                           : MisRule{MisType::kBalance, 1}),
        paths_(kGroupMost),
        views_(kGroupMost * kGroupMost) {}
  void trace(std::span<GroupPath> paths, int each, std::uint64_t& rays) noexcept override;

 private:
  struct Member {
    std::optional<TracedPath> path;
    PathVertex vertex;
    std::optional<Bsdf> bsdf;
    bool is_over = true;
    bool shares = false;
    std::uint64_t alike = 0;  ///< N: bit i is path i
    LightPoint light;         ///< y
    float weight = 0;         ///< W in the light's measure; 0: no sample
  };
  /// The data of a surface that is used n^2 times.
  struct Receiver {
    Vec3 origin;
    Vec3 light_normal;
    Vec3 normal_geometric;
    Vec3 horizon;
    float distance_m = 0;
    float count = 0;  ///< M; 0: shares nothing
    bool any_side = false;

    /// t: proportional to the density with which the light tree finds the light from here. Positive
    /// only where it can.
    float density(const LightView& view) const noexcept {
      return view.geometric *
             (view.is_far || any_side ? 1.0F : std::max(dot(light_normal, view.wi_world), 0.0F));
    }
    bool is_like(const Receiver& other) const noexcept;
  };
  struct Expected {
    BsdfEval f;
    float share = 1;   ///< MIS weight, by the density that the sample was drawn with
    float target = 0;  ///< s: contribution without shadows, in its own measure
  };

  void begin(const GroupPath& from, Member& member, Receiver& receiver,
             std::uint64_t& rays) const noexcept;
  void draw(Member& member, Receiver& receiver) const noexcept;
  Expected expected(const Member& member, const LightPoint& light,
                    const LightView& view) const noexcept;
  void find_alike(std::size_t count) noexcept;
  Rgb direct(std::size_t which, std::size_t count) noexcept;
  float corrected(const Member& member, const Member& from, const Expected& of,
                  const LightView& view) const noexcept;

  const StudyTracer& owner_;
  MisRule expected_rule_;  ///< never 0 and smooth, so that little depends on the unknown density
  std::vector<Member> paths_;
  std::array<Receiver, kGroupMost> receivers_{};
  std::vector<LightView> views_;  ///< [path * paths + sample]: a sample as seen by a path
  SharedSamples shared_;
  float each_ = 1;  ///< paths per pixel
  std::array<Expected, kGroupMost> expected_{};
  std::array<float, kGroupMost> weights_{};
};

/// Traces to the first surface.
void SharedLightsTracer::begin(const GroupPath& from, Member& member, Receiver& receiver,
                               std::uint64_t& rays) const noexcept {
  TracedPath& path = member.path.emplace(
      TracedPath{start_path(owner_.scene(), from.camera_ray, from.sampler, rays)});
  member.is_over = true;
  member.shares = false;
  receiver.count = 0;
  if (!owner_.next_vertex(path, member.vertex)) {
    return;
  }
  const Bsdf& bsdf = member.bsdf.emplace(make_bsdf(member.vertex.shading, member.vertex.wo_world));
  member.is_over = !owner_.visit(path, member.vertex, bsdf);
  member.shares = !member.is_over && !owner_.is_at_max_depth(path) && bsdf.has_spread() &&
                  !owner_.lights().empty();
  if (member.shares) {
    draw(member, receiver);
  }
}

SharedLightsTracer::Expected SharedLightsTracer::expected(const Member& member,
                                                          const LightPoint& light,
                                                          const LightView& view) const noexcept {
  Expected out;
  if (!(view.solid_angle > 0)) {
    return out;
  }
  out.f = member.bsdf->evaluate(member.vertex.shading.frame.to_local(view.wi_world));
  if (is_black(out.f.value_cos)) {
    return out;
  }
  if (!view.is_delta && owner_.options().strategy == Strategy::kMis) {
    const float p = light.pdf_measure / view.solid_angle;
    out.share = expected_rule_.weight(member.path->shared_samples * p, out.f.pdf_solid_angle);
  }
  out.target = size_of(out.f.value_cos * view.radiance) * view.solid_angle * out.share;
  return out;
}

void SharedLightsTracer::draw(Member& member, Receiver& receiver) const noexcept {
  TracedPath& path = *member.path;
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  path.u_roulette = u.w;
  const int count = owner_.options().first_candidates;
  const PathVertex& vertex = member.vertex;
  const Vec3 p = vertex.shading.origin;
  receiver = {p,
              vertex.light_normal,
              vertex.shading.normal_geometric,
              vertex.shading.horizon,
              vertex.distance_m,
              static_cast<float>(count),
              vertex.light_normal == Vec3{}};
  const auto sampled = [&](int k) {
    const auto at = candidate(u, k, count);
    return owner_.lights().point_of(
        owner_.lights().sample(p, vertex.light_normal, at.pick, at.place));
  };
  member.weight = 0;
  if (count == 1) {
    member.light = sampled(0);
    member.weight = member.light.pdf_measure > 0 ? 1 / member.light.pdf_measure : 0.0F;
    return;
  }
  path.shared_samples = receiver.count;
  struct Candidate {
    LightPoint light;
    float target = 0;
  };
  WeightedReservoir<Candidate> reservoir(
      static_cast<double>(path.sampler.get_4d(choice_group(path.depth)).x));
  for (int k = 0; k < count; ++k) {
    const LightPoint light = sampled(k);
    if (!(light.pdf_measure > 0)) {
      continue;
    }
    const LightView view = owner_.lights().view(light, p);
    const float diffuse =
        size_of(view.radiance) * view.solid_angle * (receiver.density(view) > 0 ? 1.0F : 0.0F);
    const float target = expected(member, light, view).target + kFloor * diffuse;
    reservoir.add({light, target}, static_cast<double>(target / light.pdf_measure));
  }
  if (!reservoir.empty()) {
    member.light = reservoir.item().light;
    member.weight =
        static_cast<float>(reservoir.sum() / (static_cast<double>(count) *
                                              static_cast<double>(reservoir.item().target)));
  }
}

/// Symmetric.
bool SharedLightsTracer::Receiver::is_like(const Receiver& other) const noexcept {
  const float far = std::max(distance_m, other.distance_m);
  const Vec3 way = other.origin - origin;
  const float off =
      std::max(std::fabs(dot(way, normal_geometric)), std::fabs(dot(way, other.normal_geometric)));
  return any_side == other.any_side && dot(horizon, other.horizon) > kCosNormals &&
         off <= kPlaneShare * far && std::fabs(distance_m - other.distance_m) <= kDepthShare * far;
}

/// Finds similar paths, and evaluates each sample for each of them.
void SharedLightsTracer::find_alike(std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    const Receiver& receiver = receivers_[i];
    if (!(receiver.count > 0)) {
      paths_[i].alike = 0;
      continue;
    }
    paths_[i].alike = std::uint64_t{1} << i;
    for (std::size_t j = 0; j < i; ++j) {
      if (receivers_[j].count > 0 && receiver.is_like(receivers_[j])) {
        paths_[i].alike |= std::uint64_t{1} << j;
        paths_[j].alike |= std::uint64_t{1} << i;
      }
    }
  }
  shared_.start(count);
  for (std::size_t j = 0; j < count; ++j) {
    const bool is_drawn = receivers_[j].count > 0 && paths_[j].weight > 0;
    for (std::size_t i = 0; i < count; ++i) {
      float density = 0;
      if (is_drawn) {
        LightView& view = views_[i * count + j];
        view = owner_.lights().view(paths_[j].light, receivers_[i].origin);
        density = receivers_[i].count * receivers_[i].density(view);
      }
      shared_.set(i, j, density);
    }
  }
}

/// Returns the ratio of the actual to the assumed MIS weight. The light tree's density of a
/// neighbour's sample is evaluated with a fixed probability, and the difference is weighted to
/// stand for the other samples: close to 1 and unbiased.
float SharedLightsTracer::corrected(const Member& member, const Member& from, const Expected& of,
                                    const LightView& view) const noexcept {
  if (view.is_delta || owner_.options().strategy != Strategy::kMis) {
    return 1;
  }
  const TracedPath& path = *member.path;
  float p = from.light.pdf_measure / view.solid_angle;
  float asked = 1;
  if (&member != &from) {
    if (path.sampler.get_4d(choice_group(path.depth)).w >= kAsked) {
      return 1;
    }
    asked = kAsked;
    const PathVertex& vertex = member.vertex;
    p = owner_.lights().pdf_solid_angle(from.light, view, vertex.shading.origin,
                                        vertex.light_normal);
  }
  return 1 +
         (owner_.options().mis.weight(path.shared_samples * p, of.f.pdf_solid_angle) / of.share -
          1) /
             asked;
}

/// Returns the contribution of one of the group's light samples to member `which`.
Rgb SharedLightsTracer::direct(std::size_t which, std::size_t count) noexcept {
  Member& member = paths_[which];
  TracedPath& path = *member.path;
  path.shared_samples = 0;
  for (std::size_t i = 0; i < count; ++i) {
    path.shared_samples += SharedSamples::has(member.alike, i) ? receivers_[i].count / each_ : 0.0F;
  }
  shared_.choose(member.alike);
  float sum = 0;
  for (std::size_t j = 0; j < count; ++j) {
    const float share = shared_.weight(j);
    weights_[j] = 0;
    if (share > 0) {
      expected_[j] = expected(member, paths_[j].light, views_[which * count + j]);
      weights_[j] = share * expected_[j].target * paths_[j].weight;
      sum += weights_[j];
    }
  }
  if (!std::isfinite(sum)) {
    return Rgb(sum);  // counted as rejected
  }
  if (!(sum > 0)) {
    return {};
  }
  float u = path.sampler.get_4d(choice_group(path.depth)).z * sum;
  std::size_t taken = count;
  for (std::size_t j = 0; j < count && !(u < 0); ++j) {
    if (weights_[j] > 0) {
      taken = j;
      u -= weights_[j];
    }
  }
  const Member& from = paths_[taken];
  const Expected& of = expected_[taken];
  const LightView& view = views_[which * count + taken];
  PathLight out;
  out.light.wi_world = view.wi_world;
  out.light.target = owner_.lights().target(from.light, view, member.vertex.shading.origin);
  out.light.is_far = view.is_far;
  out.light.is_delta = view.is_delta;
  out.value = path.beta * of.f.value_cos * view.radiance;
  out.scale = of.share * view.solid_angle * sum / of.target;
  const Rgb value = owner_.arriving(path, member.vertex, out);
  return is_black(value) ? value : value * corrected(member, from, of, view);
}

void SharedLightsTracer::trace(std::span<GroupPath> paths, int each, std::uint64_t& rays) noexcept {
  const std::size_t count = paths.size();
  each_ = static_cast<float>(each);
  for (std::size_t i = 0; i < count; ++i) {
    begin(paths[i], paths_[i], receivers_[i], rays);
  }
  find_alike(count);
  for (std::size_t i = 0; i < count; ++i) {
    Member& member = paths_[i];
    TracedPath& path = *member.path;
    if (member.shares) {
      path.out.radiance += direct(i, count);
    }
    if (!member.is_over && owner_.extend(path, member.vertex, *member.bsdf)) {
      owner_.follow(path);
    }
    paths[i].out = path.out;
  }
}

std::unique_ptr<GroupTracer> make_shared_lights_tracer(const StudyTracer& owner) {
  return std::make_unique<SharedLightsTracer>(owner);
}

}  // namespace core
