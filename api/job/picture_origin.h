/// Recovers the job that rendered an image from the texts in the image file.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "api/job/job_spec.h"

namespace api {

/// Returns the job request stored in images: without the webhook, which is private.
std::string picture_spec(const JobSpec& spec);

/// Returns a request for the same film, from the texts in an image (core::read_image_texts()): its
/// spec, stopping at the image's number of samples. arithmetic: of this server; another one in the
/// image gives a warning. Problems: 422 if the texts are missing, or the film was merged from
/// several jobs.
Parsed<ParsedJob> parse_picture_origin(const std::map<std::string, std::string>& texts,
                                       std::string_view arithmetic);

}  // namespace api
