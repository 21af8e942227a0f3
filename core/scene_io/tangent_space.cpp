#include "core/scene_io/tangent_space.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace core {
namespace {

using Index = std::uint32_t;
constexpr Index kNone = 0xFFFFFFFFU;

struct Face {
  Vec3 tangent;             // unit direction of increasing u, the same for mirrored faces
  bool preserves = false;   // handedness: positive signed texture area
  bool any_group = false;   // no texture area: joins a neighbour's group
  bool degenerate = false;  // no area at all: ignored
  std::array<Index, 3> neighbor = {kNone, kNone, kNone};  // across the edge from corner i to i + 1
  std::array<Index, 3> group = {kNone, kNone, kNone};     // of each corner
};

Vec3 in_plane(Vec3 v, Vec3 n) { return v - n * dot(n, v); }

// Returns the attributes of `from` at `corners`, one vertex per corner.
template <typename V>
void pick(std::vector<V>& values, const std::vector<Index>& from) {
  if (values.empty()) {
    return;
  }
  std::vector<V> picked(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) {
    picked[i] = values[from[i]];
  }
  values = std::move(picked);
}

void rearrange(PrimitiveDescription& p, const std::vector<Index>& from) {
  pick(p.positions, from);
  pick(p.normals, from);
  pick(p.uv[0], from);
  pick(p.uv[1], from);
  pick(p.colors, from);
  if (p.file_vertices.empty()) {
    p.file_vertices = from;
  } else {
    pick(p.file_vertices, from);
  }
}

void make_flat_normals(PrimitiveDescription& p) {
  rearrange(p, std::vector<Index>(p.indices));
  p.normals.resize(p.positions.size());
  for (Index i = 0; i < p.indices.size(); ++i) {
    p.indices[i] = i;
  }
  for (std::size_t i = 0; i + 2 < p.positions.size(); i += 3) {
    const Vec3 n = normalize_or(
        cross(p.positions[i + 1] - p.positions[i], p.positions[i + 2] - p.positions[i]), {0, 0, 1});
    p.normals[i] = p.normals[i + 1] = p.normals[i + 2] = n;
  }
}

class TangentMaker {
 public:
  TangentMaker(PrimitiveDescription& p, const std::vector<Vec2>& uv)
      : p_(p), uv_(uv), faces_(p.indices.size() / 3) {}

  void run() {
    weld();
    measure_faces();
    find_neighbors();
    make_groups();
    average_groups();
    write();
  }

 private:
  Index corner(std::size_t face, std::size_t i) const { return welded_[p_.indices[face * 3 + i]]; }

  // Merges vertices with equal position, normal and texture coordinates.
  void weld() {
    std::vector<Index> order(p_.positions.size());
    for (Index i = 0; i < order.size(); ++i) {
      order[i] = i;
    }
    const auto key = [this](Index i) {
      const Vec3 a = p_.positions[i];
      const Vec3 n = p_.normals[i];
      return std::make_tuple(a.x, a.y, a.z, n.x, n.y, n.z, uv_[i].x, uv_[i].y);
    };
    std::sort(order.begin(), order.end(), [&key](Index a, Index b) {
      const auto ka = key(a);
      const auto kb = key(b);
      return ka != kb ? ka < kb : a < b;
    });
    welded_.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      welded_[order[i]] =
          i > 0 && key(order[i]) == key(order[i - 1]) ? welded_[order[i - 1]] : order[i];
    }
  }

