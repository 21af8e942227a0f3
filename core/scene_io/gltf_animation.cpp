#include "core/scene_io/gltf_animation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/invalid.h"
#include "core/scene_io/gltf_accessor.h"
#include "core/scene_io/gltf_model.h"
#include "core/scene_io/gltf_nodes.h"

namespace core {
namespace {

struct Track {
  std::vector<float> times;
  std::vector<float> values;  // `width` values per key; three times as many for cubic splines
  std::size_t width = 0;
  std::string interpolation;
};

// The key at or before `time`, and the position between it and the next, in [0, 1].
struct KeyInterval {
  std::size_t key = 0;
  float fraction = 0;
  float duration = 0;
};

KeyInterval find_interval(const std::vector<float>& times, double time) {
  const auto after = std::upper_bound(times.begin(), times.end(), time, [](double t, float key) {
    return t < static_cast<double>(key);
  });
  if (after == times.begin()) {
    return {0, 0, 0};
  }
  const auto key = static_cast<std::size_t>(after - times.begin()) - 1;
  if (after == times.end()) {
    return {key, 0, 0};
  }
  const float duration = times[key + 1] - times[key];
  const double since = time - static_cast<double>(times[key]);
  return {key, static_cast<float>(since / static_cast<double>(duration)), duration};
}

// Spherical interpolation along the shorter arc, glTF 2.0 appendix C.4.
std::vector<float> slerp(const float* a, const float* b, float t) {
  float d = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const float sign = d < 0 ? -1.0F : 1.0F;
  d = std::min(std::abs(d), 1.0F);
  const float angle = std::acos(d);
  const float s = std::sin(angle);
  // For nearly equal rotations uses linear interpolation.
  const float wa = s > 1e-4F ? std::sin((1 - t) * angle) / s : 1 - t;
  const float wb = (s > 1e-4F ? std::sin(t * angle) / s : t) * sign;
  std::vector<float> out(4);
  for (std::size_t i = 0; i < 4; ++i) {
    out[i] = wa * a[i] + wb * b[i];
  }
  return out;
}

std::vector<float> sample(const Track& track, double time, bool is_rotation) {
  const KeyInterval interval = find_interval(track.times, time);
  const std::size_t w = track.width;
  const float t = interval.fraction;
  if (track.interpolation == "CUBICSPLINE") {
    // Each key holds in-tangent, value, out-tangent; appendix C.5.
    const float* key = track.values.data() + interval.key * 3 * w;
    std::vector<float> out(key + w, key + 2 * w);
    if (interval.duration > 0) {
      const float* next = key + 3 * w;
      const float t2 = t * t;
      const float t3 = t2 * t;
      for (std::size_t i = 0; i < w; ++i) {
        out[i] = (2 * t3 - 3 * t2 + 1) * key[w + i] +
                 interval.duration * (t3 - 2 * t2 + t) * key[2 * w + i] +
                 (-2 * t3 + 3 * t2) * next[w + i] + interval.duration * (t3 - t2) * next[i];
      }
    }
    return out;
  }
  const float* key = track.values.data() + interval.key * w;
  if (track.interpolation == "STEP" || !(interval.duration > 0)) {
    return {key, key + w};
  }
  const float* next = key + w;
  if (is_rotation) {
    return slerp(key, next, t);
  }
  std::vector<float> out(w);
  for (std::size_t i = 0; i < w; ++i) {
    out[i] = (1 - t) * key[i] + t * next[i];
  }
  return out;
}

/// Returns whether STEP keys between two times differ from the one that holds at the first.
bool jumps_between(const Track& track, double first, double last) {
  const std::size_t from = find_interval(track.times, first).key;
  const std::size_t to = find_interval(track.times, last).key;
  const auto at = [&track](std::size_t key) {
    return std::span(track.values).subspan(key * track.width, track.width);
  };
  bool out = false;
  for (std::size_t key = from + 1; key <= to; ++key) {
    out = out || !std::ranges::equal(at(key), at(from));
  }
  return out;
}

/// Returns the greatest of the keys' first values.
float greatest_key(const Track& track) {
  const bool is_cubic = track.interpolation == "CUBICSPLINE";
  const std::size_t step = track.width * (is_cubic ? 3 : 1);
  float most = -std::numeric_limits<float>::infinity();
  for (std::size_t i = is_cubic ? track.width : 0; i < track.values.size(); i += step) {
    most = std::max(most, track.values[i]);
  }
  return most;
}

struct SamplerUse {
  int input = -1;
  int output = -1;
  std::string interpolation;
};

Result<Track> read_track(const SamplerUse& sampler, GltfSource& source, std::size_t width,
                         const std::string& where) {
  Track track;
  track.interpolation = sampler.interpolation;
  if (auto status = check_shape(source, sampler.input, {1, 1}, where + "/input"); !status) {
    return status.error();
  }
  auto times = read_floats(source, sampler.input, where + "/input");
  auto values = read_floats(source, sampler.output, where + "/output");
  if (!times || !values) {
    return times ? values.error() : times.error();
  }
  track.times = *std::move(times);
  track.values = *std::move(values);
  if (std::adjacent_find(track.times.begin(), track.times.end(), std::greater_equal<>()) !=
      track.times.end()) {
    return invalid(where + "/input", "the times of an animation have to grow from key to key");
  }
  const std::size_t parts = track.times.size() * (track.interpolation == "CUBICSPLINE" ? 3 : 1);
  track.width = width == 0 ? track.values.size() / parts : width;
  if (track.width == 0 || track.values.size() != parts * track.width) {
    return invalid(where + "/output", std::to_string(track.values.size()) + " values do not fit " +
                                          std::to_string(track.times.size()) + " keys");
  }
  return track;
}

Vec4 unit(const std::vector<float>& q) {
  const float squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(squared > 0) || !std::isfinite(squared)) {
    return {0, 0, 0, 1};
  }
  const float scale = 1 / std::sqrt(squared);
  return {q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale};
}

void put(AnimatedNode& node, const std::string& path, const std::vector<float>& v) {
  if (path == "translation") {
    node.translation = Vec3{v[0], v[1], v[2]};
  } else if (path == "scale") {
    node.scale = Vec3{v[0], v[1], v[2]};
  } else if (path == "rotation") {
    node.rotation = unit(v);
  } else {
    node.weights = v;
  }
}

std::string path_of(const tinygltf::AnimationChannel& channel) {
  return "/nodes/" + std::to_string(channel.target_node) + "/" + channel.target_path;
}

/// Evaluates the animations of a file at one time.
class Player {
 public:
  Player(const tinygltf::Model& model, GltfSource& source, const PlayTime& time,
         GltfRepairs& repairs)
      : model_(model), source_(source), time_(time), repairs_(repairs) {}

