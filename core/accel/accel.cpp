#include "core/accel/accel.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "core/accel/embree_bridge.h"
#include "core/accel/few_triangles.h"
#include "core/math/intrinsics.h"
#include "core/math/offset_ray.h"

namespace core {

namespace {

/// Instances of at most as many triangles in all are copied to world space, so that rays need no
/// second level and packets serve: many-lights takes 4/5 of the time. The copies take up to 60 MB.
constexpr std::size_t kCopiedTriangles = std::size_t{1} << 19;

/// A geometry of an instance.
struct Copy {
  std::uint32_t instance;
  std::uint32_t geometry;
  std::vector<Vec3> positions;  ///< world
};

/// Returns whether a triangle is a sliver that rays may hit again when they leave it, because the
/// step off its plane is bounded (core/math/offset_ray.h).
bool has_sliver(std::span<const Vec3> positions, std::span<const std::uint32_t> indices) {
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    const Vec3 edge1 = positions[indices[i + 1]] - positions[indices[i]];
    const Vec3 edge2 = positions[indices[i + 2]] - positions[indices[i]];
    const float twice_area = length(cross(edge1, edge2));
    if (twice_area > 0 &&
        kSliverShare * taxicab(edge1) * taxicab(edge2) > kSliverMost * twice_area) {
      return true;
    }
  }
  return false;
}

/// Returns the copies; empty if they would be too many, or one has slivers, which are none in the
/// space of a mesh that is stretched.
std::vector<Copy> copy_instances(std::span<const std::vector<AccelGeometry>> groups,
                                 std::span<const AccelInstance> instances) {
  std::size_t triangles = 0;
  for (const AccelInstance& instance : instances) {
    for (const AccelGeometry& mesh : groups[instance.group]) {
      triangles += mesh.indices.size() / 3;
    }
  }
  std::vector<Copy> out;
  if (triangles > kCopiedTriangles) {
    return out;
  }
  for (std::uint32_t i = 0; i < instances.size(); ++i) {
    const auto& group = groups[instances[i].group];
    for (std::uint32_t id = 0; id < group.size(); ++id) {
      Copy& copy = out.emplace_back(Copy{i, id, {}});
      copy.positions.reserve(group[id].positions.size() + 1);
      for (const Vec3 p : group[id].positions) {
        copy.positions.push_back(instances[i].to_world.point(p));
      }
      if (has_sliver(copy.positions, group[id].indices)) {
        return {};
      }
      copy.positions.push_back(Vec3{});  // as AccelGeometry::positions
    }
  }
  return out;
}

}  // namespace

struct Accel::Impl {
  RTCDevice device = nullptr;
  RTCScene top = nullptr;
  std::vector<RTCScene> groups;
  std::uint32_t top_geometries = 0;
  std::vector<Copy> copies;    ///< of instances; geometries that follow those of the top level
  bool has_instances = false;  ///< that are not copied
  FewTriangles few{{}};        ///< replaces packets
  std::atomic<std::ptrdiff_t> bytes{0};
  /// What Embree made stays, which is little without its trees: where the system had no memory for
  /// its threads, Embree 3.13 ends the process when a scene is released.
  bool is_lost = false;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (is_lost) {
      rtcSetDeviceMemoryMonitorFunction(device, nullptr, nullptr);
      return;
    }
    if (top != nullptr) {
      rtcReleaseScene(top);
    }
    for (RTCScene group : groups) {
      rtcReleaseScene(group);
    }
    if (device != nullptr) {
      rtcReleaseDevice(device);
    }
  }

  struct HitMesh {
    std::uint32_t instance;
    std::uint32_t geometry;
  };
  /// Returns the mesh of a hit that Embree names.
  HitMesh mesh_of(std::uint32_t instance, std::uint32_t geometry) const noexcept {
    if (instance != RTC_INVALID_GEOMETRY_ID) {
      return {instance - top_geometries, geometry};
    }
    if (geometry < top_geometries || geometry == RTC_INVALID_GEOMETRY_ID) {
      return {kNoInstance, geometry};
    }
    const Copy& copy = copies[geometry - top_geometries];
    return {copy.instance, copy.geometry};
  }
};

