#include "core/scene/solids.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "core/scene/closed_surface.h"

namespace core {
namespace {

void add_vertices(Bounds& box, const MeshData& mesh, const Transform* to_world) {
  for (const std::uint32_t i : mesh.indices) {
    box.add(to_world == nullptr ? mesh.positions[i] : to_world->point(mesh.positions[i]));
    for (const MovedVertices& moved : mesh.later) {
      box.add(moved.positions[i]);
    }
  }
}

bool contains(const Bounds& outer, const Bounds& inner) {
  bool out = true;
  for (int i = 0; i < 3; ++i) {
    out = out && outer.min[i] < inner.min[i] && inner.max[i] < outer.max[i];
  }
  return out;
}

/// The box with a margin beyond the offsets of rays.
Bounds with_margin(const Bounds& box) {
  constexpr float kMargin = 0x1p-12F;  // relative to coordinates
  const auto margin = [](float a, float b) {
    return kMargin * std::max({std::fabs(a), std::fabs(b), 1.0F});
  };
  const Vec3 by = {margin(box.min.x, box.max.x), margin(box.min.y, box.max.y),
                   margin(box.min.z, box.max.z)};
  return {box.min - by, box.max + by};
}

/// Smaller boxes win; surfaces that may extend without limit are the largest.
float size_of(const Solid& solid) {
  return solid.kind == SolidKind::kOpen ? std::numeric_limits<float>::infinity()
                                        : length(solid.box.diagonal());
}

void set_ranks(std::vector<Solid>& solids) {
  std::vector<std::size_t> order(solids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const int of_a = solids[a].material->factors.priority;
    const int of_b = solids[b].material->factors.priority;
    return of_a != of_b ? of_a < of_b : size_of(solids[a]) > size_of(solids[b]);
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    solids[order[i]].rank = static_cast<std::uint32_t>(i);
  }
}

/// Sets Solid::shares_space by the boxes.
void find_shared_space(std::vector<Solid>& solids) {
  struct Placed {
    Bounds box;
    Solid* solid;
  };
  std::vector<Placed> placed;
  for (Solid& solid : solids) {
    placed.push_back({with_margin(solid.box), &solid});
  }
  std::sort(placed.begin(), placed.end(),
            [](const Placed& a, const Placed& b) { return a.box.min.x < b.box.min.x; });
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Placed& a = placed[i];
    for (std::size_t j = i + 1; j < placed.size() && placed[j].box.min.x <= a.box.max.x; ++j) {
      if (overlap(placed[j].box, a.box)) {
        a.solid->shares_space = placed[j].solid->shares_space = true;
      }
    }
  }
}

/// Returns the consequence for a view that passes the surface once, as through an open pane.
std::string view_through(float ior) {
  if (ior == 1) {
    return "";
  }
  char text[160];
  std::snprintf(text, sizeof text,
                ", and what lies behind is seen %.3g times as bright (1 over the square of the "
                "index of refraction); a thin pane has no thicknessFactor",
                static_cast<double>(1 / (ior * ior)));
  return text;
}

/// Joins open surfaces of one material: they are parts of one solid, as the two faces of a slab.
std::vector<JoinedSurface> with_open_parts_joined(std::vector<JoinedSurface> surfaces,
                                                  std::span<const MeshData* const> meshes) {
  const auto material_of = [&meshes](const JoinedSurface& surface) {
    return meshes[surface.meshes.front()]->material;
  };
  std::vector<JoinedSurface> out;
  for (JoinedSurface& surface : surfaces) {
    const auto other =
        surface.border_edges == 0
            ? out.end()
            : std::find_if(out.begin(), out.end(), [&](const JoinedSurface& each) {
                return each.border_edges > 0 && material_of(each) == material_of(surface);
              });
    if (other == out.end()) {
      out.push_back(std::move(surface));
    } else {
      other->meshes.insert(other->meshes.end(), surface.meshes.begin(), surface.meshes.end());
      other->border_edges += surface.border_edges;
      other->one_way_edges += surface.one_way_edges;
      other->volume_m3 += surface.volume_m3;
    }
  }
  return out;
}

class SolidFinder {
 public:
  SolidFinder(SceneData& scene, const PlacedFrom& from) : scene_(scene), from_(from) {}

  /// placed: the meshes of one instance, or of joined ones, that bound volumes.
  void add_instance(std::span<const std::uint32_t> placed) {
    std::vector<const MeshData*> meshes;
    for (const std::uint32_t i : placed) {
      meshes.push_back(&scene_.meshes[scene_.placed[i].mesh]);
    }
    auto found = surfaces_.find(meshes);
    if (found == surfaces_.end()) {
      found =
          surfaces_.emplace(meshes, with_open_parts_joined(join_surfaces(meshes), meshes)).first;
    }
    for (const JoinedSurface& surface : found->second) {
      add_solid(placed, surface);
    }
  }

  /// After all instances.
  void finish() {
    for (std::size_t i = 0; i < scene_.solids.size(); ++i) {
      Solid& solid = scene_.solids[i];
      if (!faces_inwards_[i]) {
        continue;
      }
      const bool is_cavity = std::any_of(
          scene_.solids.begin(), scene_.solids.end(),
          [&](const Solid& other) { return &other != &solid && contains(other.box, solid.box); });
      solid.kind = is_cavity ? SolidKind::kCavity : SolidKind::kClosed;
      solid.is_inside_out = !is_cavity;
      if (!is_cavity) {
        warn(first_[i], solid, "faces inwards; it is taken as if it faced outwards");
      }
    }
    set_ranks(scene_.solids);
    find_shared_space(scene_.solids);
    for (const Solid& solid : scene_.solids) {
      scene_.has_shared_space = scene_.has_shared_space || solid.shares_space;
      scene_.has_open_solids = scene_.has_open_solids || solid.kind == SolidKind::kOpen;
    }
  }

