#include "core/scene_io/gltf_pointer.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/base/invalid.h"
#include "core/scene_io/gltf_schema.h"
#include "core/scene_io/gltf_schema_check.h"

namespace core {
namespace {

using Json = GltfJson;

/// Returns the unescaped steps of a JSON pointer (RFC 6901); empty if it is invalid.
std::vector<std::string> steps_of(std::string_view pointer) {
  std::vector<std::string> steps;
  while (pointer.starts_with('/')) {
    const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
    std::string step;
    for (std::size_t i = 1; i < end; ++i) {
      const bool escaped = pointer[i] == '~' && i + 1 < end;
      step += !escaped ? pointer[i] : pointer[i + 1] == '1' ? '/' : '~';
      i += escaped ? 1 : 0;
    }
    steps.push_back(std::move(step));
    pointer.remove_prefix(end);
  }
  return pointer.empty() ? steps : std::vector<std::string>();
}

/// Returns the element of `array` that a step names; null if there is none.
const Json* element(const Json& array, const std::string& step) {
  std::size_t index = 0;
  const auto [end, fault] = std::from_chars(step.data(), step.data() + step.size(), index);
  const bool is_index = fault == std::errc() && end == step.data() + step.size() &&
                        (step.size() == 1 || step[0] != '0');
  return is_index && array.is_array() && index < array.size() ? &array[index] : nullptr;
}

const SchemaMember* find_member(std::string_view schema, std::string_view name) {
  const auto* const members = find_schema(schema);
  if (members == nullptr) {
    return nullptr;
  }
  const auto it = std::find_if(members->begin(), members->end(),
                               [name](const SchemaMember& m) { return m.name == name; });
  return it == members->end() ? nullptr : &*it;
}

/// Follows a pointer through the document and its schemas.
class TargetWalk {
 public:
  enum class Outcome : std::uint8_t { kFound, kMissing, kFixed };

  TargetWalk(const Json& root, const std::vector<std::string>& steps)
      : value_(&root), steps_(steps) {}

  /// Fills width, range and kind of `to` if the target is found.
  Outcome walk(GltfPointer& to) {
    if (steps_.empty() || !may_change()) {
      return Outcome::kFixed;
    }
    while (at_ < steps_.size()) {
      if (const auto outcome = step(to)) {
        return *outcome;
      }
    }
    return Outcome::kFixed;  // ends at an object
  }

 private:
  bool may_change() const {
    const std::string& first = steps_[0];
    const bool lights =
        first == "extensions" && steps_.size() > 1 &&
        (steps_[1] == "KHR_lights_punctual" || steps_[1] == "EXT_lights_image_based");
    return lights || first == "cameras" || first == "materials" || first == "meshes" ||
           first == "nodes";
  }

  std::optional<Outcome> step(GltfPointer& to) {
    const std::string& name = steps_[at_];
    if (name == "extensions" && at_ + 1 < steps_.size()) {
      schema_ += "/" + steps_[at_ + 1];
      if (find_schema(schema_) == nullptr) {
        return Outcome::kFixed;
      }
      return enter("extensions") && enter(steps_[at_]) ? std::nullopt
                                                       : std::optional(Outcome::kMissing);
    }
    const SchemaMember* const member = find_member(schema_, name);
    if (member == nullptr) {
      return Outcome::kFixed;
    }
    if (member->kind == JsonKind::kObject || member->kind == JsonKind::kObjects) {
      schema_ = member->child;
      if (!enter(name)) {
        return Outcome::kMissing;
      }
      return member->kind == JsonKind::kObject || enter_element()
                 ? std::nullopt
                 : std::optional(Outcome::kMissing);
    }
    return end_at(*member, to);
  }

  bool enter(const std::string& name) {
    const auto it = value_->find(name);
    if (it == value_->end()) {
      return false;
    }
    value_ = &*it;
    ++at_;
    return true;
  }

  bool enter_element() {
    value_ = at_ < steps_.size() ? element(*value_, steps_[at_]) : nullptr;
    ++at_;
    return value_ != nullptr;
  }

  Outcome end_at(const SchemaMember& member, GltfPointer& to) {
    const bool is_visibility = schema_ == "node/KHR_node_visibility";
    const bool numbers = member.kind == JsonKind::kNumbers && member.name != "matrix";
    const bool single =
        member.kind == JsonKind::kNumber || (member.kind == JsonKind::kBoolean && is_visibility);
    const std::size_t left = steps_.size() - at_ - 1;
    if ((!numbers && !single) || left > (numbers ? 1U : 0U)) {
      return Outcome::kFixed;
    }
    constexpr auto kMax = static_cast<double>(std::numeric_limits<float>::max());
    to.min = static_cast<float>(std::max(member.min, -kMax));
    to.max = static_cast<float>(std::min(member.max, kMax));
    to.is_boolean = member.kind == JsonKind::kBoolean;
    to.is_array = numbers && left == 0;
    const bool fixed_count = member.count_min == member.count_max;
    to.width = !to.is_array ? 1 : fixed_count ? member.count_min : 0;
    to.is_rotation = to.width == 4 && member.name == "rotation";
    if (left == 0) {
      return Outcome::kFound;
    }
    return enter(steps_[at_]) && enter_element() ? Outcome::kFound : Outcome::kMissing;
  }