namespace {

bool count_memory(void* user, ssize_t bytes, bool /*post*/) {
  static_cast<std::atomic<std::ptrdiff_t>*>(user)->fetch_add(bytes, std::memory_order_relaxed);
  return true;
}

void attach_mesh(RTCDevice device, RTCScene scene, const AccelGeometry& mesh, std::uint32_t id) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryTimeStepCount(geometry, static_cast<unsigned>(1 + mesh.later.size()));
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             mesh.positions.data(), 0, sizeof(Vec3), mesh.positions.size());
  unsigned slot = 0;
  for (const std::span<const Vec3> positions : mesh.later) {
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, ++slot, RTC_FORMAT_FLOAT3,
                               positions.data(), 0, sizeof(Vec3), positions.size());
  }
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             mesh.indices.data(), 0, 3 * sizeof(std::uint32_t),
                             mesh.indices.size() / 3);
  if (mesh.has_holes) {
    rtcSetGeometryOccludedFilterFunction(geometry, &embree::pass_hole);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

RTCScene new_scene(RTCDevice device, bool has_each_hit) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  // Robust: edges are watertight, so that closed furnaces do not leak.
  rtcSetSceneFlags(
      scene, has_each_hit ? RTC_SCENE_FLAG_ROBUST | embree::kFilterFlag : RTC_SCENE_FLAG_ROBUST);
  return scene;
}

/// Embree asks while it builds, on any of its threads, whether to go on.
bool may_go_on(void* stop, double /*done*/) {
  return !static_cast<const std::stop_token*>(stop)->stop_requested();
}

void commit(RTCScene scene, std::stop_token stop) {
  rtcSetSceneProgressMonitorFunction(scene, &may_go_on, &stop);
  rtcCommitScene(scene);
  rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
}

RTCRay to_embree(const Ray& ray) {
  RTCRay out;
  out.org_x = ray.origin.x;
  out.org_y = ray.origin.y;
  out.org_z = ray.origin.z;
  out.tnear = ray.t_min;
  out.dir_x = ray.direction.x;
  out.dir_y = ray.direction.y;
  out.dir_z = ray.direction.z;
  out.time = ray.time;
  out.tfar = ray.t_max;
  out.mask = 0xffffffffU;
  out.id = 0;
  out.flags = 0;
  return out;
}

bool traceable(const Ray& ray) {
  // Debian's Embree aborts the process on NaN; the sum is finite only if all terms are.
  const Vec3 sum = ray.origin + ray.direction;
  return std::isfinite(sum.x + sum.y + sum.z) && ray.t_max >= ray.t_min;
}

/// Copies the active, traceable rays of a packet to Embree's lanes; returns their bits.
unsigned to_embree(const RayPacket& rays, unsigned active, RTCRay8& out, int (&valid)[8]) {
  std::memcpy(out.org_x, rays.origin_x, sizeof(rays.origin_x));
  std::memcpy(out.org_y, rays.origin_y, sizeof(rays.origin_y));
  std::memcpy(out.org_z, rays.origin_z, sizeof(rays.origin_z));
  std::memcpy(out.dir_x, rays.direction_x, sizeof(rays.direction_x));
  std::memcpy(out.dir_y, rays.direction_y, sizeof(rays.direction_y));
  std::memcpy(out.dir_z, rays.direction_z, sizeof(rays.direction_z));
  std::memset(out.tnear, 0, sizeof(out.tnear));
  std::memcpy(out.time, rays.time, sizeof(rays.time));
  std::memset(out.mask, 0xff, sizeof(out.mask));
  std::memset(out.flags, 0, sizeof(out.flags));
  unsigned traced = 0;
  for (unsigned k = 0; k < 8; ++k) {
    out.id[k] = k;
    const float sum = (rays.origin_x[k] + rays.direction_x[k]) +
                      (rays.origin_y[k] + rays.direction_y[k]) +
                      (rays.origin_z[k] + rays.direction_z[k]);
    const bool is_traced = (active >> k & 1U) != 0 && std::isfinite(sum) && rays.t_max[k] >= 0;
    valid[k] = is_traced ? -1 : 0;
    out.tfar[k] = is_traced ? rays.t_max[k] : -1;  // without native packets, valid is not read
    traced |= is_traced ? 1U << k : 0U;
  }
  return traced;
}

Ray ray_of(const RayPacket& rays, unsigned k) {
  return {.origin = {rays.origin_x[k], rays.origin_y[k], rays.origin_z[k]},
          .direction = {rays.direction_x[k], rays.direction_y[k], rays.direction_z[k]},
          .t_max = rays.t_max[k],
          .time = rays.time[k]};
}

