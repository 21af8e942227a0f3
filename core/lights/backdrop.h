/// Backdrop: the radiance of camera rays that leave the scene.
///
/// With through_glass also of camera paths that have only passed clear surfaces (core/transport/
/// vertex.h): refraction bends them, and the page behind a transparent image shows unbent, as with
/// Cycles' transparent glass. Their environment light, also that of light samples, is left out.
#pragma once

#include <optional>

#include "core/lights/environment.h"
#include "core/settings/settings.h"

namespace core {

class Backdrop {
 public:
  /// environment: as seen by the camera; null is black. Must outlive it.
  Backdrop(const BackgroundSettings& settings, const Environment* environment)
      : settings_(settings), environment_(environment) {}

  /// Returns whether camera rays see the same as all other rays.
  bool is_environment() const noexcept { return settings_.type == BackgroundType::kEnvironment; }

  /// Returns whether it is seen where a camera path leaves the scene. is_clear:
  /// PathState::is_clear.
  bool is_seen(int depth, bool is_clear) const noexcept {
    return !is_environment() && (depth == 0 || (is_clear && settings_.through_glass));
  }
  /// Returns whether clear surfaces show it.
  bool is_through_glass() const noexcept { return !is_environment() && settings_.through_glass; }

  /// Returns the radiance from a direction (unit, world); empty if the image is transparent there.
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
