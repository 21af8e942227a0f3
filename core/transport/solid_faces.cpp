#include "core/transport/solid_faces.h"

#include <algorithm>
#include <array>

#include "core/math/offset_ray.h"
#include "core/scene/solids.h"

namespace core {
namespace {

bool is_same(const RawHit& a, const RawHit& b) noexcept {
  return a.instance == b.instance && a.geometry == b.geometry && a.primitive == b.primitive;
}

/// The solids that the faces of an interface belong to, each once.
class CoincidentFaces {
 public:
  CoincidentFaces(const SceneData& scene, const RawHit& hit, const SurfacePoint& point,
                  const Ray& probe)
      : scene_(scene), hit_(hit), point_(point), probe_(probe), error_m_(point.error_m) {}

  void add(const RawHit& at) noexcept {
    if (is_same(at, hit_)) {
      return;
    }
    const SurfacePoint there = scene_.surface_point(at, probe_);
    const float away_m = apart_m(point_, there);
    if (away_m > point_.error_m + there.error_m) {
      return;
    }
    const float over_m = away_m + there.error_m;
    if (const Solid* solid = scene_.solid_of(at); solid != nullptr) {
      solid_hit_ = at;
      error_m_ = std::max(error_m_, over_m);
      add(*solid, is_inwards(*solid, there.normal_geometric, probe_.direction));
    } else if (!scene_.materials[there.material].transmits && scene_.coverage(at, probe_) >= 1) {
      opaque_hit_ = at;
      error_m_ = std::max(error_m_, over_m);
    }
  }
  void add(const Solid& solid, bool inwards) noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      if (crossed_[i].solid == &solid && crossed_[i].inwards == inwards) {
        return;
      }
    }
    if (count_ < crossed_.size()) {
      crossed_[count_++] = {&solid, inwards};
    }
  }
  void cross(MediumStack& media) const noexcept {
    for (const bool inwards : {false, true}) {
      for (std::size_t i = 0; i < count_; ++i) {
        if (crossed_[i].inwards == inwards && !has_both(*crossed_[i].solid)) {
          media.cross(*crossed_[i].solid, inwards);
        }
      }
    }
  }
  bool has_both(const Solid& solid) const noexcept {
    return std::count_if(crossed_.begin(), crossed_.begin() + count_,
                         [&solid](const Crossed& c) { return c.solid == &solid; }) > 1;
  }
  float error_m() const noexcept { return error_m_; }
  const std::optional<RawHit>& opaque_hit() const noexcept { return opaque_hit_; }
  const std::optional<RawHit>& solid_hit() const noexcept { return solid_hit_; }

 private:
  struct Crossed {
    const Solid* solid;
    bool inwards;
  };

  const SceneData& scene_;
  const RawHit& hit_;
  const SurfacePoint& point_;
  const Ray& probe_;
  float error_m_;
  std::array<Crossed, 16> crossed_{};
  std::size_t count_ = 0;
  std::optional<RawHit> opaque_hit_;
  std::optional<RawHit> solid_hit_;
};

}  // namespace

FacesAt faces_at(const SceneData& scene, const RawHit& hit, const SurfacePoint& point,
                 const Ray& ray, const MediumStack& media) noexcept {
  const Vec3 n = point.normal_geometric;
  const Solid* solid = scene.solid_of(hit);
  if (solid != nullptr && scene.is_single_face(hit, point.position)) {
    FacesAt out{media, {}, point.error_m};
    out.beyond.cross(*solid, is_inwards(*solid, n, ray.direction));
    return out;
  }
  const Vec3 ahead = dot(n, ray.direction) >= 0 ? n : -n;
  // As far as rounding may put any triangles of the scene apart.
  const float reach_m =
      point.error_m + kPlaneError * (taxicab(point.position) + 4 * scene.radius_m);
  const Vec3 from = offset_ray(point.position, -ahead, reach_m);
  const Ray probe = {.origin = from,
                     .direction = offset_ray(point.position, ahead, reach_m) - from,
                     .t_max = 1,
                     .time = ray.time};
  CoincidentFaces faces(scene, hit, point, probe);
  if (solid != nullptr) {
    faces.add(*solid, is_inwards(*solid, n, ray.direction));
  }
  scene.accel->each_hit(
      probe, [](void* to, const RawHit& at) { static_cast<CoincidentFaces*>(to)->add(at); },
      &faces);
  FacesAt out{media, {}, faces.error_m(), solid != nullptr && faces.has_both(*solid)};
  if (solid == nullptr) {
    out.instead = faces.solid_hit();
  } else if (faces.opaque_hit()) {
    out.instead = faces.opaque_hit();
  } else {
    faces.cross(out.beyond);
  }
  return out;
}

void enter_late(MediumStack& media, const Solid& solid, const FacesAt& faces,
                const SurfacePoint& point, const Ray& ray) noexcept {
  if (media.empty() && !faces.has_both_ways && solid.kind != SolidKind::kCavity &&
      !is_inwards(solid, point.normal_geometric, ray.direction)) {
    media.enter(solid);
  }
}

}  // namespace core
