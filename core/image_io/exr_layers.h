/// Chooses the picture among the layers of an OpenEXR file.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace core {

/// A part of a file: the only one has no name.
struct ExrPart {
  std::string name;
  std::vector<std::string> channels;
};

struct ExrPicture {
  std::size_t part = 0;
  std::vector<int> channels;  ///< of the part: R G B, R G B A, or grey, grey A
};

/// Names of channels are LAYER.CHANNEL; in a file of several parts, those without a layer belong to
/// the layer that the part is named after. The picture is the layer with R, G and B (or `red`,
/// `green`, `blue`) that has no name; else Nuke's `rgba`, Blender's `Composite.Combined` or
/// `ViewLayer.Combined`, `beauty`, `view`; else the only one. Without R, G and B it is Y, chosen
/// alike, as grey; else up to four channels of the only layer, in order. Errors: kInvalidArgument
/// that lists the layers, if none or several qualify, and for luminance and chroma.
Result<ExrPicture> choose_exr_picture(const std::vector<ExrPart>& parts);

}  // namespace core
