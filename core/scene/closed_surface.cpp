#include "core/scene/closed_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <tuple>
#include <utility>

namespace core {
namespace {

/// Distance of vertices that are one, relative to the largest coordinate: 16 roundings.
constexpr float kSame = 0x1p-20F;

/// How often the triangles of a mesh pass along an edge from `a` to `b`, minus the other way.
struct Edge {
  std::uint32_t a;
  std::uint32_t b;
  std::uint32_t mesh;
  std::int32_t count;

  friend bool operator<(const Edge& x, const Edge& y) {
    return std::tie(x.a, x.b, x.mesh) < std::tie(y.a, y.b, y.mesh);
  }
  bool is_same(const Edge& other) const { return a == other.a && b == other.b; }
};

Edge edge(std::uint32_t from, std::uint32_t to, std::uint32_t mesh, std::int32_t count) {
  return from < to ? Edge{from, to, mesh, count} : Edge{to, from, mesh, -count};
}

/// Adds up the edges of each mesh and leaves those out that have both sides.
void keep_borders(std::vector<Edge>& edges) {
  std::sort(edges.begin(), edges.end());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < edges.size();) {
    Edge sum = edges[i];
    for (++i; i < edges.size() && edges[i].is_same(sum) && edges[i].mesh == sum.mesh; ++i) {
      sum.count += edges[i].count;
    }
    if (sum.count != 0 && sum.a != sum.b) {
      edges[kept++] = sum;
    }
  }
  edges.resize(kept);
}

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) {
      i = parent_[i] = parent_[parent_[i]];
    }
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

struct Vertices {
  std::vector<Vec3> at;
  std::vector<std::uint32_t> first;  ///< of each mesh
};

/// Numbers of vertices, equal where positions are.
std::vector<std::uint32_t> exact_numbers(const Vertices& vertices) {
  std::vector<std::uint32_t> order(vertices.at.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t i) {
    return std::tie(vertices.at[i].x, vertices.at[i].y, vertices.at[i].z);
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t i, std::uint32_t j) { return key(i) < key(j); });
  std::vector<std::uint32_t> number(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool is_new = i == 0 || key(order[i]) != key(order[i - 1]);
    number[order[i]] = is_new ? order[i] : number[order[i - 1]];
  }
  return number;
}

/// Joins the ends of borders that are the same up to rounding.
void join_near(const Vertices& vertices, std::vector<Edge>& borders) {
  std::vector<std::uint32_t> ends;
  for (const Edge& e : borders) {
    ends.push_back(e.a);
    ends.push_back(e.b);
  }
  float largest = 0;
  for (const std::uint32_t i : ends) {
    const Vec3 p = vertices.at[i];
    largest = std::max({largest, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
  }
  // Vertices are sorted along a direction across which no faces of models lie, so that few are near
  // in it only. Its components are below 1.
  const auto along = [&](std::uint32_t i) {
    const Vec3 p = vertices.at[i];
    return 0.9 * static_cast<double>(p.x) + 0.57 * static_cast<double>(p.y) +
           0.31 * static_cast<double>(p.z);
  };
  std::sort(ends.begin(), ends.end(), [&](std::uint32_t i, std::uint32_t j) {
    return std::pair(along(i), i) < std::pair(along(j), j);
  });
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  const float apart = kSame * largest;
  const double apart_along = 3 * static_cast<double>(apart);
  DisjointSets same(vertices.at.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    for (std::size_t j = i + 1; j < ends.size() && along(ends[j]) - along(ends[i]) <= apart_along;
         ++j) {
      const Vec3 d = vertices.at[ends[j]] - vertices.at[ends[i]];
      if (std::max({std::fabs(d.x), std::fabs(d.y), std::fabs(d.z)}) <= apart) {
        same.join(ends[i], ends[j]);
      }
    }
  }
  for (Edge& e : borders) {
    e = edge(same.find(e.a), same.find(e.b), e.mesh, e.count);
  }
  keep_borders(borders);
}

double volume(const MeshData& mesh, Vec3 center) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const auto corner = [&](std::size_t k) {
      return mesh.positions[mesh.indices[3 * t + k]] - center;
    };
    sum += static_cast<double>(dot(corner(0), cross(corner(1), corner(2)))) / 6;
  }
  return sum;
}

