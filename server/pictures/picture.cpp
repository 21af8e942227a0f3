#include "server/pictures/picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "api/answers/film_view.h"
#include "api/answers/matte_manifest.h"
#include "api/job/light_exposure.h"
#include "api/job/picture_origin.h"
#include "api/json/values.h"
#include "api/queries/fireflies.h"
#include "core/layers/exposure.h"
#include "core/layers/layer_rows.h"
#include "core/layers/layers.h"
#include "core/settings/choices.h"
#include "core/settings/light_shares.h"
#include "server/pictures/denoised_facts.h"
#include "server/pictures/false_colors.h"
#include "server/pictures/image_scale.h"

namespace server {

using core::Error;
using core::ErrorCode;

namespace {

/// Removes the channel named A; the others keep their order.
core::ImageRows without_alpha(core::ImageRows image) {
  std::vector<std::size_t> kept;
  std::vector<std::string> names;
  for (std::size_t c = 0; c < image.channel_names.size(); ++c) {
    if (image.channel_names[c] != "A") {
      kept.push_back(c);
      names.push_back(image.channel_names[c]);
    }
  }
  const std::size_t channels = image.channel_names.size();
  const auto width = static_cast<std::size_t>(image.width);
  image.channel_names = std::move(names);
  image.row = [row = std::move(image.row), out = std::vector<float>(width * kept.size()), kept,
               channels](int y) mutable {
    const float* in = row(y);
    for (std::size_t to = 0; to < out.size(); in += channels) {
      for (const std::size_t c : kept) {
        out[to++] = in[c];
      }
    }
    return static_cast<const float*>(out.data());
  };
  return image;
}

/// Returns the metadata of the image's origin, stored in the file.
std::map<std::string, std::string> provenance(const api::JobView& view,
                                              const api::ServerView& about) {
  const std::string build = view.build.empty() ? api::build_json(about) : view.build;
  std::map<std::string, std::string> texts = {
      {"tessera:job", view.id},
      {"tessera:scene", view.spec.scene},
      {"tessera:spec", api::picture_spec(view.spec)},
      {"tessera:seed", std::to_string(view.spec.render.seed)},
      {"tessera:build", build},
      {"tessera:arithmetic", api::arithmetic_of(build)},
      {"tessera:samples_per_pixel", api::number_text(view.progress.samples_mean)},
      {"Software", "Tessera " + about.version},
  };
  if (std::isfinite(view.progress.error.relative)) {
    texts["tessera:error"] = api::number_text(view.progress.error.relative);
    texts["tessera:error_interval"] = api::number_text(view.progress.error.low) + " " +
                                      api::number_text(view.progress.error.high);
  }
  if (!view.ledger.empty()) {
    texts["tessera:samples"] = api::ledger_json(view.ledger);
  }
  if (!view.film_digest.empty()) {
    texts["tessera:film_digest"] = view.film_digest;
    texts["tessera:stop_reason"] = api::to_text(view.stop_reason);
    if (view.samples_by_error > 0) {
      texts["tessera:samples_by_error"] = std::to_string(view.samples_by_error);
    }
  }
  return texts;
}

/// EXR contains all layers unless a layer or the denoised picture is requested.
bool shows_all_layers(const Picture& picture) {
  return picture.query.mix.empty() && !picture.query.layer && picture.format.extension == "exr" &&
         !picture.denoised;
}

/// Returns the largest memory of a picture until it is sent.
std::uint64_t working_bytes(const core::Film& film, const Picture& picture) {
  const bool all_layers = shows_all_layers(picture);
  const int most = picture.query.max_size.value_or(std::numeric_limits<int>::max());
  return core::LayerRows::bytes(film, picture.rect) +
         core::encoding_bytes(std::min(picture.rect.width, most),
                              std::min(picture.rect.height, most),
                              all_layers ? static_cast<int>(core::channels_max(film)) : 4,
                              picture.format, picture.query.bits);
}

std::string_view layer_of(const api::ImageQuery& query) {
  return query.layer ? std::string_view(*query.layer) : core::kBeauty;
}

core::LayerForm form_of(const api::ImageQuery& query) {
  const core::LayerEntry* layer = core::find_layer(layer_of(query));
  return layer == nullptr ? core::LayerForm::kValues : layer->form;
}

bool is_color(const api::ImageQuery& query) {
  const core::LayerEntry* layer = core::find_layer(layer_of(query));
  if (layer != nullptr) {
    return layer->is_color;
  }
  const auto share = core::light_share(layer_of(query));  // not in the table
  return !share || !share->is_irradiance;
}

/// Returns the exposure that the picture gets; empty if its format or layer has none.
std::optional<float> exposure_of(const core::Film& film, const Picture& picture) {
  if (picture.format.high_dynamic_range || !is_color(picture.query)) {
    return std::nullopt;
  }
  if (!picture.query.auto_exposure) {
    return picture.query.exposure_stops;
  }
  return static_cast<float>(api::auto_exposure_stops(picture.view.spec, [&] {
    return picture.auto_exposure
               ? *picture.auto_exposure
               : core::brightness_of(film, picture.view.spec.render.film).auto_exposure;
  }));
}

core::EncodeOptions encode_options(const Picture& picture, const api::ServerView& about) {
  core::EncodeOptions options;
  const bool is_exr = picture.format.extension == "exr";
  if (is_exr && shows_all_layers(picture)) {
    options.whole_channels = core::whole_channels();
  } else if (is_exr && form_of(picture.query) == core::LayerForm::kIds) {
    options.whole_channels = {"Y"};
  }
  for (const core::ToneMapEntry& entry : core::tone_maps()) {
    if (entry.name == picture.query.tone_map) {
      options.tone_map = entry.tone_map;
    }
  }
  options.is_color = is_color(picture.query);
  if (picture.query.white_balance_k) {
    options.white_kelvin = static_cast<float>(*picture.query.white_balance_k);
  }
  options.contrast = static_cast<float>(picture.query.contrast);
  options.bits = picture.query.bits;
  options.background = picture.query.background;
  options.parts = picture.query.parts;
  options.metadata = provenance(picture.view, about);
  if (is_exr) {
    api::add_mattes(options.metadata, picture.view.spec.render.film, picture.scene.get());
  }
  if (picture.denoised_view) {
    add_denoised_origin(options.metadata, *picture.denoised_view, picture.query);
  }
  return options;
}

/// Ids are integers and mattes belong to their pixel: neither can be scaled, mapped to a range or
/// averaged.
std::optional<Error> refused_ids(const Picture& picture) {
  const core::LayerForm form = form_of(picture.query);
  const core::FilmSettings& film = picture.view.spec.render.film;
  const bool has_ids = film.object || film.instance || film.material || film.primitive ||
                       film.object_mattes || film.material_mattes;
  const bool is_linear = picture.format.high_dynamic_range;
  const bool is_plain = form == core::LayerForm::kValues;
  const auto refused = [](std::string why, std::string where) {
    return Error{ErrorCode::kInvalidArgument, std::move(why), std::move(where)};
  };
  if (!is_plain && picture.query.range) {
    return refused("ids have no range", "/range");
  }
  if (picture.query.max_size && is_linear &&
      (!is_plain || (has_ids && shows_all_layers(picture)))) {
    return refused("ids cannot be averaged; png, jpg, webp and avif show them in colours",
                   "/max_size");
  }
  const bool is_exact = picture.format.extension == "exr" ||
                        (form == core::LayerForm::kIds && picture.format.extension == "tif");
  if (!is_plain && is_linear && !is_exact) {
    return refused("." + std::string(picture.format.extension) +
                       " cannot store this layer; exr can, and tif can store ids",
                   "/layer");
  }
  return std::nullopt;
}

/// A mix of light shares replaces the picture, and has its error.
std::optional<Error> refused_mix(const core::Film& film, const Picture& picture) {
  const api::ImageQuery& query = picture.query;
  if (query.mix.empty()) {
    return std::nullopt;
  }
  const auto refused = [](std::string why) {
    return Error{ErrorCode::kInvalidArgument, std::move(why), "/mix"};
  };
  const auto parts = std::count_if(film.shares().begin(), film.shares().end(),
                                   [](const core::LightShare& share) { return share.is_part(); });
  if (query.mix.size() != static_cast<std::size_t>(parts)) {
    return refused("has " + std::to_string(query.mix.size()) + " weights; the job records " +
                   std::to_string(parts) + " light shares");
  }
  if (layer_of(query) != core::kBeauty && layer_of(query) != "error") {
    return refused("applies only to the layers beauty and error");
  }
  if (query.denoise != api::DenoiseShow::kOff) {
    return refused("is not denoised");
  }
  return std::nullopt;
}

core::Result<bool> sets_aside(const Picture& picture) {
  return api::sets_fireflies_aside(
      picture.query.fireflies,
      {.is_linear = picture.format.high_dynamic_range,
       .is_denoised = picture.denoised != nullptr,
       .layer = shows_all_layers(picture) ? std::nullopt
                                          : std::optional<std::string>(layer_of(picture.query))});
}

/// Returns a weight for each of the film's shares: 0 for those that are not part of the image.
std::vector<float> all_weights(const core::Film& film, std::span<const float> mix) {
  std::vector<float> weights;
  for (const core::LightShare& share : film.shares()) {
    weights.push_back(share.is_part() ? mix.front() : 0.0F);
    mix = mix.subspan(share.is_part() ? 1 : 0);
  }
  return weights;
}

/// Returns why the film or the format has no such image.
std::optional<Error> refused(const core::Film& film, const Picture& picture) {
  if (picture.query.range && (is_color(picture.query) || picture.format.high_dynamic_range)) {
    return Error{ErrorCode::kInvalidArgument,
                 "only layers of data (such as depth and normal) in display formats have a range",
                 "/range"};
  }
  if (picture.query.background &&
      (!is_color(picture.query) || (!picture.query.layer && picture.format.extension == "exr"))) {
    return Error{ErrorCode::kInvalidArgument, "only a single colour layer can have a background",
                 "/background"};
  }
  if (picture.query.parts && !shows_all_layers(picture)) {
    return Error{ErrorCode::kInvalidArgument, "only an EXR of all layers has parts", "/parts"};
  }
  auto fault = refused_mix(film, picture);
  return fault ? fault : refused_ids(picture);
}

}  // namespace

core::Result<EncodedPicture> PictureMaker::make(const core::Film& film, const Picture& picture,
                                                std::chrono::milliseconds patience) const {
  if (auto fault = refused(film, picture)) {
    return *std::move(fault);
  }
  const auto is_calm = sets_aside(picture);
  if (!is_calm) {
    return is_calm.error();
  }
  const std::uint64_t bytes = working_bytes(film, picture);
  // The film itself is held too.
  if (const core::Status fits = memory_.check(bytes + film.bytes(), "the image"); !fits) {
    return fits.error();
  }
  auto lease = memory_.take({.bytes = bytes, .tenant = picture.tenant}, "the image", patience);
  if (!lease) {
    return lease.error();
  }
  const bool all_layers = shows_all_layers(picture);
  const auto layer = denoised_layer(picture.query);
  if (!layer) {
    return layer.error();
  }
  auto layers = core::LayerRows::create(
      film, picture.rect,
      all_layers ? std::nullopt : std::optional(layer->value_or(std::string(core::kBeauty))),
      picture.view.spec.render.film,
      {.denoised = {picture.denoised, api::is_full(picture.query.denoise)
                                          ? core::DenoiseMode::kFull
                                          : core::DenoiseMode::kMixed},
       .mix =
           picture.query.mix.empty() ? std::vector<float>() : all_weights(film, picture.query.mix),
       .sets_aside = *is_calm});
  if (!layers) {
    return Error{layers.error().code, layers.error().message, "/layer"};
  }
  core::ImageRows rows = layers->rows();
  // Formats without alpha composite over a background, which needs it.
  if (!all_layers && !core::is_transparent(picture.view.spec.render)) {
    rows = without_alpha(std::move(rows));
  }
  if (!all_layers && form_of(picture.query) != core::LayerForm::kValues &&
      !picture.format.high_dynamic_range) {
    rows = false_colors(std::move(rows), form_of(picture.query));
  }
  if (picture.query.max_size) {
    rows = scaled_down(std::move(rows), *picture.query.max_size);
  }
  std::optional<ValueRange> range;
  if (picture.query.range) {
    range = value_range(rows, *picture.query.range);
    rows = rescaled(std::move(rows), *range);
  }
  core::EncodeOptions options = encode_options(picture, about_);
  const std::optional<float> exposure = exposure_of(film, picture);
  options.exposure_stops = exposure.value_or(0.0F);
  auto encoded = core::encode_rows(rows, picture.format, options);
  if (!encoded) {
    return encoded.error();
  }
  encoded->shrink_to_fit();
  lease->shrink_to(encoded->size());
  return EncodedPicture{
      .content =
          with_lease(std::make_shared<const std::string>(*std::move(encoded)), *std::move(lease)),
      .range = range,
      .set_aside =
          *is_calm || picture.denoised ? std::optional(layers->set_aside().share()) : std::nullopt,
      .exposure_stops = exposure};
}

bool wants_names(const core::ImageFormat& format, const core::FilmSettings& film) {
  return format.extension == "exr" && (film.object_mattes || film.material_mattes);
}

std::optional<Error> refused_part(core::PixelRect part, core::PixelRect crop) {
  if (part.x >= crop.x && part.y >= crop.y && part.x + part.width <= crop.x + crop.width &&
      part.y + part.height <= crop.y + crop.height) {
    return std::nullopt;
  }
  return Error{ErrorCode::kInvalidArgument,
               "the part reaches beyond the film's " + std::to_string(crop.width) + " by " +
                   std::to_string(crop.height) + " pixels at " + std::to_string(crop.x) + ", " +
                   std::to_string(crop.y),
               "/x"};
}

}  // namespace server