  const Json* value_;
  const std::vector<std::string>& steps_;
  std::size_t at_ = 0;
  std::string schema_ = "root";
};

bool moves_a_node(const std::vector<std::string>& steps) {
  return steps.size() == 3 && steps[0] == "nodes" &&
         (steps[2] == "translation" || steps[2] == "rotation" || steps[2] == "scale" ||
          steps[2] == "weights");
}

struct Channel {
  Json& json;
  const Json& samplers;
  std::size_t animation = 0;
  std::size_t index = 0;
};

Status read_pointer(const Json& root, const Channel& channel, GltfTables& tables,
                    GltfRepairs& repairs) {
  Json& target = channel.json["target"];
  const std::string where = "/animations/" + std::to_string(channel.animation) + "/channels/" +
                            std::to_string(channel.index);
  const auto extension = target["extensions"].find("KHR_animation_pointer");
  if (target.contains("node") || target["path"] != "pointer") {
    return invalid(where + "/target",
                   "a target with a pointer must have the path \"pointer\" and no node");
  }
  const auto path = extension->at("pointer").get<std::string>();
  const std::string pointer_where = where + "/target/extensions/KHR_animation_pointer/pointer";
  GltfPointer pointer;
  const std::vector<std::string> steps = steps_of(path);
  const auto outcome = TargetWalk(root, steps).walk(pointer);
  if (outcome == TargetWalk::Outcome::kFixed) {
    repairs.note("animation_ignored", where, "target " + shown(Json(path)) + " is not animated");
    return ok_status();
  }
  if (outcome == TargetWalk::Outcome::kMissing) {
    return invalid(pointer_where, shown(Json(path)) + " names nothing in the file");
  }
  const auto sampler = channel.json["sampler"].get<std::size_t>();
  if (sampler >= channel.samplers.size()) {
    return invalid(where + "/sampler", std::to_string(sampler) + " names none of the " +
                                           std::to_string(channel.samplers.size()) + " samplers");
  }
  if (moves_a_node(steps)) {
    target = {{"node", std::stoi(steps[1])}, {"path", steps[2]}};
    return ok_status();
  }
  const Json& s = channel.samplers[sampler];
  pointer.animation = channel.animation;
  pointer.channel = channel.index;
  pointer.input = s.at("input").get<int>();
  pointer.output = s.at("output").get<int>();
  pointer.interpolation = s.value("interpolation", std::string("LINEAR"));
  pointer.path = path;
  const GltfAccessor& output = tables.accessors[static_cast<std::size_t>(pointer.output)];
  if (pointer.is_boolean &&
      (pointer.interpolation != "STEP" || output.component != ComponentType::kU8)) {
    return invalid(pointer_where,
                   "a boolean must be animated by unsigned bytes with STEP interpolation");
  }
  tables.pointers.push_back(std::move(pointer));
  return ok_status();
}

}  // namespace

Status read_pointers(GltfJson& root, GltfTables& tables, GltfRepairs& repairs) {
  const auto animations = root.find("animations");
  for (std::size_t a = 0; animations != root.end() && a < animations->size(); ++a) {
    Json& animation = (*animations)[a];
    Json& channels = animation["channels"];
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const Json& target = channels[c]["target"];
      const auto extensions = target.find("extensions");
      if (extensions == target.end() || !extensions->contains("KHR_animation_pointer")) {
        continue;
      }
      const auto status =
          read_pointer(root, {channels[c], animation["samplers"], a, c}, tables, repairs);
      if (status) {
        continue;
      }
      channels[c]["target"].erase("node");  // so that nothing plays it
      if (auto mended = repairs.mended("animation_ignored", status.error().where,
                                       status.error().message, "the channel is not played");
          !mended) {
        return mended;
      }
    }
  }
  return ok_status();
}

std::string with_values(const std::string& model_json, std::span<const AnimatedValue> values) {
  Json root = Json::parse(model_json);
  for (const AnimatedValue& value : values) {
    Json& member = root[Json::json_pointer(value.path)];
    if (value.is_boolean) {
      member = value.values.at(0) != 0;
    } else if (value.is_array) {
      member = value.values;
    } else {
      member = value.values.at(0);
    }
  }
  return root.dump();
}

}  // namespace core
