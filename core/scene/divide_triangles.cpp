#include "core/scene/divide_triangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "core/math/offset_ray.h"
#include "core/scene/placed_meshes.h"

namespace core {
namespace {

/// Steps of rays off a triangle along the radius of a mesh on it. Light on a cube of 2 cm of which
/// a step is .11, .05 or .016 differs by 2 to 50% in blocks of 8x8 pixels from that on small
/// triangles; with .001, by .3%.
constexpr float kSteps = 1024;
/// The time and memory for scenes with many small things on large ones is bounded: the smallest
/// meshes, triangles of a mesh that are large enough, and all of them. Each small mesh adds some 60
/// triangles; where coordinates are so large that halves are no smaller, they would double.
constexpr std::size_t kSmallMost = 1024;
constexpr std::size_t kLargeMost = 4096;
constexpr std::size_t kDividedMost = kLargeMost + 100 * kSmallMost;
/// Rounds in which triangles are bisected for each halving of their edges. Two halve all three
/// edges of a triangle; two more are for those that its neighbours bisect. More are of no use:
/// coordinates are then so large that halves are no smaller.
constexpr int kRoundsPerHalving = 4;
/// The surroundings of a mesh, and the longest edges of triangles there: edges_m().
struct Small {
  Bounds box;
  float edges_m = 0;
};

/// Returns the edges that a step off a triangle is a multiple of: plane_error_m().
float edges_m(const Corners<Vec3>& p) { return taxicab(p[1] - p[0]) + taxicab(p[2] - p[0]); }

template <typename V>
V mean(V a, V b) {
  return (a + b) * 0.5F;
}

Vec4 mean(Vec4 a, Vec4 b) {
  return {0.5F * (a.x + b.x), 0.5F * (a.y + b.y), 0.5F * (a.z + b.z), 0.5F * (a.w + b.w)};
}

bool is_near(const Corners<Vec3>& p, const Small& small) {
  Bounds box;
  for (const Vec3 corner : p) {
    box.add(corner);
  }
  const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
  const Vec3 half = small.box.diagonal() * 0.5F;
  const float reach = std::fabs(n.x) * half.x + std::fabs(n.y) * half.y + std::fabs(n.z) * half.z;
  return meet(box, small.box) && std::fabs(dot(n, small.box.center() - p[0])) <= reach;
}

/// Returns the largest edges of a mesh; 0 if their squares are infinite, so that no edge is the
/// longest.
float largest_edges_m(const MeshData& mesh) {
  float most = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const auto at = [&](std::size_t k) { return mesh.positions[mesh.indices[3 * t + k]]; };
    most = std::max(most, edges_m({at(0), at(1), at(2)}));
  }
  return std::isfinite(most * most) ? most : 0;
}

float largest_scale(const Transform& m) {
  return std::max({length(m.x), length(m.y), length(m.z)});
}

/// Keeps the first kSmallMost by edges_m, in that order.
void keep_smallest(std::vector<Small>& all) {
  const std::size_t count = std::min(all.size(), kSmallMost);
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count), all.end(),
                    [](const Small& a, const Small& b) { return a.edges_m < b.edges_m; });
  all.resize(count);
}

/// Adds one, and keeps the number bounded while many are added.
void add(std::vector<Small>& all, const Small& small) {
  all.push_back(small);
  if (all.size() == 16 * kSmallMost) {
    keep_smallest(all);
  }
}

/// Returns the meshes near which triangles of these edges are too large, the smallest first.
std::vector<Small> find_small(const SceneData& scene, float most_m) {
  std::vector<Bounds> own;
  for (const MeshData& mesh : scene.meshes) {
    own.push_back(bounds_of(mesh));
    for (const MovedVertices& moved : mesh.later) {
      for (std::size_t v = 0; v + 1 < moved.positions.size(); ++v) {
        own.back().add(moved.positions[v]);
      }
    }
  }
  std::vector<Small> out;
  for_each_placed(scene, [&](std::uint32_t placed, std::uint32_t instance, std::uint32_t) {
    Bounds box = own[scene.placed[placed].mesh];
    if (instance != kNoInstance) {
      box = image_of(box, scene.instances[instance].to_world);
    }
    const float radius_m = box.radius_or(0);
    const float edges = radius_m / (kSteps * kPlaneError);
    if (radius_m > 0 && edges < most_m) {
      const Vec3 room = {radius_m, radius_m, radius_m};
      box = {box.min - room, box.max + room};
      add(out, {box, edges});
    }
  });
  keep_smallest(out);
  return out;
}

/// Bisects the large triangles of a mesh at their longest edges, and those beside them, so that no
/// vertex is within an edge. Source: Rivara 1984, Algorithms for Refining Triangular Grids.
class Division {
 public:
  Division(MeshData& mesh, const std::vector<Small>& small) : mesh_(mesh), small_(small) {}

