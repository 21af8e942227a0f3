/// What the pixels' values would be without noise, as far as the halves tell: what variances are divided by.
///
/// A noisy pixel's own mean does not do: a firefly's square over the square of its own mean never exceeds 1, however rare
/// it is; and the mean of a region mixes what is dark with what is bright where noise hides the border. Rare events mostly
/// are in one half only. So the lesser of the halves, min(A, B), is nearly free of them and shows the picture's edges, and
/// its mean is taken over regions that end there; what it lacks, (A + B) / 2 - min(A, B) = |A - B| / 2, is averaged over a
/// window that holds enough events. Both averages are without bias, so their sum is, where noise is alike.
#pragma once

#include <vector>

#include "core/film/film.h"

namespace core {

struct ExpectedValue {
  Rgb mean;      ///< radiance
  Rgb variance;  ///< of a pixel's mean in the region that `mean` is shared with; 0 where it is the pixel's own
};

/// One for each pixel of the snapshot, both of whose halves have samples. O(pixels).
std::vector<ExpectedValue> expected_values(const FilmSnapshot& film);

}  // namespace core
