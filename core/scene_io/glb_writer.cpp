#include "core/scene_io/glb_writer.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/base/check.h"

namespace core {
namespace {

using Json = nlohmann::json;

void append_u32(Bytes& to, std::size_t value) {
  const auto v = static_cast<std::uint32_t>(value);
  const auto* bytes = reinterpret_cast<const std::byte*>(&v);
  to.insert(to.end(), bytes, bytes + sizeof(v));
}

void pad(Bytes& bytes, std::byte with) { bytes.resize((bytes.size() + 3) / 4 * 4, with); }

Json parsed(std::string_view text) {
  Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  CHECK(!json.is_discarded());
  return json;
}

}  // namespace

struct GlbWriter::State {
  Json root = {{"asset", {{"version", "2.0"}, {"generator", "tessera"}}}};
  Bytes bin;

  void complete() {
    if (!root.contains("scenes") && root.contains("nodes")) {
      std::vector<bool> is_child(root["nodes"].size(), false);
      for (const Json& node : root["nodes"]) {
        for (const Json& child : node.value("children", Json::array())) {
          is_child[child.get<std::size_t>()] = true;
        }
      }
      Json roots = Json::array();
      for (std::size_t i = 0; i < is_child.size(); ++i) {
        if (!is_child[i]) {
          roots.push_back(i);
        }
      }
      root["scenes"] = Json::array({{{"nodes", roots}}});
      root["scene"] = 0;
    }
    pad(bin, std::byte{0});
  }
};

GlbWriter::GlbWriter() : state_(std::make_unique<State>()) {}
GlbWriter::~GlbWriter() = default;

int GlbWriter::add(std::string_view collection, std::string_view json) {
  Json& array = state_->root[std::string(collection)];
  array.push_back(parsed(json));
  return static_cast<int>(array.size()) - 1;
}

void GlbWriter::set(std::string_view member, std::string_view json) {
  state_->root[std::string(member)] = parsed(json);
}

void GlbWriter::use_extension(std::string_view name) {
  Json& used = state_->root["extensionsUsed"];
  const Json value = std::string(name);
  if (std::find(used.begin(), used.end(), value) == used.end()) {
    used.push_back(value);
  }
}

int GlbWriter::add_view(std::span<const std::byte> bytes, std::string_view more) {
  pad(state_->bin, std::byte{0});
  Json view = {{"buffer", 0}, {"byteOffset", state_->bin.size()}, {"byteLength", bytes.size()}};
  view.merge_patch(parsed(more));
  state_->bin.insert(state_->bin.end(), bytes.begin(), bytes.end());
  return add("bufferViews", view.dump());
}

int GlbWriter::add_accessor(std::span<const std::byte> bytes, int component_type,
                            std::string_view type, std::size_t count, std::string_view more) {
  Json accessor = {{"bufferView", add_view(bytes)},
                   {"componentType", component_type},
                   {"type", std::string(type)},
                   {"count", count}};
  accessor.merge_patch(parsed(more));
  return add("accessors", accessor.dump());
}

Bytes GlbWriter::finish() {
  state_->complete();
  if (!state_->bin.empty() && !state_->root.contains("buffers")) {
    state_->root["buffers"] = Json::array({{{"byteLength", state_->bin.size()}}});
  }
  const std::string json = state_->root.dump();
  Bytes text(json.size());
  std::memcpy(text.data(), json.data(), json.size());
  pad(text, std::byte{' '});
  const std::size_t bin_chunk = state_->bin.empty() ? 0 : 8 + state_->bin.size();
  Bytes file;
  file.reserve(20 + text.size() + bin_chunk);
  append_u32(file, 0x46546C67);  // "glTF"
  append_u32(file, 2);
  append_u32(file, 20 + text.size() + bin_chunk);
  append_u32(file, text.size());
  append_u32(file, 0x4E4F534A);  // "JSON"
  file.insert(file.end(), text.begin(), text.end());
  if (bin_chunk > 0) {
    append_u32(file, state_->bin.size());
    append_u32(file, 0x004E4942);  // "BIN\0"
    file.insert(file.end(), state_->bin.begin(), state_->bin.end());
  }
  return file;
}

GlbWriter::Separate GlbWriter::finish_separate(std::string_view bin_uri) {
  state_->complete();
  state_->root["buffers"] =
      Json::array({{{"byteLength", state_->bin.size()}, {"uri", std::string(bin_uri)}}});
  return {state_->root.dump(), state_->bin};
}

}  // namespace core
