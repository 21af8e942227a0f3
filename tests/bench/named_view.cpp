#include "tests/bench/named_view.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "tests/bench/bench_views.h"
#include "tests/bench/caustic_views.h"
#include "tests/support/asset_files.h"
#include "tests/support/scenes.h"

namespace bench {

core::View named_view(const std::string& name, int width, int height) {
  const std::size_t comma = std::min(name.find(','), name.size());
  if (auto made = caustic_view(name, width, height)) {
    return *std::move(made);
  }
  if (name.find('.') == std::string::npos) {
    return builtin_view(name, width, height);
  }
  auto description = test_support::load_asset(name.substr(0, comma));
  CHECK(description);
  auto scene = core::Scene::build(std::move(*description), 2);
  CHECK(scene);
  core::View view = test_support::view_of(*scene, width, height);
  const std::string sky = name.substr(std::min(comma + 1, name.size()));
  if (sky == "white") {
    view.environment = *core::Environment::create(nullptr, {});
  } else if (!sky.empty()) {
    view.environment = test_support::load_sky(sky);
  }
  return view;
}

}  // namespace bench
