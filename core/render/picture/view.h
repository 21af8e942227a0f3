/// View: everything that a renderer needs to render one image.
#pragma once

#include <memory>
#include <optional>

#include "core/aovs/motion.h"
#include "core/base/result.h"
#include "core/camera/moving_camera.h"
#include "core/integrators/rules.h"
#include "core/lights/environment.h"
#include "core/scene/scene.h"
#include "core/settings/settings.h"

namespace core {

/// Options that pilots have measured, so that creating a renderer renders nothing.
struct Measured {
  int split_count = 0;         ///< of `measured` splitting; 0 for other types
  bool aims_in_media = false;  ///< as IntegratorInput::aims_in_media
};

struct View {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Environment> environment;  ///< null: black
  CameraSettings camera;
  /// The scene at the second time of the layer `motion`; null if nothing moves.
  std::shared_ptr<const MotionTarget> later;
  RenderSettings settings;
  /// Paths per wave, if the integrator supports waves: 8, or 1 for tests. 0 traces one path at a
  /// time; the image is the same up to rounding.
  int wave_width = 8;
  /// Measured options are not: light sampler tree, two continuations. For previews, of which pilots
  /// would be the larger part.
  bool is_quick = false;
  std::optional<Measured> measured = {};  ///< set by settle()
};

/// Returns whether the settings leave a choice to pilots, which settle() has to make before a
/// renderer is created (core/render/task/settle.h).
bool leaves_a_choice(const RenderSettings& settings);
/// Returns what rules depend on in the scene, which must outlive the result.
SceneTraits traits_of(const SceneSummary& scene);
/// Errors: kInvalidArgument if the view breaks a rule (core/integrators/rules.h); the first.
Status check_rules(const View& view);
/// Returns the view's camera. Errors: as above; kInvalidArgument at "/camera/...".
Result<MovingCamera> camera_of(const View& view);

}  // namespace core