/// Returns the borders of each mesh, sorted.
std::vector<Edge> borders_of(std::span<const MeshData* const> meshes) {
  Vertices vertices;
  for (const MeshData* mesh : meshes) {
    vertices.first.push_back(static_cast<std::uint32_t>(vertices.at.size()));
    vertices.at.insert(vertices.at.end(), mesh->positions.begin(), mesh->positions.end());
  }
  const std::vector<std::uint32_t> number = exact_numbers(vertices);
  std::vector<Edge> borders;
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    std::vector<Edge> edges;
    const auto& indices = meshes[m]->indices;
    for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
      const auto corner = [&](std::size_t k) { return number[vertices.first[m] + indices[t + k]]; };
      for (std::size_t k = 0; k < 3; ++k) {
        edges.push_back(edge(corner(k), corner((k + 1) % 3), m, 1));
      }
    }
    keep_borders(edges);
    borders.insert(borders.end(), edges.begin(), edges.end());
  }
  join_near(vertices, borders);
  return borders;
}

/// A mesh beyond an edge of another one.
struct Neighbour {
  std::uint32_t mesh;
  bool is_turned;  ///< both pass the edge the same way
};

}  // namespace

double area(const MeshData& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const auto corner = [&](std::size_t k) { return mesh.positions[mesh.indices[3 * t + k]]; };
    sum += static_cast<double>(length(cross(corner(1) - corner(0), corner(2) - corner(0))));
  }
  return sum;
}

std::vector<JoinedSurface> join_surfaces(std::span<const MeshData* const> meshes) {
  const std::vector<Edge> borders = borders_of(meshes);
  DisjointSets joined(meshes.size());
  std::vector<std::size_t> border_edges(meshes.size());
  std::vector<std::size_t> one_way_edges(meshes.size());
  for (std::size_t i = 0; i < borders.size();) {
    std::int32_t count = 0;
    const Edge first = borders[i];
    for (; i < borders.size() && borders[i].is_same(first); ++i) {
      joined.join(first.mesh, borders[i].mesh);
      count += borders[i].count;
    }
    border_edges[first.mesh] += count != 0 ? 1 : 0;
    one_way_edges[first.mesh] += std::abs(count) == 2 ? 1 : 0;
  }
  std::vector<JoinedSurface> out;
  std::vector<std::size_t> place(meshes.size());
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    const std::uint32_t root = joined.find(m);  // the least of its set
    if (root == m) {
      place[m] = out.size();
      out.emplace_back();
    }
    JoinedSurface& surface = out[place[root]];
    surface.meshes.push_back(m);
    surface.border_edges += border_edges[m];
    surface.one_way_edges += one_way_edges[m];
    surface.volume_m3 += volume(*meshes[m], meshes[root]->positions.front());
  }
  return out;
}

std::vector<ClosingMeshes> find_closing_meshes(std::span<const MeshData* const> meshes) {
  const std::vector<Edge> borders = borders_of(meshes);
  std::vector<std::vector<Neighbour>> beyond(meshes.size());
  std::vector<bool> is_open(meshes.size());
  for (std::size_t first = 0, end = 0; first < borders.size(); first = end) {
    const Edge& a = borders[first];
    while (end < borders.size() && borders[end].is_same(a)) {
      ++end;
    }
    const Edge& b = borders[end - 1];
    if (end - first == 2 && std::abs(a.count) == 1 && std::abs(b.count) == 1) {
      beyond[a.mesh].push_back({b.mesh, a.count == b.count});
      beyond[b.mesh].push_back({a.mesh, a.count == b.count});
    } else {
      std::for_each(borders.begin() + static_cast<std::ptrdiff_t>(first),
                    borders.begin() + static_cast<std::ptrdiff_t>(end),
                    [&](const Edge& each) { is_open[each.mesh] = true; });
    }
  }
  std::vector<ClosingMeshes> out;
  std::vector<bool> is_known(meshes.size());
  std::vector<bool> is_turned(meshes.size());
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    if (is_known[m] || beyond[m].empty()) {
      continue;
    }
    is_known[m] = true;
    bool closes = true;
    ClosingMeshes found = {{m}, {}};
    for (std::size_t i = 0; i < found.meshes.size(); ++i) {
      const std::size_t here = found.meshes[i];
      closes = closes && !is_open[here];
      for (const Neighbour& next : beyond[here]) {
        const bool turned = is_turned[here] != next.is_turned;
        if (!is_known[next.mesh]) {
          is_known[next.mesh] = true;
          is_turned[next.mesh] = turned;
          found.meshes.push_back(next.mesh);
        }
        closes = closes && is_turned[next.mesh] == turned;
      }
    }
    if (closes) {
      std::sort(found.meshes.begin(), found.meshes.end());
      for (const std::size_t each : found.meshes) {
        found.is_turned.push_back(is_turned[each]);
      }
      out.push_back(std::move(found));
    }
  }
  return out;
}

}  // namespace core
