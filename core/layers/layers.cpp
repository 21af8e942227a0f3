#include "core/layers/layers.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "core/denoise/denoised_picture.h"
#include "core/error/pixel_error.h"
#include "core/settings/registry.h"

namespace core {
namespace {

void put(float* out, Rgb c) {
  out[0] = c.r;
  out[1] = c.g;
  out[2] = c.b;
}

/// write(film, pixel, out) for each pixel.
template <auto kWrite>
void fill(const FilmSnapshot& film, std::span<float> out) {
  const std::size_t channels = out.size() / film.pixel_count();
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    kWrite(film, i, &out[i * channels]);
  }
}

void write_beauty(const FilmSnapshot& film, std::size_t i, float* out) {
  const HalfValue v = pixel_value(film, i);
  put(out, v.mean);
  out[3] = v.alpha;
}
void write_albedo(const FilmSnapshot& film, std::size_t i, float* out) {
  put(out, film.aux[i].albedo);
}
void write_normal(const FilmSnapshot& film, std::size_t i, float* out) {
  const Vec3 n = film.aux[i].normal_world;
  put(out, {n.x, n.y, n.z});
}
void write_depth(const FilmSnapshot& film, std::size_t i, float* out) {
  *out = film.aux[i].depth_m;
}
void write_alpha(const FilmSnapshot& film, std::size_t i, float* out) {
  *out = pixel_value(film, i).alpha;
}
void write_samples(const FilmSnapshot& film, std::size_t i, float* out) {
  *out = static_cast<float>(pixel_value(film, i).count);
}
void write_variance(const FilmSnapshot& film, std::size_t i, float* out) {
  put(out, raw_variance(half_value(film, i, 0), half_value(film, i, 1)));
}
void fill_error(const FilmSnapshot& film, std::span<float> out) {
  const std::vector<float> error = relative_error_plane(film);
  std::copy(error.begin(), error.end(), out.begin());
}

/// write(look, pixel of the denoised picture, out) for each pixel; the picture is of the whole
/// film.
template <auto kWrite>
void fill_denoised(const FilmSnapshot& film, const DenoisedLook& look, std::span<float> out) {
  const PixelRect& whole = look.picture->rect;
  const std::size_t channels = out.size() / film.pixel_count();
  std::size_t i = 0;
  for (int y = film.rect.y - whole.y; y < film.rect.y - whole.y + film.rect.height; ++y) {
    for (int x = film.rect.x - whole.x; x < film.rect.x - whole.x + film.rect.width; ++x, ++i) {
      const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(whole.width) +
                      static_cast<std::size_t>(x);
      kWrite(look, at, &out[i * channels]);
    }
  }
}

void put(float* out, const ColorPlanes& planes, std::size_t i) {
  put(out, {planes[0][i], planes[1][i], planes[2][i]});
}
void write_denoised(const DenoisedLook& look, std::size_t i, float* out) {
  put(out, look.picture->planes(look.mode), i);
}
void write_denoised_error(const DenoisedLook& look, std::size_t i, float* out) {
  *out = look.picture->error(look.mode)[i];
}
void write_denoise_bias(const DenoisedLook& look, std::size_t i, float* out) {
  put(out, look.picture->bias, i);
}
void write_denoise_bias_error(const DenoisedLook& look, std::size_t i, float* out) {
  put(out, look.picture->bias_error, i);
}
/// Coverage is that of the plain picture.
void fill_denoised_beauty(const FilmSnapshot& film, const DenoisedLook& look,
                          std::span<float> out) {
  fill_denoised<&write_denoised>(film, look, out);
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    out[4 * i + 3] = pixel_value(film, i).alpha;
  }
}

