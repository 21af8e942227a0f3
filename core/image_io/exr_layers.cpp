#include "core/image_io/exr_layers.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "core/base/text.h"

namespace core {
namespace {

constexpr std::size_t kListedMax = 20;
constexpr std::size_t kNameShown = 60;

struct Layer {
  std::string name;
  std::size_t part = 0;
  std::vector<int> channels;
  std::vector<std::string> letters;  ///< of the channels, in lower case

  /// Returns the channel of one of two names, or -1.
  int find(std::string_view letter, std::string_view word) const {
    const auto at = std::find_if(letters.begin(), letters.end(), [&](const std::string& each) {
      return each == letter || each == word;
    });
    return at == letters.end() ? -1 : channels[static_cast<std::size_t>(at - letters.begin())];
  }
  bool has(std::string_view letter) const { return find(letter, letter) >= 0; }

  /// Returns R G B or Y, with A if there is one; empty if the layer has neither.
  std::vector<int> picture(bool grey) const {
    // X, Y and Z are the axes of a vector; Y with RY and BY is luminance, mostly subsampled.
    const bool is_grey = has("y") && !has("x") && !has("ry") && !has("by");
    std::vector<int> found =
        grey ? std::vector{is_grey ? find("y", "y") : -1}
             : std::vector{find("r", "red"), find("g", "green"), find("b", "blue")};
    if (std::find(found.begin(), found.end(), -1) != found.end()) {
      return {};
    }
    if (const int alpha = find("a", "alpha"); alpha >= 0) {
      found.push_back(alpha);
    }
    return found;
  }
};

/// Names of the picture, the most likely first. A name matches at the end of the layer's, behind
/// dots.
constexpr std::array<std::string_view, 6> kNames = {
    "rgba", "composite.combined", "combined", "beauty", "view", "rgb"};

std::size_t rank_of(const Layer& layer) {
  if (layer.name.empty()) {
    return 0;
  }
  const std::string name = "." + in_lower_case(layer.name);
  const auto* const found = std::find_if(kNames.begin(), kNames.end(), [&](std::string_view each) {
    return name.ends_with("." + std::string(each));
  });
  return 1 + static_cast<std::size_t>(found - kNames.begin());
}

std::vector<Layer> layers_of(const std::vector<ExrPart>& parts) {
  std::vector<Layer> layers;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const std::size_t first = layers.size();
    for (std::size_t c = 0; c < parts[p].channels.size(); ++c) {
      const std::string& channel = parts[p].channels[c];
      const std::size_t dot = channel.rfind('.');
      const std::string of_part = parts.size() > 1 ? parts[p].name : "";
      const std::string name = dot == std::string::npos ? of_part : channel.substr(0, dot);
      auto layer = std::find_if(layers.begin() + static_cast<std::ptrdiff_t>(first), layers.end(),
                                [&name](const Layer& each) { return each.name == name; });
      if (layer == layers.end()) {
        layers.push_back({name, p, {}, {}});
        layer = layers.end() - 1;
      }
      layer->channels.push_back(static_cast<int>(c));
      layer->letters.push_back(
          in_lower_case(channel.substr(dot == std::string::npos ? 0 : dot + 1)));
    }
  }
  return layers;
}

std::string listed(const std::vector<Layer>& layers, const std::vector<ExrPart>& parts) {
  std::string list;
  for (std::size_t i = 0; i < std::min(layers.size(), kListedMax); ++i) {
    const Layer& layer = layers[i];
    list += (i == 0 ? "" : ", ") +
            (layer.name.empty() ? "(no name)" : layer.name.substr(0, kNameShown)) + ":";
    for (std::size_t c = 0; c < std::min(layer.channels.size(), kListedMax); ++c) {
      const std::string& channel =
          parts[layer.part].channels[static_cast<std::size_t>(layer.channels[c])];
      list += " " + channel.substr(channel.rfind('.') + 1).substr(0, kNameShown);
    }
  }
  return list + (layers.size() > kListedMax
                     ? ", and " + std::to_string(layers.size() - kListedMax) + " more"
                     : "");
}

}  // namespace

Result<ExrPicture> choose_exr_picture(const std::vector<ExrPart>& parts) {
  const std::vector<Layer> layers = layers_of(parts);
  for (const bool grey : {false, true}) {
    std::vector<std::pair<std::size_t, const Layer*>> found;  // rank and layer
    for (const Layer& layer : layers) {
      if (!layer.picture(grey).empty()) {
        found.emplace_back(rank_of(layer), &layer);
      }
    }
    if (found.empty()) {
      continue;
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    if (found.size() == 1 || found[0].first < found[1].first) {
      const Layer& layer = *found.front().second;
      return ExrPicture{layer.part, layer.picture(grey)};
    }
    return Error{ErrorCode::kInvalidArgument,
                 "the EXR has several layers that may be the picture; call it \"rgba\", or give "
                 "its channels no layer. It has " +
                     listed(layers, parts),
                 ""};
  }
  const bool has_chroma = std::any_of(layers.begin(), layers.end(), [](const Layer& layer) {
    return layer.has("ry") && layer.has("by");
  });
  if (layers.size() == 1 && !has_chroma) {
    std::vector<int> channels = layers[0].channels;
    channels.resize(std::min<std::size_t>(channels.size(), 4));
    return ExrPicture{layers[0].part, std::move(channels)};
  }
  return Error{ErrorCode::kInvalidArgument,
               (has_chroma ? "luminance and chroma are not read: no layer" : "no layer") +
                   std::string(" of the EXR has the channels R, G and B, or Y alone. It has ") +
                   listed(layers, parts),
               ""};
}

}  // namespace core
