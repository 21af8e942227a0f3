#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/sampling/warp.h"
#include "core/scene/solids.h"

namespace core {
namespace {

/// Rays that count crossings of closed surfaces. Odd: the median is one of them.
constexpr std::size_t kCounts = 5;
/// So many more votes for one side decide. Where 4 of 5 votes are right, 1 decision in 4^5 is
/// wrong. Source: Wald, Sequential Tests of Statistical Hypotheses, 1945.
constexpr int kLead = 5;
/// Most rays: some meet an open surface that fills a fiftieth of the sphere.
constexpr std::size_t kRaysMost = 128;

/// The first of any number are spread over the sphere; none is along an axis or a diagonal, where
/// edges of models are. Source: Roberts, The Unreasonable Effectiveness of Quasirandom Sequences,
/// 2018 (R2).
Vec3 direction_of(std::size_t ray) noexcept {
  constexpr double kPlastic = 1.32471795724474602596;
  const auto part = [ray](double step) {
    const double at = 0.5 + static_cast<double>(ray + 1) * step;
    return static_cast<float>(at - std::floor(at));
  };
  return uniform_sphere(Vec2{part(1 / kPlastic), part(1 / (kPlastic * kPlastic))});
}

/// What the rays have met so far of a solid that may be around their origin.
struct Candidate {
  const Solid* solid = nullptr;
  std::array<int, kCounts> left{};  ///< minus entered
  float first_t = 0;                ///< of the current ray
  bool leaves_first = false;
  bool is_met = false;
  /// Open surfaces: rays that meet it first from the back, minus those that meet its front or leave
  /// the scene without it. Rays that an opaque surface stops before do not count.
  int votes = 0;

  bool is_decided(std::size_t rays) const {
    return solid->kind == SolidKind::kOpen ? std::abs(votes) >= kLead : rays >= kCounts;
  }
};

class Probe {
 public:
  Probe(const SceneData& scene, std::vector<Candidate>& candidates)
      : scene_(scene), candidates_(candidates) {}

  /// number: of rays cast before.
  void cast(const Ray& ray, std::size_t number) {
    ray_ = ray;
    number_ = number;
    crossings_.clear();
    blocked_t_ = ray.t_max;
    for (Candidate& candidate : candidates_) {
      candidate.is_met = false;
    }
    scene_.accel->each_hit(
        ray, [](void* self, const RawHit& hit) { static_cast<Probe*>(self)->add(hit); }, this);
    for (Candidate& candidate : candidates_) {
      if (candidate.is_decided(number)) {
        continue;
      }
      if (candidate.is_met && candidate.first_t < blocked_t_) {
        candidate.votes += candidate.leaves_first ? 1 : -1;
      } else if (!(blocked_t_ < ray.t_max)) {
        --candidate.votes;  // the ray leaves the scene without it
      }
    }
  }

 private:
  /// Faces of a solid that coincide are one, as in faces_at().
  struct Crossing {
    const Solid* solid;
    bool inwards;
    SurfacePoint at;
  };

  void add(const RawHit& hit) {
    const PlacedMesh& placed = scene_.placed_mesh(hit);
    if (placed.solid == kNoSolid) {
      if (!scene_.materials[scene_.meshes[placed.mesh].material].transmits &&
          scene_.coverage(hit, ray_) >= 1) {
        blocked_t_ = std::min(blocked_t_, hit.t);
      }
      return;
    }
    const Solid& solid = scene_.solids[placed.solid];
    const auto found =
        std::lower_bound(candidates_.begin(), candidates_.end(), &solid,
                         [](const Candidate& c, const Solid* s) { return c.solid < s; });
    if (found == candidates_.end() || found->solid != &solid || found->is_decided(number_)) {
      return;
    }
    const SurfacePoint at = scene_.surface_point(hit, ray_);
    const bool inwards = is_inwards(solid, at.normal_geometric, ray_.direction);
    if (std::any_of(crossings_.begin(), crossings_.end(), [&](const Crossing& other) {
          return other.solid == &solid && other.inwards == inwards &&
                 apart_m(other.at, at) <= other.at.error_m + at.error_m;
        })) {
      return;
    }
    crossings_.push_back({&solid, inwards, at});
    if (number_ < kCounts) {
      found->left[number_] += inwards ? -1 : 1;
    }
    if (!found->is_met || hit.t < found->first_t) {
      found->is_met = true;
      found->first_t = hit.t;
      found->leaves_first = !inwards;
    }
  }

  const SceneData& scene_;
  std::vector<Candidate>& candidates_;
  Ray ray_;
  std::size_t number_ = 0;
  std::vector<Crossing> crossings_;
  float blocked_t_ = 0;  ///< nearest opaque surface
};

}  // namespace

MediumStack solids_around(const SceneData& scene, Vec3 point, float time) noexcept {
  MediumStack out;
  std::vector<Candidate> candidates;  // in the order of solids
  for (const Solid& solid : scene.solids) {
    if (solid.kind == SolidKind::kOpen || overlap(solid.box, {point, point})) {
      candidates.push_back({.solid = &solid});
    }
  }
  if (candidates.empty()) {
    return out;
  }
  Probe probe(scene, candidates);
  const auto is_undecided = [&candidates](std::size_t rays) {
    return std::any_of(candidates.begin(), candidates.end(),
                       [rays](const Candidate& c) { return !c.is_decided(rays); });
  };
  for (std::size_t i = 0; i < kRaysMost && is_undecided(i); ++i) {
    probe.cast({.origin = point, .direction = direction_of(i), .time = time}, i);
  }
  for (Candidate& candidate : candidates) {
    auto& left = candidate.left;
    std::nth_element(left.begin(), left.begin() + left.size() / 2, left.end());
    const int times = candidate.solid->kind == SolidKind::kOpen ? (candidate.votes > 0 ? 1 : 0)
                                                                : left[left.size() / 2];
    for (int k = 0; k < times; ++k) {
      out.enter(*candidate.solid);
    }
  }
  for (const Candidate& candidate : candidates) {
    if (candidate.solid->kind == SolidKind::kCavity &&
        candidate.left[candidate.left.size() / 2] < 0) {
      out.leave(*candidate.solid);
    }
  }
  return out;
}

}  // namespace core
