#include "tests/bench/bench_views.h"

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "core/base/check.h"
#include "core/scene_io/builtin_scenes.h"
#include "tests/support/scenes.h"

namespace bench {

core::View builtin_view(std::string_view name, int width, int height) {
  const core::BuiltinScene* builtin = core::find_builtin_scene(name);
  if (builtin == nullptr) {
    std::fprintf(stderr,
                 "no built-in scene is named '%.*s'; `tessera render --scenes` lists them\n",
                 static_cast<int>(name.size()), name.data());
    std::exit(2);
  }
  auto description = core::load_gltf(builtin->make_glb(), {}, {});
  CHECK(description);
  auto scene = core::Scene::build(std::move(*description), 2);
  CHECK(scene);
  core::View view;
  view.scene = *scene;
  view.settings.film.width = width;
  view.settings.film.height = height;
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = false;
  const core::SceneSummary& facts = (*scene)->summary();
  if (facts.lights.empty() && !facts.has_emissive_strength) {
    view.environment = test_support::constant_sky(core::Rgb(1));
  }
  return view;
}

}  // namespace bench
