/// Rays against triangles: a thin face over Embree 3.13 or 4.3, which stays inside core/accel.
///
/// Two levels: geometries (triangle meshes) stand in the top level or in a group; groups are placed
/// by instances. Embree picks the primitive; callers recompute the hit point from the vertices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/math/bounds.h"
#include "core/math/transform.h"
#include "core/math/vec.h"

namespace core {

struct Ray {
  Vec3 origin;
  Vec3 direction;  ///< need not be unit; t is in its lengths
  float t_min = 0;
  float t_max = 3.4e38F;
  float time = 0;  ///< share of the open shutter's interval
};

inline constexpr std::uint32_t kNoInstance = 0xffffffffU;

struct RawHit {
  float t = 0;
  std::uint32_t instance =
      kNoInstance;             ///< index of the instance, or kNoInstance for the top level
  std::uint32_t geometry = 0;  ///< index within the top level or the group
  std::uint32_t primitive = 0;
};

/// Eight rays side by side, as Ray from t = 0 on, at time 0.
struct alignas(32) RayPacket {
  float origin_x[8], origin_y[8], origin_z[8];
  float direction_x[8], direction_y[8], direction_z[8];
  float t_max[8];
};

/// RawHit of eight rays; t is left to the caller.
struct alignas(32) HitPacket {
  std::uint32_t instance[8];
  std::uint32_t geometry[8];
  std::uint32_t primitive[8];
};

struct AccelGeometry {
  std::span<const Vec3>
      positions;  ///< with at least 16 readable bytes after the last but one float
  std::span<const std::uint32_t> indices;
  /// Positions at further, evenly spaced times until 1; between them vertices go straight. Empty:
  /// nothing moves.
  std::vector<std::span<const Vec3>> later = {};
};

struct AccelInstance {
  std::uint32_t group = 0;
  Transform to_world;
};

class Accel {
 public:
  /// The spans are used in place: they must outlive the Accel, and each vertex buffer must have
  /// four readable bytes past its end. threads: for building. isa: restricts Embree to it, as
  /// resolve_isa() gives it; empty leaves the choice to Embree.
  /// Errors: kTooLarge when memory runs out, kInternal with Embree's words.
  static Result<std::unique_ptr<Accel>> build(std::span<const AccelGeometry> top_level,
                                              std::span<const std::vector<AccelGeometry>> groups,
                                              std::span<const AccelInstance> instances, int threads,
                                              std::string_view isa = {});
  ~Accel();
  Accel(const Accel&) = delete;
  Accel& operator=(const Accel&) = delete;

  /// Nearest hit in [t_min, t_max].
  bool intersect(const Ray& ray, RawHit& hit) const noexcept;
  /// Is there any hit in [t_min, t_max]?
  bool occluded(const Ray& ray) const noexcept;
  /// The same for the rays of a packet whose bit is set, as bits. What a ray meets does not depend
  /// on the others of its packet, but where two surfaces are as near as rounding tells it may be
  /// the other one than a ray alone meets: one kind of path uses one of the two, always. Scenes of
  /// a few dozen triangles have a kernel of their own (few_triangles.h). Where there are instances
  /// the rays go one by one: packets that part at their boxes took 1.2 to 1.5 times as long
  /// (GrassFieldInstanced).
  unsigned intersect8(const RayPacket& rays, unsigned active, HitPacket& hits) const noexcept;
  unsigned occluded8(const RayPacket& rays, unsigned active) const noexcept;
  /// Does Embree trace packets of eight as such?
  bool has_packets() const noexcept;
  std::size_t bytes() const noexcept;

 private:
  Accel();
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// "4.3.3", as linked.
const char* embree_version() noexcept;
/// Sets flush-to-zero for the calling thread, as Embree requires of every thread that traces.
void prepare_tracing_thread() noexcept;

}  // namespace core
