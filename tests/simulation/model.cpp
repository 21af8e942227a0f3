// The linker's option --wrap lets calls of Renderer::create() and settle() end here.
#include "tests/simulation/model.h"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "core/base/cpu_time.h"
#include "core/film/replicate_fit.h"
#include "core/render/picture/renderer.h"
#include "core/render/picture/tile_fill.h"
#include "core/render/task/pass_plan.h"
#include "core/render/task/settle.h"
#include "core/samplers/hash.h"
#include "tests/simulation/executor.h"
#include "tests/simulation/faults.h"

namespace simulation {
namespace {

using core::View;

bool is_real = false;
bool is_failing = false;
int hanging = 0;

/// Of the seed, the pixel and the sample, in [0, 1).
float value_at(std::uint64_t seed, int x, int y, int sample) {
  const auto place = static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32U |
                     static_cast<std::uint32_t>(y);
  const std::uint64_t bits =
      core::hash_combine(core::hash_combine(seed, place), static_cast<std::uint64_t>(sample));
  return core::to_unit_float(static_cast<std::uint32_t>(bits >> 32U));
}

class ModelRenderer final : public core::Renderer {
 public:
  explicit ModelRenderer(View view) : view_(std::move(view)) {}

  const View& view() const noexcept override { return view_; }

  bool render(core::TileState& state, int last_sample, std::stop_token stop) const override {
    const double start = core::thread_cpu_seconds();
    const core::RenderSettings& settings = view_.settings;
    const core::FillRule rule = {settings.replicates, core::plan_step(settings),
                                 core::fit_type(settings), settings.light_history};
    const bool is_whole =
        core::fill_tile(state, rule, last_sample, stop, [&](int x, int y, int sample) {
          ++state.rays;
          core::PathSample made;
          made.radiance = core::Rgb(value_at(settings.seed, x, y, sample));
          return made;
        });
    state.cpu_seconds += core::thread_cpu_seconds() - start;
    return is_whole;
  }

  bool render_pilot(core::TileState& state, int last_sample, std::stop_token stop) const override {
    return core::fill_pilot(state, last_sample, stop,
                            [&](int x, int y, int sample, std::uint64_t& rays) {
                              ++rays;
                              return core::Rgb(value_at(~view_.settings.seed, x, y, sample));
                            });
  }

 private:
  View view_;
};

}  // namespace

using Made = core::Result<std::shared_ptr<const core::Renderer>>;

Made real_create(View view) __asm__("__real__ZN4core8Renderer6createENS_4ViewE");
Made create(View view) __asm__("__wrap__ZN4core8Renderer6createENS_4ViewE");
core::Result<std::string>
real_settle(View& view, const core::StopRules& rules, const std::stop_token& stop) __asm__(
    "__real__ZN4core6settleB5cxx11ERNS_4ViewERKNS_9StopRulesERKSt10stop_token");
core::Result<std::string>
settle(View& view, const core::StopRules& rules, const std::stop_token& stop) __asm__(
    "__wrap__ZN4core6settleB5cxx11ERNS_4ViewERKNS_9StopRulesERKSt10stop_token");

Made create(View view) {
  if (is_real) {
    return real_create(std::move(view));
  }
  return std::shared_ptr<const core::Renderer>(std::make_shared<ModelRenderer>(std::move(view)));
}

/// Pre: the settings leave no choice.
core::Result<std::string> settle(View& view, const core::StopRules& rules,
                                 const std::stop_token& stop) {
  if (is_real) {
    return real_settle(view, rules, stop);
  }
  if (is_failing && strikes(Fault::kLoadFails)) {
    return core::Error{core::ErrorCode::kUnavailable, kLoadFailure, ""};
  }
  if (is_failing && strikes(Fault::kLoadHangs)) {
    ++hanging;
    while (!stop.stop_requested()) {
      sleep_for(kSecond);
    }
    --hanging;
    return core::Error{core::ErrorCode::kCancelled, "stopped while measuring", ""};
  }
  view.measured = core::Measured{};
  return std::string();
}

void render_really() { is_real = true; }
void fail_sometimes(bool is_failing_now) { is_failing = is_failing_now; }
bool renders_really() { return is_real; }
int hanging_loads() { return hanging; }

}  // namespace simulation
