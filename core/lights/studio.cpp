#include "core/lights/studio.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "core/math/numbers.h"

namespace core {
namespace {

/// Angles in degrees: azimuth from the front to the camera's right, elevation, and half the sides
/// of the rectangle.
struct Lamp {
  float azimuth;
  float elevation;
  float half_width;
  float half_height;
  float radiance;
};

struct Room {
  float above;  ///< radiance of the room at the zenith and the nadir; linear in height
  float below;
  std::span<const Lamp> lights;
};

// Three-point lighting: key and fill at 45 degrees to the sides, the key 45 degrees high and four
// times as bright, the back light opposite the key. Source: Millerson, Lighting for Television and
// Film, 3rd ed., chapter 6.
constexpr std::array kStudioPanels = {
    Lamp{-45, 45, 24, 24, 12},
    Lamp{45, 20, 22, 30, 3},
    Lamp{0, 90, 30, 30, 6},
    Lamp{150, 35, 10, 30, 8},
};
// A light tent, lit from above and both sides; the opening for the camera is dark.
constexpr std::array kTentLamps = {
    Lamp{0, 90, 40, 40, 0.8F},
    Lamp{-90, 20, 35, 35, 0.5F},
    Lamp{90, 20, 35, 35, 0.5F},
    Lamp{0, 10, 14, 14, -0.8F},
};
constexpr std::array kRimLamps = {
    Lamp{-135, 20, 9, 40, 20},
    Lamp{135, 20, 9, 40, 20},
    Lamp{180, 75, 30, 8, 8},
    Lamp{0, 30, 30, 20, 0.5F},
};

constexpr Room kStudio = {0.5F, 0.2F, kStudioPanels};
constexpr Room kTent = {1, 0.7F, kTentLamps};
constexpr Room kRim = {0.04F, 0.02F, kRimLamps};

/// Returns 1 within half, 0 beyond half + edge, smooth between.
float soft_step(float at, float half) {
  constexpr float kEdge = 0.05F;  // tangent of 3 degrees: the soft edge of a soft box
  const float t = clamp01((half + kEdge - std::fabs(at)) / kEdge);
  return t * t * (3 - 2 * t);
}

float lamp_radiance(const Lamp& light, Vec3 d) {
  constexpr float kDegree = kPi / 180;
  const float azimuth = light.azimuth * kDegree;
  const float elevation = light.elevation * kDegree;
  const Vec3 axis = {std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                     std::cos(elevation) * std::cos(azimuth)};
  const Vec3 right = {std::cos(azimuth), 0, -std::sin(azimuth)};
  const Vec3 up = cross(axis, right);
  const float depth = dot(d, axis);
  if (!(depth > 0)) {
    return 0;
  }
  return light.radiance * soft_step(dot(d, right) / depth, std::tan(light.half_width * kDegree)) *
         soft_step(dot(d, up) / depth, std::tan(light.half_height * kDegree));
}

const Room& room_of(EnvironmentPreset preset) {
  switch (preset) {
    case EnvironmentPreset::kTent:
      return kTent;
    case EnvironmentPreset::kRim:
      return kRim;
    case EnvironmentPreset::kStudio:
      break;
  }
  return kStudio;
}

}  // namespace

Studio::Studio(EnvironmentPreset preset) : preset_(preset) {
  constexpr int kRows = 256;  // midpoints over the height, which is uniform in solid angle
  constexpr int kColumns = 512;
  double sum = 0;
  for (int i = 0; i < kRows; ++i) {
    const float y = 2 * (static_cast<float>(i) + 0.5F) / kRows - 1;
    const float level = safe_sqrt(1 - y * y);
    for (int k = 0; k < kColumns; ++k) {
      const float phi = kTwoPi * (static_cast<float>(k) + 0.5F) / kColumns;
      sum += static_cast<double>(unscaled({level * std::cos(phi), y, level * std::sin(phi)}));
    }
  }
  scale_ = static_cast<float>(kRows * kColumns / sum);
}

float Studio::exposure_stops(Vec3 to_camera) const {
  // Midpoints that are uniform in solid angle, as above. The lights' edges are 3 degrees wide.
  constexpr int kRows = 48;
  constexpr int kColumns = 96;
  constexpr float kSolidAngle = 4 * kPi / (kRows * kColumns);
  std::vector<Vec3> directions;
  std::vector<float> light;
  for (int i = 0; i < kRows; ++i) {
    const float y = 2 * (static_cast<float>(i) + 0.5F) / kRows - 1;
    const float level = safe_sqrt(1 - y * y);
    for (int k = 0; k < kColumns; ++k) {
      const float phi = kTwoPi * (static_cast<float>(k) + 0.5F) / kColumns;
      directions.push_back({level * std::cos(phi), y, level * std::sin(phi)});
      light.push_back(unscaled(directions.back()) * scale_ * kSolidAngle);
    }
  }
  float brightest = 0;
  constexpr int kStep = 7;  // orientations, 8 degrees apart on average: irradiance is smooth
  for (std::size_t n = 0; n < directions.size(); n += kStep) {
    if (dot(directions[n], to_camera) < 0) {
      continue;
    }
    float irradiance = 0;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      irradiance += light[i] * std::max(dot(directions[n], directions[i]), 0.0F);
    }
    brightest = std::max(brightest, irradiance);
  }
  return std::log2(kPi / brightest);
}

float studio_exposure_stops(EnvironmentPreset preset, float rotation_degrees, Vec3 to_camera) {
  // As Environment does: turning the light one way turns directions the other way.
  const float angle = rotation_degrees * (kPi / 180);
  const Vec3 turned = {to_camera.x * std::cos(angle) - to_camera.z * std::sin(angle), to_camera.y,
                       to_camera.x * std::sin(angle) + to_camera.z * std::cos(angle)};
  return Studio(preset).exposure_stops(turned);
}

float Studio::unscaled(Vec3 direction) const {
  const Room& room = room_of(preset_);
  float sum = lerp(room.below, room.above, 0.5F + 0.5F * direction.y);
  for (const Lamp& light : room.lights) {
    sum += lamp_radiance(light, direction);
  }
  return std::max(sum, 0.0F);
}

}  // namespace core
