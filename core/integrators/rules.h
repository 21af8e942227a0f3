/// Rules on what goes together: values of a job, its integrator and its scene. The parser of
/// requests walks them without a scene, the server with the facts of a scene, and the renderer with
/// the scene itself.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/settings/settings.h"

namespace core {

/// What rules depend on in a scene.
struct SceneTraits {
  bool has_scattering = false;  ///< media that scatter
  bool has_dispersion = false;
  std::optional<std::span<const std::string>> light_groups = {};  ///< empty: unknown
};

struct BrokenRule {
  std::string pointer;  ///< of the member of the job request
  std::string reason;
  std::optional<std::size_t> share = {};  ///< the one of film.shares that is refused
};

/// Returns the rules that the job breaks, in a fixed order; empty if everything goes together.
/// scene: null if it is not known yet, which leaves out the rules on it.
std::vector<BrokenRule> broken_rules(const RenderSettings& settings, const CameraSettings& camera,
                                     const SceneTraits* scene);
/// The same for the rules that end the job: errors that they wait for must be measurable.
std::vector<BrokenRule> broken_stop_rules(const StopRules& stop, const RenderSettings& settings,
                                          const SceneTraits* scene);

/// Returns why particles cannot follow all light: "with fog", in media that scatter, or of motion;
/// empty if they can. has_scattering: as in SceneTraits.
std::string_view census_obstacle(const RenderSettings& settings, bool has_scattering);

}  // namespace core