Error no_memory() {
  return {ErrorCode::kTooLarge, "not enough memory for the acceleration structure", ""};
}

Error without_device() {
  return rtcGetDeviceError(nullptr) == RTC_ERROR_OUT_OF_MEMORY
             ? no_memory()
             : Error{ErrorCode::kInternal, "Embree could not create a device", ""};
}

}  // namespace

Accel::Accel() : impl_(std::make_unique<Impl>()) {}
Accel::~Accel() = default;

Result<std::unique_ptr<Accel>> Accel::build(std::span<const AccelGeometry> top_level,
                                            std::span<const std::vector<AccelGeometry>> groups,
                                            std::span<const AccelInstance> instances, int threads,
                                            std::string_view isa, const std::stop_token& stop,
                                            bool has_each_hit) {
  std::unique_ptr<Accel> accel(new Accel());
  Impl& impl = *accel->impl_;
  std::string config = "threads=" + std::to_string(threads) + ",set_affinity=0";
  if (!isa.empty()) {
    config += ",isa=" + std::string(isa);
  }
  impl.device = rtcNewDevice(config.c_str());
  if (impl.device == nullptr) {
    return without_device();
  }
  rtcSetDeviceMemoryMonitorFunction(impl.device, &count_memory, &impl.bytes);
  const Error stopped = {ErrorCode::kCancelled, "stopped while building the acceleration structure",
                         ""};
  impl.copies = copy_instances(groups, instances);
  impl.has_instances = !instances.empty() && impl.copies.empty();
  for (const auto& group : groups) {
    if (!impl.has_instances) {
      break;
    }
    if (stop.stop_requested()) {
      return stopped;
    }
    RTCScene scene = new_scene(impl.device, has_each_hit);
    impl.groups.push_back(scene);
    for (std::uint32_t id = 0; id < group.size(); ++id) {
      attach_mesh(impl.device, scene, group[id], id);
    }
    commit(scene, stop);
  }
  impl.top = new_scene(impl.device, has_each_hit);
  impl.top_geometries = static_cast<std::uint32_t>(top_level.size());
  const bool is_still = std::all_of(top_level.begin(), top_level.end(),
                                    [](const AccelGeometry& mesh) { return mesh.later.empty(); });
  if (instances.empty() && is_still) {
    impl.few = FewTriangles(top_level);
  }
  for (std::uint32_t id = 0; id < top_level.size(); ++id) {
    attach_mesh(impl.device, impl.top, top_level[id], id);
  }
  for (std::uint32_t i = 0; i < impl.copies.size(); ++i) {
    const Copy& copy = impl.copies[i];
    AccelGeometry placed = groups[instances[copy.instance].group][copy.geometry];
    placed.positions = std::span(copy.positions).first(placed.positions.size());
    attach_mesh(impl.device, impl.top, placed, impl.top_geometries + i);
  }
  for (std::uint32_t i = 0; impl.has_instances && i < instances.size(); ++i) {
    RTCGeometry geometry = rtcNewGeometry(impl.device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, impl.groups[instances[i].group]);
    const Transform& m = instances[i].to_world;
    const float columns[12] = {m.x.x, m.x.y, m.x.z, m.y.x, m.y.y, m.y.z,
                               m.z.x, m.z.y, m.z.z, m.t.x, m.t.y, m.t.z};
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(impl.top, geometry, impl.top_geometries + i);
    rtcReleaseGeometry(geometry);
  }
  commit(impl.top, stop);
  const RTCError error = rtcGetDeviceError(impl.device);
  if (stop.stop_requested()) {
    return stopped;
  }
  if (error == RTC_ERROR_UNKNOWN || error == RTC_ERROR_OUT_OF_MEMORY) {
    impl.is_lost = true;
    return no_memory();
  }
  if (error != RTC_ERROR_NONE) {
    return Error{ErrorCode::kInternal, "Embree error " + std::to_string(static_cast<int>(error)),
                 ""};
  }
  return accel;
}

bool Accel::intersect(const Ray& ray, RawHit& hit) const noexcept {
  if (!traceable(ray)) {
    return false;
  }
  RTCRayHit rayhit;
  rayhit.ray = to_embree(ray);
  rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  embree::intersect1(impl_->top, &rayhit);
  if (rayhit.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
    return false;
  }
  const auto [instance, geometry] = impl_->mesh_of(rayhit.hit.instID[0], rayhit.hit.geomID);
  hit = {rayhit.ray.tfar, instance, geometry, rayhit.hit.primID};
  return true;
}