constexpr std::array kLayers = {
    LayerEntry{.name = kBeauty,
               .summary = "The picture: radiance and coverage.",
               .is_color = true,
               .channels = "RGBA",
               .exr_channels = "RGBA",
               .fill = &fill<&write_beauty>,
               .is_mean = true},
    LayerEntry{.name = "albedo",
               .summary = "Fraction of light that the first surface reflects or transmits.",
               .is_color = true,
               .channels = "RGB",
               .exr_channels = "RGB",
               .fill = &fill<&write_albedo>,
               .is_mean = true,
               .recorded = &FilmSettings::albedo},
    LayerEntry{.name = "normal",
               .summary = "Shading normal of the first surface, world space, in [-1, 1].",
               .is_color = false,
               .channels = "RGB",
               .exr_channels = "XYZ",
               .fill = &fill<&write_normal>,
               .is_mean = true,
               .recorded = &FilmSettings::normal},
    LayerEntry{.name = "depth",
               .summary = "Distance from the eye to the first surface in metres, mean over hits.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "Z",
               .fill = &fill<&write_depth>,
               .is_mean = true,
               .recorded = &FilmSettings::depth},
    LayerEntry{.name = "alpha",
               .summary = "Coverage; below 1 where a hidden environment shows.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "",  // the A of beauty
               .fill = &fill<&write_alpha>,
               .is_mean = true},
    LayerEntry{.name = "samples",
               .summary = "Samples taken.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "Y",
               .fill = &fill<&write_samples>},
    LayerEntry{.name = "variance",
               .summary = "Variance of the mean, raw estimate from the two halves.",
               .is_color = false,
               .channels = "RGB",
               .exr_channels = "RGB",
               .fill = &fill<&write_variance>},
    LayerEntry{.name = "error",
               .summary = "Relative error of the pixel, pooled over its neighbourhood.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "Y",
               .fill = &fill_error},
    LayerEntry{.name = "denoised",
               .summary = "The denoised picture, mixed with the plain one where that is better.",
               .is_color = true,
               .channels = "RGBA",
               .exr_channels = "",
               .fill = nullptr,
               .fill_denoised = &fill_denoised_beauty},
    LayerEntry{.name = "denoised_error",
               .summary = "Relative error of the denoised picture, bias included, over 64 pixels.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "",
               .fill = nullptr,
               .fill_denoised = &fill_denoised<&write_denoised_error>},
    LayerEntry{.name = "denoise_bias",
               .summary = "Light that the denoiser adds or takes, signed, over 15 pixels.",
               .is_color = false,
               .channels = "RGB",
               .exr_channels = "",
               .fill = nullptr,
               .fill_denoised = &fill_denoised<&write_denoise_bias>},
    LayerEntry{.name = "denoise_bias_error",
               .summary = "Standard error of denoise_bias.",
               .is_color = false,
               .channels = "RGB",
               .exr_channels = "",
               .fill = nullptr,
               .fill_denoised = &fill_denoised<&write_denoise_bias_error>},
};

