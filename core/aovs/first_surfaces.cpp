#include "core/aovs/first_surfaces.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "core/math/place.h"

namespace core {
namespace {

Place cross(Place a, Place b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(Place a, Place b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Place scaled(Place a, double s) { return {a.x * s, a.y * s, a.z * s}; }

Place placed(const Transform& m, Vec3 p) {
  return scaled(m.x, static_cast<double>(p.x)) + scaled(m.y, static_cast<double>(p.y)) +
         scaled(m.z, static_cast<double>(p.z)) + Place(m.t);
}

/// A rectangle of pixels, with its last row and column.
struct Pixels {
  int first_x, first_y, last_x, last_y;
};

class PixelView {
 public:
  PixelView(const Camera& camera, int width, int height)
      : camera_(camera), film_(camera.intrinsics()), width_(width), height_(height) {}

  /// Returns the pixels in which the box can be; empty if it is not in the view.
  std::optional<Pixels> pixels_of(const Bounds& box, const Transform& to_world) const {
    double least[2] = {static_cast<double>(width_), static_cast<double>(height_)};
    double most[2] = {-1, -1};
    for (int corner = 0; corner < 8; ++corner) {
      const Place from_eye = placed(to_world, {(corner & 1) != 0 ? box.max.x : box.min.x,
                                               (corner & 2) != 0 ? box.max.y : box.min.y,
                                               (corner & 4) != 0 ? box.max.z : box.min.z}) -
                             Place(camera_.eye());
      const double depth = dot(from_eye, camera_.forward());
      if (!(depth > 0)) {
        return Pixels{0, 0, width_ - 1, height_ - 1};
      }
      const double at[2] = {film_.cx + film_.fx * dot(from_eye, camera_.right()) / depth,
                            film_.cy - film_.fy * dot(from_eye, camera_.up()) / depth};
      for (int axis = 0; axis < 2; ++axis) {
        least[axis] = std::min(least[axis], at[axis]);
        most[axis] = std::max(most[axis], at[axis]);
      }
    }
    // A pixel more on each side, for rounding.
    const auto within = [](double px, int count) {
      return static_cast<int>(std::clamp(px, -2.0, count + 1.0));
    };
    const Pixels pixels = {std::max(within(least[0], width_) - 1, 0),
                           std::max(within(least[1], height_) - 1, 0),
                           std::min(within(most[0], width_) + 1, width_ - 1),
                           std::min(within(most[1], height_) + 1, height_ - 1)};
    return pixels.first_x <= pixels.last_x && pixels.first_y <= pixels.last_y
               ? std::optional(pixels)
               : std::nullopt;
  }

  /// Returns the direction of a pixel's centre, which advances by 1 along forward().
  Place direction(int x, int y) const {
    return Place(camera_.forward()) +
           scaled(camera_.right(), (static_cast<double>(x) + 0.5 - film_.cx) / film_.fx) +
           scaled(camera_.up(), (film_.cy - static_cast<double>(y) - 0.5) / film_.fy);
  }

  /// Returns the depth of the triangle's plane: float hits would be off by some 1e-6 of the depth.
  double depth(const MeshTree& tree, const Transform& to_world, const RawHit& hit,
               Place along) const {
    Place corner[3];
    for (std::size_t i = 0; i < 3; ++i) {
      corner[i] =
          placed(to_world, tree.positions[tree.indices[3 * std::size_t{hit.primitive} + i]]);
    }
    const Place normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    return dot(normal, corner[0] - Place(camera_.eye())) / dot(normal, along);
  }

 private:
  const Camera& camera_;
  const Intrinsics film_;
  const int width_;
  const int height_;
};

}  // namespace

std::size_t MeshTree::bytes() const noexcept {
  return positions.size() * sizeof(Vec3) + indices.size() * sizeof(std::uint32_t) + accel->bytes();
}

Result<std::shared_ptr<const MeshTree>> MeshTree::build(const PrimitiveDescription& mesh,
                                                        int threads, std::string_view isa,
                                                        const std::stop_token& stop) {
  auto tree = std::make_shared<MeshTree>();
  tree->indices = mesh.indices;
  tree->positions.reserve(mesh.positions.size() + 1);
  tree->positions = mesh.positions;
  tree->positions.push_back(Vec3{});
  for (const Vec3 position : mesh.positions) {
    tree->bounds.add(position);
  }
  const AccelGeometry geometry = {std::span(tree->positions).first(mesh.positions.size()),
                                  tree->indices};
  auto accel = Accel::build({&geometry, 1}, {}, {}, threads, isa, stop);
  if (!accel) {
    return accel.error();
  }
  tree->accel = *std::move(accel);
  return std::shared_ptr<const MeshTree>(std::move(tree));
}

Result<std::vector<FirstSurface>> first_surfaces(const SceneDescription& scene,
                                                 const Camera& camera, int width, int height,
                                                 const FindTree& find,
                                                 const std::stop_token& stop) {
  prepare_tracing_thread();
  const PixelView view(camera, width, height);
  std::vector<FirstSurface> out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  // Nearest so far along each pixel's ray.
  std::vector<float> nearest(out.size(), Ray{}.t_max);
  for (const InstanceDescription& instance : scene.instances) {
    const Transform& to_world = instance.to_world;
    const Transform to_local = inverse(to_world);
    for (const PrimitiveDescription& mesh :
         scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
      if (stop.stop_requested()) {
        return Error{ErrorCode::kCancelled, "stopped while rendering", ""};
      }
      const auto tree = find(mesh);
      if (!tree) {
        return tree.error();
      }
      const auto pixels = view.pixels_of((*tree)->bounds, to_world);
      if (!pixels) {
        continue;
      }
      for (int y = pixels->first_y; y <= pixels->last_y; ++y) {
        for (int x = pixels->first_x; x <= pixels->last_x; ++x) {
          const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                             static_cast<std::size_t>(x);
          const Ray world =
              camera.ray({static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F}, {0.5F, 0.5F})
                  .ray;
          const Ray local = {.origin = to_local.point(world.origin),
                             .direction = to_local.vector(world.direction),
                             .t_max = std::min(world.t_max, nearest[pixel])};
          RawHit hit;
          if ((*tree)->accel->intersect(local, hit) && hit.t < nearest[pixel]) {
            nearest[pixel] = hit.t;
            out[pixel] = {view.depth(**tree, to_world, hit, view.direction(x, y)), mesh.material};
          }
        }
      }
    }
  }
  return out;
}

}  // namespace core
