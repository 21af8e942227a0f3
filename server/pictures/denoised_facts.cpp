#include "server/pictures/denoised_facts.h"

#include <cmath>

#include "api/json/values.h"
#include "core/layers/layer_rows.h"

namespace server {
namespace {

std::string denoiser_text(const api::DenoisedView& view, const api::ImageQuery& query) {
  std::string out = core::to_text(view.by);
  out.append(api::is_full(query.denoise) ? ", full" : ", mixed");
  out.append(view.has_features ? "" : ", without features");
  return view.note.empty() ? out : out.append("; ").append(view.note);
}

}  // namespace

bool wants_denoised(const api::ImageQuery& query) {
  const core::LayerEntry* layer = query.layer ? core::find_layer(*query.layer) : nullptr;
  return query.denoise != api::DenoiseShow::kOff ||
         (layer != nullptr && layer->fill_denoised != nullptr);
}

core::Result<std::optional<std::string>> denoised_layer(const api::ImageQuery& query) {
  if (!wants_denoised(query)) {
    return query.layer;
  }
  if (!query.layer || *query.layer == core::kBeauty) {
    return std::optional<std::string>("denoised");
  }
  const core::LayerEntry* layer = core::find_layer(*query.layer);
  if (layer == nullptr || layer->fill_denoised == nullptr) {
    return core::Error{core::ErrorCode::kInvalidArgument,
                       "the layer '" + *query.layer + "' is not denoised", "/denoise"};
  }
  return query.layer;
}

std::string error_text(const core::ErrorInterval& error) {
  std::string out;
  if (std::isfinite(error.relative)) {
    out = api::number_text(error.relative);
    if (std::isfinite(error.low)) {
      out.append(", ").append(api::number_text(error.low));
      out.append(", ").append(api::number_text(error.high));
    }
  }
  return out;
}

DenoisedFacts denoised_facts(const api::DenoisedView& view, const api::ImageQuery& query) {
  const core::ErrorInterval& error = api::is_full(query.denoise) ? view.full : view.mixed;
  DenoisedFacts out;
  out.denoiser = denoiser_text(view, query);
  out.error = error_text(error);
  // The denoiser's picture stays biased; the mixed one converges to the plain one.
  out.bias = api::is_full(query.denoise) ? "biased" : "consistent";
  return out;
}

void add_denoised_origin(std::map<std::string, std::string>& texts, const api::DenoisedView& view,
                         const api::ImageQuery& query) {
  const core::ErrorInterval& error = api::is_full(query.denoise) ? view.full : view.mixed;
  texts["tessera:denoiser"] = denoiser_text(view, query);
  texts["tessera:bias"] = denoised_facts(view, query).bias;
  texts.erase("tessera:error_interval");
  texts["tessera:error"] = api::number_text(error.relative);
  if (std::isfinite(error.low)) {
    texts["tessera:error_interval"] =
        api::number_text(error.low) + " " + api::number_text(error.high);
  }
}

}  // namespace server
