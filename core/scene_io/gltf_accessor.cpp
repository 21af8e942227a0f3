#include "core/scene_io/gltf_accessor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/invalid.h"

namespace core {
namespace {

template <typename T>
T load(const std::byte* from) noexcept {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

// Converts an integer to float, glTF 2.0 section 3.11: c / 127 clamped to -1, c / 255, and so on.
float load_float(const std::byte* from, ComponentType type, bool normalized) noexcept {
  switch (type) {
    case ComponentType::kI8: {
      const auto v = static_cast<float>(load<std::int8_t>(from));
      return normalized ? std::max(v / 127.0F, -1.0F) : v;
    }
    case ComponentType::kU8: {
      const auto v = static_cast<float>(load<std::uint8_t>(from));
      return normalized ? v / 255.0F : v;
    }
    case ComponentType::kI16: {
      const auto v = static_cast<float>(load<std::int16_t>(from));
      return normalized ? std::max(v / 32767.0F, -1.0F) : v;
    }
    case ComponentType::kU16: {
      const auto v = static_cast<float>(load<std::uint16_t>(from));
      return normalized ? v / 65535.0F : v;
    }
    case ComponentType::kU32:
      return static_cast<float>(load<std::uint32_t>(from));
    case ComponentType::kF32:
      break;
  }
  return load<float>(from);
}

std::uint32_t load_integer(const std::byte* from, ComponentType type) noexcept {
  switch (component_bytes(type)) {
    case 1:
      return load<std::uint8_t>(from);
    case 2:
      return load<std::uint16_t>(from);
    default:
      return load<std::uint32_t>(from);
  }
}

bool is_unsigned(ComponentType type) noexcept {
  return type == ComponentType::kU8 || type == ComponentType::kU16 || type == ComponentType::kU32;
}

struct Layout {
  std::uint64_t offset = 0;
  std::uint64_t stride = 0;
};

// Calls put(element, value, address) for each value of `count` elements.
template <typename Put>
void for_each_value(std::span<const std::byte> view, const GltfAccessor& accessor,
                    std::uint64_t count, Layout layout, const Put& put) {
  const std::uint64_t size = component_bytes(accessor.component);
  const std::uint64_t column = element_bytes(accessor.component, accessor.shape) /
                               static_cast<std::uint64_t>(accessor.shape.columns);
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::byte* element = view.data() + layout.offset + i * layout.stride;
    for (int c = 0; c < accessor.shape.columns; ++c) {
      for (int r = 0; r < accessor.shape.rows; ++r) {
        put(i, static_cast<std::uint64_t>(c * accessor.shape.rows + r),
            element + static_cast<std::uint64_t>(c) * column +
                static_cast<std::uint64_t>(r) * size);
      }
    }
  }
}

// Reads dense values, then replaces sparse ones. `convert` turns an address into a T.
template <typename T, typename Convert>
Result<std::vector<T>> read_all(GltfSource& source, int index, const std::string& where,
                                const Convert& convert) {
  if (const Error* fault = source.tables().fault_of("accessors", index)) {
    return *fault;
  }
  const GltfAccessor& accessor = source.tables().accessors[static_cast<std::size_t>(index)];
  const auto width = static_cast<std::uint64_t>(accessor.shape.values());
  if (accessor.count > source.budget().left()) {
    return Error{ErrorCode::kTooLarge,
                 std::to_string(accessor.count) + " elements are more than fit in memory", where};
  }
  // Counts twice: callers make vectors of the numbers.
  if (auto status = source.budget().take(2 * accessor.count * width * sizeof(T), where); !status) {
    return status.error();
  }
  std::vector<T> values(accessor.count * width);
  const std::uint64_t bytes = element_bytes(accessor.component, accessor.shape);
  if (accessor.view >= 0) {
    const std::uint64_t stride =
        source.tables().views[static_cast<std::size_t>(accessor.view)].stride;
    auto view = source.view(accessor.view);
    if (!view) {
      return view.error();
    }
    for_each_value(*view, accessor, accessor.count, {accessor.offset, stride == 0 ? bytes : stride},
                   [&](std::uint64_t i, std::uint64_t v, const std::byte* from) {
                     values[i * width + v] = convert(from, accessor);
                   });
  }
  if (!accessor.sparse) {
    return values;
  }
  const GltfSparse& sparse = *accessor.sparse;
  auto indices = source.view(sparse.indices_view);
  auto substitutes = source.view(sparse.values_view);
  if (!indices || !substitutes) {
    return indices ? substitutes.error() : indices.error();
  }
  std::vector<std::uint32_t> places(sparse.count);
  const std::uint64_t index_bytes = component_bytes(sparse.indices_type);
  for (std::uint64_t i = 0; i < sparse.count; ++i) {
    places[i] = load_integer(indices->data() + sparse.indices_offset + i * index_bytes,
                             sparse.indices_type);
    if (places[i] >= accessor.count) {
      return invalid("/accessors/" + std::to_string(index) + "/sparse/indices",
                     "sparse index " + std::to_string(places[i]) + " is not below the count of " +
                         std::to_string(accessor.count));
    }
  }
  for_each_value(*substitutes, accessor, sparse.count, {sparse.values_offset, bytes},
                 [&](std::uint64_t i, std::uint64_t v, const std::byte* from) {
                   values[places[i] * width + v] = convert(from, accessor);
                 });
  return values;
}

}  // namespace

Status check_shape(const GltfSource& source, int accessor, ElementShape shape,
                   const std::string& where) {
  if (const Error* fault = source.tables().fault_of("accessors", accessor)) {
    return *fault;
  }
  const ElementShape seen = source.tables().accessors[static_cast<std::size_t>(accessor)].shape;
  if (seen.rows != shape.rows || seen.columns != shape.columns) {
    return invalid(where, "accessor " + std::to_string(accessor) + " has elements of " +
                              std::to_string(seen.values()) + " values; " +
                              std::to_string(shape.values()) + " are needed here");
  }
  return ok_status();
}

Result<std::vector<float>> read_floats(GltfSource& source, int accessor, const std::string& where,
                                       GltfRepairs* repairs) {
  auto values =
      read_all<float>(source, accessor, where, [](const std::byte* from, const GltfAccessor& a) {
        return load_float(from, a.component, a.normalized);
      });
  if (!values) {
    return values;
  }
  const auto is_not_finite = [](float v) { return !std::isfinite(v); };
  const auto count = std::count_if(values->begin(), values->end(), is_not_finite);
  if (count == 0) {
    return values;
  }
  std::string fault = "accessor " + std::to_string(accessor) + " holds a value that is not finite";
  if (repairs == nullptr) {
    return invalid(where, std::move(fault));
  }
  std::replace_if(values->begin(), values->end(), is_not_finite, 0.0F);
  const auto status = repairs->mended("not_finite", where, std::move(fault),
                                      std::to_string(count) + " values count as 0");
  return status ? std::move(values) : Result<std::vector<float>>(status.error());
}

Result<std::vector<std::uint32_t>> read_integers(GltfSource& source, int accessor,
                                                 const std::string& where) {
  if (const Error* fault = source.tables().fault_of("accessors", accessor)) {
    return *fault;
  }
  const ComponentType type =
      source.tables().accessors[static_cast<std::size_t>(accessor)].component;
  if (!is_unsigned(type)) {
    return invalid(where,
                   "accessor " + std::to_string(accessor) + " does not hold unsigned integers");
  }
  return read_all<std::uint32_t>(
      source, accessor, where,
      [](const std::byte* from, const GltfAccessor& a) { return load_integer(from, a.component); });
}

}  // namespace core
