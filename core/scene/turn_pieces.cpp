#include "core/scene/turn_pieces.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/scene/closed_surface.h"
#include "core/scene/placed_meshes.h"

namespace core {
namespace {

/// A mesh in world space that bounds a solid.
struct Piece {
  std::uint32_t placed = 0;
  Bounds box;
  bool has_neighbours = false;  ///< of other instances
};

/// Leaves those out that touch none of another instance, in the order of `placed`.
void keep_neighbours(std::vector<Piece>& pieces, const PlacedFrom& from) {
  std::sort(pieces.begin(), pieces.end(),
            [](const Piece& a, const Piece& b) { return a.box.min.x < b.box.min.x; });
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    Piece& a = pieces[i];
    for (std::size_t j = i + 1; j < pieces.size() && pieces[j].box.min.x <= a.box.max.x; ++j) {
      Piece& b = pieces[j];
      if (from.instances[a.placed] != from.instances[b.placed] && overlap(a.box, b.box)) {
        a.has_neighbours = b.has_neighbours = true;
      }
    }
  }
  std::erase_if(pieces, [](const Piece& piece) { return !piece.has_neighbours; });
  std::sort(pieces.begin(), pieces.end(),
            [](const Piece& a, const Piece& b) { return a.placed < b.placed; });
}

/// The box with room for the rounding of its corners.
Bounds with_room(const Bounds& box) {
  constexpr float kRoom = 0x1p-19F;  // 32 roundings, which are more than join_surfaces() takes
  const auto room = [](float a, float b) { return kRoom * (std::fabs(a) + std::fabs(b)); };
  const Vec3 by = {room(box.min.x, box.max.x), room(box.min.y, box.max.y),
                   room(box.min.z, box.max.z)};
  return {box.min - by, box.max + by};
}

void turn(MeshData& mesh) {
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  }
  for (Vec3& n : mesh.normals) {
    n = -n;
  }
  for (Vec4& t : mesh.tangents) {  // and the bitangents: as the maps are seen from the back
    t = {-t.x, -t.y, -t.z, -t.w};
  }
}

class PieceTurner {
 public:
  PieceTurner(SceneData& scene, const PlacedFrom& from) : scene_(scene), from_(from) {}

  std::vector<std::vector<std::uint32_t>> run() {
    std::vector<Piece> pieces;
    for (std::uint32_t i = 0; i < from_.top_level; ++i) {
      const MeshData& mesh = mesh_of(i);
      if (scene_.materials[mesh.material].is_volume && mesh.later.empty()) {
        pieces.push_back({i, with_room(bounds_of(mesh))});
      }
    }
    keep_neighbours(pieces, from_);
    std::vector<const MeshData*> meshes;
    for (const Piece& piece : pieces) {
      meshes.push_back(&mesh_of(piece.placed));
    }
    std::vector<std::vector<std::uint32_t>> out;
    for (const ClosingMeshes& surface : find_closing_meshes(meshes)) {
      std::vector<std::uint32_t> placed;
      for (const std::size_t m : surface.meshes) {
        placed.push_back(pieces[m].placed);
      }
      const InstanceDescription* const first = from_.instances[placed.front()];
      if (std::any_of(placed.begin(), placed.end(),
                      [&](std::uint32_t i) { return from_.instances[i] != first; })) {
        align(placed, surface.is_turned);
        out.push_back(std::move(placed));
      }
    }
    return out;
  }

 private:
  MeshData& mesh_of(std::uint32_t placed) { return scene_.meshes[scene_.placed[placed].mesh]; }

  void align(const std::vector<std::uint32_t>& placed, const std::vector<bool>& is_turned) {
    double more = 0;  // area of the side of the first
    for (std::size_t k = 0; k < placed.size(); ++k) {
      more += (is_turned[k] ? -1 : 1) * area(mesh_of(placed[k]));
    }
    const bool turns_others = more >= 0;
    for (std::size_t k = 0; k < placed.size(); ++k) {
      if (is_turned[k] == turns_others) {
        turn(mesh_of(placed[k]));
        warn(placed[k]);
      }
    }
  }

  void warn(std::uint32_t placed) {
    const auto mesh = static_cast<std::size_t>(from_.instances[placed]->mesh);
    from_.description.warnings.emplace_back(
        "turned", "",
        "mesh '" + from_.description.meshes[mesh].name + "': the surface of material '" +
            scene_.materials[mesh_of(placed).material].factors.name +
            "' is wound the other way than those of other nodes that close it; it is turned, since "
            "the surface of a solid has one outside");
  }

  SceneData& scene_;
  const PlacedFrom& from_;
};

}  // namespace

std::vector<std::vector<std::uint32_t>> turn_pieces(SceneData& scene, const PlacedFrom& from) {
  return scene.has_volumes ? PieceTurner(scene, from).run()
                           : std::vector<std::vector<std::uint32_t>>();
}

}  // namespace core
