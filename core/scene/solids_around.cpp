#include <algorithm>
#include <array>
#include <vector>

#include "core/scene/solids.h"

namespace core {
namespace {

/// Directions of test rays: none along an axis or a diagonal, where edges of models are. Odd: the
/// median of crossings is one of them.
constexpr std::array kDirections = {
    Vec3{0.2573F, 0.9379F, 0.2333F}, Vec3{-0.6811F, 0.3123F, 0.6624F},
    Vec3{0.7151F, -0.2237F, 0.6622F}, Vec3{-0.3347F, -0.8719F, -0.3573F},
    Vec3{0.1931F, 0.4457F, -0.8741F}};

/// One ray may meet the back of a window pane.
constexpr int kVotesLeast = 2;

/// What the rays have met so far of a solid that may be around their origin.
struct Candidate {
  const Solid* solid = nullptr;
  std::array<int, kDirections.size()> left{};  ///< minus entered
  float first_t = 0;                           ///< of the current ray
  bool leaves_first = false;
  bool is_met = false;
  /// Open surfaces: rays that meet it first from the back, minus those that meet its front or leave
  /// the scene without it. Rays that an opaque surface stops before do not count.
  int votes = 0;
};

class Probe {
 public:
  Probe(const SceneData& scene, std::vector<Candidate>& candidates)
      : scene_(scene), candidates_(candidates) {}

  void cast(const Ray& ray, std::size_t direction) {
    ray_ = ray;
    direction_ = direction;
    blocked_t_ = ray.t_max;
    for (Candidate& candidate : candidates_) {
      candidate.is_met = false;
    }
    scene_.accel->each_hit(
        ray, [](void* self, const RawHit& hit) { static_cast<Probe*>(self)->add(hit); }, this);
    for (Candidate& candidate : candidates_) {
      if (candidate.is_met && candidate.first_t < blocked_t_) {
        candidate.votes += candidate.leaves_first ? 1 : -1;
      } else if (!(blocked_t_ < ray.t_max)) {
        --candidate.votes;  // the ray leaves the scene without it
      }
    }
  }

 private:
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
    if (found == candidates_.end() || found->solid != &solid) {
      return;
    }
    const bool inwards =
        is_inwards(solid, scene_.surface_point(hit, ray_).normal_geometric, ray_.direction);
    found->left[direction_] += inwards ? -1 : 1;
    if (!found->is_met || hit.t < found->first_t) {
      found->is_met = true;
      found->first_t = hit.t;
      found->leaves_first = !inwards;
    }
  }

  const SceneData& scene_;
  std::vector<Candidate>& candidates_;
  Ray ray_;
  std::size_t direction_ = 0;
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
  for (std::size_t i = 0; i < kDirections.size(); ++i) {
    probe.cast({.origin = point, .direction = kDirections[i], .time = time}, i);
  }
  for (Candidate& candidate : candidates) {
    auto& left = candidate.left;
    std::nth_element(left.begin(), left.begin() + left.size() / 2, left.end());
    const int times = candidate.solid->kind == SolidKind::kOpen
                          ? (candidate.votes >= kVotesLeast ? 1 : 0)
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
