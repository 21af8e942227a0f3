/// Layers: pictures made of a film.
#pragma once

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
#include "core/image_io/image.h"
#include "core/image_io/image_rows.h"
#include "core/settings/registry.h"

namespace core {

/// What layers of denoised pictures show.
struct DenoisedLook {
  std::shared_ptr<const DenoisedPicture> picture;  ///< of the whole film; null: there is none
  DenoiseMode mode = DenoiseMode::kMixed;
};

/// Does a film of such a job have the layer?
bool has_layer(const FilmSnapshot& film, const FilmSettings& settings, const LayerEntry& row);

/// The name that readers of Cryptomatte find a layer of mattes by: CryptoObject. Pre: it is one.
std::string_view matte_layer(const LayerEntry& row);

/// Channels of an EXR of all layers whose values are whole numbers.
std::vector<std::string> whole_channels();

/// The most channels that an EXR of all layers has.
std::size_t channels_max(const Film& film);

/// Layer `name` (a row of layers()) as a float image. Unknown errors are NaN. Errors:
/// kInvalidArgument when the layer is unknown, was not recorded, or needs a denoised picture.
Result<FloatImage> layer_image(const FilmSnapshot& film, std::string_view name,
                               const DenoisedLook* look = nullptr);
/// All recorded layers in one image, for EXR: R G B A of beauty, then channels such as albedo.R,
/// and CryptoObject00.R.
FloatImage all_layers_image(const FilmSnapshot& film, const FilmSettings& settings);

/// Puts the weighted sum of the shares of the light in place of the picture. Its halves are those
/// of the sum, so that its error is right: shares come from the same paths. Pre: a weight for each.
void mix_shares(FilmSnapshot& film, std::span<const float> weights);

/// Layers of a film by rows: a few rows of them are in memory at a time.
class LayerRows {
 public:
  /// rect: inside the film's crop. layer: a row of layers(); null: all, as all_layers_image() has
  /// them. film is borrowed; settings are the job's. Errors: of layer_image().
  /// denoised: of the whole film, for layers that show it. mix: weights of the film's shares of the
  /// light, whose sum stands for the picture; empty: the picture.
  static Result<LayerRows> create(const Film& film, PixelRect rect,
                                  const std::optional<std::string>& layer,
                                  const FilmSettings& settings, DenoisedLook denoised = {},
                                  std::vector<float> mix = {});
  /// Borrows this.
  ImageRows rows();
  /// The most that it takes.
  static std::uint64_t bytes(const Film& film, PixelRect rect);

 private:
  LayerRows(const Film& film, PixelRect rect, std::optional<std::string> layer,
            const FilmSettings& settings)
      : film_(&film), rect_(rect), layer_(std::move(layer)), settings_(settings) {}
  bool has_errors() const { return !layer_ || *layer_ == "error"; }
  Result<FloatImage> band(int first, int count) const;
  FilmSnapshot snapshot(PixelRect rect) const;

  const Film* film_;
  PixelRect rect_;
  std::optional<std::string> layer_;
  FilmSettings settings_;
  DenoisedLook denoised_;
  std::vector<float> mix_;
  double mean_luminance_ = 0;
  FloatImage band_;
  int first_ = 0;  ///< Row of rect that band_ begins with.
};

}  // namespace core
