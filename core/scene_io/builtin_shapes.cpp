#include "core/scene_io/builtin_shapes.h"

#include <array>
#include <cmath>
#include <utility>

#include "core/math/numbers.h"

namespace core {
namespace {

// Triangles of a grid of (columns + 1) by (rows + 1) vertices, rows outermost.
void add_grid_triangles(PrimitiveDescription& p, int columns, int rows) {
  const auto at = [columns](int row, int column) {
    return static_cast<std::uint32_t>(row * (columns + 1) + column);
  };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const std::array<std::uint32_t, 4> q = {at(r, c), at(r, c + 1), at(r + 1, c + 1),
                                              at(r + 1, c)};
      const auto same = [&p](std::uint32_t a, std::uint32_t b) {
        return length_squared(p.positions[a] - p.positions[b]) < 1e-14F;
      };
      if (!same(q[0], q[1])) {
        p.indices.insert(p.indices.end(), {q[0], q[1], q[2]});
      }
      if (!same(q[2], q[3])) {
        p.indices.insert(p.indices.end(), {q[0], q[2], q[3]});
      }
    }
  }
}

}  // namespace

PrimitiveDescription quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  PrimitiveDescription p;
  const Vec3 n = normalize(cross(b - a, d - a));
  p.positions = {a, b, c, d};
  p.normals = {n, n, n, n};
  p.uv[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  p.indices = {0, 1, 2, 0, 2, 3};
  return p;
}

PrimitiveDescription box(Vec3 min, Vec3 max, float uv_per_metre) {
  const auto at = [&](int x, int y, int z) {
    return Vec3{x != 0 ? max.x : min.x, y != 0 ? max.y : min.y, z != 0 ? max.z : min.z};
  };
  const std::array<std::array<Vec3, 4>, 6> faces = {{
      {at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)},
      {at(1, 0, 0), at(0, 0, 0), at(0, 1, 0), at(1, 1, 0)},
      {at(1, 0, 1), at(1, 0, 0), at(1, 1, 0), at(1, 1, 1)},
      {at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)},
      {at(0, 1, 1), at(1, 1, 1), at(1, 1, 0), at(0, 1, 0)},
      {at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)},
  }};
  PrimitiveDescription p;
  for (const auto& f : faces) {
    PrimitiveDescription face = quad(f[0], f[1], f[2], f[3]);
    const float u = length(f[1] - f[0]) * uv_per_metre;
    const float v = length(f[3] - f[0]) * uv_per_metre;
    face.uv[0] = {{0, v}, {u, v}, {u, 0}, {0, 0}};
    append(p, face);
  }
  return p;
}

PrimitiveDescription sphere(float radius, int segments) {
  PrimitiveDescription p;
  const int rows = segments / 2;
  for (int r = 0; r <= rows; ++r) {
    const float theta = kPi * static_cast<float>(r) / static_cast<float>(rows);
    // sin(pi) is not 0 in floats, but the poles must be points.
    const float ring = r == 0 || r == rows ? 0 : std::sin(theta);
    const float height = r == 0 ? 1 : (r == rows ? -1 : std::cos(theta));
    for (int s = 0; s <= segments; ++s) {
      const float phi =
          s == segments ? 0 : 2 * kPi * static_cast<float>(s) / static_cast<float>(segments);
      const Vec3 n = {ring * std::cos(phi), height, ring * std::sin(phi)};
      p.positions.push_back(n * radius);
      p.normals.push_back(n);
      p.uv[0].push_back({static_cast<float>(s) / static_cast<float>(segments),
                         static_cast<float>(r) / static_cast<float>(rows)});
    }
  }
  add_grid_triangles(p, segments, rows);
  return p;
}

PrimitiveDescription lathe(std::span<const Vec2> profile, int segments) {
  PrimitiveDescription p;
  const auto rows = static_cast<int>(profile.size()) - 1;
  for (int r = 0; r <= rows; ++r) {
    const auto i = static_cast<std::size_t>(r);
    const Vec2 before = profile[r == 0 ? 0 : i - 1];
    const Vec2 after = profile[r == rows ? i : i + 1];
    // The profile goes upwards on the outside: its right-hand side faces out.
    const Vec2 along = after - before;
    const Vec3 out = normalize_or({along.y, -along.x, 0}, {0, along.x < 0 ? 1.0F : -1.0F, 0});
    const bool is_pole = profile[i].x == 0;
    for (int s = 0; s <= segments; ++s) {
      const float phi =
          s == segments ? 0 : 2 * kPi * static_cast<float>(s) / static_cast<float>(segments);
      const float c = std::cos(phi);
      const float n = std::sin(phi);
      p.positions.push_back({profile[i].x * c, profile[i].y, profile[i].x * n});
      p.normals.push_back(is_pole ? Vec3{0, out.y < 0 ? -1.0F : 1.0F, 0}
                                  : Vec3{out.x * c, out.y, out.x * n});
      p.uv[0].push_back({static_cast<float>(s) / static_cast<float>(segments),
                         1 - static_cast<float>(r) / static_cast<float>(rows)});
    }
  }
  add_grid_triangles(p, segments, rows);
  turn_inside_out(p);
  for (Vec3& n : p.normals) {
    n = -n;
  }
  return p;
}

