/// Fireflies for display: light that is in one half alone and outshines all around it.
///
/// No pixel of a half may outshine both itself in the other half and its eight neighbours in both
/// halves: it is scaled down to the brightest of them and keeps its colour. What two samples or two
/// pixels agree on stays. The measured error of the plain image also holds for this one.
#pragma once

#include <array>
#include <vector>

#include "core/film/film.h"

namespace core {

/// Luminance set aside, and of the image with it.
struct SetAside {
  double taken = 0;
  double light = 0;
  double share() const { return light > 0 ? taken / light : 0; }
  SetAside& operator+=(const SetAside& other);
};

/// Factors of a pixel's light in half A and in half B, [half][pixel].
using CalmFactors = std::array<std::vector<float>, 2>;
/// Pixels beyond the snapshot, and halves without samples, outshine nothing. A pixel that lacks a
/// half keeps its light.
CalmFactors calm_factors(const FilmSnapshot& film);

/// Returns what the factors take from the snapshot.
SetAside taken_by(const FilmSnapshot& film, const CalmFactors& factors);

/// Scales the light of the snapshot. Returns what it took within `counted`, a part of its rect.
SetAside set_aside(FilmSnapshot& film, const PixelRect& counted);

/// Returns the light of a tile without fireflies, as far as its neighbours are known; without
/// auxiliary layers.
TileState calm_tile(const Film& film, int tile);

/// Grows a part of an image by one pixel within the image.
PixelRect with_neighbours(const PixelRect& rect, const PixelRect& image);

}  // namespace core
