#include <array>
#include <charconv>

#include "core/settings/registry.h"

namespace core {
namespace {

constexpr std::array kLayerPatterns = {
    LayerPattern{"bounce:N",
                 "Light of paths with N scatterings: 0 is emitted, 1 direct light; `bounce:N-` of "
                 "those with N and more."},
    LayerPattern{"light:NAME",
                 "Light of a group of lights: extras.light_group of their nodes, or their names; "
                 "`environment` is the sky's."},
};

constexpr std::string_view kBounce = "bounce:";
constexpr std::string_view kLight = "light:";

/// Digits without a sign or zeros in front; empty: it is none.
std::optional<int> bounce_of(std::string_view text) {
  constexpr std::size_t kDigitsMost = 6;
  if (text.empty() || text.size() > kDigitsMost || (text.size() > 1 && text.front() == '0')) {
    return std::nullopt;
  }
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  return is_whole && value >= 0 ? std::optional(value) : std::nullopt;
}

}  // namespace

std::span<const LayerPattern> layer_patterns() { return kLayerPatterns; }

std::optional<LightShare> light_share(std::string_view layer) {
  LightShare share{.layer = std::string(layer), .group = {}};
  if (layer.starts_with(kLight) && layer.size() > kLight.size()) {
    share.group = layer.substr(kLight.size());
    return share;
  }
  if (!layer.starts_with(kBounce)) {
    return std::nullopt;
  }
  std::string_view number = layer.substr(kBounce.size());
  const bool is_open = number.ends_with('-');
  number.remove_suffix(is_open ? 1 : 0);
  const auto bounce = bounce_of(number);
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
