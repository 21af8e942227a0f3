/// Rules on what goes together: values of a job, its integrator and its scene. The parser of
/// requests walks them without a scene, the server with the facts of a scene, and the renderer with
/// the scene itself.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
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

}  // namespace core