  Result<AnimatedMoment> play() {
    for (std::size_t a = 0; a < model_.animations.size(); ++a) {
      if (moves_what_is_taken(a)) {
        repairs_.note("animation_ignored", where_of(a),
                      '"' + model_.animations[a].name +
                          "\" is not played, because an earlier animation moves the same");
        continue;
      }
      const AnimatedMoment before = moment_;
      const std::set<std::string> taken_before = taken_;
      const Status played = play_animation(a);
      if (played) {
        continue;
      }
      if (played.error().code != ErrorCode::kInvalidArgument) {
        return played.error();
      }
      moment_ = before;
      taken_ = taken_before;
      if (auto mended = repairs_.mended("animation_ignored", played.error().where,
                                        played.error().message, "the animation is not played");
          !mended) {
        return mended.error();
      }
    }
    if (jumps_) {
      repairs_.note("shutter", "",
                    "While the shutter is open, parts that animations with STEP keys move keep "
                    "their pose at the opening.");
    }
    return std::move(moment_);
  }

 private:
  static std::string where_of(std::size_t animation) {
    return "/animations/" + std::to_string(animation);
  }

  bool moves_what_is_taken(std::size_t animation) const {
    const auto& channels = model_.animations[animation].channels;
    const auto& pointers = source_.tables().pointers;
    return std::any_of(channels.begin(), channels.end(),
                       [this](const auto& c) { return taken_.contains(path_of(c)); }) ||
           std::any_of(pointers.begin(), pointers.end(), [&](const GltfPointer& p) {
             return p.animation == animation && taken_.contains(p.path);
           });
  }

  Status play_animation(std::size_t a) {
    const tinygltf::Animation& animation = model_.animations[a];
    for (std::size_t c = 0; c < animation.channels.size(); ++c) {
      const tinygltf::AnimationChannel& channel = animation.channels[c];
      const auto sampler = static_cast<std::size_t>(channel.sampler);
      const tinygltf::AnimationSampler& s = animation.samplers[sampler];
      if (auto status = move_node(channel, {s.input, s.output, s.interpolation},
                                  where_of(a) + "/channels/" + std::to_string(c),
                                  where_of(a) + "/samplers/" + std::to_string(sampler));
          !status) {
        return status;
      }
    }
    for (const GltfPointer& pointer : source_.tables().pointers) {
      if (pointer.animation != a) {
        continue;
      }
      if (auto status = set_value(pointer); !status) {
        return status;
      }
    }
    return ok_status();
  }

