/// Cryptomatte metadata in the header of an EXR.
#pragma once

#include <map>
#include <string>

#include "core/scene/scene.h"
#include "core/settings/settings.h"

namespace api {

/// Adds, for each layer of mattes in the film, its name, the hash from names to ids, and the names.
/// Source: Cryptomatte specification 1.2.0, "Metadata". scene: null, without names.
void add_mattes(std::map<std::string, std::string>& texts, const core::FilmSettings& film,
                const core::Scene* scene);

}  // namespace api
