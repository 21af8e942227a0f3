#include "core/scene_io/both_windings.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace core {
namespace {

using Corner = std::array<float, 3>;

/// Corners in increasing order, and whether that is a turn of the triangle's own.
struct Triangle {
  std::array<Corner, 3> corners;
  std::uint32_t index = 0;
  bool is_front = true;

  Triangle(const PrimitiveDescription& p, std::uint32_t number) : index(number) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 at = p.positions[p.indices[3 * std::size_t{number} + k]];
      corners[k] = {at.x, at.y, at.z};
    }
    for (const std::size_t k : {0U, 1U, 0U}) {
      if (corners[k + 1] < corners[k]) {
        std::swap(corners[k], corners[k + 1]);
        is_front = !is_front;
      }
    }
  }
  bool has_area() const { return corners[0] < corners[1] && corners[1] < corners[2]; }
};

}  // namespace

std::vector<bool> find_backs(const PrimitiveDescription& primitive) {
  std::vector<Triangle> all;
  const auto count = static_cast<std::uint32_t>(primitive.indices.size() / 3);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (const Triangle triangle(primitive, i); triangle.has_area()) {
      all.push_back(triangle);
    }
  }
  std::sort(all.begin(), all.end(), [](const Triangle& a, const Triangle& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.index < b.index;
  });
  std::vector<bool> out(count);
  for (std::size_t i = 0, first = 0; i < all.size(); ++i) {
    first = all[i].corners == all[first].corners ? first : i;
    out[all[i].index] = all[i].is_front != all[first].is_front;
  }
  return out;
}

std::vector<std::uint32_t> take_triangles(PrimitiveDescription& primitive,
                                          const std::vector<bool>& which) {
  std::vector<std::uint32_t> taken;
  std::vector<std::uint32_t> left;
  for (std::size_t i = 0; i < which.size(); ++i) {
    std::vector<std::uint32_t>& to = which[i] ? taken : left;
    to.insert(to.end(), &primitive.indices[3 * i], &primitive.indices[3 * i] + 3);
  }
  primitive.indices = std::move(left);
  return taken;
}

}  // namespace core
