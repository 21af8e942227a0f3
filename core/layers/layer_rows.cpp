#include "core/layers/layer_rows.h"

// The table of layers, and functions that compute their values.
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/denoise/denoised_picture.h"
#include "core/error/pixel_error.h"
#include "core/film/film.h"
#include "core/layers/layers.h"

namespace core {
namespace {

void put(float* out, Rgb c) {
  out[0] = c.r;
  out[1] = c.g;
  out[2] = c.b;
}

/// Calls write(film, pixel, out) for each pixel.
template <auto kWrite>
void fill(const FilmSnapshot& film, std::span<float> out) {
  const std::size_t channels = out.size() / film.pixel_count();
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    kWrite(film, i, &out[i * channels]);
  }
}

/// Estimates of alpha may lie outside [0,1]: noise behind glass, and neutral shadows that get more
/// light from the model than it takes.
float bounded(float alpha) { return std::clamp(alpha, 0.0F, 1.0F); }

void write_beauty(const FilmSnapshot& film, std::size_t i, float* out) {
  const HalfValue v = pixel_value(film, i);
  put(out, v.mean);
  out[3] = bounded(v.alpha);
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
  *out = bounded(pixel_value(film, i).alpha);
}
void write_samples(const FilmSnapshot& film, std::size_t i, float* out) {
  *out = static_cast<float>(pixel_value(film, i).count);
}
void write_variance(const FilmSnapshot& film, std::size_t i, float* out) {
  const auto [a, b] = error_halves(film, i);
  put(out, raw_variance(a, b));
}
template <auto kMember>
void write_id(const FilmSnapshot& film, std::size_t i, float* out) {
  *out = static_cast<float>(film.first_hits[i].*kMember);
}
void write_position(const FilmSnapshot& film, std::size_t i, float* out) {
  const Vec3 p = film.first_hits[i].position;
  put(out, {p.x, p.y, p.z});
}
void write_z_depth(const FilmSnapshot& film, std::size_t i, float* out) { *out = film.z_depths[i]; }
void write_uv(const FilmSnapshot& film, std::size_t i, float* out) {
  const Vec2 uv = film.first_hits[i].uv;
  put(out, {uv.x, uv.y, 0});
}
void write_motion(const FilmSnapshot& film, std::size_t i, float* out) {
  const Vec2 motion = film.first_hits[i].motion;
  put(out, {motion.x, motion.y, 0});
}

/// Writes ids and coverages, largest first. Halves have equal weight, as in a pixel's value.
void write_mattes(const FilmSnapshot& film, std::size_t i, std::size_t kind, float* out) {
  const std::array<float, 2> counts = {static_cast<float>(half_value(film, i, 0).count),
                                       static_cast<float>(half_value(film, i, 1).count)};
  const float halves = (counts[0] > 0 ? 1.0F : 0.0F) + (counts[1] > 0 ? 1.0F : 0.0F);
  std::array<std::pair<float, std::uint32_t>, kMatteRanks> ranks{};
  for (std::size_t k = 0; k < kMatteRanks; ++k) {
    const MatteRank& rank = film.mattes[i * film.recorded.matte_kinds().count() + kind][k];
    float coverage = 0;
    for (std::size_t h = 0; h < 2; ++h) {
      coverage += counts[h] > 0 ? static_cast<float>(rank.hits[h]) / counts[h] / halves : 0.0F;
    }
    ranks[k] = {-coverage, rank.id};
  }
  std::sort(ranks.begin(), ranks.end());
  for (const auto& [coverage, id] : ranks) {
    *out++ = std::bit_cast<float>(id);
    *out++ = -coverage;
  }
}
void write_object_mattes(const FilmSnapshot& film, std::size_t i, float* out) {
  write_mattes(film, i, 0, out);
}
void write_material_mattes(const FilmSnapshot& film, std::size_t i, float* out) {
  write_mattes(film, i, film.recorded.matte_kinds().count() - 1, out);
}

void fill_error(const FilmSnapshot& film, std::span<float> out) {
  const std::vector<float> error = relative_error_plane(film);
  std::copy(error.begin(), error.end(), out.begin());
}

/// Calls write(denoised, pixel of the denoised image, out) for each pixel; that image is of the
/// whole film.
template <auto kWrite>
void fill_denoised(const FilmSnapshot& film, const DenoisedInput& denoised, std::span<float> out) {
  const PixelRect& whole = denoised.picture->rect;
  const std::size_t channels = out.size() / film.pixel_count();
  std::size_t i = 0;
  for (int y = film.rect.y - whole.y; y < film.rect.y - whole.y + film.rect.height; ++y) {
    for (int x = film.rect.x - whole.x; x < film.rect.x - whole.x + film.rect.width; ++x, ++i) {
      const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(whole.width) +
                      static_cast<std::size_t>(x);
      kWrite(denoised, at, &out[i * channels]);
    }
  }
}

void put(float* out, const ColorPlanes& planes, std::size_t i) {
  put(out, {planes[0][i], planes[1][i], planes[2][i]});
}
void write_denoised(const DenoisedInput& denoised, std::size_t i, float* out) {
  put(out, denoised.picture->planes(denoised.mode), i);
}
void write_denoised_error(const DenoisedInput& denoised, std::size_t i, float* out) {
  *out = denoised.picture->error(denoised.mode)[i];
}
void write_denoise_bias(const DenoisedInput& denoised, std::size_t i, float* out) {
  put(out, denoised.picture->bias, i);
}
void write_denoise_bias_error(const DenoisedInput& denoised, std::size_t i, float* out) {
  put(out, denoised.picture->bias_error, i);
}
void write_denoised_with_alpha(const DenoisedInput& denoised, std::size_t i, float* out) {
  write_denoised(denoised, i, out);
  out[3] = bounded(denoised.picture->alpha(denoised.mode)[i]);
}
/// Coverage is that of the plain image, unless it was denoised too.
void fill_denoised_beauty(const FilmSnapshot& film, const DenoisedInput& denoised,
                          std::span<float> out) {
  if (!denoised.picture->alpha(denoised.mode).empty()) {
    fill_denoised<&write_denoised_with_alpha>(film, denoised, out);
    return;
  }
  fill_denoised<&write_denoised>(film, denoised, out);
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    out[4 * i + 3] = bounded(pixel_value(film, i).alpha);
  }
}