 private:
  void add_solid(std::span<const std::uint32_t> placed, const JoinedSurface& surface) {
    const auto id = static_cast<std::uint32_t>(scene_.solids.size());
    Solid solid;
    double largest = -1;
    bool refracts = false;
    for (const std::size_t i : surface.meshes) {
      PlacedMesh& here = scene_.placed[placed[i]];
      const MeshData& mesh = scene_.meshes[here.mesh];
      const Material& material = scene_.materials[mesh.material];
      add_vertices(solid.box, mesh,
                   placed[i] < from_.top_level ? nullptr : &from_.instances[placed[i]]->to_world);
      here.solid = id;
      scene_.has_solid_holes = scene_.has_solid_holes || material.has_alpha;
      if (const double size = area(mesh); solid.material == nullptr || size > largest) {
        largest = size;
        solid.material = &material;
      }
      refracts = refracts || material.plain.transmission > 0;
    }
    solid.scatters = solid.material->medium.scatters();
    solid.ior = refracts ? std::max(solid.material->factors.ior, 1.0F) : 1.0F;
    first_.push_back(placed[surface.meshes.front()]);
    faces_inwards_.push_back(surface.border_edges == 0 && surface.volume_m3 < 0);
    if (surface.border_edges > 0) {
      solid.kind = SolidKind::kOpen;
      const std::string edges = std::to_string(surface.border_edges) + " edges";
      warn(first_.back(), solid,
           (surface.one_way_edges == surface.border_edges
                ? "faces both ways (both triangles at " + edges +
                      " are wound in one direction: turn one side)"
                : "is not closed (" + edges + " belong to one triangle only)") +
               "; where light enters the volume that it bounds and does not meet it again, the "
               "volume has no end" +
               view_through(solid.ior));
    }
    scene_.solids.push_back(solid);
  }

  /// Once for all instances of a mesh.
  void warn(std::uint32_t placed, const Solid& solid, const std::string& what) {
    const auto mesh = static_cast<std::size_t>(from_.instances[placed]->mesh);
    std::string text = "mesh '" + from_.description.meshes[mesh].name +
                       "': the surface of material '" + solid.material->factors.name + "' " + what;
    if (told_.insert(text).second) {
      from_.description.warnings.emplace_back("solid", "", std::move(text));
    }
  }

  SceneData& scene_;
  const PlacedFrom& from_;
  std::map<std::vector<const MeshData*>, std::vector<JoinedSurface>> surfaces_;
  std::vector<std::uint32_t> first_;  ///< a placed mesh of each solid
  std::vector<bool> faces_inwards_;
  std::set<std::string> told_;
};

/// Instances whose meshes close a surface together, as turn_pieces() found: they are as one.
class JoinedInstances {
 public:
  JoinedInstances(const SceneData& scene, const PlacedFrom& from) {
    for (const std::vector<std::uint32_t>& pieces : from.pieces) {
      for (const std::uint32_t i : pieces) {
        const auto* const a = first_of(from.instances[pieces.front()]);
        const auto* const b = first_of(from.instances[i]);
        if (a != b) {
          earlier_[std::max(a, b)] = std::min(a, b);
        }
      }
    }
    for (const auto& [later, earlier] : earlier_) {
      placed_[first_of(earlier)];
    }
    for (std::uint32_t i = 0; i < from.top_level && !placed_.empty(); ++i) {
      const auto found = placed_.find(first_of(from.instances[i]));
      if (found != placed_.end() &&
          scene.materials[scene.meshes[scene.placed[i].mesh].material].is_volume) {
        found->second.push_back(i);
      }
    }
  }
  /// Replaces the placed meshes of an instance by those of all that are joined, the first of which
  /// has them all.
  void join(const InstanceDescription* instance, std::vector<std::uint32_t>& placed) const {
    if (earlier_.contains(instance)) {
      placed.clear();
    } else if (const auto found = placed_.find(instance); found != placed_.end()) {
      placed = found->second;
    }
  }

 private:
  const InstanceDescription* first_of(const InstanceDescription* instance) const {
    for (auto at = earlier_.find(instance); at != earlier_.end(); at = earlier_.find(instance)) {
      instance = at->second;
    }
    return instance;
  }

  std::map<const InstanceDescription*, const InstanceDescription*> earlier_;
  std::map<const InstanceDescription*, std::vector<std::uint32_t>> placed_;
};

}  // namespace

void find_solids(SceneData& scene, const PlacedFrom& from) {
  if (!scene.has_volumes) {
    return;
  }
  SolidFinder finder(scene, from);
  const JoinedInstances joined(scene, from);
  std::vector<std::uint32_t> placed;
  for (std::uint32_t i = 0; i < scene.placed.size(); ++i) {
    if (scene.materials[scene.meshes[scene.placed[i].mesh].material].is_volume) {
      placed.push_back(i);
    }
    const bool is_last = i + 1 == scene.placed.size() || from.instances[i + 1] != from.instances[i];
    if (is_last && !placed.empty()) {
      joined.join(from.instances[i], placed);
      finder.add_instance(placed);
      placed.clear();
    }
  }
  finder.finish();
}

}  // namespace core
