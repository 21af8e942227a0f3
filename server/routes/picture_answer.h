/// The image of a job as a response: format, denoising, headers. Shared by the routes that answer
/// with one.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/requests.h"
#include "core/image_io/image_io.h"
#include "server/http/message.h"
#include "server/jobs/denoise_service.h"
#include "server/routes/context.h"

namespace server {

/// Names that images accept as their tone map.
std::vector<std::string> tone_map_names();

/// Chooses by the extension, or if it is empty by Accept; null: 406.
const core::ImageFormat* choose_format(const Request& request, std::string_view extension);
/// Returns kNotAcceptable, with the formats there are.
core::Error unknown_format();

std::shared_ptr<const core::DenoisedPicture> planes_of(const DenoiseService::Pointer& made);
std::optional<api::DenoisedView> view_of(const DenoiseService::Pointer& made,
                                         const api::JobView& job);
/// Returns null if the image contains no names, or the scene is gone.
std::shared_ptr<const core::Scene> scene_for_names(const JobService& jobs, const Job& job,
                                                   const core::ImageFormat& format);

/// Returns the key of the image with that ETag of an ended job: in RouteContext::pictures after the
/// job's id, and in its file of first images.
std::string kept_key(const api::JobView& view, std::string_view etag);

/// Returns 200 with the image of the job's newest film, 304 to a GET that knows it, or a problem.
/// The ETag identifies the job, its revision and the request's query.
Response picture_answer(const RouteContext& context, const Request& request, const JobPointer& job,
                        const core::ImageFormat& format, const api::ImageQuery& query);

}  // namespace server
