// Any bytes as a glTF file: no crash, no read beyond the end, and accepted scenes can be built.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>

#include "core/scene/scene.h"
#include "core/scene_io/gltf_load.h"
#include "core/scene_io/split_gltf.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  core::GltfOptions options;
  options.limits.triangles_max = 100'000;
  options.limits.instances_max = 1'000;
  options.limits.decoded_bytes_max = std::size_t{64} << 20U;
  options.limits.image_side_max = 1024;
  const std::span bytes(data, size);
  const auto none = [](std::string_view) { return core::SharedBytes(); };
  auto description = core::load_gltf(std::as_bytes(bytes), none, options);
  if (description) {
    const auto scene = core::Scene::build(*std::move(description), 1);
    static_cast<void>(scene);
  }
  if (const auto split = core::split_gltf({reinterpret_cast<const char*>(data), size},
                                          /*turns_z_up=*/true, options.limits)) {
    static_cast<void>(core::join_buffers(*split));
  }
  return 0;
}
