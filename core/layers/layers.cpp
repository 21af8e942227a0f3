#include "core/layers/layers.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "core/denoise/denoised_picture.h"
#include "core/error/pixel_error.h"
#include "core/layers/layer_rows.h"
#include "core/settings/light_shares.h"

namespace core {
namespace {

void put(float* out, Rgb c) {
  out[0] = c.r;
  out[1] = c.g;
  out[2] = c.b;
}

std::vector<std::string> letters(std::string_view channels) {
  std::vector<std::string> names;
  for (const char letter : channels) {
    names.emplace_back(1, letter);
  }
  return names;
}

/// Returns CryptoObject00.R and so on, the names that Cryptomatte readers expect.
std::vector<std::string> matte_channels(const LayerEntry& row) {
  std::vector<std::string> names = letters(row.channels);
  for (std::size_t i = 0; i < names.size(); ++i) {
    names[i] = std::string(matte_layer(row)) + "0" + std::to_string(i / 4) + "." + names[i];
  }
  return names;
}

/// Returns the channels of a row's image.
std::vector<std::string> channels_of(const LayerEntry& row) {
  return row.form == LayerForm::kMattes ? matte_channels(row) : letters(row.channels);
}

/// Returns the channels of a row in an EXR of all layers. The image's own have no prefix, so
/// viewers show them first.
std::vector<std::string> exr_channels_of(const LayerEntry& row) {
  if (row.form == LayerForm::kMattes) {
    return matte_channels(row);
  }
  std::vector<std::string> names = letters(row.exr_channels);
  for (std::string& name : names) {
    name.insert(0, row.name == kBeauty ? "" : std::string(row.name) + ".");
  }
  return names;
}

FloatImage blank(const FilmSnapshot& film, std::vector<std::string> channels) {
  FloatImage image;
  image.width = film.rect.width;
  image.height = film.rect.height;
  image.channel_names = std::move(channels);
  image.values.resize(film.pixel_count() * image.channel_names.size());
  return image;
}

void fill_colors(const FilmSnapshot& film, std::span<float> out) {
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    put(&out[3 * i], pixel_value(film, i).mean);
  }
}

Result<FloatImage> share_image(const FilmSnapshot& film, std::string_view name) {
  const auto share = share_of(film, name);
  if (!share) {
    return Error{ErrorCode::kInvalidArgument,
                 "the layer '" + std::string(name) + "' was not recorded by this job", ""};
  }
  FloatImage image = blank(film, letters("RGB"));
  fill_colors(*share, image.values);
  return image;
}

/// Rows computed at a time. Their light takes less than a megabyte if they have 1920 pixels: it
/// stays in the second-level cache and in memory that the server keeps mapped
/// (give_back_large_blocks()).
constexpr int kBandRows = kTileSize / 4;

}  // namespace

bool has_layer(const FilmSnapshot& film, const FilmSettings& settings, const LayerEntry& row) {
  return row.recorded == nullptr || (row.is_held(film) && settings.*row.recorded);
}

std::string_view matte_layer(const LayerEntry& row) {
  return row.recorded == &FilmSettings::object_mattes ? "CryptoObject" : "CryptoMaterial";
}

std::vector<std::string> whole_channels() {
  std::vector<std::string> names;
  for (const LayerEntry& row : layers()) {
    if (row.form == LayerForm::kIds) {
      names.push_back(exr_channels_of(row).front());
    }
  }
  return names;
}

std::size_t channels_max(const Film& film) {
  FilmSnapshot parts;
  parts.recorded = film.recorded();
  std::size_t count = 3 * film.shares().size();
  for (const LayerEntry& row : layers()) {
    const bool is_held = row.recorded == nullptr || row.is_held(parts);
    count += is_held ? exr_channels_of(row).size() : 0;
  }
  return count;
}

Result<FloatImage> layer_image(const FilmSnapshot& film, std::string_view name,
                               const DenoisedInput* denoised) {
  const LayerEntry* row = find_layer(name);
  if (row == nullptr && light_share(name)) {
    return share_image(film, name);
  }
  if (row == nullptr) {
    return Error{ErrorCode::kInvalidArgument, "there is no layer '" + std::string(name) + "'", ""};
  }
  if (row->recorded != nullptr && !row->is_held(film)) {
    return Error{ErrorCode::kInvalidArgument,
                 "the layer '" + std::string(name) + "' was not recorded by this job", ""};
  }
  if (row->fill_denoised != nullptr && (denoised == nullptr || denoised->picture == nullptr)) {
    return Error{ErrorCode::kInvalidArgument,
                 "the layer '" + std::string(name) + "' needs a denoised image", ""};
  }
  FloatImage image = blank(film, channels_of(*row));
  if (row->fill_denoised != nullptr) {
    row->fill_denoised(film, *denoised, image.values);
  } else {
    row->fill(film, image.values);
  }
  return image;
}

void mix_shares(FilmSnapshot& film, std::span<const float> weights) {
  for (std::size_t i = 0; i < film.pixels.size(); ++i) {
    Rgb sum;
    for (std::size_t k = 0; k < weights.size(); ++k) {
      sum += film.shares[i * weights.size() + k] * weights[k];
    }
    ReplicatePixel& p = film.pixels[i];
    p.mean_r = sum.r;
    p.mean_g = sum.g;
    p.mean_b = sum.b;
    p.m2_luminance = 0;
  }
}

