#include "core/scene_io/gltf_draco.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <new>

#include <draco/compression/decode.h>

#include "core/base/invalid.h"

namespace core {
namespace {

float normalisation(const GltfAccessor& accessor, const draco::PointAttribute& attribute) {
  if (!accessor.normalized || attribute.normalized()) {
    return 1;
  }
  switch (accessor.component) {
    case ComponentType::kI8:
      return 1 / 127.0F;
    case ComponentType::kU8:
      return 1 / 255.0F;
    case ComponentType::kI16:
      return 1 / 32767.0F;
    case ComponentType::kU16:
      return 1 / 65535.0F;
    default:
      return 1;
  }
}

Result<std::vector<float>> values_of(const draco::PointAttribute& attribute, std::uint32_t points,
                                     const GltfAccessor& accessor, const std::string& where) {
  const auto width = static_cast<std::size_t>(accessor.shape.values());
  if (attribute.num_components() != accessor.shape.values() || width > 4) {
    return invalid(where, "the Draco attribute has " + std::to_string(attribute.num_components()) +
                              " values, its accessor " + std::to_string(width));
  }
  const float scale = normalisation(accessor, attribute);
  const float lowest = accessor.normalized ? -1.0F : -INFINITY;
  std::vector<float> values(points * width);
  for (std::uint32_t p = 0; p < points; ++p) {
    const draco::AttributeValueIndex entry = attribute.mapped_index(draco::PointIndex(p));
    float* to = values.data() + p * width;
    if (entry.value() >= attribute.size() ||
        !attribute.ConvertValue<float>(entry, static_cast<std::int8_t>(width), to)) {
      return invalid(where, "the Draco attribute cannot be read");
    }
    for (std::size_t i = 0; i < width; ++i) {
      to[i] = std::max(to[i] * scale, lowest);
      if (!std::isfinite(to[i])) {
        return invalid(where, "the Draco attribute contains a value that is not finite");
      }
    }
  }
  return values;
}

Result<DracoPrimitive> decode(GltfSource& source, int view,
                              const std::map<std::string, DracoAttribute>& attributes,
                              const std::string& where) {
  auto bytes = source.view(view);
  if (!bytes) {
    return bytes.error();
  }
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) {
    return invalid(where, "Draco: " + decoded.status().error_msg_string());
  }
  const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
  const std::uint32_t points = mesh->num_points();
  DracoPrimitive primitive;
  for (const auto& [name, reference] : attributes) {
    const std::string attribute_where = where + "/attributes/" + name;
    const draco::PointAttribute* attribute =
        mesh->GetAttributeByUniqueId(static_cast<std::uint32_t>(reference.unique_id));
    if (attribute == nullptr) {
      return invalid(attribute_where,
                     "the Draco data has no attribute " + std::to_string(reference.unique_id));
    }
    const GltfAccessor& accessor =
        source.tables().accessors[static_cast<std::size_t>(reference.accessor)];
    if (auto status = source.budget().take(std::uint64_t{points} * 16, attribute_where); !status) {
      return status.error();
    }
    auto values = values_of(*attribute, points, accessor, attribute_where);
    if (!values) {
      return values.error();
    }
    primitive.attributes[name] = *std::move(values);
  }
  if (auto status = source.budget().take(std::uint64_t{mesh->num_faces()} * 12, where); !status) {
    return status.error();
  }
  primitive.triangles.reserve(std::size_t{mesh->num_faces()} * 3);
  for (std::uint32_t f = 0; f < mesh->num_faces(); ++f) {
    for (const draco::PointIndex& corner : mesh->face(draco::FaceIndex(f))) {
      if (corner.value() >= points) {
        return invalid(where, "the Draco data contains an index beyond its points");
      }
      primitive.triangles.push_back(corner.value());
    }
  }
  return primitive;
}

}  // namespace

Result<DracoPrimitive> decode_draco(GltfSource& source, int view,
                                    const std::map<std::string, DracoAttribute>& attributes,
                                    const std::string& where) {
  try {
    return decode(source, view, attributes, where);
  } catch (const std::bad_alloc&) {
    // Malformed Draco data requests huge allocations; none of ours is large here.
    return Error{ErrorCode::kTooLarge, "Draco: the data needs more memory than is available",
                 where};
  } catch (const std::exception& problem) {
    return invalid(where, std::string("Draco: ") + problem.what());
  }
}

}  // namespace core
