#include "core/scene/matte_names.h"

#include <bit>
#include <cstddef>
#include <unordered_set>

namespace core {
namespace {

std::uint32_t scrambled(std::uint32_t k) noexcept {
  return std::rotl(k * 0xcc9e2d51U, 15) * 0x1b873593U;
}

/// Makes names unique.
class UniqueNames {
 public:
  explicit UniqueNames(std::string_view folder) : folder_(folder) {}
  std::string take(const std::string& wish, std::size_t number) {
    std::string name = wish.empty() ? folder_ + std::to_string(number) : wish;
    while (!taken_.insert(name).second) {
      name.append("#").append(std::to_string(number));
    }
    return name;
  }

 private:
  std::string folder_;
  std::unordered_set<std::string> taken_;
};

}  // namespace

std::uint32_t murmur3(std::string_view bytes) noexcept {
  const auto byte = [&bytes](std::size_t i) {
    return std::uint32_t{static_cast<std::uint8_t>(bytes[i])};
  };
  std::uint32_t h = 0;
  const std::size_t whole = bytes.size() / 4 * 4;
  for (std::size_t i = 0; i < whole; i += 4) {
    h ^= scrambled(byte(i) | byte(i + 1) << 8U | byte(i + 2) << 16U | byte(i + 3) << 24U);
    h = std::rotl(h, 13) * 5 + 0xe6546b64U;
  }
  std::uint32_t tail = 0;
  for (std::size_t i = bytes.size(); i > whole; --i) {
    tail = tail << 8U | byte(i - 1);
  }
  h ^= scrambled(tail);
  h ^= static_cast<std::uint32_t>(bytes.size());
  h = (h ^ h >> 16U) * 0x85ebca6bU;
  h = (h ^ h >> 13U) * 0xc2b2ae35U;
  return h ^ h >> 16U;
}

std::uint32_t matte_id(std::string_view name) noexcept {
  const std::uint32_t hash = murmur3(name);
  const std::uint32_t exponent = hash >> 23U & 255U;
  return exponent == 0 || exponent == 255 ? hash ^ 1U << 23U : hash;
}

std::vector<std::string> object_names(std::span<const ObjectDescription> objects) {
  UniqueNames names("/nodes/");
  std::vector<std::string> out;
  out.reserve(objects.size());
  for (const ObjectDescription& object : objects) {
    out.push_back(names.take(object.name, object.id - 1));
  }
  return out;
}

std::vector<std::string> material_names(std::span<const std::string> wishes) {
  UniqueNames names("/materials/");
  std::vector<std::string> out;
  out.reserve(wishes.size());
  for (const std::string& wish : wishes) {
    out.push_back(names.take(wish, out.size()));
  }
  return out;
}

std::vector<std::uint32_t> object_mattes(std::span<const ObjectDescription> objects) {
  std::vector<std::uint32_t> out(objects.empty() ? 0 : objects.back().id + std::size_t{1});
  const std::vector<std::string> names = object_names(objects);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    out[objects[i].id] = matte_id(names[i]);
  }
  return out;
}

std::vector<std::uint32_t> material_mattes(std::span<const std::string> names) {
  std::vector<std::uint32_t> out;
  for (const std::string& name : material_names(names)) {
    out.push_back(matte_id(name));
  }
  return out;
}

void number_objects(SceneDescription& from, SceneData& to) {
  if (from.objects.empty()) {
    for (InstanceDescription& instance : from.instances) {
      const auto id = static_cast<std::uint32_t>(&instance - from.instances.data()) + 1;
      instance.object = instance.instance = id;
      from.objects.push_back(
          {id, from.meshes[static_cast<std::size_t>(instance.mesh)].name, id, 1});
    }
    std::uint32_t next = 1;
    for (MeshDescription& mesh : from.meshes) {
      from.mesh_primitives.push_back(static_cast<std::uint32_t>(mesh.primitives.size()));
      for (PrimitiveDescription& p : mesh.primitives) {
        p.id = next++;
      }
    }
  }
  std::vector<std::string> materials;
  for (const MaterialDescription& m : from.materials) {
    materials.push_back(m.name);
  }
  to.object_mattes = object_mattes(from.objects);
  to.material_mattes = material_mattes(materials);
}

}  // namespace core