/// Channel names of a row's image.
std::vector<std::string> letters(std::string_view channels) {
  std::vector<std::string> names;
  for (const char letter : channels) {
    names.emplace_back(1, letter);
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

/// Rows that are made at a time: one row of tiles, and what the encoders ask for.
constexpr int kBandRows = kTileSize;

}  // namespace

std::span<const LayerEntry> layers() { return kLayers; }

Result<FloatImage> layer_image(const FilmSnapshot& film, std::string_view name,
                               const DenoisedLook* look) {
  const LayerEntry* row = find_layer(name);
  if (row == nullptr && light_share(name)) {
    return share_image(film, name);
  }
  if (row == nullptr) {
    return Error{ErrorCode::kInvalidArgument, "there is no layer '" + std::string(name) + "'", ""};
  }
  if (row->recorded != nullptr && !film.has_aux) {
    return Error{ErrorCode::kInvalidArgument,
                 "the layer '" + std::string(name) + "' was not recorded by this job", ""};
  }
  if (row->fill_denoised != nullptr && (look == nullptr || look->picture == nullptr)) {
    return Error{ErrorCode::kInvalidArgument,
                 "the layer '" + std::string(name) + "' needs a denoised picture", ""};
  }
  FloatImage image = blank(film, letters(row->channels));
  if (row->fill_denoised != nullptr) {
    row->fill_denoised(film, *look, image.values);
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
  for (const LayerEntry& row : kLayers) {
    const bool has = row.recorded == nullptr || (film.has_aux && settings.*row.recorded);
    if (!has || row.exr_channels.empty()) {
      continue;
    }
    // The picture's own channels have no prefix: viewers show them first.
    const std::string prefix = row.name == kBeauty ? "" : std::string(row.name) + ".";
    for (const std::string& letter : letters(row.exr_channels)) {
      channels.push_back(prefix + letter);
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
                                    const FilmSettings& settings, DenoisedLook denoised,
                                    std::vector<float> mix) {
  LayerRows rows(film, rect, layer, settings);
  rows.denoised_ = std::move(denoised);
  rows.mix_ = std::move(mix);
  if (rows.has_errors()) {
    Light light;
    for (int y = 0; y < rect.height; y += kBandRows) {
      light.add(
          rows.snapshot({rect.x, rect.y + y, rect.width, std::min(kBandRows, rect.height - y)}));
    }
    rows.mean_luminance_ = light.mean();
  }
  auto first = rows.band(0, std::min(kBandRows, rect.height));
  if (!first) {
    return first.error();
  }
  rows.band_ = *std::move(first);
  return rows;
}

Result<FloatImage> LayerRows::band(int first, int count) const {
  // Errors of pixels are pooled over their neighbours, as far as the picture goes.
  const int above = has_errors() ? std::min(kErrorWindow, first) : 0;
  const int below = has_errors() ? std::min(kErrorWindow, rect_.height - first - count) : 0;
  FilmSnapshot snapshot =
      this->snapshot({rect_.x, rect_.y + first - above, rect_.width, above + count + below});
  snapshot.mean_luminance = mean_luminance_;
  auto image = layer_ ? layer_image(snapshot, *layer_, &denoised_)
                      : Result<FloatImage>(all_layers_image(snapshot, settings_));
  if (image) {
    auto& values = image->values;
    values.resize(image->index(0, above + count, 0));
    values.erase(values.begin(),
                 values.begin() + static_cast<std::ptrdiff_t>(image->index(0, above, 0)));
    image->height = count;
  }
  return image;
}

FilmSnapshot LayerRows::snapshot(PixelRect rect) const {
  FilmSnapshot out = film_->snapshot(rect);
  if (!mix_.empty()) {
    mix_shares(out, mix_);
  }
  return out;
}

ImageRows LayerRows::rows() {
  return {rect_.width, rect_.height, band_.channel_names, [this](int y) {
            if (y < first_ || y >= first_ + band_.height) {
              first_ = y - y % kBandRows;
              band_ = *band(first_, std::min(kBandRows, rect_.height - first_));
            }
            return &band_.values[band_.index(0, y - first_, 0)];
          }};
}

std::uint64_t LayerRows::bytes(const Film& film, PixelRect rect) {
  const PixelRect crop = film.crop();
  const std::uint64_t film_pixels =
      static_cast<std::uint64_t>(crop.width) * static_cast<std::uint64_t>(crop.height);
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(rect.width) * (kBandRows + 2 * kErrorWindow);
  // The snapshot, and once more for a share; sums and planes of errors; the layers, 16 and the
  // shares at most, as they were and as they are.
  constexpr std::uint64_t kErrorBytes = 3 * sizeof(double) + 2 * sizeof(float);
  const std::uint64_t layer_bytes = 2 * (16 + 3 * film.shares().size()) * sizeof(float);
  const std::uint64_t snapshots = film.shares().empty() ? 1 : 2;
  return pixels * (snapshots * (film.bytes() / film_pixels + 1) + kErrorBytes + layer_bytes);
}

}  // namespace core