FloatImage all_layers_image(const FilmSnapshot& film, const FilmSettings& settings) {
  std::vector<const LayerEntry*> rows;
  std::vector<std::string> channels;
  for (const LayerEntry& row : layers()) {
    if (!has_layer(film, settings, row) || row.exr_channels.empty()) {
      continue;
    }
    for (std::string& name : exr_channels_of(row)) {
      channels.push_back(std::move(name));
    }
    rows.push_back(&row);
  }
  for (const LightShare& share : settings.shares) {
    for (const std::string& letter : letters("RGB")) {
      channels.push_back(share.layer + "." + letter);
    }
  }
  FloatImage image = blank(film, std::move(channels));
  const std::size_t stride = image.channel_names.size();
  std::size_t first = 0;
  const auto add = [&](const std::vector<float>& plane) {
    const std::size_t count = plane.size() / film.pixel_count();
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      std::copy_n(&plane[i * count], count, &image.values[i * stride + first]);
    }
    first += count;
  };
  for (const LayerEntry* row : rows) {
    std::vector<float> plane(film.pixel_count() * row->exr_channels.size());
    row->fill(film, plane);
    add(plane);
  }
  for (const LightShare& share : settings.shares) {
    std::vector<float> plane(film.pixel_count() * 3);
    if (const auto part = share_of(film, share.layer)) {
      fill_colors(*part, plane);
    }
    add(plane);
  }
  return image;
}

Result<LayerRows> LayerRows::create(const Film& film, PixelRect rect,
                                    const std::optional<std::string>& layer,
                                    const FilmSettings& settings, LayerOptions options) {
  LayerRows rows(film, rect, layer, settings);
  rows.options_ = std::move(options);
  if (rows.has_errors() && rows.options_.mix.empty()) {
    rows.error_floor_ = film.error_floor();
  } else if (rows.has_errors()) {
    FloorSum light;
    const PixelRect whole = film.crop();
    for (int y = 0; y < whole.height; y += kBandRows) {
      light.add(rows.snapshot(
          {whole.x, whole.y + y, whole.width, std::min(kBandRows, whole.height - y)}));
    }
    rows.error_floor_ = light.floor();
  }
  if (rows.options_.denoised.picture != nullptr) {
    rows.set_aside_ = rows.options_.denoised.picture->set_aside;
  }
  auto first = rows.band(0, std::min(kBandRows, rect.height));
  if (!first) {
    return first.error();
  }
  rows.band_ = *std::move(first);
  return rows;
}

bool has_fireflies(const std::optional<std::string>& layer) {
  return layer && (*layer == kBeauty || light_share(*layer));
}

/// The snapshot includes the neighbours of the rect, which bound the light of its border.
Result<LayerRows::Band> LayerRows::calm_band(const PixelRect& rect) {
  const PixelRect wide = with_neighbours(rect, film_->crop());
  FilmSnapshot film = snapshot(wide, Film::Planes::kLight);
  const bool is_share = light_share(*layer_).has_value();
  if (is_share) {
    auto share = share_of(film, *layer_);
    if (!share) {
      return share_image(film, *layer_).error();
    }
    film = *std::move(share);
  }
  set_aside_ += core::set_aside(film, rect);
  FloatImage image = blank(film, letters(is_share ? "RGB" : "RGBA"));
  if (is_share) {
    fill_colors(film, image.values);
  } else {
    find_layer(kBeauty)->fill(film, image.values);
  }
  const std::size_t first = image.index(rect.x - wide.x, rect.y - wide.y, 0);
  return Band{std::move(image), first, rect.height};
}

Result<LayerRows::Band> LayerRows::band(int first, int count) {
  if (options_.sets_aside) {
    return calm_band({rect_.x, rect_.y + first, rect_.width, count});
  }
  // Pixel errors are pooled over neighbours within the image.
  const int above = has_errors() ? std::min(kErrorWindow, first) : 0;
  const int below = has_errors() ? std::min(kErrorWindow, rect_.height - first - count) : 0;
  FilmSnapshot snapshot =
      this->snapshot({rect_.x, rect_.y + first - above, rect_.width, above + count + below});
  snapshot.error_floor = error_floor_;
  auto image = layer_ ? layer_image(snapshot, *layer_, &options_.denoised)
                      : Result<FloatImage>(all_layers_image(snapshot, settings_));
  if (!image) {
    return image.error();
  }
  const std::size_t begin = image->index(0, above, 0);
  return Band{*std::move(image), begin, count};
}

FilmSnapshot LayerRows::snapshot(PixelRect rect, Film::Planes planes) const {
  FilmSnapshot out = film_->snapshot(rect, planes);
  if (!options_.mix.empty()) {
    mix_shares(out, options_.mix);
  }
  return out;
}

ImageRows LayerRows::rows() {
  return {rect_.width, rect_.height, band_.image.channel_names, [this](int y) {
            if (y < first_ || y >= first_ + band_.rows) {
              first_ = y - y % kBandRows;
              band_ = *band(first_, std::min(kBandRows, rect_.height - first_));
            }
            return &band_.image.values[band_.begin + band_.image.index(0, y - first_, 0)];
          }};
}

std::uint64_t LayerRows::bytes(const Film& film, PixelRect rect) {
  const PixelRect crop = film.crop();
  const std::uint64_t film_pixels =
      static_cast<std::uint64_t>(crop.width) * static_cast<std::uint64_t>(crop.height);
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(rect.width) * (kBandRows + 2 * kErrorWindow);
  // The snapshot, again for a share; sums and planes of errors; the layers before and after
  // conversion.
  constexpr std::uint64_t kErrorBytes = 3 * sizeof(double) + 2 * sizeof(float);
  const std::uint64_t layer_bytes = 2 * channels_max(film) * sizeof(float);
  const std::uint64_t snapshots = film.shares().empty() ? 1 : 2;
  return pixels * (snapshots * (film.bytes() / film_pixels + 1) + kErrorBytes + layer_bytes);
}

}  // namespace core
