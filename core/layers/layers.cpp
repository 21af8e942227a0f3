#include "core/layers/layers.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/error/pixel_error.h"
#include "core/settings/registry.h"

namespace core {
namespace {

/// Variance of the mean, per channel: the raw half estimate, which adds up over a block.
Rgb raw_variance(const FilmSnapshot& film, std::size_t pixel) {
  const HalfValue a = half_value(film, pixel, 0);
  const HalfValue b = half_value(film, pixel, 1);
  if (a.count == 0 || b.count == 0) {
    return Rgb(std::numeric_limits<float>::quiet_NaN());
  }
  const Rgb d = a.mean - b.mean;
  return d * d * 0.25F;
}

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
  put(out, raw_variance(film, i));
}
void fill_error(const FilmSnapshot& film, std::span<float> out) {
  const std::vector<float> error = relative_error_plane(film);
  std::copy(error.begin(), error.end(), out.begin());
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

}  // namespace

std::span<const LayerEntry> layers() { return kLayers; }

Result<FloatImage> layer_image(const FilmSnapshot& film, std::string_view name) {
  const LayerEntry* row = find_layer(name);
  if (row == nullptr) {
    return Error{ErrorCode::kInvalidArgument, "there is no layer '" + std::string(name) + "'", ""};
  }
  if (row->recorded != nullptr && !film.has_aux) {
    return Error{ErrorCode::kInvalidArgument,
                 "the layer '" + std::string(name) + "' was not recorded by this job", ""};
  }
  FloatImage image = blank(film, letters(row->channels));
  row->fill(film, image.values);
  return image;
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
  FloatImage image = blank(film, std::move(channels));
  const std::size_t stride = image.channel_names.size();
  std::size_t first = 0;
  for (const LayerEntry* row : rows) {
    const std::size_t count = row->exr_channels.size();
    std::vector<float> plane(film.pixel_count() * count);
    row->fill(film, plane);
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      std::copy_n(&plane[i * count], count, &image.values[i * stride + first]);
    }
    first += count;
  }
  return image;
}

}  // namespace core
