/// Where the film's filter straddles the rim of something that shines: found by rays that look for nothing else.
///
/// A few rays a pixel tell where the brightness of lights changes within the reach of the filter; there, a grid of rays gives the
/// integral of the filter times what is seen. Nothing of it goes into the picture; it is the same whenever the job runs.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include "core/film/filter.h"
#include "core/film/light_edges.h"
#include "core/render/settings.h"

namespace core {

/// What is directly seen of lights at one place of the film.
struct SeenLight {
  Vec2 film_px;
  Rgb radiance;
};

/// Looks at place i of side * side ones, jittered, of the pixel (x, y), which may be outside of the film by the filter's radius.
using LightViewer = std::function<SeenLight(int x, int y, int i, int side)>;

/// Plans of samples need to know less of what is seen at a rim than errors do, and in less time.
enum class EdgeDetail { kPlans, kErrors };

/// The search, a row of pixels at a time: whoever has time goes on with it. Not thread-safe.
///
/// Finds at most a 32nd of the pixels and a few thousand, those of the strongest contrast. What covers less than a 16th of a pixel may be
/// missed, or more on large films.
class LightEdgeSearch {
 public:
  LightEdgeSearch(const PixelRect& crop, const FilterSampler& filter, LightViewer look);
  ~LightEdgeSearch();
  LightEdgeSearch(const LightEdgeSearch&) = delete;
  LightEdgeSearch& operator=(const LightEdgeSearch&) = delete;

  /// For who has little use for it: a fourth of the places, and half of those at rims for plans. Pre: no step was taken.
  void be_sparing() noexcept;
  bool knows(EdgeDetail detail) const noexcept;
  void step(EdgeDetail detail);  ///< Towards knowing it. Pre: not yet.
  const LightEdges& edges(EdgeDetail detail) const;  ///< Pre: known.
  int side(EdgeDetail detail) const noexcept;  ///< Of the grid of places in each pixel that told. Pre: known.
  /// All steps that are left; none are known when stop was requested before the end.
  LightEdges finish(const std::stop_token& stop);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace core
