#include "core/scene_io/windings.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/math/bounds.h"

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

/// Triangles of several primitives.
struct Joined {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  std::vector<std::uint32_t> parts;  ///< of each triangle: the number of its primitive

  explicit Joined(std::span<PrimitiveDescription* const> primitives) {
    for (std::uint32_t part = 0; part < primitives.size(); ++part) {
      const PrimitiveDescription& p = *primitives[part];
      const auto first = static_cast<std::uint32_t>(positions.size());
      positions.insert(positions.end(), p.positions.begin(), p.positions.end());
      for (const std::uint32_t i : p.indices) {
        indices.push_back(first + i);
      }
      parts.resize(indices.size() / 3, part);
    }
  }
};

/// Edge i % 3 of triangle i / 3, its ends in increasing order. is_up: the triangle passes it so.
struct Edge {
  Corner low, high;
  std::uint32_t part = 0;
  std::uint32_t i = 0;
  bool is_up = true;

  Edge(const Joined& p, std::uint32_t number) : part(p.parts[number / 3]), i(number) {
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

/// The triangle beyond each edge: in its primitive, if that has two there, or in another one, if
/// each of two has one.
struct Neighbours {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::vector<std::uint32_t> triangle;  ///< kNone: there is none
  std::vector<bool> is_turned;          ///< both pass the edge the same way

  explicit Neighbours(const Joined& p)
      : triangle(p.indices.size(), kNone), is_turned(p.indices.size()) {
    std::vector<Edge> edges;
    edges.reserve(p.indices.size());
    for (std::uint32_t i = 0; i < p.indices.size(); ++i) {
      edges.emplace_back(p, i);
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
      return std::tie(a.low, a.high, a.part, a.i) < std::tie(b.low, b.high, b.part, b.i);
    });
    std::vector<const Edge*> borders;  // of the primitives that share an edge
    for (std::size_t first = 0, end = 0; first < edges.size(); first = end) {
      while (end < edges.size() && edges[end].is_same(edges[first]) &&
             edges[end].part == edges[first].part) {
        ++end;
      }
      if (end - first == 2) {
        pair(edges[first], edges[first + 1]);
      } else if (end - first == 1) {
        borders.push_back(&edges[first]);
      }
      if (end == edges.size() || !edges[end].is_same(edges[first])) {
        if (borders.size() == 2) {
          pair(*borders[0], *borders[1]);
        }
        borders.clear();
      }
    }
  }

 private:
  void pair(const Edge& a, const Edge& b) {
    if (a.low != a.high && a.i / 3 != b.i / 3) {
      triangle[a.i] = b.i / 3;
      triangle[b.i] = a.i / 3;
      is_turned[a.i] = is_turned[b.i] = a.is_up == b.is_up;
    }
  }
};

/// Connected triangles.
struct Surface {
  std::vector<std::uint32_t> triangles;
  std::array<double, 2> areas = {};  ///< of both sides
  bool has_sides = true;             ///< a Moebius strip has not
  bool is_closed = true;
  double volume = 0;  ///< negative: it faces inwards
  Bounds box;
};

/// Says whether one of many boxes contains a box, without a look at each pair.
class Boxes {
 public:
  explicit Boxes(std::vector<Bounds> boxes)
      : boxes_(std::move(boxes)), order_(boxes_.size()), unions_(boxes_.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    build(0, order_.size(), 0);
  }
  /// Whether another box contains that one.
  bool surround(std::size_t which) const { return surround(which, 0, order_.size()); }

 private:
  /// Boxes [first, end) in order_: the middle one, those before and those behind it along an axis.
  void build(std::size_t first, std::size_t end, std::size_t axis) {
    if (first == end) {
      return;
    }
    const std::size_t middle = first + (end - first) / 2;
    const auto place = [&](std::size_t i) {
      const Vec3 at = boxes_[i].center();
      return axis == 0 ? at.x : axis == 1 ? at.y : at.z;
    };
    const auto begin = order_.begin();
    std::nth_element(begin + static_cast<std::ptrdiff_t>(first),
                     begin + static_cast<std::ptrdiff_t>(middle),
                     begin + static_cast<std::ptrdiff_t>(end),
                     [&](std::size_t i, std::size_t j) { return place(i) < place(j); });
    build(first, middle, (axis + 1) % 3);
    build(middle + 1, end, (axis + 1) % 3);
    unions_[middle] = boxes_[order_[middle]];
    for (const auto& [from, to] : {std::pair{first, middle}, std::pair{middle + 1, end}}) {
      if (from < to) {
        unions_[middle].add(unions_[from + (to - from) / 2]);
      }
    }
  }

  bool surround(std::size_t which, std::size_t first, std::size_t end) const {
    const std::size_t middle = first + (end - first) / 2;
    return first < end && contains(unions_[middle], boxes_[which]) &&
           ((order_[middle] != which && contains(boxes_[order_[middle]], boxes_[which])) ||
            surround(which, first, middle) || surround(which, middle + 1, end));
  }

