/// light_not_found: how much of a picture's light may be missing from it, from a census of
/// particles (core/integrators/census.h).
///
/// The census counts a fixed number of particles per sample of the picture. Light that the
/// integrator finds by design counts as found where the open half of the census met it. Everything
/// else is bounded from the held half: with k hits among its n particles, the light that was met
/// nowhere, or that the integrator finds by chance alone, is below the Clopper-Pearson limit of k
/// and n, exactly, whatever its distribution. Light that no integrator of its kind can find (a
/// punctual light through glass) is missing with certainty as soon as one particle meets it.
///
/// Besides, a tile lacks light where its luminance and that of the census are incompatible: with p
/// the probability of so many hits at the upper end of the tile's luminance, Holm's test of all
/// tiles at half of 1 - confidence. The census blurs light by the radius of its disks; what may
/// come from a brighter neighbour is allowed for.
#pragma once

#include <string_view>

#include "core/base/result.h"
#include "core/error/light_not_found.h"
#include "core/film/film.h"
#include "core/integrators/census.h"
#include "core/render/picture/view.h"

namespace core {

/// Returns the number of particles beside `samples` samples of the picture's pixels, a multiple of
/// kCensusPart.
int census_particles(const RenderSettings& settings, int samples);
inline constexpr int kCensusPart = 4096;

/// Returns whether particles can follow all light: census_obstacle() is empty.
bool has_census(const View& view);

/// Compares the census with the picture. particles: all that it traced.
LightNotFound light_not_found(const LightCensus& census, int particles, const Film& film,
                              const View& view, double confidence);

}  // namespace core
