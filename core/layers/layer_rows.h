/// The table of layers that films can show. A row is the registration.
#pragma once

#include <span>
#include <string_view>

#include "core/settings/settings.h"

namespace core {

struct DenoisedInput;
struct FilmSnapshot;

/// The layer that is the image.
inline constexpr std::string_view kBeauty = "beauty";

/// The kind of values in a layer.
enum class LayerForm {
  kValues,  ///< colours or other values that can be averaged
  kIds,     ///< integers
  kMattes   ///< Cryptomatte pairs: an id whose bits form a float, and its coverage
};

/// A layer that a film can show.
struct LayerEntry {
  std::string_view name;
  std::string_view summary;
  bool is_color;              ///< the tone curve applies
  std::string_view channels;  ///< of its image, one letter each
  /// One letter per channel in an EXR of all layers; empty if the layer is left out there.
  std::string_view exr_channels;
  /// Writes the values of all pixels, channels interleaved; NaN if unknown.
  void (*fill)(const FilmSnapshot& film, std::span<float> out);
  bool has_value = false;                  ///< defined for a single pixel
  bool FilmSettings::*recorded = nullptr;  ///< its setting; null if every film has the layer
  /// Returns whether the film has the layer. For layers with a setting.
  bool (*is_held)(const FilmSnapshot& film) = nullptr;
  LayerForm form = LayerForm::kValues;
  /// For layers that show a denoised image, which is computed on demand; null: the film suffices.
  void (*fill_denoised)(const FilmSnapshot& film, const DenoisedInput& denoised,
                        std::span<float> out) = nullptr;
};
std::span<const LayerEntry> layers();
/// Returns null if there is no such row.
const LayerEntry* find_layer(std::string_view name);

}  // namespace core