  /// Returns the number of triangles added.
  std::size_t run() {
    take_large();
    const std::size_t before = triangles_.size();
    if (before > kLargeMost) {
      return 0;
    }
    for_each_padded([](std::vector<Vec3>& values) { values.pop_back(); });
    for (int left = rounds_most(); left > 0 && triangles_.size() < kDividedMost && mark(); --left) {
      bisect_marked();
    }
    for_each_padded([](std::vector<Vec3>& values) { values.push_back(Vec3{}); });
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      const auto& v = triangles_[i].v;
      if (i < before) {
        std::copy(v.begin(), v.end(), &mesh_.indices[3 * std::size_t{numbers_[i]}]);
      } else {
        mesh_.indices.insert(mesh_.indices.end(), v.begin(), v.end());
      }
    }
    return triangles_.size() - before;
  }

 private:
  struct Face {
    std::array<std::uint32_t, 3> v;
    bool is_open = true;  ///< may be too large
  };
  /// Returns the corners of a triangle; time: of MeshData::later, -1 at time 0.
  Corners<Vec3> corners_at(const Face& face, std::ptrdiff_t time) const {
    const std::vector<Vec3>& at =
        time < 0 ? mesh_.positions : mesh_.later[static_cast<std::size_t>(time)].positions;
    return {at[face.v[0]], at[face.v[1]], at[face.v[2]]};
  }
  Corners<Vec3> corners(const Face& face) const { return corners_at(face, -1); }

  /// An edge by its ends: vertices in one place may differ in normals or texture coordinates.
  using Edge = std::array<float, 6>;

  template <typename Visit>
  void for_each_padded(const Visit& visit) {
    visit(mesh_.positions);
    if (!mesh_.normals.empty()) {
      visit(mesh_.normals);
    }
    for (MovedVertices& moved : mesh_.later) {
      visit(moved.positions);
    }
  }

  /// Takes the triangles that may have to be divided, or lie beside such: an edge of these has at
  /// least a third of the smallest edges_m(), and so have the edges of whatever shares it.
  void take_large() {
    const float least_m = small_.front().edges_m / 4;
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
      const std::uint32_t* v = &mesh_.indices[3 * std::size_t{t}];
      const Face face = {{v[0], v[1], v[2]}};
      if (edges_m(corners(face)) >= least_m) {
        triangles_.push_back(face);
        numbers_.push_back(t);
      }
    }
  }

  int rounds_most() const {
    double ratio = 1;
    const float least_m = std::max(small_.front().edges_m, std::numeric_limits<float>::min());
    for (const Face& face : triangles_) {
      ratio = std::max(ratio, static_cast<double>(edges_m(corners(face))) / double{least_m});
    }
    return kRoundsPerHalving * (1 + static_cast<int>(std::ceil(std::log2(ratio))));
  }

  Edge edge(const Face& face, std::size_t k) const {
    Vec3 a = mesh_.positions[face.v[k]];
    Vec3 b = mesh_.positions[face.v[(k + 1) % 3]];
    if (std::tie(b.x, b.y, b.z) < std::tie(a.x, a.y, a.z)) {
      std::swap(a, b);
    }
    return {a.x, a.y, a.z, b.x, b.y, b.z};
  }

  /// Returns the number of the longest edge; of equal ones all triangles take the same.
  std::size_t longest(const Face& face) const {
    std::size_t best = 0;
    std::pair<float, Edge> most;
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge here = edge(face, k);
      const float length_2 =
          length_squared(Vec3{here[3] - here[0], here[4] - here[1], here[5] - here[2]});
      if (k == 0 || most < std::pair(length_2, here)) {
        most = {length_2, here};
        best = k;
      }
    }
    return best;
  }

  bool is_too_large(const Face& face) const {
    const float edges = edges_m(corners(face));
    return std::any_of(small_.begin(), small_.end(), [&](const Small& small) {
      bool near = false;
      for (std::ptrdiff_t time = -1; time < std::ssize(mesh_.later) && !near; ++time) {
        near = edges > small.edges_m && is_near(corners_at(face, time), small);
      }
      return near;
    });
  }

  /// Marks the edges to be bisected. Returns whether there are any.
  bool mark() {
    marked_.clear();
    for (Face& face : triangles_) {
      face.is_open = face.is_open && is_too_large(face);
      if (face.is_open) {
        marked_.insert(edge(face, longest(face)));
      }
    }
    for (std::size_t before = 0; before != marked_.size();) {
      before = marked_.size();
      for (const Face& face : triangles_) {
        if (is_marked(face, 0) || is_marked(face, 1) || is_marked(face, 2)) {
          marked_.insert(edge(face, longest(face)));
        }
      }
    }
    return !marked_.empty();
  }

  bool is_marked(const Face& face, std::size_t k) const { return marked_.contains(edge(face, k)); }

  void bisect_marked() {
    const std::size_t count = triangles_.size();
    for (std::size_t i = 0; i < count; ++i) {
      const Face face = triangles_[i];
      const std::size_t first = longest(face);
      if (!is_marked(face, first)) {
        continue;
      }
      const std::size_t second = (first + 1) % 3;
      const std::size_t third = (first + 2) % 3;
      const std::uint32_t a = face.v[first];
      const std::uint32_t b = face.v[second];
      const std::uint32_t c = face.v[third];
      const std::uint32_t m = middle(a, b);
      Face halves[2] = {{{a, m, c}}, {{m, b, c}}};
      if (is_marked(face, third)) {
        const std::uint32_t n = middle(c, a);
        triangles_.push_back({{n, m, c}});
        halves[0] = {{a, m, n}};
      }
      if (is_marked(face, second)) {
        const std::uint32_t n = middle(b, c);
        triangles_.push_back({{m, n, c}});
        halves[1] = {{m, b, n}};
      }
      triangles_[i] = halves[0];
      triangles_.push_back(halves[1]);
    }
  }

  /// Returns the vertex in the middle of an edge.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const auto next = static_cast<std::uint32_t>(mesh_.positions.size());
    const auto [found, is_new] = middles_.try_emplace(std::minmax(a, b), next);
    if (!is_new) {
      return found->second;
    }
    const auto add = [&](auto& values) {
      if (!values.empty()) {
        values.push_back(mean(values[a], values[b]));
      }
    };
    mesh_.added.push_back(between(a, b));
    add(mesh_.positions);
    add(mesh_.normals);
    add(mesh_.uv[0]);
    add(mesh_.uv[1]);
    add(mesh_.colors);
    for (MovedVertices& moved : mesh_.later) {
      add(moved.positions);
      add(moved.normals);
    }
    if (!mesh_.tangents.empty()) {
      const float handedness = mesh_.tangents[a].w;
      add(mesh_.tangents);
      mesh_.tangents.back().w = handedness;
    }
    return next;
  }

  /// Returns the middle in terms of vertices of the file. All are of one of its triangles.
  AddedVertex between(std::uint32_t a, std::uint32_t b) const {
    std::map<std::uint32_t, float> weights;
    const std::size_t given = mesh_.positions.size() - mesh_.added.size();
    for (const std::uint32_t end : {a, b}) {
      if (end < given) {
        weights[end] += 0.5F;
        continue;
      }
      const AddedVertex& of = mesh_.added[end - given];
      for (std::size_t k = 0; k < 3; ++k) {
        weights[of.vertices[k]] += 0.5F * of.weights[k];
      }
    }
    std::erase_if(weights, [](const auto& each) { return each.second == 0; });
    AddedVertex out;
    std::size_t k = 0;
    for (const auto& [vertex, weight] : weights) {
      out.vertices[k] = vertex;
      out.weights[k++] = weight;
    }
    return out;
  }

  MeshData& mesh_;
  const std::vector<Small>& small_;
  std::vector<Face> triangles_;
  std::vector<std::uint32_t> numbers_;  ///< in the mesh, of those that were taken from it
  std::set<Edge> marked_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles_;
};

}  // namespace

