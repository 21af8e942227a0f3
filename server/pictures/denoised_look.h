/// Denoised pictures for requests: which layer they show, and what is told about them.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "api/job_view.h"
#include "api/requests.h"
#include "core/base/result.h"

namespace server {

/// Does the query show a denoised picture?
bool wants_denoised(const api::ImageQuery& query);

/// The layer in place of beauty. Errors: kInvalidArgument at /denoise for another layer.
core::Result<std::optional<std::string>> denoised_layer(const api::ImageQuery& query);

/// What is told of it: X-Tessera-Denoiser; X-Tessera-Error (relative error, low, high; empty:
/// unknown); X-Tessera-Bias.
struct DenoisedFacts {
  std::string denoiser;
  std::string error;
  std::string bias;
};
DenoisedFacts denoised_facts(const api::DenoisedView& view, const api::ImageQuery& query);

/// The same in the file, whose error is that of the denoised picture.
void add_denoised_origin(std::map<std::string, std::string>& texts, const api::DenoisedView& view,
                         const api::ImageQuery& query);

}  // namespace server
