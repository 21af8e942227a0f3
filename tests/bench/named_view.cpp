#include "tests/bench/named_view.h"

#include <utility>

#include "core/base/check.h"
#include "tests/bench/bench_views.h"
#include "tests/render/asset_files.h"
#include "tests/support/scenes.h"

namespace bench {

core::View named_view(const std::string& name, int width, int height) {
  const std::size_t comma = name.find(',');
  if (comma == std::string::npos) {
    return builtin_view(name, width, height);
  }
  auto description = test_support::load_asset(name.substr(0, comma));
  CHECK(description);
  auto scene = core::Scene::build(std::move(*description), 2);
  CHECK(scene);
  core::View view = test_support::view_of(*scene, width, height);
  view.environment = test_support::load_sky(name.substr(comma + 1));
  return view;
}

}  // namespace bench
