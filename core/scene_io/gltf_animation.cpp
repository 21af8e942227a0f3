#include "core/scene_io/gltf_animation.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "core/scene_io/gltf_accessor.h"

namespace core {
namespace {

Error invalid(std::string where, std::string message) {
  return {ErrorCode::kInvalidArgument, std::move(message), std::move(where)};
}

struct Track {
  std::vector<float> times;
  std::vector<float> values;  // per key `width` values; three times as many for cubic splines
  std::size_t width = 0;
  std::string interpolation;
};

// The key at or before `time`, and how far it is to the next one, in [0, 1].
struct Place {
  std::size_t key = 0;
  float fraction = 0;
  float duration = 0;
};

Place find_place(const std::vector<float>& times, double time) {
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
  // For nearly equal rotations the arc is a straight line.
  const float wa = s > 1e-4F ? std::sin((1 - t) * angle) / s : 1 - t;
  const float wb = (s > 1e-4F ? std::sin(t * angle) / s : t) * sign;
  std::vector<float> out(4);
  for (std::size_t i = 0; i < 4; ++i) {
    out[i] = wa * a[i] + wb * b[i];
  }
  return out;
}

std::vector<float> sample(const Track& track, double time, bool is_rotation) {
  const Place place = find_place(track.times, time);
  const std::size_t w = track.width;
  const float t = place.fraction;
  if (track.interpolation == "CUBICSPLINE") {
    // Each key holds in-tangent, value, out-tangent; appendix C.5.
    const float* key = track.values.data() + place.key * 3 * w;
    std::vector<float> out(key + w, key + 2 * w);
    if (place.duration > 0) {
      const float* next = key + 3 * w;
      const float t2 = t * t;
      const float t3 = t2 * t;
      for (std::size_t i = 0; i < w; ++i) {
        out[i] = (2 * t3 - 3 * t2 + 1) * key[w + i] +
                 place.duration * (t3 - 2 * t2 + t) * key[2 * w + i] +
                 (-2 * t3 + 3 * t2) * next[w + i] + place.duration * (t3 - t2) * next[i];
      }
    }
    return out;
  }
  const float* key = track.values.data() + place.key * w;
  if (track.interpolation == "STEP" || !(place.duration > 0)) {
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

Result<Track> read_track(const tinygltf::AnimationSampler& sampler, GltfSource& source,
                         std::size_t width, const std::string& where) {
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

// Whether `animation` moves anything that is in `taken`.
bool moves_any(const tinygltf::Animation& animation,
               const std::set<std::pair<int, std::string>>& taken) {
  return std::any_of(animation.channels.begin(), animation.channels.end(),
                     [&taken](const auto& channel) {
                       return taken.contains({channel.target_node, channel.target_path});
                     });
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

}  // namespace

Result<std::map<int, AnimatedNode>> evaluate_animations(const tinygltf::Model& model,
                                                        GltfSource& source, double time_seconds,
                                                        std::vector<std::string>& warnings) {
  std::map<int, AnimatedNode> nodes;
  std::set<std::pair<int, std::string>> taken;
  for (std::size_t a = 0; a < model.animations.size(); ++a) {
    const tinygltf::Animation& animation = model.animations[a];
    const std::string where = "/animations/" + std::to_string(a);
    if (moves_any(animation, taken)) {
      warnings.push_back(where + ": \"" + animation.name +
                         "\" is not played, because an earlier animation moves the same nodes");
      continue;
    }
    for (std::size_t c = 0; c < animation.channels.size(); ++c) {
      const tinygltf::AnimationChannel& channel = animation.channels[c];
      const std::string& path = channel.target_path;
      const bool rotation = path == "rotation";
      if (!rotation && path != "translation" && path != "scale" && path != "weights") {
        warnings.push_back(where + "/channels/" + std::to_string(c) + ": target \"" + path +
                           "\" is not animated");
        continue;
      }
      if (!taken.insert({channel.target_node, path}).second) {
        return invalid(where + "/channels/" + std::to_string(c) + "/target",
                       "two channels of one animation have the same target");
      }
      const auto sampler = static_cast<std::size_t>(channel.sampler);
      const std::size_t width = rotation ? 4 : (path == "weights" ? 0 : 3);
      auto track = read_track(animation.samplers[sampler], source, width,
                              where + "/samplers/" + std::to_string(sampler));
      if (!track) {
        return track.error();
      }
      put(nodes[channel.target_node], path, sample(*track, time_seconds, rotation));
    }
  }
  return nodes;
}

}  // namespace core