  void measure_faces() {
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      const Index a = corner(f, 0);
      const Index b = corner(f, 1);
      const Index c = corner(f, 2);
      Face& face = faces_[f];
      const Vec3 d1 = p_.positions[b] - p_.positions[a];
      const Vec3 d2 = p_.positions[c] - p_.positions[a];
      const Vec2 t1 = uv_[b] - uv_[a];
      const Vec2 t2 = uv_[c] - uv_[a];
      face.degenerate = p_.positions[a] == p_.positions[b] || p_.positions[b] == p_.positions[c] ||
                        p_.positions[c] == p_.positions[a];
      const float area = t1.x * t2.y - t1.y * t2.x;
      face.preserves = area > 0;
      const Vec3 u_direction = (d1 * t2.y - d2 * t1.y) * (face.preserves ? 1.0F : -1.0F);
      face.any_group = !(std::abs(area) > 0) || !(length_squared(u_direction) > 0);
      face.tangent = normalize_or(u_direction, {0, 0, 0});
    }
  }

  // Pairs faces that traverse an edge in opposite directions; if more than two share it, the first
  // of each direction are paired first.
  void find_neighbors() {
    struct Edge {
      Index low, high, face, side;
      bool rises;
    };
    std::vector<Edge> edges;
    edges.reserve(faces_.size() * 3);
    for (Index f = 0; f < faces_.size(); ++f) {
      for (Index i = 0; i < 3 && !faces_[f].degenerate; ++i) {
        const Index from = corner(f, i);
        const Index to = corner(f, (i + 1) % 3);
        edges.push_back(Edge{std::min(from, to), std::max(from, to), f, i, from < to});
      }
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
      return std::tie(a.low, a.high, a.rises, a.face, a.side) <
             std::tie(b.low, b.high, b.rises, b.face, b.side);
    });
    for (std::size_t first = 0; first < edges.size();) {
      std::size_t last = first;
      std::size_t rising = first;  // start of the rising ones
      while (last < edges.size() && edges[last].low == edges[first].low &&
             edges[last].high == edges[first].high) {
        rising += edges[last].rises ? 0U : 1U;
        ++last;
      }
      for (std::size_t down = first, up = rising; down < rising && up < last; ++down, ++up) {
        faces_[edges[down].face].neighbor[edges[down].side] = edges[up].face;
        faces_[edges[up].face].neighbor[edges[up].side] = edges[down].face;
      }
      first = last;
    }
  }

  // Groups all faces around a vertex that are connected by shared edges without changing
  // handedness.
  void make_groups() {
    for (Index f = 0; f < faces_.size(); ++f) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (!faces_[f].degenerate && !faces_[f].any_group && faces_[f].group[i] == kNone) {
          grow_group(f, corner(f, i));
        }
      }
    }
  }

  void grow_group(Index first, Index vertex) {
    const auto group = static_cast<Index>(groups_.size());
    groups_.push_back({vertex, faces_[first].preserves, {}, {}});
    std::vector<Index> open = {first};
    while (!open.empty()) {
      const Index f = open.back();
      open.pop_back();
      Face& face = faces_[f];
      const std::size_t i = side_of(f, vertex);
      if (i == 3 || face.group[i] != kNone) {
        continue;
      }
      if (face.any_group && face.group == std::array{kNone, kNone, kNone}) {
        face.preserves = groups_[group].preserves;
      }
      if (face.preserves != groups_[group].preserves) {
        continue;
      }
      face.group[i] = group;
      groups_[group].faces.push_back(f);
      for (const Index next : {face.neighbor[i], face.neighbor[(i + 2) % 3]}) {
        if (next != kNone) {
          open.push_back(next);
        }
      }
    }
  }

  std::size_t side_of(Index face, Index vertex) const {
    std::size_t i = 0;
    while (i < 3 && corner(face, i) != vertex) {
      ++i;
    }
    return i;
  }

  void average_groups() {
    for (Group& group : groups_) {
      const Vec3 n = p_.normals[group.vertex];
      const Vec3 here = p_.positions[group.vertex];
      for (const Index f : group.faces) {
        if (faces_[f].any_group) {
          continue;
        }
        const std::size_t i = side_of(f, group.vertex);
        const Vec3 next =
            normalize_or(in_plane(p_.positions[corner(f, (i + 1) % 3)] - here, n), {0, 0, 0});
        const Vec3 previous =
            normalize_or(in_plane(p_.positions[corner(f, (i + 2) % 3)] - here, n), {0, 0, 0});
        const float angle = std::acos(std::clamp(dot(next, previous), -1.0F, 1.0F));
        group.tangent += normalize_or(in_plane(faces_[f].tangent, n), {0, 0, 0}) * angle;
      }
      group.tangent = normalize_or(group.tangent, {0, 0, 0});
    }
  }

  // Writes one vertex for each pair of original vertex and tangent.
  void write() {
    std::vector<Index> group_at(welded_.size(), kNone);  // for faces without a group
    for (Index f = 0; f < faces_.size(); ++f) {
      for (std::size_t i = 0; i < 3; ++i) {
        Index& group = group_at[corner(f, i)];
        group = group == kNone ? faces_[f].group[i] : group;
      }
    }
    std::unordered_map<std::uint64_t, Index> known;
    known.reserve(welded_.size());
    std::vector<Index> from;
    std::vector<Vec4> tangents;
    for (std::size_t c = 0; c < p_.indices.size(); ++c) {
      const Index vertex = p_.indices[c];
      const Index own = faces_[c / 3].group[c % 3];
      const Index group = own == kNone ? group_at[welded_[vertex]] : own;
      const std::uint64_t key = std::uint64_t{vertex} << 32U | group;
      const auto [it, is_new] = known.try_emplace(key, static_cast<Index>(from.size()));
      if (is_new) {
        from.push_back(vertex);
        tangents.push_back(tangent_of(group, p_.normals[vertex]));
      }
      p_.indices[c] = it->second;
    }
    rearrange(p_, from);
    p_.tangents = std::move(tangents);
  }

  Vec4 tangent_of(Index group, Vec3 n) const {
    const Vec3 axis = std::abs(n.x) < 0.9F ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 any = normalize_or(in_plane(axis, n), {1, 0, 0});
    if (group == kNone) {
      return {any.x, any.y, any.z, 1};
    }
    const Vec3 t = groups_[group].tangent;
    const Vec3 usable = length_squared(t) > 0 ? t : any;
    return {usable.x, usable.y, usable.z, groups_[group].preserves ? -1.0F : 1.0F};
  }

  struct Group {
    Index vertex = 0;
    bool preserves = false;
    std::vector<Index> faces;
    Vec3 tangent;
  };

  PrimitiveDescription& p_;
  const std::vector<Vec2>& uv_;
  std::vector<Face> faces_;
  std::vector<Index> welded_;
  std::vector<Group> groups_;
};

}  // namespace

void make_tangents(PrimitiveDescription& primitive, int uv_set,
                   const std::array<float, 6>& uv_transform) {
  if (primitive.uv[static_cast<std::size_t>(uv_set)].empty()) {
    return;
  }
  if (primitive.normals.empty()) {
    make_flat_normals(primitive);
  }
  std::vector<Vec2> uv = primitive.uv[static_cast<std::size_t>(uv_set)];
  const auto& m = uv_transform;
  for (Vec2& at : uv) {  // without the offset, which changes no tangent
    at = {m[0] * at.x + m[1] * at.y, m[3] * at.x + m[4] * at.y};
  }
  TangentMaker(primitive, uv).run();
}

}  // namespace core
