/// Layers: images computed from a film.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/denoise/denoised_picture.h"
#include "core/film/film.h"
#include "core/film/set_aside.h"
#include "core/image_io/image.h"
#include "core/image_io/image_rows.h"
#include "core/layers/layer_rows.h"

namespace core {

/// The content of layers that show a denoised image.
struct DenoisedInput {
  std::shared_ptr<const DenoisedPicture> picture;  ///< of the whole film; null if there is none
  DenoiseMode mode = DenoiseMode::kMixed;
};

/// Returns whether the film of such a job has the layer.
bool has_layer(const FilmSnapshot& film, const FilmSettings& settings, const LayerEntry& row);

/// Returns the name by which Cryptomatte readers find a layer of mattes, such as CryptoObject. Pre:
/// it is one.
std::string_view matte_layer(const LayerEntry& row);

/// Returns the integer channels of an EXR of all layers.
std::vector<std::string> whole_channels();

/// Returns the maximum number of channels of an EXR of all layers.
std::size_t channels_max(const Film& film);

/// Returns layer `name` (a row of layers()) as a float image. Unknown errors are NaN. Errors:
/// kInvalidArgument if the layer is unknown, was not recorded, or needs a denoised image.
Result<FloatImage> layer_image(const FilmSnapshot& film, std::string_view name,
                               const DenoisedInput* denoised = nullptr);
/// Returns all recorded layers as one image for EXR: R G B A of beauty, then channels such as
/// albedo.R and CryptoObject00.R.
FloatImage all_layers_image(const FilmSnapshot& film, const FilmSettings& settings);

/// Replaces the image by the weighted sum of the light's shares. Its halves are those of the sum,
/// so that its error is correct although shares come from the same paths. Pre: one weight per
/// share.
void mix_shares(FilmSnapshot& film, std::span<const float> weights);

/// How layers of a film are shown.
struct LayerOptions {
  DenoisedInput denoised = {};  ///< of the whole film, for layers that show it
  /// Weights of the film's shares of the light, whose sum replaces the image; empty: the image.
  std::vector<float> mix = {};
  /// Sets fireflies aside (core/film/set_aside.h). Pre: has_fireflies() of the layer.
  bool sets_aside = false;
};

/// Returns whether the layer shows the light of the halves: beauty or a share of it.
bool has_fireflies(const std::optional<std::string>& layer);

/// Layers of a film by rows; keeps a few rows in memory at a time.
class LayerRows {
 public:
  /// rect: inside the film's crop. layer: a row of layers(); null: all, as in all_layers_image().
  /// Borrows the film; settings are the job's. Errors: as layer_image().
  static Result<LayerRows> create(const Film& film, PixelRect rect,
                                  const std::optional<std::string>& layer,
                                  const FilmSettings& settings, LayerOptions options = {});
  /// Borrows this object.
  ImageRows rows();
  /// Returns what was set aside in the rows so far, or in the denoised image.
  const SetAside& set_aside() const { return set_aside_; }
  /// Returns the maximum memory.
  static std::uint64_t bytes(const Film& film, PixelRect rect);

 private:
  /// Rows within an image, which may have neighbours around them.
  struct Band {
    FloatImage image;
    std::size_t begin = 0;  ///< index of their first value
    int rows = 0;
  };

  LayerRows(const Film& film, PixelRect rect, std::optional<std::string> layer,
            const FilmSettings& settings)
      : film_(&film), rect_(rect), layer_(std::move(layer)), settings_(settings) {}
  bool has_errors() const { return !layer_ || *layer_ == "error"; }
  Result<Band> band(int first, int count);
  Result<Band> calm_band(const PixelRect& rect);
  FilmSnapshot snapshot(PixelRect rect, Film::Planes planes = Film::Planes::kAll) const;

  const Film* film_;
  PixelRect rect_;
  std::optional<std::string> layer_;
  FilmSettings settings_;
  LayerOptions options_;
  SetAside set_aside_;
  double error_floor_ = 0;
  Band band_;
  int first_ = 0;  ///< its first row, of rect
};

}  // namespace core