std::size_t divide_triangles(SceneData& scene) {
  std::vector<float> edges;  // of each mesh, in its space
  for (const MeshData& mesh : scene.meshes) {
    edges.push_back(largest_edges_m(mesh));
  }
  const auto scale_of = [&](std::uint32_t instance) {
    return instance == kNoInstance ? 1.0F : largest_scale(scene.instances[instance].to_world);
  };
  float most_m = 0;
  for_each_placed(scene, [&](std::uint32_t placed, std::uint32_t instance, std::uint32_t) {
    most_m = std::max(most_m, edges[scene.placed[placed].mesh] * scale_of(instance));
  });
  const std::vector<Small> small = find_small(scene, most_m);
  if (small.empty()) {
    return 0;
  }
  std::vector<std::vector<Small>> near(scene.meshes.size());  // in the space of the mesh
  std::vector<std::size_t> uses(scene.meshes.size());
  for_each_placed(scene, [&](std::uint32_t placed, std::uint32_t instance, std::uint32_t) {
    const std::uint32_t mesh = scene.placed[placed].mesh;
    ++uses[mesh];
    if (instance == kNoInstance && edges[mesh] > small.front().edges_m) {
      near[mesh] = small;
    } else if (instance != kNoInstance &&
               edges[mesh] * scale_of(instance) > small.front().edges_m) {
      const Transform& to_world = scene.instances[instance].to_world;
      const Transform to_mesh = inverse(to_world);
      for (const Small& each : small) {
        add(near[mesh], {image_of(each.box, to_mesh), each.edges_m / largest_scale(to_world)});
      }
    }
  });
  std::size_t added = 0;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    keep_smallest(near[m]);
    if (!near[m].empty()) {
      added += uses[m] * Division(scene.meshes[m], near[m]).run();
    }
  }
  return added;
}

}  // namespace core
