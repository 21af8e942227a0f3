#include "core/scene_io/gltf_tables.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/base/invalid.h"

namespace core {
namespace {

// All numbers are integers below 2^53, so sums of two cannot overflow.
bool fits(std::uint64_t offset, std::uint64_t bytes, std::uint64_t whole) {
  return offset <= whole && bytes <= whole - offset;
}

std::string span_text(std::uint64_t offset, std::uint64_t bytes) {
  return "bytes " + std::to_string(offset) + " to " + std::to_string(offset + bytes);
}

Status check_buffer(const GltfTables& tables, std::size_t i, const GltfContainer& container) {
  const GltfBuffer& buffer = tables.buffers[i];
  if (buffer.uri || buffer.is_meshopt_fallback) {
    return ok_status();
  }
  if (i != 0 || !container.has_bin) {
    return invalid(pointer_of("buffers", i),
                   "the buffer has neither a uri nor the binary chunk of a GLB");
  }
  return ok_status();
}

Status check_meshopt(const GltfTables& tables, const GltfView& view, const std::string& where) {
  const GltfMeshopt& m = *view.meshopt;
  const GltfBuffer& source = tables.buffers[static_cast<std::size_t>(m.buffer)];
  if (source.is_meshopt_fallback) {
    return invalid(where + "/buffer", "compressed data in a buffer marked as fallback");
  }
  if (!fits(m.offset, m.bytes, source.bytes)) {
    return invalid(where, span_text(m.offset, m.bytes) + " lie outside of the buffer of " +
                              std::to_string(source.bytes) + " bytes");
  }
  if (m.mode == MeshoptMode::kAttributes) {
    if (m.stride % 4 != 0) {
      return invalid(where + "/byteStride", std::to_string(m.stride) + " is not a multiple of 4");
    }
  } else if (m.stride != 2 && m.stride != 4) {
    return invalid(where + "/byteStride", std::to_string(m.stride) + " is neither 2 nor 4");
  }
  if (m.mode == MeshoptMode::kTriangles && m.count % 3 != 0) {
    return invalid(where + "/count", std::to_string(m.count) + " is not a multiple of 3");
  }
  if (m.mode != MeshoptMode::kAttributes && m.filter != MeshoptFilter::kNone) {
    return invalid(where + "/filter", "indices cannot have a filter");
  }
  if (m.filter == MeshoptFilter::kOctahedral && m.stride != 4 && m.stride != 8) {
    return invalid(where + "/byteStride", "an octahedral filter takes 4 or 8 bytes");
  }
  if (m.filter == MeshoptFilter::kQuaternion && m.stride != 8) {
    return invalid(where + "/byteStride", "a quaternion filter takes 8 bytes");
  }
  // count < 2^53 / 256 keeps the product exact; more than the view holds is refused anyway.
  if (m.count > view.bytes || m.count * m.stride > view.bytes) {
    return invalid(where + "/count",
                   std::to_string(m.count) + " elements of " + std::to_string(m.stride) +
                       " bytes do not fit in the view of " + std::to_string(view.bytes));
  }
  return ok_status();
}

Status check_view(GltfTables& tables, std::size_t i, GltfRepairs& repairs) {
  GltfView& view = tables.views[i];
  if (view.buffer < 0) {
    return ok_status();  // left out
  }
  const GltfBuffer& buffer = tables.buffers[static_cast<std::size_t>(view.buffer)];
  if (!fits(view.offset, view.bytes, buffer.bytes)) {
    std::string fault = span_text(view.offset, view.bytes) + " lie outside of the buffer of " +
                        std::to_string(buffer.bytes) + " bytes";
    if (view.offset >= buffer.bytes || view.offset + view.bytes > buffer.bytes + kPaddingMax) {
      return invalid(pointer_of("bufferViews", i), std::move(fault));
    }
    view.bytes = buffer.bytes - view.offset;
    if (auto status = repairs.mended("padding", pointer_of("bufferViews", i), std::move(fault),
                                     "the view ends with the buffer");
        !status) {
      return status;
    }
  }
  if (buffer.is_meshopt_fallback && !buffer.uri && !view.meshopt) {
    return invalid(pointer_of("bufferViews", i), "the view reads a buffer without content");
  }
  return view.meshopt
             ? check_meshopt(tables, view,
                             pointer_of("bufferViews", i) + "/extensions/EXT_meshopt_compression")
             : ok_status();
}

struct Elements {
  std::uint64_t offset = 0;
  std::uint64_t count = 0;
  std::uint64_t bytes = 0;   // of one element
  std::uint64_t stride = 0;  // between elements
};

Status check_elements(const GltfView& view, const Elements& e, const std::string& where) {
  const bool fit =
      e.count <= view.bytes && fits(e.offset, (e.count - 1) * e.stride + e.bytes, view.bytes);
  if (!fit) {
    return invalid(where, std::to_string(e.count) + " elements of " + std::to_string(e.bytes) +
                              " bytes at stride " + std::to_string(e.stride) + " and offset " +
                              std::to_string(e.offset) + " do not fit in the view of " +
                              std::to_string(view.bytes) + " bytes");
  }
  return ok_status();
}

Status check_accessor(const GltfTables& tables, std::size_t i) {
  const GltfAccessor& accessor = tables.accessors[i];
  const std::uint64_t bytes = element_bytes(accessor.component, accessor.shape);
  if (accessor.count == 0) {
    return ok_status();  // left out
  }
  if (accessor.view >= 0 && tables.fault_of("bufferViews", accessor.view) == nullptr) {
    const GltfView& view = tables.views[static_cast<std::size_t>(accessor.view)];
    if (view.stride != 0 && view.stride < bytes) {
      return invalid(
          pointer_of("bufferViews", static_cast<std::size_t>(accessor.view)) + "/byteStride",
          std::to_string(view.stride) + " is less than an element of accessor " +
              std::to_string(i) + ", " + std::to_string(bytes) + " bytes");
    }
    const Elements elements = {accessor.offset, accessor.count, bytes,
                               view.stride == 0 ? bytes : view.stride};
    if (auto status = check_elements(view, elements, pointer_of("accessors", i)); !status) {
      return status;
    }
  }
  if (!accessor.sparse) {
    return ok_status();
  }
  const GltfSparse& sparse = *accessor.sparse;
  const std::string where = pointer_of("accessors", i) + "/sparse";
  if (sparse.count > accessor.count) {
    return invalid(where + "/count", std::to_string(sparse.count) +
                                         " is more than the accessor's " +
                                         std::to_string(accessor.count));
  }
  if (tables.fault_of("bufferViews", sparse.indices_view) != nullptr ||
      tables.fault_of("bufferViews", sparse.values_view) != nullptr) {
    return ok_status();  // an error where the accessor is read
  }
  const std::uint64_t index_bytes = component_bytes(sparse.indices_type);
  if (auto status = check_elements(tables.views[static_cast<std::size_t>(sparse.indices_view)],
                                   {sparse.indices_offset, sparse.count, index_bytes, index_bytes},
                                   where + "/indices");
      !status) {
    return status;
  }
  return check_elements(tables.views[static_cast<std::size_t>(sparse.values_view)],
                        {sparse.values_offset, sparse.count, bytes, bytes}, where + "/values");
}

Status check_image(GltfTables& tables, std::size_t i, GltfRepairs& repairs) {
  GltfImage& image = tables.images[i];
  if (image.uri && image.view >= 0) {
    image.uri.reset();
    return repairs.mended("left_out", pointer_of("images", i),
                          "an image has a uri or a bufferView, not both", "its uri is ignored");
  }
  return image.uri || image.view >= 0
             ? ok_status()
             : Status(invalid(pointer_of("images", i),
                              "the image has neither a uri nor a bufferView"));
}

Status check_profile(const GltfTables& tables, std::size_t i) {
  const GltfProfile& profile = tables.profiles[i];
  if (profile.uri.has_value() == (profile.view >= 0)) {
    return invalid(pointer_of("extensions/EXT_lights_ies/lights", i),
                   profile.uri ? "a light profile has a uri or a bufferView, not both"
                               : "the light profile has neither a uri nor a bufferView");
  }
  return ok_status();
}

/// Runs `check` for every part of an array; leaves out those with faults where that is possible.
template <typename Check>
Status check_all(GltfTables& tables, const char* array, std::size_t count, GltfRepairs& repairs,
                 const Check& check) {
  const bool is_deferred =
      std::string_view(array) != "buffers" && std::string_view(array) != "light profiles";
  for (std::size_t i = 0; i < count; ++i) {
    if (tables.fault_of(array, static_cast<int>(i)) != nullptr) {
      continue;
    }
    if (const Status status = check(i); !status) {
      if (repairs.is_strict() || (!is_deferred && tables.uses(array, i))) {
        return status;
      }
      leave_out(tables, {array, i}, status.error(), repairs);
    }
  }
  return ok_status();
}

}  // namespace

const Error* GltfTables::fault_of(const char* array, int index) const {
  if (left_out.empty()) {
    return nullptr;
  }
  const auto found = left_out.find({array, static_cast<std::size_t>(index)});
  return found == left_out.end() ? nullptr : &found->second;
}

std::uint64_t needed_bytes(const GltfTables& tables, std::size_t buffer) {
  std::vector<bool> has_accessor(tables.views.size(), false);
  std::uint64_t needed = 0;
  const auto is_here = [&](std::size_t view) {
    return tables.views[view].buffer == static_cast<int>(buffer) && !tables.views[view].meshopt;
  };
  for (std::size_t i = 0; i < tables.accessors.size(); ++i) {
    const GltfAccessor& accessor = tables.accessors[i];
    if (accessor.view < 0 || tables.fault_of("accessors", static_cast<int>(i)) != nullptr ||
        !is_here(static_cast<std::size_t>(accessor.view))) {
      continue;
    }
    const GltfView& view = tables.views[static_cast<std::size_t>(accessor.view)];
    has_accessor[static_cast<std::size_t>(accessor.view)] = true;
    const std::uint64_t bytes = element_bytes(accessor.component, accessor.shape);
    const std::uint64_t stride = view.stride == 0 ? bytes : view.stride;
    needed =
        std::max(needed, view.offset + accessor.offset + (accessor.count - 1) * stride + bytes);
  }
  for (std::size_t i = 0; i < tables.views.size(); ++i) {
    const GltfView& view = tables.views[i];
    if (tables.fault_of("bufferViews", static_cast<int>(i)) != nullptr) {
      continue;
    }
    if (view.meshopt && view.meshopt->buffer == static_cast<int>(buffer)) {
      needed = std::max(needed, view.meshopt->offset + view.meshopt->bytes);
    } else if (is_here(i) && !has_accessor[i]) {
      needed = std::max(needed, view.offset + view.bytes);
    }
  }
  return needed;
}

void leave_out(GltfTables& tables, const GltfPart& part, const Error& fault, GltfRepairs& repairs) {
  if (tables.left_out.emplace(part, fault).second) {
    repairs.note("left_out", fault.where, fault.message + "; the part is left out");
  }
}

Status check_tables(GltfTables& tables, const GltfContainer& container, GltfRepairs& repairs) {
  Status status = check_all(tables, "buffers", tables.buffers.size(), repairs,
                            [&](std::size_t i) { return check_buffer(tables, i, container); });
  const auto check = [&](const char* array, std::size_t count, const auto& one) {
    if (status) {
      status = check_all(tables, array, count, repairs, one);
    }
  };
  check("bufferViews", tables.views.size(),
        [&](std::size_t i) { return check_view(tables, i, repairs); });
  check("accessors", tables.accessors.size(),
        [&](std::size_t i) { return check_accessor(tables, i); });
  check("images", tables.images.size(),
        [&](std::size_t i) { return check_image(tables, i, repairs); });
  check("light profiles", tables.profiles.size(),
        [&](std::size_t i) { return check_profile(tables, i); });
  return status;
}

}  // namespace core