void Accel::each_hit(const Ray& ray, HitVisitor visit, void* visitor) const noexcept {
  if (!traceable(ray)) {
    return;
  }
  struct To {
    HitVisitor visit;
    void* visitor;
    const Impl& impl;
  } to{visit, visitor, *impl_};
  RTCRayHit rayhit;
  rayhit.ray = to_embree(ray);
  rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  embree::each_hit(
      impl_->top, &rayhit,
      [](void* user, float t, unsigned instance, unsigned geometry, unsigned primitive) {
        const To& told = *static_cast<const To*>(user);
        const auto mesh = told.impl.mesh_of(instance, geometry);
        told.visit(told.visitor, {t, mesh.instance, mesh.geometry, primitive});
      },
      &to);
}

bool Accel::occluded(const Ray& ray) const noexcept {
  if (!traceable(ray)) {
    return true;
  }
  RTCRay shadow = to_embree(ray);
  embree::PassContext context(nullptr, nullptr);
  embree::occluded1(impl_->top, context.context, &shadow);
  return shadow.tfar < 0;
}

unsigned Accel::intersect8(const RayPacket& rays, unsigned active, HitPacket& hits) const noexcept {
  if (!impl_->few.empty()) {
    if (const auto met = impl_->few.intersect8(rays, active, hits)) {
      return *met;
    }
  }
  unsigned met = 0;
  if (impl_->has_instances) {
    for (unsigned rest = active; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<unsigned>(std::countr_zero(rest));
      RawHit hit;
      if (intersect(ray_of(rays, k), hit)) {
        met |= 1U << k;
        hits.instance[k] = hit.instance;
        hits.geometry[k] = hit.geometry;
        hits.primitive[k] = hit.primitive;
      }
    }
    return met;
  }
  alignas(32) RTCRayHit8 rayhit;
  alignas(32) int valid[8];
  const unsigned traced = to_embree(rays, active, rayhit.ray, valid);
  static_assert(RTC_INVALID_GEOMETRY_ID == kNoInstance);
  std::memset(rayhit.hit.geomID, 0xff, sizeof(rayhit.hit.geomID));
  std::memset(rayhit.hit.instID[0], 0xff, sizeof(rayhit.hit.instID[0]));
  embree::intersect8(valid, impl_->top, &rayhit);
  for (unsigned k = 0; k < 8; ++k) {
    const auto mesh = impl_->mesh_of(rayhit.hit.instID[0][k], rayhit.hit.geomID[k]);
    met |= rayhit.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID ? 1U << k : 0U;
    hits.instance[k] = mesh.instance;
    hits.geometry[k] = mesh.geometry;
    hits.primitive[k] = rayhit.hit.primID[k];
  }
  return met & traced;
}

unsigned Accel::occluded8(const RayPacket& rays, unsigned active) const noexcept {
  if (!impl_->few.empty()) {
    if (const auto blocked = impl_->few.occluded8(rays, active)) {
      return *blocked;
    }
  }
  unsigned met = 0;
  if (impl_->has_instances) {
    for (unsigned rest = active; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<unsigned>(std::countr_zero(rest));
      met |= occluded(ray_of(rays, k)) ? 1U << k : 0U;
    }
    return met;
  }
  alignas(32) RTCRay8 shadow;
  alignas(32) int valid[8];
  const unsigned traced = to_embree(rays, active, shadow, valid);
  embree::PassContext context(nullptr, nullptr);
  embree::occluded8(valid, impl_->top, context.context, &shadow);
  met = active & ~traced;  // as in occluded()
  for (unsigned k = 0; k < 8; ++k) {
    met |= shadow.tfar[k] < 0 ? (traced & 1U << k) : 0U;
  }
  return met;
}

/// The holes that eight rays have passed. Sums of integers do not depend on the order in which
/// Embree finds holes, which depends on the other rays of a packet.
struct Accel::Holes {
  /// Parts of a binary logarithm: those of 2^-30, the smallest factor, have an error of 2^-33.
  static constexpr double kUnits = 4294967296.0;

  const Impl& impl;
  CoverageOf coverage;
  const void* of;
  std::int64_t log2_open[8] = {};  ///< of the open share, in 1 / kUnits
  std::uint32_t passed[8] = {};

