/// What a job request is checked against before its scene is loaded.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api/job_spec.h"
#include "api/problem.h"
#include "core/scene/scene.h"

namespace server {

/// Names and kinds of cameras, names of variants, whether there are lights of its own, sizes: as
/// text for the store. decode_facts() gives a summary that holds these and nothing else.
/// load_bytes: memory that loading took at most beside the scene, the file included; 0: not known.
std::string encode_facts(const core::SceneSummary& summary, std::uint64_t load_bytes = 0);
core::SceneSummary decode_facts(std::string_view text);
std::uint64_t load_bytes_of(std::string_view facts);

/// Members of the request that the scene does not have: camera name or index, a field of view for
/// an orthographic camera, variant.
std::vector<api::FieldError> faults_against_scene(const api::JobSpec& spec,
                                                  const core::SceneSummary& facts);

}  // namespace server