  Status take(const std::string& path, const std::string& channel) {
    return taken_.insert(path).second
               ? ok_status()
               : Status(invalid(channel + "/target",
                                "two channels of one animation have the same target"));
  }

  std::vector<float> sampled(const Track& track, bool is_rotation, bool is_boolean = false) {
    moment_.first_seconds =
        std::min(moment_.first_seconds, static_cast<double>(track.times.front()));
    moment_.last_seconds = std::max(moment_.last_seconds, static_cast<double>(track.times.back()));
    if (track.interpolation != "STEP" || is_boolean) {
      return sample(track, time_.seconds, is_rotation);
    }
    jumps_ = jumps_ || jumps_between(track, time_.opening_seconds, time_.closing_seconds);
    return sample(track, time_.opening_seconds, is_rotation);
  }

  Status move_node(const tinygltf::AnimationChannel& channel, const SamplerUse& sampler,
                   const std::string& where, const std::string& sampler_where) {
    const std::string& path = channel.target_path;
    const bool rotation = path == "rotation";
    if (!rotation && path != "translation" && path != "scale" && path != "weights") {
      repairs_.note("animation_ignored", where, "target \"" + path + "\" is not animated");
      return ok_status();
    }
    if (auto status = take(path_of(channel), where); !status) {
      return status;
    }
    const std::size_t width = rotation ? 4 : (path == "weights" ? 0 : 3);
    auto track = read_track(sampler, source_, width, sampler_where);
    if (!track) {
      return track.error();
    }
    if (rotation && track->interpolation != "CUBICSPLINE") {
      note_lengths(track->values, sampler_where + "/output");
    }
    put(moment_.nodes[channel.target_node], path, sampled(*track, rotation));
    return ok_status();
  }

  void note_lengths(const std::vector<float>& rotations, const std::string& where) {
    const std::size_t others = others_than_unit<4>(rotations);
    if (others > 0) {
      repairs_.note("normalized", where,
                    std::to_string(others) +
                        " rotations are not of unit length; the result is "
                        "normalised");
    }
  }

  Status set_value(const GltfPointer& pointer) {
    const std::string where =
        where_of(pointer.animation) + "/channels/" + std::to_string(pointer.channel);
    if (auto status = take(pointer.path, where); !status) {
      return status;
    }
    const int rows = std::max(1, static_cast<int>(pointer.width));
    if (auto status = check_shape(source_, pointer.output, {rows, 1}, where); !status) {
      return status;
    }
    auto track = read_track({pointer.input, pointer.output, pointer.interpolation}, source_,
                            pointer.width, where);
    if (!track) {
      return track.error();
    }
    AnimatedValue value = {pointer.path, sampled(*track, pointer.is_rotation, pointer.is_boolean),
                           pointer.is_boolean, pointer.is_array};
    for (float& v : value.values) {
      if (std::isnan(v)) {
        return invalid(where, "the animated value is not a number");
      }
      v = std::clamp(v, pointer.min, pointer.max);
    }
    moment_.values.push_back(std::move(value));
    note_lights(pointer.path, greatest_key(*track));
    return ok_status();
  }

  /// Lights that are faded or hidden at this time are lights of the scene. most: of the keys.
  void note_lights(const std::string& path, float most) {
    if (path.ends_with("/extensions/KHR_node_visibility/visible")) {
      const int node = std::stoi(path.substr(std::string_view("/nodes/").size()));
      moment_.nodes[node].is_shown_once =
          most > 0 || is_shown(model_.nodes[static_cast<std::size_t>(node)]);
    } else if (path.ends_with("/KHR_materials_emissive_strength/emissiveStrength")) {
      const auto material = std::stoul(path.substr(std::string_view("/materials/").size()));
      const tinygltf::Value* const own =
          find_extension(model_.materials[material].extensions, "KHR_materials_emissive_strength");
      const float at_rest = own == nullptr ? 1 : value_number(*own, "emissiveStrength", 1);
      moment_.has_emissive_strength = moment_.has_emissive_strength || std::max(most, at_rest) > 1;
    }
  }

  const tinygltf::Model& model_;
  GltfSource& source_;
  PlayTime time_;
  GltfRepairs& repairs_;
  bool jumps_ = false;  ///< while the shutter is open
  std::set<std::string> taken_;
  AnimatedMoment moment_;
};

}  // namespace

Result<AnimatedMoment> evaluate_animations(const tinygltf::Model& model, GltfSource& source,
                                           const PlayTime& time, GltfRepairs& repairs) {
  return Player(model, source, time, repairs).play();
}

}  // namespace core
