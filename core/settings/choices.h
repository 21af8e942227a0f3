/// Tables of named choices: samplers, light samplers, filters and every other value that a request
/// may name. A row is the registration: names in requests, refusals, GET /v1/server and the OpenAPI
/// page come from the rows. Integrators and layers have tables of their own
/// (core/integrators/registry.h, core/layers/layer_rows.h).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <span>
#include <string_view>

#include "core/base/check.h"
#include "core/settings/settings.h"

namespace core {

/// JSON pointers of the job's options, at most 16.
class Options {
 public:
  constexpr Options(std::initializer_list<std::string_view> pointers) : count_(pointers.size()) {
    std::copy(pointers.begin(), pointers.end(), pointers_.begin());
  }
  constexpr const std::string_view* begin() const { return pointers_.data(); }
  constexpr const std::string_view* end() const { return begin() + count_; }
  bool has(std::string_view pointer) const { return std::find(begin(), end(), pointer) != end(); }

 private:
  std::array<std::string_view, 16> pointers_{};
  std::size_t count_;
};

/// A value that a request may name.
template <typename T>
struct NamedValue {
  std::string_view name;
  T value;
  std::string_view summary;
  Options accepts = {};  ///< options that it honours; other values of its group refuse them unless
                         ///< they list them too
  std::string_view bias = "none";
};

/// Returns the row of a value. Pre: it exists.
template <typename T>
const NamedValue<T>& row_of(std::span<const NamedValue<T>> rows, T value) {
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [value](const NamedValue<T>& r) { return r.value == value; });
  CHECK(row != rows.end());
  return *row;
}

std::span<const NamedValue<SamplerType>> samplers();
std::span<const NamedValue<LightSamplerType>> light_samplers();
std::span<const NamedValue<Strategy>> strategies();
std::span<const NamedValue<MisType>> mis_types();
std::span<const NamedValue<RouletteType>> roulette_types();
std::span<const NamedValue<SplittingType>> splitting_types();
std::span<const NamedValue<CausticsType>> caustics_types();
std::span<const NamedValue<ControlVariateType>> control_variate_types();
std::span<const NamedValue<bool>> expected_value_types();
std::span<const NamedValue<bool>> spectral_types();
std::span<const NamedValue<AdaptiveType>> adaptive_types();
std::span<const NamedValue<Granularity>> granularities();
std::span<const NamedValue<FilterType>> filters();
std::span<const NamedValue<FogType>> fog_types();
std::span<const NamedValue<BackgroundType>> backgrounds();
std::span<const NamedValue<GroundType>> grounds();
std::span<const NamedValue<ShadowColor>> shadow_colors();
std::span<const NamedValue<Units>> units();
std::span<const NamedValue<EnvironmentPreset>> environment_presets();
std::span<const NamedValue<CameraType>> camera_types();
std::span<const NamedValue<DistortionModel>> distortion_models();
std::span<const NamedValue<PoseConvention>> pose_conventions();

/// Returns whether the ground is a shadow catcher.
inline bool has_catcher(const RenderSettings& settings) {
  return settings.ground.type == GroundType::kCatcher;
}
inline bool is_transparent(const RenderSettings& settings) {
  return settings.background.type == BackgroundType::kTransparent;
}

/// Adaptive rules available only in the laboratory, as estimators of its experiments.
struct LaboratoryRule {
  std::string_view name;
  std::string_view experiment;
  std::string_view estimator;
};
std::span<const LaboratoryRule> laboratory_rules();

}  // namespace core
