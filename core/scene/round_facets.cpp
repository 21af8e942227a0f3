#include "core/scene/round_facets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include "core/math/offset_ray.h"
#include "core/math/stretch.h"
#include "core/scene/isolated_instances.h"

namespace core {
namespace {

/// Largest angle between a facet and its normals, 20 degrees: over a chord of that turn the smooth
/// surface rises by tan(10 degrees) / 2, 9 % of the chord. Light paths meet facets, camera paths
/// leave from the smooth surface; up to here both find the same light within 3 % of a block.
constexpr float kCosTurn = 0.9396926F;
/// Rises below this part of their mesh's radius are not looked at: what they may pass through is
/// smaller than a pixel, unless the mesh is seen magnified.
constexpr float kSmallRise = 0x1p-11F;
/// What stands within this many rises beside or above the facet counts.
constexpr float kRoom = 2;
/// Longest edges within which is_occupied() looks for triangles: from the middle of a facet two
/// thirds of a median, and 2 kRoom rises of at most a sixth of an edge times 2 sin(20 degrees).
constexpr float kNearEdges = 1.13F;
/// Difference of two shapes' products up to which they are one: much finer than a facet's room, and
/// coarser than numbers of four digits in files.
constexpr float kAlike = 1e-3F;
/// Shapes that are remembered of each mesh; instances of further ones are looked at in full.
constexpr std::size_t kShapes = 16;

struct Facet {
  Vec3 p[3];
  InstanceError error;

  /// Of twice the area, in the direction of the winding.
  Vec3 normal() const { return cross(p[1] - p[0], p[2] - p[0]); }
  /// Rounding of heights above the facet.
  float step_m() const {
    const float twice_area = length(normal());
    float out = 0;
    for (const Vec3 corner : p) {
      out = std::max(out, plane_error_m(corner, p[1] - p[0], p[2] - p[0], twice_area, error));
    }
    return out;
  }
};

/// Triangles to look for in a facet's room. Those of its own instance are looked for once for all
/// instances of one shape.
enum class Near { kAll, kOthers, kNone };

/// A mesh at one of its places; null: in the world.
struct Placement {
  std::uint32_t placed = 0;
  const PlacedInstance* instance = nullptr;
  Near near = Near::kAll;
};

/// An instance up to a similarity: its meshes, and the products of its transform's axes over the
/// sum of their squares.
struct Shape {
  std::vector<std::uint32_t> meshes;
  std::array<float, 6> products{};

  Shape(const SceneData& scene, std::size_t instance) {
    for (const PlacedMesh& placed : placed_of(scene, instance)) {
      meshes.push_back(placed.mesh);
    }
    const Transform& m = scene.instances[instance].to_world;
    products = {dot(m.x, m.x), dot(m.y, m.y), dot(m.z, m.z),
                dot(m.x, m.y), dot(m.y, m.z), dot(m.z, m.x)};
    const float sum = products[0] + products[1] + products[2];
    for (float& product : products) {
      product /= sum > 0 ? sum : 1;
    }
  }
  bool is_like(const Shape& other) const {
    for (std::size_t i = 0; i < products.size(); ++i) {
      if (!(std::fabs(products[i] - other.products[i]) <= kAlike)) {
        return false;
      }
    }
    return meshes == other.meshes;
  }
};

class RoundFacets {
 public:
  RoundFacets(SceneData& scene, const std::stop_token& stop)
      : scene_(scene),
        places_(scene.meshes.size()),
        is_isolated_(find_isolated_instances(scene, kNearEdges, stop)) {
    for (std::uint32_t i = 0; i < scene.placed.size(); ++i) {
      const auto above = std::upper_bound(
          scene.instances.begin(), scene.instances.end(), i,
          [](std::uint32_t at, const PlacedInstance& one) { return at < one.first_placed; });
      places_[scene.placed[i].mesh].push_back(
          {i, above == scene.instances.begin() ? nullptr : &*std::prev(above)});
    }
  }

