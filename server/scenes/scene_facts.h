/// Scene facts against which a job request is checked before the scene is loaded.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api/job/job_spec.h"
#include "api/problem.h"
#include "core/scene/scene.h"

namespace server {

/// Encodes for the store: names and kinds of cameras, names of variants, whether the scene has its
/// own lights, scattering media or dispersion, bounds, origin and extreme points, sizes.
/// decode_facts() returns a summary of these alone. load_bytes: peak memory of loading besides the
/// scene, including the file; 0: unknown.
std::string encode_facts(const core::SceneSummary& summary, std::uint64_t load_bytes = 0);
core::SceneSummary decode_facts(std::string_view text);
/// Returns whether a version without origin and extreme points encoded these facts.
bool lacks_extremes(const core::SceneSummary& facts);
std::uint64_t load_bytes_of(std::string_view facts);

/// Returns errors for stop rules that have no meaning with the scene's media.
std::vector<api::FieldError> stop_faults_against_scene(const core::StopRules& stop,
                                                       const core::SceneSummary& facts);
/// Returns these, and errors for members of the request that the scene lacks: camera name or index,
/// a field of view for an orthographic camera, variant; and for an integrator or an option that
/// does not support the scene's media or dispersion.
std::vector<api::FieldError> faults_against_scene(const api::JobSpec& spec,
                                                  const core::SceneSummary& facts);

}  // namespace server
