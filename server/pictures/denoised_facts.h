/// Denoised images for requests: the layer to show, and the facts reported about it.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "api/answers/job_view.h"
#include "api/requests.h"
#include "core/base/result.h"

namespace server {

/// Returns whether the query asks for a denoised image.
bool wants_denoised(const api::ImageQuery& query);

/// Returns the layer that replaces beauty. Errors: kInvalidArgument at /denoise for another layer.
core::Result<std::optional<std::string>> denoised_layer(const api::ImageQuery& query);

/// Returns the header X-Tessera-Error: error, low, high; without the ends if they are unknown,
/// empty if the error is.
std::string error_text(const core::ErrorInterval& error);

/// Response headers: X-Tessera-Denoiser, X-Tessera-Error, X-Tessera-Bias.
struct DenoisedFacts {
  std::string denoiser;
  std::string error;
  std::string bias;
};
DenoisedFacts denoised_facts(const api::DenoisedView& view, const api::ImageQuery& query);

/// Adds the same facts to the file's metadata, whose error is that of the denoised image.
void add_denoised_origin(std::map<std::string, std::string>& texts, const api::DenoisedView& view,
                         const api::ImageQuery& query);

}  // namespace server