  Status run(const std::stop_token& stop) {
    // Coordinates near the origin are rounded least: what holds there holds for copies further out.
    for (std::vector<Placement>& places : places_) {
      std::stable_sort(places.begin(), places.end(), [](const Placement& a, const Placement& b) {
        return offset(a) < offset(b);
      });
    }
    for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
      MeshData& mesh = scene_.meshes[m];
      // What moves has no fixed neighbours; light through a surface needs both of its sides.
      if (mesh.normals.empty() || !mesh.later.empty() ||
          scene_.materials[mesh.material].transmits) {
        continue;
      }
      std::vector<std::uint8_t> sides(mesh.triangle_count(), 3);
      std::vector<Shape> seen;
      for (Placement& place : places_[m]) {
        if (stop.stop_requested()) {
          return Error{ErrorCode::kCancelled, "stopped while looking for round facets", ""};
        }
        place.near = near_to(place, seen);
        const float small_m = kSmallRise * radius_of(mesh, place);
        for (std::uint32_t t = 0; t < sides.size(); ++t) {
          sides[t] =
              sides[t] == 0 ? std::uint8_t{0} : round_sides(mesh, place, t, small_m, sides[t]);
        }
      }
      if (std::any_of(sides.begin(), sides.end(), [](std::uint8_t s) { return s != 0; })) {
        mesh.round_sides = std::move(sides);
      }
    }
    return ok_status();
  }

 private:
  /// Distance of an instance from the origin over its scale, which its coordinates' rounding grows
  /// with.
  static float offset(const Placement& place) {
    if (place.instance == nullptr) {
      return 0;
    }
    const Transform& m = place.instance->to_world;
    const float scale = stretch_bound(m);
    return scale > 0 ? length(m.t) / scale : 0;
  }

  static Facet facet(const MeshData& mesh, const Placement& place, std::uint32_t triangle) {
    Facet out;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = mesh.positions[mesh.indices[3 * std::size_t{triangle} + k]];
      out.p[k] = place.instance == nullptr ? p : place.instance->to_world.point(p);
    }
    out.error = place.instance == nullptr ? InstanceError{} : place.instance->error;
    return out;
  }

  /// seen: shapes whose own triangles have been looked for; adds that of this instance.
  Near near_to(const Placement& place, std::vector<Shape>& seen) const {
    if (place.instance == nullptr) {
      return Near::kAll;
    }
    const auto i = static_cast<std::size_t>(place.instance - scene_.instances.data());
    Shape shape(scene_, i);
    if (std::any_of(seen.begin(), seen.end(),
                    [&shape](const Shape& one) { return one.is_like(shape); })) {
      return is_isolated_[i] ? Near::kNone : Near::kOthers;
    }
    if (seen.size() < kShapes) {
      seen.push_back(std::move(shape));
    }
    return Near::kAll;
  }

  static float radius_of(const MeshData& mesh, const Placement& place) {
    Bounds box;
    for (std::size_t i = 0; i + 1 < mesh.positions.size(); ++i) {
      const Vec3 p = mesh.positions[i];
      box.add(place.instance == nullptr ? p : place.instance->to_world.point(p));
    }
    return box.radius_or(0);
  }

