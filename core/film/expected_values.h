/// What the pixels' values would be without noise, as far as the halves tell: what variances are divided by.
///
/// A noisy pixel's own mean does not do: a firefly's square over the square of its own mean never exceeds 1, however rare
/// it is; and the mean of a region mixes what is dark with what is bright where noise hides the border. Rare events mostly
/// are in one half only. So the lesser of the halves, min(A, B), is nearly free of them and shows the picture's edges, and
/// its mean is taken over regions that end there; what it lacks, (A + B) / 2 - min(A, B) = |A - B| / 2, is averaged over a
/// window that holds enough events. Both averages are without bias, so their sum is, where noise is alike.
///
/// Where lights are seen in part the scene says what of them is expected (core/film/light_edges.h). These pixels have no part in the averages;
/// what else they see is had from those around them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/film/film.h"
#include "core/film/light_edges.h"
#include "core/film/probed_pixel.h"

namespace core {

struct ExpectedValue {
  Rgb mean;                ///< radiance
  bool is_shared = false;  ///< is it had from regions?
  /// Where it is: how far what the halves have in common is from its mean over the region whose lack is taken for the pixel's, over `mean`.
  /// What is lacking grows with what is there, so the share that Var / mean^2 may be wrong by is about as large.
  float unlike = 0;
  /// What the pixel gives to one of the averages that `mean` is the sum of: of what the halves have in common, and of what that lacks.
  struct Share {
    std::uint32_t part = 0;  ///< number of the region, below that of the pixels
    Rgb apart;               ///< from the region's average
  };
  std::array<Share, 2> shares;
};

/// One for each pixel of the snapshot, both of whose halves have samples. O(pixels). edges: of the snapshot, whose rect is the film's
/// crop; none where they are not known.
/// probed: pixels that are taken for what these say, and have no events.
std::vector<ExpectedValue> expected_values(const FilmSnapshot& film, const LightEdges& edges = {}, std::span<const ProbedPixel> probed = {});

/// Relative variance of what the pixel sees of lights, Var / (mu^2 + 0.01), if its samples were independent. expected: mu.
float edge_noise(const FilmSnapshot& film, const LightEdge& edge, Rgb expected);

}  // namespace core
