/// Backdrop: what camera rays see that meet nothing.
#pragma once

#include <optional>

#include "core/lights/environment.h"
#include "core/settings/settings.h"

namespace core {

class Backdrop {
 public:
  /// environment: as seen; null is black. Must outlive it.
  Backdrop(const BackgroundSettings& settings, const Environment* environment)
      : settings_(settings), environment_(environment) {}

  /// Nothing else than what all rays see?
  bool is_environment() const noexcept { return settings_.type == BackgroundType::kEnvironment; }

  /// Radiance from a direction (unit, world); empty: the picture is transparent there.
  std::optional<Rgb> seen(Vec3 direction_world) const noexcept {
    switch (settings_.type) {
      case BackgroundType::kTransparent:
        return std::nullopt;
      case BackgroundType::kColor:
        return settings_.color;
      case BackgroundType::kBlurred:
        return environment_ != nullptr ? environment_->blurred(direction_world) : Rgb{};
      case BackgroundType::kEnvironment:
        break;
    }
    return environment_ != nullptr ? environment_->background(direction_world) : Rgb{};
  }

 private:
  BackgroundSettings settings_;
  const Environment* environment_;
};

}  // namespace core