  /// Returns those of the asked sides (bit 0: front) that are round.
  std::uint8_t round_sides(const MeshData& mesh, const Placement& place, std::uint32_t triangle,
                           float small_m, unsigned asked) const {
    const Facet here = facet(mesh, place, triangle);
    const bool mirrored = place.instance != nullptr && place.instance->to_world.determinant() < 0;
    const Vec3 winding = normalize_or(here.normal(), {0, 0, 0});
    const Vec3 front = mirrored ? -winding : winding;
    std::array<Vec3, 3> n;
    for (std::size_t k = 0; k < 3; ++k) {
      n[k] = mesh.normals[mesh.indices[3 * std::size_t{triangle} + k]];
      if (place.instance != nullptr) {
        n[k] = normalize_or(place.instance->to_world.normal(n[k]), {0, 0, 0});
      }
      if (!(dot(n[k], front) >= kCosTurn)) {
        return 0;
      }
    }
    unsigned out = 0;
    for (const unsigned side : {0U, 1U}) {
      const float sign = side == 0 ? 1.0F : -1.0F;
      float rise = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        rise = std::max(rise, sign * dot(n[next] - n[k], here.p[next] - here.p[k]));
      }
      // Barycentric products add up to at most a third, and the surface is half of that.
      rise /= 6;
      const bool is_open = (asked >> side & 1U) != 0 && rise > here.step_m() &&
                           (rise <= small_m || place.near == Near::kNone ||
                            !is_occupied(here, front * sign, rise, place, triangle));
      out |= is_open ? 1U << side : 0U;
    }
    return static_cast<std::uint8_t>(out);
  }

  /// The room above a facet: up to kRoom rises above it and as far beside it.
  struct Room {
    struct Plane {
      Vec3 at;
      Vec3 inward;  ///< unit
      float by_m;   ///< how far outside of `at` the plane is
      float inside_m(Vec3 p) const { return dot(p - at, inward) + by_m; }
    };
    /// The first is the facet's own; its by_m holds for triangles without rounding.
    std::array<Plane, 5> planes;

    /// up: the facet's unit normal on that side.
    Room(const Facet& here, Vec3 up, float rise_m) {
      planes[0] = {here.p[0], up, -4 * here.step_m()};
      planes[1] = {here.p[0], -up, kRoom * rise_m};
      // Of unit length first: products of three edges of a tiny mesh underflow.
      const Vec3 winding = normalize_or(here.normal(), {0, 0, 0});
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 along = here.p[(k + 1) % 3] - here.p[k];
        planes[2 + k] = {here.p[k], normalize_or(cross(winding, along), {0, 0, 0}), kRoom * rise_m};
      }
    }
    /// Returns whether one of the planes has all three points outside: most triangles near by.
    bool is_beside(const Vec3 (&p)[3]) const {
      return std::any_of(planes.begin(), planes.end(), [&p](const Plane& plane) {
        return std::none_of(std::begin(p), std::end(p),
                            [&plane](Vec3 q) { return plane.inside_m(q) > 0; });
      });
    }
    /// Clips the triangle. Source: Sutherland and Hodgman, Reentrant Polygon Clipping, CACM 17(1),
    /// 1974.
    bool holds_part_of(const Facet& there) const {
      std::vector<Vec3> polygon(std::begin(there.p), std::end(there.p));
      for (std::size_t k = 0; k < planes.size(); ++k) {
        Plane plane = planes[k];
        if (k == 0) {
          plane.by_m = std::min(plane.by_m, -4 * there.step_m());
        }
        std::vector<Vec3> kept;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
          const Vec3 p = polygon[i];
          const Vec3 q = polygon[(i + 1) % polygon.size()];
          const float a = plane.inside_m(p);
          const float b = plane.inside_m(q);
          if (a > 0) {
            kept.push_back(p);
          }
          if ((a > 0) != (b > 0)) {
            kept.push_back(p + (q - p) * (a / (a - b)));
          }
        }
        polygon = std::move(kept);
      }
      return !polygon.empty();
    }
  };

  /// Returns whether a triangle, other than the facet's neighbours in its own surface, is in the
  /// room above the facet or beside it. up: its unit normal on that side.
  bool is_occupied(const Facet& here, Vec3 up, float rise_m, const Placement& place,
                   std::uint32_t triangle) const {
    const Vec3 middle = (here.p[0] + here.p[1] + here.p[2]) * (1.0F / 3);
    float reach = 0;
    for (const Vec3 p : here.p) {
      reach = std::max(reach, length(p - middle));
    }
    const Room room(here, up, rise_m);
    bool found = false;
    scene_.accel->visit_near(middle, reach + 2 * kRoom * rise_m, [&](const RawHit& hit) {
      const PlacedMesh& other = scene_.placed_mesh(hit);
      const Placement its = {
          static_cast<std::uint32_t>(&other - scene_.placed.data()),
          hit.instance == kNoInstance ? nullptr : &scene_.instances[hit.instance]};
      const bool is_own = its.placed == place.placed;
      if ((is_own && hit.primitive == triangle) ||
          (place.near == Near::kOthers && its.instance == place.instance)) {
        return true;
      }
      const Facet there = facet(scene_.meshes[other.mesh], its, hit.primitive);
      if (room.is_beside(there.p) || (is_own && touch(here, there))) {
        return true;
      }
      found = found || room.holds_part_of(there);
      return !found;
    });
    return found;
  }

  static bool touch(const Facet& a, const Facet& b) {
    return std::any_of(std::begin(a.p), std::end(a.p), [&b](Vec3 p) {
      return std::any_of(std::begin(b.p), std::end(b.p), [p](Vec3 q) { return p == q; });
    });
  }

  SceneData& scene_;
  std::vector<std::vector<Placement>> places_;  ///< by mesh
  std::vector<bool> is_isolated_;               ///< by instance
};

}  // namespace

Status find_round_facets(SceneData& scene, const std::stop_token& stop) {
  return RoundFacets(scene, stop).run(stop);
}

}  // namespace core
