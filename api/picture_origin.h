/// The job that made a picture, by what the picture says.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "api/job_spec.h"

namespace api {

/// The job as pictures carry it: without the webhook, which is private.
std::string picture_spec(const JobSpec& spec);

/// The request for the same film, from the texts in a picture (core::read_image_texts()): its spec,
/// to stop at the samples that the picture has. arithmetic: of this server; another one in the
/// picture is a warning. Problems: 422 when the picture does not say, or was merged from several
/// jobs.
Parsed<ParsedJob> parse_picture_origin(const std::map<std::string, std::string>& texts,
                                       std::string_view arithmetic);

}  // namespace api
