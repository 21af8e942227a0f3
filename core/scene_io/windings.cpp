#include "core/scene_io/windings.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>
#include <utility>

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

/// Edge i % 3 of triangle i / 3, its ends in increasing order. is_up: the triangle passes it so.
struct Edge {
  Corner low, high;
  std::uint32_t i = 0;
  bool is_up = true;

  Edge(const PrimitiveDescription& p, std::uint32_t number) : i(number) {
    const Vec3 a = p.positions[p.indices[i]];
    const Vec3 b = p.positions[p.indices[i % 3 == 2 ? i - 2 : i + 1]];
    low = {a.x, a.y, a.z};
    high = {b.x, b.y, b.z};
    if (high < low) {
      std::swap(low, high);
      is_up = false;
    }
  }
  bool is_same(const Edge& other) const { return low == other.low && high == other.high; }
};

/// The triangle beyond each edge that no third one has.
struct Neighbours {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::vector<std::uint32_t> triangle;  ///< kNone: there is none
  std::vector<bool> is_turned;          ///< both pass the edge the same way

  explicit Neighbours(const PrimitiveDescription& p)
      : triangle(p.indices.size(), kNone), is_turned(p.indices.size()) {
    std::vector<Edge> edges;
    edges.reserve(p.indices.size());
    for (std::uint32_t i = 0; i < p.indices.size(); ++i) {
      edges.emplace_back(p, i);
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
      return std::tie(a.low, a.high, a.i) < std::tie(b.low, b.high, b.i);
    });
    for (std::size_t first = 0, end = 0; first < edges.size(); first = end) {
      while (end < edges.size() && edges[end].is_same(edges[first])) {
        ++end;
      }
      const Edge& a = edges[first];
      const Edge& b = edges[end - 1];
      if (end - first == 2 && a.low != a.high && a.i / 3 != b.i / 3) {
        triangle[a.i] = b.i / 3;
        triangle[b.i] = a.i / 3;
        is_turned[a.i] = is_turned[b.i] = a.is_up == b.is_up;
      }
    }
  }
};

double area(const PrimitiveDescription& p, std::uint32_t triangle) {
  const auto at = [&](std::size_t k) {
    return p.positions[p.indices[3 * std::size_t{triangle} + k]];
  };
  return 0.5 * static_cast<double>(length(cross(at(1) - at(0), at(2) - at(0))));
}

}  // namespace

std::size_t align_windings(PrimitiveDescription& primitive) {
  const Neighbours neighbours(primitive);
  enum Side : std::uint8_t { kUnknown, kFirst, kOther };
  std::vector<Side> side(primitive.indices.size() / 3, kUnknown);
  std::size_t turned = 0;
  for (std::uint32_t start = 0; start < side.size(); ++start) {
    if (side[start] != kUnknown) {
      continue;
    }
    std::vector<std::uint32_t> surface = {start};  // triangles that are connected
    std::array<double, 2> areas = {};              // of both sides
    bool has_sides = true;                         // a Moebius strip has not
    side[start] = kFirst;
    for (std::size_t i = 0; i < surface.size(); ++i) {
      const std::uint32_t here = surface[i];
      areas[side[here] == kFirst ? 0 : 1] += area(primitive, here);
      for (std::size_t edge = 3 * std::size_t{here}; edge < 3 * std::size_t{here} + 3; ++edge) {
        const std::uint32_t next = neighbours.triangle[edge];
        if (next == Neighbours::kNone) {
          continue;
        }
        const bool is_other = (side[here] == kOther) != neighbours.is_turned[edge];
        if (side[next] == kUnknown) {
          side[next] = is_other ? kOther : kFirst;
          surface.push_back(next);
        }
        has_sides = has_sides && (side[next] == kOther) == is_other;
      }
    }
    const Side smaller = areas[0] < areas[1] ? kFirst : kOther;
    for (const std::uint32_t triangle : surface) {
      if (has_sides && side[triangle] == smaller) {
        std::swap(primitive.indices[3 * std::size_t{triangle} + 1],
                  primitive.indices[3 * std::size_t{triangle} + 2]);
        ++turned;
      }
    }
  }
  return turned;
}

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