  bool pass(unsigned lane, const RawHit& hit) noexcept {
    const float covered = coverage(of, hit, lane);
    if (!(covered < 1)) {
      return false;
    }
    ++passed[lane];
    if (covered > 0) {
      log2_open[lane] +=
          static_cast<std::int64_t>(static_cast<double>(std::log2(1 - covered)) * kUnits);
    }
    return true;
  }
  /// Returns the passage of a ray that is not blocked.
  Passage passage(unsigned lane) const noexcept {
    const std::int64_t sum = log2_open[lane];
    return {sum == 0 ? 1.0F : std::exp2(static_cast<float>(static_cast<double>(sum) / kUnits)),
            passed[lane]};
  }
  /// Context of rays that pass these holes.
  embree::PassContext context() noexcept {
    return {
        [](void* user, unsigned lane, unsigned instance, unsigned geometry, unsigned primitive) {
          auto& to = *static_cast<Holes*>(user);
          const auto mesh = to.impl.mesh_of(instance, geometry);
          return to.pass(lane, {0, mesh.instance, mesh.geometry, primitive});
        },
        this};
  }
};

Passage Accel::pass_holes(const Ray& ray, CoverageOf coverage, const void* of) const noexcept {
  if (!traceable(ray)) {
    return {0, 0};
  }
  Holes holes{*impl_, coverage, of};
  embree::PassContext context = holes.context();
  RTCRay shadow = to_embree(ray);
  embree::occluded1(impl_->top, context.context, &shadow);
  return shadow.tfar < 0 ? Passage{0, 0} : holes.passage(0);
}

void Accel::pass_holes8(const RayPacket& rays, unsigned active, CoverageOf coverage, const void* of,
                        Passage (&out)[8]) const noexcept {
  Holes holes{*impl_, coverage, of};
  embree::PassContext context = holes.context();
  alignas(32) RTCRay8 shadow;
  alignas(32) int valid[8];
  const unsigned traced = to_embree(rays, active, shadow, valid);
  if (!impl_->has_instances) {
    embree::occluded8(valid, impl_->top, context.context, &shadow);
  }
  for (unsigned rest = active; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<unsigned>(std::countr_zero(rest));
    const bool is_traced = (traced >> k & 1U) != 0;
    if (impl_->has_instances && is_traced) {
      RTCRay one = to_embree(ray_of(rays, k));
      one.id = k;
      embree::occluded1(impl_->top, context.context, &one);
      shadow.tfar[k] = one.tfar;
    }
    out[k] = is_traced && !(shadow.tfar[k] < 0) ? holes.passage(k) : Passage{0, 0};
  }
}

void Accel::visit_near(Vec3 center, float radius_m,
                       const std::function<bool(const RawHit&)>& visit) const {
  struct Asked {
    const std::function<bool(const RawHit&)>& visit;
    const Impl& impl;
  } asked = {visit, *impl_};
  RTCPointQuery query{center.x, center.y, center.z, 0, radius_m};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  const auto meet = [](RTCPointQueryFunctionArguments* met) {
    const auto& to = *static_cast<const Asked*>(met->userPtr);
    const bool is_instance = met->context->instStackSize != 0;
    const auto mesh = to.impl.mesh_of(
        is_instance ? met->context->instID[0] : RTC_INVALID_GEOMETRY_ID, met->geomID);
    const bool ends = !to.visit({0, mesh.instance, mesh.geometry, met->primID});
    met->query->radius = ends ? 0 : met->query->radius;
    return ends;  // whether the radius has changed
  };
  rtcPointQuery(impl_->top, &query, &context, +meet, &asked);
}

bool Accel::has_packets() const noexcept {
#ifdef __x86_64__
  return rtcGetDeviceProperty(impl_->device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0;
#else
  return true;
#endif
}

std::size_t Accel::bytes() const noexcept {
  auto out = static_cast<std::size_t>(std::max<std::ptrdiff_t>(impl_->bytes.load(), 0));
  for (const Copy& copy : impl_->copies) {
    out += copy.positions.capacity() * sizeof(Vec3);
  }
  return out;
}

const char* embree_version() noexcept { return RTC_VERSION_STRING; }

void prepare_tracing_thread() noexcept {
#ifdef __aarch64__
  __builtin_aarch64_set_fpcr(__builtin_aarch64_get_fpcr() | 1U << 24);  // FZ
#else
  // Bits 15 and 6 of MXCSR; the header's macros trigger our sign-conversion warning.
  _mm_setcsr(_mm_getcsr() | 0x8040U);
#endif
}

}  // namespace core