PrimitiveDescription height_field(float width, float depth, int cells,
                                  float (*height)(float x, float z)) {
  PrimitiveDescription p;
  for (int r = 0; r <= cells; ++r) {
    for (int c = 0; c <= cells; ++c) {
      const float u = static_cast<float>(c) / static_cast<float>(cells);
      const float v = static_cast<float>(r) / static_cast<float>(cells);
      const float x = (u - 0.5F) * width;
      const float z = (0.5F - v) * depth;
      constexpr float kStep = 1e-2F;
      const float dx = (height(x + kStep, z) - height(x - kStep, z)) / (2 * kStep);
      const float dz = (height(x, z + kStep) - height(x, z - kStep)) / (2 * kStep);
      p.positions.push_back({x, height(x, z), z});
      p.normals.push_back(normalize({-dx, 1, -dz}));
      p.uv[0].push_back({u, 1 - v});
    }
  }
  add_grid_triangles(p, cells, cells);
  return p;
}

void turn_inside_out(PrimitiveDescription& primitive) {
  for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
    std::swap(primitive.indices[i + 1], primitive.indices[i + 2]);
  }
  for (Vec3& n : primitive.normals) {
    n = -n;
  }
}

void append(PrimitiveDescription& to, const PrimitiveDescription& more) {
  const auto first = static_cast<std::uint32_t>(to.positions.size());
  to.positions.insert(to.positions.end(), more.positions.begin(), more.positions.end());
  to.normals.insert(to.normals.end(), more.normals.begin(), more.normals.end());
  to.uv[0].insert(to.uv[0].end(), more.uv[0].begin(), more.uv[0].end());
  for (const std::uint32_t i : more.indices) {
    to.indices.push_back(first + i);
  }
}

MaterialDescription diffuse_material(std::string name, Rgb albedo) {
  MaterialDescription m;
  m.name = std::move(name);
  m.base_color = albedo;
  m.metallic = 0;
  m.roughness = 1;
  m.specular = 0;
  return m;
}

MaterialDescription emissive_material(std::string name, Rgb radiance) {
  MaterialDescription m = diffuse_material(std::move(name), Rgb(0));
  m.emissive = radiance;
  return m;
}

MaterialDescription metal_material(std::string name, Rgb color, float roughness) {
  MaterialDescription m;
  m.name = std::move(name);
  m.base_color = color;
  m.metallic = 1;
  m.roughness = roughness;
  return m;
}

MaterialDescription plastic_material(std::string name, Rgb color, float roughness) {
  MaterialDescription m = metal_material(std::move(name), color, roughness);
  m.metallic = 0;
  return m;
}

MaterialDescription glass_material(std::string name, Rgb attenuation_color,
                                   float attenuation_distance_m) {
  MaterialDescription m = plastic_material(std::move(name), Rgb(1), 0);
  m.transmission = 1;
  m.thickness = 1;
  m.attenuation_color = attenuation_color;
  m.attenuation_distance = attenuation_distance_m;
  return m;
}

int add_material(SceneDescription& scene, MaterialDescription material) {
  scene.materials.push_back(std::move(material));
  return static_cast<int>(scene.materials.size()) - 1;
}

int add_mesh(SceneDescription& scene, std::string name, PrimitiveDescription primitive,
             int material) {
  primitive.material = material;
  MeshDescription mesh;
  mesh.name = std::move(name);
  mesh.primitives.push_back(std::move(primitive));
  scene.meshes.push_back(std::move(mesh));
  return static_cast<int>(scene.meshes.size()) - 1;
}

void add_instance(SceneDescription& scene, int mesh, const Transform& to_world) {
  scene.instances.push_back({mesh, to_world});
}

void add_object(SceneDescription& scene, std::string name, PrimitiveDescription primitive,
                int material, const Transform& to_world) {
  add_instance(scene, add_mesh(scene, std::move(name), std::move(primitive), material), to_world);
}

void add_camera(SceneDescription& scene, Vec3 position, Vec3 target, float vertical_fov_rad) {
  CameraDescription camera;
  camera.name = "camera";
  camera.vertical_fov_rad = vertical_fov_rad;
  const Vec3 back = normalize(position - target);
  const Vec3 right = normalize(cross({0, 1, 0}, back));
  camera.to_world = {right, cross(back, right), back, position};
  scene.cameras.push_back(camera);
}

Transform rotation_y(float angle_rad) {
  return rotation({0, std::sin(angle_rad / 2), 0, std::cos(angle_rad / 2)});
}

float PlacementNumbers::next() noexcept {
  state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
  const auto shifted = static_cast<std::uint32_t>(((state_ >> 18U) ^ state_) >> 27U);
  const auto turn = static_cast<std::uint32_t>(state_ >> 59U);
  const std::uint32_t bits = (shifted >> turn) | (shifted << ((32 - turn) & 31U));
  return static_cast<float>(bits >> 8U) * 0x1p-24F;
}

}  // namespace core
