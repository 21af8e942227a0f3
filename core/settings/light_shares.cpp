#include "core/settings/light_shares.h"

#include <array>
#include <charconv>
#include <string>

namespace core {
namespace {

constexpr std::array kLayerPatterns = {
    LayerPattern{"irradiance",
                 "Irradiance on the first surface, W/m2 of nominal white (683 lm/W), independent "
                 "of its material."},
    LayerPattern{"bounce:N",
                 "Light of paths with N scattering events: 0 is emitted, 1 direct light."},
    LayerPattern{"bounce:N-", "Light of paths with N or more scattering events."},
    LayerPattern{"light:NAME",
                 "Light of a light group: extras.light_group of its nodes, or their names; "
                 "`environment` is the environment light."},
    LayerPattern{"st:S,T",
                 "bdpt: light of paths with S vertices from the light and T from the camera, "
                 "endpoints included, weighted by MIS."},
    LayerPattern{"st:S,T:unweighted", "The same without the MIS weight."},
};

constexpr std::string_view kBounce = "bounce:";
constexpr std::string_view kLight = "light:";
constexpr std::string_view kStrategy = "st:";
constexpr std::string_view kUnweighted = ":unweighted";
constexpr std::string_view kIrradiance = "irradiance";

/// Parses digits without sign and leading zeros; empty if invalid.
std::optional<int> count_of(std::string_view text) {
  constexpr std::size_t kDigitsMost = 6;
  if (text.empty() || text.size() > kDigitsMost || (text.size() > 1 && text.front() == '0')) {
    return std::nullopt;
  }
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  return is_whole && value >= 0 ? std::optional(value) : std::nullopt;
}

/// Parses "S,T"; the camera has at least one vertex, and a path two.
std::optional<SubpathLengths> lengths_of(std::string_view text) {
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos) {
    return std::nullopt;
  }
  const auto light = count_of(text.substr(0, comma));
  const auto camera = count_of(text.substr(comma + 1));
  const bool is_path = light && camera && *camera >= 1 && *light + *camera >= 2;
  return is_path ? std::optional(SubpathLengths{*light, *camera}) : std::nullopt;
}

}  // namespace

std::span<const LayerPattern> layer_patterns() { return kLayerPatterns; }

std::optional<LightShare> light_share(std::string_view layer) {
  LightShare share{.layer = std::string(layer), .group = {}, .strategy = {}};
  if (layer.starts_with(kLight) && layer.size() > kLight.size()) {
    share.group = layer.substr(kLight.size());
    return share;
  }
  if (layer == kIrradiance) {
    share.is_irradiance = true;
    return share;
  }
  if (layer.starts_with(kStrategy)) {
    share.is_weighted = !layer.ends_with(kUnweighted);
    std::string_view lengths = layer.substr(kStrategy.size());
    lengths.remove_suffix(share.is_weighted ? 0 : kUnweighted.size());
    share.strategy = lengths_of(lengths);
    return share.strategy ? std::optional(share) : std::nullopt;
  }
  if (!layer.starts_with(kBounce)) {
    return std::nullopt;
  }
  std::string_view number = layer.substr(kBounce.size());
  const bool is_open = number.ends_with('-');
  number.remove_suffix(is_open ? 1 : 0);
  const auto bounce = count_of(number);
  if (!bounce) {
    return std::nullopt;
  }
  share.first_bounce = *bounce;
  if (!is_open) {
    share.last_bounce = *bounce;
  }
  return share;
}

}  // namespace core
