#include "core/accel/accel.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <tuple>
#include <utility>
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
    accel_ = build(false, false);
  }
  /// has_holes: of the grids; of the floor.
  std::unique_ptr<Accel> build(bool has_holes, bool has_floor_holes) const {
    AccelGeometry floor{std::span(floor_).first(3), kTriangle};
    floor.has_holes = has_floor_holes;
    std::vector<AccelInstance> instances(kPlaces);
    for (std::uint32_t i = 0; i < kPlaces; ++i) {
      instances[i].to_world.t = {2 * static_cast<float>(i), 0, 0};
    }
    std::vector<std::vector<AccelGeometry>> groups = {{grid_.geometry(), upper_.geometry()}};
    for (AccelGeometry& mesh : groups[0]) {
      mesh.has_holes = has_holes;
    }
    return std::move(Accel::build({&floor, 1}, groups, instances, 2, {}, {}, true)).value();
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

/// Coverages of the floor, the lower and the upper grid.
struct Covered {
  float floor, lower, upper;
  static float at(const void* of, const RawHit& hit, unsigned /*lane*/) {
    const auto& to = *static_cast<const Covered*>(of);
    return hit.instance == kNoInstance ? to.floor : hit.geometry == 0 ? to.lower : to.upper;
  }
};

/// Lane 0 goes through both grids to the floor; lane 1 falls on the floor alone.
std::pair<Passage, Passage> passages(const Accel& accel, Ray through, Ray beside,
                                     const Covered& covered) {
  RayPacket packet{};
  const Ray rays[2] = {through, beside};
  for (int k = 0; k < 2; ++k) {
    packet.origin_x[k] = rays[k].origin.x;
    packet.origin_y[k] = rays[k].origin.y;
    packet.origin_z[k] = rays[k].origin.z;
    packet.direction_z[k] = rays[k].direction.z;
    packet.t_max[k] = rays[k].t_max;
  }
  Passage out[8];
  accel.pass_holes8(packet, 3, &Covered::at, &covered, out);
  for (int k = 0; k < 2; ++k) {
    const Passage alone = accel.pass_holes(rays[k], &Covered::at, &covered);
    EXPECT_EQ(alone.open, out[k].open);
    EXPECT_EQ(alone.holes, out[k].holes);
  }
  return {out[0], out[1]};
}

TEST_P(Placed, HolesMultiply) {
  const Ray through = down(1, 2, 3);
  const Ray beside = down(kPlaces, 2, 3);
  const auto open = build(true, true);
  auto [light, floor] = passages(*open, through, beside, {0.5F, 0.25F, 0.6F});
  EXPECT_NEAR(light.open, 0.5F * 0.75F * 0.4F, 1e-7F);
  EXPECT_EQ(light.holes, 3U);
  EXPECT_EQ(floor.open, 0.5F);
  EXPECT_EQ(floor.holes, 1U);
  // Holes of MASK lose nothing, and what covers blocks, wherever it is.
  EXPECT_EQ(passages(*open, through, beside, {0, 0, 0}).first.open, 1);
  for (const Covered& covered : {Covered{1, 0.5F, 0}, {0, 1, 0.5F}, {0.5F, 0, 1}}) {
    light = passages(*open, through, beside, covered).first;
    EXPECT_EQ(light.open, 0);
    EXPECT_EQ(light.holes, 0U);
  }
  // A ray that ends above the floor.
  Ray ended = through;
  ended.t_max = 3.5F;
  EXPECT_NEAR(passages(*open, ended, beside, {1, 0.25F, 0.6F}).first.open, 0.3F, 1e-7F);
  // Geometries without holes block, whatever their coverage.
  std::tie(light, floor) = passages(*build(true, false), through, beside, {0.5F, 0.25F, 0.6F});
  EXPECT_EQ(light.open, 0);
  EXPECT_EQ(floor.open, 0);
  EXPECT_EQ(passages(*build(false, true), through, beside, {0, 0, 0}).first.open, 0);
  EXPECT_TRUE(open->occluded(through));
}

// 1,200 triangles are copied, and 600,000 are not.
INSTANTIATE_TEST_SUITE_P(OfFewAndManyTriangles, Placed, ::testing::Values(10, 224));

/// Eight rays straight down from z = 3 at these places.
RayPacket all_down(const float (&x)[8], const float (&y)[8]) {
  RayPacket out{};
  for (std::size_t k = 0; k < 8; ++k) {
    out.origin_x[k] = x[k];
    out.origin_y[k] = y[k];
    out.origin_z[k] = 3;
    out.direction_z[k] = -1;
    out.t_max[k] = 100;
  }
  return out;
}

/// Coverage of a triangle: a number of its own.
float some_coverage(const void* /*of*/, const RawHit& hit, unsigned /*lane*/) {
  return std::fmod(static_cast<float>(hit.primitive + 1) * 0.618034F, 0.95F);
}

/// Forty grids of 4 x 4 cells, tilted through each other, so that the order in which Embree visits
/// their boxes depends on all rays of a packet. Each covers the unit square, seen from above.
struct Tilted {
  static constexpr std::uint32_t kLayers = 40;
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;

  Tilted() {
    const Grid flat(4);
    for (std::uint32_t layer = 0; layer < kLayers; ++layer) {
      const auto first = static_cast<std::uint32_t>(positions.size());
      const float turn = static_cast<float>(layer) * 0.37F;
      for (const Vec3 p : flat.geometry().positions) {
        positions.push_back({p.x, p.y, std::sin(turn) * (p.x - 0.5F) + std::cos(turn) * p.y});
      }
      for (const std::uint32_t i : flat.indices) {
        indices.push_back(first + i);
      }
    }
    positions.push_back({});
  }
  AccelGeometry geometry() const {
    return {std::span(positions).first(positions.size() - 1), indices, {}, true};
  }
  /// Returns the share of light that a ray straight down at x, y keeps.
  static double open(float x, float y) {
    const float across = x * 4 - std::floor(x * 4);
    const float up = y * 4 - std::floor(y * 4);
    const auto cell = static_cast<std::uint32_t>(x * 4) + 4 * static_cast<std::uint32_t>(y * 4);
    double out = 1;
    for (std::uint32_t layer = 0; layer < kLayers; ++layer) {
      const std::uint32_t triangle = 32 * layer + 2 * cell + (across + up < 1 ? 0 : 1);
      out *= 1 - static_cast<double>(some_coverage(nullptr, {.primitive = triangle}, 0));
    }
    return out;
  }
};

TEST(PassHoles, LightDoesNotDependOnTheOtherRays) {
  const Tilted tilted;
  const AccelGeometry mesh = tilted.geometry();
  const auto accel = std::move(Accel::build({&mesh, 1}, {}, {}, 1)).value();
  std::mt19937 random(1);
  std::uniform_int_distribution<int> place(0, 99);
  for (int i = 0; i < 2000; ++i) {
    float x[8];
    float y[8];
    for (std::size_t k = 0; k < 8; ++k) {  // on no edge
      x[k] = (static_cast<float>(place(random)) + 0.3F) / 100;
      y[k] = (static_cast<float>(place(random)) + 0.4F) / 100;
    }
    const RayPacket packet = all_down(x, y);
    Passage together[8];
    accel->pass_holes8(packet, 255, &some_coverage, nullptr, together);
    for (std::size_t k = 0; k < 8; ++k) {
      ASSERT_EQ(together[k].holes, Tilted::kLayers);
      const double expected = Tilted::open(x[k], y[k]);
      ASSERT_NEAR(static_cast<double>(together[k].open), expected, 5e-6 * expected);
      Passage alone[8];
      accel->pass_holes8(packet, 1U << k, &some_coverage, nullptr, alone);
      ASSERT_EQ(alone[k].open, together[k].open);
    }
  }
}

}  // namespace
}  // namespace core