  static bool contains(const Bounds& a, const Bounds& b) {
    return a.min.x <= b.min.x && a.min.y <= b.min.y && a.min.z <= b.min.z && b.max.x <= a.max.x &&
           b.max.y <= a.max.y && b.max.z <= a.max.z;
  }

  std::vector<Bounds> boxes_;
  std::vector<std::size_t> order_;
  std::vector<Bounds> unions_;  ///< of the boxes whose middle one is there
};

class Windings {
 public:
  explicit Windings(std::span<PrimitiveDescription* const> primitives)
      : primitives_(primitives),
        joined_(primitives),
        neighbours_(joined_),
        side_(joined_.parts.size(), kUnknown) {}

  std::vector<std::size_t> run() {
    for (std::uint32_t start = 0; start < side_.size(); ++start) {
      if (side_[start] == kUnknown) {
        surfaces_.push_back(connected_to(start));
        align(surfaces_.back());
      }
    }
    turn_outwards();
    std::vector<std::size_t> out;
    std::size_t triangle = 0;
    for (PrimitiveDescription* const p : primitives_) {
      out.push_back(0);
      for (std::size_t i = 0; i + 2 < p->indices.size(); i += 3, ++triangle) {
        if (turned_[triangle]) {
          std::swap(p->indices[i + 1], p->indices[i + 2]);
          ++out.back();
        }
      }
    }
    return out;
  }

 private:
  enum Side : std::uint8_t { kUnknown, kFirst, kOther };

  Vec3 corner(std::uint32_t triangle, std::size_t k) const {
    return joined_.positions[joined_.indices[3 * std::size_t{triangle} + k]];
  }

  Surface connected_to(std::uint32_t start) {
    Surface out;
    out.triangles = {start};
    side_[start] = kFirst;
    for (std::size_t i = 0; i < out.triangles.size(); ++i) {
      const std::uint32_t here = out.triangles[i];
      out.areas[side_[here] == kFirst ? 0 : 1] += static_cast<double>(
          length(cross(corner(here, 1) - corner(here, 0), corner(here, 2) - corner(here, 0))));
      for (std::size_t edge = 3 * std::size_t{here}; edge < 3 * std::size_t{here} + 3; ++edge) {
        const std::uint32_t next = neighbours_.triangle[edge];
        if (next == Neighbours::kNone) {
          out.is_closed = false;
          continue;
        }
        const bool is_other = (side_[here] == kOther) != neighbours_.is_turned[edge];
        if (side_[next] == kUnknown) {
          side_[next] = is_other ? kOther : kFirst;
          out.triangles.push_back(next);
        }
        out.has_sides = out.has_sides && (side_[next] == kOther) == is_other;
      }
    }
    return out;
  }

  void turn(std::uint32_t triangle) {
    std::uint32_t* const v = &joined_.indices[3 * std::size_t{triangle}];
    std::swap(v[1], v[2]);
    turned_[triangle] = !turned_[triangle];
  }

  /// Turns the smaller side to the larger one.
  void align(Surface& surface) {
    const Side smaller = surface.areas[0] < surface.areas[1] ? kFirst : kOther;
    const Vec3 center = corner(surface.triangles.front(), 0);
    for (const std::uint32_t triangle : surface.triangles) {
      if (surface.has_sides && side_[triangle] == smaller) {
        turn(triangle);
      }
      std::array<Vec3, 3> p;
      for (std::size_t k = 0; k < 3; ++k) {
        surface.box.add(corner(triangle, k));
        p[k] = corner(triangle, k) - center;
      }
      surface.volume += static_cast<double>(dot(p[0], cross(p[1], p[2])));
    }
  }

  /// Turns surfaces that face inwards beside one that faces outwards, unless they are in another
  /// one: cavities. What faces inwards as a whole is left to find_solids(), which knows all meshes.
  void turn_outwards() {
    const auto closed = [](const Surface& s) { return s.is_closed && s.has_sides; };
    const auto faces = [&](bool is_outwards) {
      return std::any_of(surfaces_.begin(), surfaces_.end(), [&](const Surface& s) {
        return closed(s) && (is_outwards ? s.volume > 0 : s.volume < 0);
      });
    };
    if (!faces(true) || !faces(false)) {
      return;
    }
    std::vector<Bounds> all;
    std::transform(surfaces_.begin(), surfaces_.end(), std::back_inserter(all),
                   [](const Surface& s) { return s.box; });
    const Boxes boxes(std::move(all));
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
      const Surface& surface = surfaces_[i];
      if (closed(surface) && surface.volume < 0 && !boxes.surround(i)) {
        std::for_each(surface.triangles.begin(), surface.triangles.end(),
                      [this](std::uint32_t triangle) { turn(triangle); });
      }
    }
  }

  std::span<PrimitiveDescription* const> primitives_;
  Joined joined_;
  const Neighbours neighbours_;
  std::vector<Side> side_;
  std::vector<bool> turned_ = std::vector<bool>(side_.size());
  std::vector<Surface> surfaces_;
};

}  // namespace

std::vector<std::size_t> align_windings(std::span<PrimitiveDescription* const> primitives) {
  return Windings(primitives).run();
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
