#include "core/render/task/settle.h"

#include <utility>

#include "core/base/invalid.h"
#include "core/integrators/rules.h"
#include "core/render/picture/split_pilot.h"
#include "core/render/task/choose_integrator.h"
#include "core/scene/scene_data.h"

namespace core {
namespace {

/// For View::is_quick: at least as efficient as none in 24 of 30 scenes of files under maps and
/// rooms.
constexpr int kQuickSplitCount = 2;

Error stopped() { return Error{ErrorCode::kCancelled, "stopped while measuring", ""}; }

}  // namespace

Status measure(View& view, const std::stop_token& stop) {
  const auto camera = camera_of(view);
  if (!camera) {
    return camera.error();
  }
  RenderSettings settings = view.settings;
  IntegratorInput input = {view.scene->data(), view.environment.get(), settings, &camera->first()};
  Measured found;
  const auto aims = pays_to_aim(input, stop);
  if (!aims) {
    return stopped();
  }
  found.aims_in_media = input.aims_in_media = *aims;
  if (settings.estimator.splitting == SplittingType::kMeasured) {
    View plain = view;
    plain.measured = found;
    const auto count =
        view.is_quick ? Result<int>(kQuickSplitCount) : choose_split_count(plain, stop);
    if (!count) {
      return count.error();
    }
    found.split_count = *count;
  }
  view.measured = found;
  return ok_status();
}

Result<std::string> settle(View& view, const StopRules& rules, const std::stop_token& stop) {
  if (const Status fits = check_rules(view); !fits) {
    return fits.error();
  }
  const SceneTraits scene = traits_of(view.scene->summary());
  if (const auto broken = broken_stop_rules(rules, view.settings, &scene); !broken.empty()) {
    return invalid(broken.front().pointer, broken.front().reason);
  }
  auto chosen = settle_integrator(view, rules, stop);
  if (!chosen) {
    return chosen;
  }
  if (const Status measured = measure(view, stop); !measured) {
    return measured.error();
  }
  if (const Status lights = settle_light_sampler(view, stop); !lights) {
    return lights.error();
  }
  return chosen;
}

void adopt_settled(RenderSettings& to, const RenderSettings& settled) {
  to.integrator = settled.integrator;
  to.caustics = settled.caustics;
  to.estimator = settled.estimator;
  to.adaptive = settled.adaptive;
  to.light_sampler = settled.light_sampler;
  to.light_candidates = settled.light_candidates;
}

Result<std::shared_ptr<const Renderer>> settled_renderer(View view, const StopRules& rules,
                                                         const std::stop_token& stop) {
  if (const auto settled = settle(view, rules, stop); !settled) {
    return settled.error();
  }
  return Renderer::create(std::move(view));
}

}  // namespace core