bool has_aux(const FilmSnapshot& film) { return film.recorded.aux; }
bool has_first_hits(const FilmSnapshot& film) { return film.recorded.first_hits; }

/// Two ranks per layer of four channels.
constexpr std::string_view kMatteChannels = "RGBARGBARGBA";

constexpr std::array kLayers = {
    LayerEntry{.name = kBeauty,
               .summary = "The image: radiance and coverage.",
               .is_color = true,
               .channels = "RGBA",
               .exr_channels = "RGBA",
               .fill = &fill<&write_beauty>,
               .has_value = true},
    LayerEntry{.name = "albedo",
               .summary = "Albedo: fraction of light that the first surface reflects or transmits.",
               .is_color = true,
               .channels = "RGB",
               .exr_channels = "RGB",
               .fill = &fill<&write_albedo>,
               .has_value = true,
               .recorded = &FilmSettings::albedo,
               .is_held = &has_aux},
    LayerEntry{.name = "normal",
               .summary = "Shading normal of the first surface, world space, in [-1, 1].",
               .is_color = false,
               .channels = "RGB",
               .exr_channels = "XYZ",
               .fill = &fill<&write_normal>,
               .has_value = true,
               .recorded = &FilmSettings::normal,
               .is_held = &has_aux},
    LayerEntry{
        .name = "depth",
        .summary = "Distance from the camera to the first surface in metres, mean over hits.",
        .is_color = false,
        .channels = "Y",
        .exr_channels = "Z",
        .fill = &fill<&write_depth>,
        .has_value = true,
        .recorded = &FilmSettings::depth,
        .is_held = &has_aux},
    LayerEntry{
        .name = "object",
        .summary =
            "Id of the node hit by the ray through the pixel's centre: 1 + its index; 0: none.",
        .is_color = false,
        .channels = "Y",
        .exr_channels = "Y",
        .fill = &fill<&write_id<&FirstHitPixel::object>>,
        .has_value = true,
        .recorded = &FilmSettings::object,
        .is_held = &has_first_hits,
        .form = LayerForm::kIds},
    LayerEntry{
        .name = "instance",
        .summary = "Id of the node's instance there; more than one with EXT_mesh_gpu_instancing.",
        .is_color = false,
        .channels = "Y",
        .exr_channels = "Y",
        .fill = &fill<&write_id<&FirstHitPixel::instance>>,
        .has_value = true,
        .recorded = &FilmSettings::instance,
        .is_held = &has_first_hits,
        .form = LayerForm::kIds},
    LayerEntry{.name = "material",
               .summary = "Id of the material there: 1 + its index.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "Y",
               .fill = &fill<&write_id<&FirstHitPixel::material>>,
               .has_value = true,
               .recorded = &FilmSettings::material,
               .is_held = &has_first_hits,
               .form = LayerForm::kIds},
    LayerEntry{
        .name = "primitive",
        .summary =
            "Id of the glTF primitive there: 1 + its index among the primitives of all meshes.",
        .is_color = false,
        .channels = "Y",
        .exr_channels = "Y",
        .fill = &fill<&write_id<&FirstHitPixel::primitive>>,
        .has_value = true,
        .recorded = &FilmSettings::primitive,
        .is_held = &has_first_hits,
        .form = LayerForm::kIds},
    LayerEntry{.name = "position",
               .summary = "Position of the hit: world space, metres.",
               .is_color = false,
               .channels = "RGB",
               .exr_channels = "XYZ",
               .fill = &fill<&write_position>,
               .has_value = true,
               .recorded = &FilmSettings::position,
               .is_held = &has_first_hits},
    LayerEntry{.name = "uv",
               .summary = "First set of texture coordinates there; the third channel is 0.",
               .is_color = false,
               .channels = "RGB",
               .exr_channels = "UVW",
               .fill = &fill<&write_uv>,
               .has_value = true,
               .recorded = &FilmSettings::uv,
               .is_held = &has_first_hits},
    LayerEntry{.name = "motion",
               .summary = "Motion vector in pixels, to the right and up, from now until "
                          "motion_seconds later; the third channel is 0.",
               .is_color = false,
               .channels = "RGB",
               .exr_channels = "UVW",
               .fill = &fill<&write_motion>,
               .has_value = true,
               .recorded = &FilmSettings::motion,
               .is_held = &has_first_hits},
    LayerEntry{.name = "z_depth",
               .summary = "Distance along the camera's axis to the hit there, metres; negative "
                          "behind, where fisheyes and panoramas see.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "Z",
               .fill = &fill<&write_z_depth>,
               .has_value = true,
               .recorded = &FilmSettings::z_depth,
               .is_held = [](const FilmSnapshot& film) { return film.recorded.z_depth; }},
    LayerEntry{.name = "cryptomatte:object",
               .summary = "Cryptomatte of objects: six name ids with their coverage.",
               .is_color = false,
               .channels = kMatteChannels,
               .exr_channels = kMatteChannels,
               .fill = &fill<&write_object_mattes>,
               .recorded = &FilmSettings::object_mattes,
               .is_held = [](const FilmSnapshot& film) { return film.recorded.object_mattes; },
               .form = LayerForm::kMattes},
    LayerEntry{.name = "cryptomatte:material",
               .summary = "Cryptomatte of materials.",
               .is_color = false,
               .channels = kMatteChannels,
               .exr_channels = kMatteChannels,
               .fill = &fill<&write_material_mattes>,
               .recorded = &FilmSettings::material_mattes,
               .is_held = [](const FilmSnapshot& film) { return film.recorded.material_mattes; },
               .form = LayerForm::kMattes},
    LayerEntry{.name = "alpha",
               .summary = "Coverage; below 1 where the background is transparent.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "",  // included as the A of beauty
               .fill = &fill<&write_alpha>,
               .has_value = true},
    LayerEntry{.name = "samples",
               .summary = "Number of samples.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "Y",
               .fill = &fill<&write_samples>},
    LayerEntry{.name = "variance",
               .summary = "Variance of the mean, estimated from the two halves without pooling.",
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
               .summary = "The denoised image, blended with the plain one where that is better.",
               .is_color = true,
               .channels = "RGBA",
               .exr_channels = "",
               .fill = nullptr,
               .fill_denoised = &fill_denoised_beauty},
    LayerEntry{.name = "denoised_error",
               .summary = "Relative error of the denoised image, bias included, over 64 pixels.",
               .is_color = false,
               .channels = "Y",
               .exr_channels = "",
               .fill = nullptr,
               .fill_denoised = &fill_denoised<&write_denoised_error>},
    LayerEntry{.name = "denoise_bias",
               .summary = "Estimated bias of the denoiser, signed, over 15 pixels.",
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

}  // namespace

std::span<const LayerEntry> layers() { return kLayers; }

const LayerEntry* find_layer(std::string_view name) {
  const auto row = std::find_if(std::begin(kLayers), std::end(kLayers),
                                [name](const LayerEntry& r) { return r.name == name; });
  return row != std::end(kLayers) ? &*row : nullptr;
}

}  // namespace core
