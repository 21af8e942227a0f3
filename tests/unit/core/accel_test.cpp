#include "core/accel/accel.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace core {
namespace {

constexpr std::uint32_t kPlaces = 3;

/// A square of cells x cells squares in the plane z = 0, two triangles each, from 0 to 1.
struct Grid {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;

  explicit Grid(std::uint32_t cells) {
    const float side = 1 / static_cast<float>(cells);
    for (std::uint32_t y = 0; y <= cells; ++y) {
      for (std::uint32_t x = 0; x <= cells; ++x) {
        positions.push_back({static_cast<float>(x) * side, static_cast<float>(y) * side, 0});
      }
    }
    for (std::uint32_t y = 0; y < cells; ++y) {
      for (std::uint32_t x = 0; x < cells; ++x) {
        const std::uint32_t a = y * (cells + 1) + x;
        const std::uint32_t b = a + cells + 1;
        indices.insert(indices.end(), {a, a + 1, b, a + 1, b + 1, b});
      }
    }
    positions.push_back({});  // as AccelGeometry::positions
  }
  AccelGeometry geometry() const {
    return {std::span(positions).first(positions.size() - 1), indices};
  }
};

/// A floor of the top level at z = -1, and two grids above each other, placed side by side.
class Placed : public ::testing::TestWithParam<std::uint32_t> {
 protected:
  Placed()
      : grid_(GetParam()), upper_(GetParam()), floor_{{-9, -9, -1}, {99, -9, -1}, {0, 99, -1}, {}} {
    for (Vec3& p : upper_.positions) {
      p.z = 0.5F;
    }
    const AccelGeometry floor{std::span(floor_).first(3), kTriangle};
    std::vector<AccelInstance> instances(kPlaces);
    for (std::uint32_t i = 0; i < kPlaces; ++i) {
      instances[i].to_world.t = {2 * static_cast<float>(i), 0, 0};
    }
    const std::vector<std::vector<AccelGeometry>> groups = {{grid_.geometry(), upper_.geometry()}};
    accel_ = std::move(Accel::build({&floor, 1}, groups, instances, 2, {}, {}, true)).value();
  }
  /// Down on the first triangle of a cell of instance i, or beside all if i is kPlaces.
  Ray down(std::uint32_t i, std::uint32_t x, std::uint32_t y) const {
    const auto cells = static_cast<float>(GetParam());
    return {.origin = {2 * static_cast<float>(i) + (static_cast<float>(x) + 0.3F) / cells,
                       (static_cast<float>(y) + 0.3F) / cells, 3},
            .direction = {0, 0, -1}};
  }

  static constexpr std::uint32_t kTriangle[3] = {0, 1, 2};
  Grid grid_, upper_;
  std::vector<Vec3> floor_;
  std::unique_ptr<Accel> accel_;
};

bool is(const RawHit& hit, std::uint32_t instance, std::uint32_t geometry,
        std::uint32_t primitive) {
  return hit.instance == instance && hit.geometry == geometry && hit.primitive == primitive;
}

TEST_P(Placed, EveryQueryNamesInstanceAndGeometry) {
  const std::uint32_t cells = GetParam();
  RayPacket packet;
  for (std::uint32_t i = 0; i <= kPlaces; ++i) {
    const std::uint32_t x = i + 1;
    const std::uint32_t y = cells - 1 - i;
    const std::uint32_t instance = i < kPlaces ? i : kNoInstance;
    const std::uint32_t primitive = i < kPlaces ? 2 * (y * cells + x) : 0;
    const std::uint32_t geometry = i < kPlaces ? 1 : 0;
    const Ray ray = down(i, x, y);
    RawHit hit;
    ASSERT_TRUE(accel_->intersect(ray, hit));
    EXPECT_TRUE(is(hit, instance, geometry, primitive)) << i;

    int floors = 0;
    std::vector<RawHit> hits;
    accel_->each_hit(
        ray,
        [](void* to, const RawHit& at) { static_cast<std::vector<RawHit>*>(to)->push_back(at); },
        &hits);
    for (const RawHit& at : hits) {
      floors += is(at, kNoInstance, 0, 0) ? 1 : 0;
      EXPECT_TRUE(is(at, kNoInstance, 0, 0) || is(at, instance, 0, primitive) ||
                  is(at, instance, 1, primitive));
    }
    EXPECT_EQ(floors, 1);
    EXPECT_EQ(hits.size(), i < kPlaces ? 3U : 1U);

    bool is_near = false;
    accel_->visit_near({ray.origin.x, ray.origin.y, geometry == 1 ? 0.5F : -1.0F}, 1e-5F,
                       [&](const RawHit& at) {
                         is_near = is_near || is(at, instance, geometry, primitive);
                         return true;
                       });
    EXPECT_TRUE(is_near);

    packet.origin_x[i] = ray.origin.x;
    packet.origin_y[i] = ray.origin.y;
    packet.origin_z[i] = ray.origin.z;
    packet.direction_x[i] = packet.direction_y[i] = 0;
    packet.direction_z[i] = -1;
    packet.t_max[i] = 100;
  }
  HitPacket hits;
  ASSERT_EQ(accel_->intersect8(packet, 15, hits), 15U);
  EXPECT_EQ(accel_->occluded8(packet, 15), 15U);
  for (std::uint32_t i = 0; i <= kPlaces; ++i) {
    RawHit one;
    accel_->intersect(down(i, i + 1, cells - 1 - i), one);
    EXPECT_TRUE(is(one, hits.instance[i], hits.geometry[i], hits.primitive[i])) << i;
  }
}

// 1,200 triangles are copied, and 600,000 are not.
INSTANTIATE_TEST_SUITE_P(OfFewAndManyTriangles, Placed, ::testing::Values(10, 224));

}  // namespace
}  // namespace core
