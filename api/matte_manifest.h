/// What readers of Cryptomatte look for in the head of an EXR.
#pragma once

#include <map>
#include <string>

#include "core/scene/scene.h"
#include "core/settings/settings.h"

namespace api {

/// For each layer of mattes that the film has: its name, how names become ids, and the names.
/// Source: Cryptomatte specification 1.2.0, "Metadata". scene: null, without names.
void add_mattes(std::map<std::string, std::string>& texts, const core::FilmSettings& film,
                const core::Scene* scene);

}  // namespace api
