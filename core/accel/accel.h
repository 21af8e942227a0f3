/// Accel: intersects rays with triangles; a thin interface over Embree 3.13 or 4.3, which only
/// core/accel uses.
///
/// Two levels: geometries (triangle meshes) are in the top level or in a group; instances place
/// groups, or small copies. Embree finds the primitive; callers recompute the hit point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/math/bounds.h"
#include "core/math/transform.h"
#include "core/math/vec.h"

namespace core {

struct Ray {
  Vec3 origin;
  Vec3 direction;  ///< need not be unit; t is in units of its length
  float t_min = 0;
  float t_max = 3.4e38F;
  float time = 0;  ///< fraction of the shutter interval
};

inline constexpr std::uint32_t kNoInstance = 0xffffffffU;

struct RawHit {
  float t = 0;
  std::uint32_t instance = kNoInstance;  ///< index of the instance; kNoInstance for the top level
  std::uint32_t geometry = 0;            ///< index within the top level or the group
  std::uint32_t primitive = 0;
};

/// Eight rays, each as Ray with t from 0.
struct alignas(32) RayPacket {
  float origin_x[8], origin_y[8], origin_z[8];
  float direction_x[8], direction_y[8], direction_z[8];
  float t_max[8];
  float time[8] = {};
};

/// RawHit of eight rays, without t, which the caller computes.
struct alignas(32) HitPacket {
  std::uint32_t instance[8];
  std::uint32_t geometry[8];
  std::uint32_t primitive[8];
};

struct AccelGeometry {
  std::span<const Vec3>
      positions;  ///< with at least 16 readable bytes after the last but one float
  std::span<const std::uint32_t> indices;
  /// Positions at further, evenly spaced times up to 1; vertices move linearly between them. Empty:
  /// no motion.
  std::vector<std::span<const Vec3>> later = {};
  bool has_holes = false;  ///< pass_holes() asks for the coverage of its hits
};

struct AccelInstance {
  std::uint32_t group = 0;
  Transform to_world;
};

/// The passage of a ray through surfaces with holes.
struct Passage {
  float open = 1;           ///< share of the light; 0 if a surface blocks the ray
  std::uint32_t holes = 0;  ///< surfaces passed; 0 if one blocks the ray
};

class Accel {
 public:
  /// Builds the structure. The spans are used in place: they must outlive the Accel, and each
  /// vertex buffer must have four readable bytes past its end. threads: for building. isa:
  /// restricts Embree's instruction set, as returned by resolve_isa(); empty lets Embree choose.
  /// has_each_hit: whether each_hit() can be called; it makes all rays a little slower.
  /// Errors: kTooLarge if memory runs out, kCancelled if stop was requested, kInternal with
  /// Embree's message.
  static Result<std::unique_ptr<Accel>> build(std::span<const AccelGeometry> top_level,
                                              std::span<const std::vector<AccelGeometry>> groups,
                                              std::span<const AccelInstance> instances, int threads,
                                              std::string_view isa = {},
                                              const std::stop_token& stop = {},
                                              bool has_each_hit = false);
  ~Accel();
  Accel(const Accel&) = delete;
  Accel& operator=(const Accel&) = delete;

  /// Finds the nearest hit in [t_min, t_max].
  bool intersect(const Ray& ray, RawHit& hit) const noexcept;
  using HitVisitor = void (*)(void* visitor, const RawHit& hit);
  /// Calls visit(visitor, hit) for all hits in [t_min, t_max], in any order.
  void each_hit(const Ray& ray, HitVisitor visit, void* visitor) const noexcept;
  /// Returns whether there is any hit in [t_min, t_max].
  bool occluded(const Ray& ray) const noexcept;
  /// As above, for the rays of a packet whose bit is set; returns bits. The hit of a ray does not
  /// depend on the other rays of its packet. If two surfaces are at the same distance up to
  /// rounding, it may differ from the hit of a single ray, so each kind of path always uses one of
  /// the two. Scenes of a few dozen triangles at rest have a kernel of their own
  /// (few_triangles.h). Where
  /// instances have too many triangles for copies, rays are traced one by one: packets that diverge
  /// at the instances' boxes took 1.2 to 1.5 times as long (GrassFieldInstanced).
  unsigned intersect8(const RayPacket& rays, unsigned active, HitPacket& hits) const noexcept;
  unsigned occluded8(const RayPacket& rays, unsigned active) const noexcept;
  using CoverageOf = float (*)(const void* of, const RawHit& hit, unsigned lane);
  /// Returns the product of 1 - coverage(of, hit, lane) over all hits in [t_min, t_max], in one
  /// traversal. Hits have no t; those of geometries without holes block the ray. lane: of the
  /// packet; 0 for a single ray. The product does not depend on the order of the hits.
  Passage pass_holes(const Ray& ray, CoverageOf coverage, const void* of) const noexcept;
  void pass_holes8(const RayPacket& rays, unsigned active, CoverageOf coverage, const void* of,
                   Passage (&out)[8]) const noexcept;
  /// Calls `visit` for every triangle whose bounding box comes within `radius_m` of a point, in the
  /// rest position, until it returns false; t of its hit is 0. A few calls may follow that.
  void visit_near(Vec3 center, float radius_m,
                  const std::function<bool(const RawHit&)>& visit) const;
  /// Returns whether packets of eight are worth using: on x86-64 if Embree traces them natively,
  /// which requires AVX. On arm64 it traces their rays one by one.
  bool has_packets() const noexcept;
  std::size_t bytes() const noexcept;

 private:
  Accel();
  struct Impl;
  struct Holes;
  std::unique_ptr<Impl> impl_;
};

/// Returns the linked version, such as "4.3.3".
const char* embree_version() noexcept;
/// Sets flush-to-zero for the calling thread, as Embree requires of every thread that traces.
void prepare_tracing_thread() noexcept;

}  // namespace core
