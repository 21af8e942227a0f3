#include "core/render/picture/light_not_found.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/statistics.h"
#include "core/integrators/registry.h"
#include "core/integrators/rules.h"
#include "core/math/numbers.h"
#include "core/scene/scene_data.h"

namespace core {
namespace {

/// Samples of pixels per particle: at most 5% of the picture's cost, of which three samples take as
/// much as one particle where samples are cheapest (callgrind on cornell-box: 3,800 instructions a
/// sample, 10,400 a particle).
constexpr double kSamplesPerParticle = 60;
/// Bounds less than 1/1000 of all light where none arrives: by the held half, -log(0.025) / 8,192
/// or 0.05%; in one of 2,000 tiles (Holm), -log(0.025 / 2,000) / 16,384 or 0.07%.
constexpr int kParticlesLeast = 1 << 14;
constexpr int kParticlesMost = 1 << 22;

/// How an integrator finds light that reaches its first diffuse surface through or off sharp ones.
enum class CausticLight {
  kByChance,       ///< camera paths hit the emitter, which no point or direction can be, or scatter
                   ///< to it in a narrow lobe
  kByConnections,  ///< light paths connect to surfaces, but not to those seen through smooth ones
  kByPhotons       ///< wherever the camera sees it
};

/// A prepass for each sample traces photons, and splats are connections.
CausticLight caustic_light_of(const IntegratorEntry& row) {
  return row.prepass_bytes != nullptr && !row.keeps_prepass ? CausticLight::kByPhotons
         : row.splats                                       ? CausticLight::kByConnections
                                                            : CausticLight::kByChance;
}

/// Whether the integrator finds light of a route by design, by chance, or never.
enum class Finds { kByDesign, kByChance, kNever };

Finds finds(CausticLight by, LightRoute route) {
  const bool is_missed = by == CausticLight::kByChance
                             ? route.is_caustic()
                             : by == CausticLight::kByConnections &&
                                   route.kind == LightRoute::kCaustic && route.is_mirrored;
  return !is_missed                             ? Finds::kByDesign
         : route.is_punctual && !route.is_rough ? Finds::kNever
                                                : Finds::kByChance;
}

struct TileLuminance {
  double mean = 0;
  double error = 0;  ///< standard error
};

/// The standard error is from the halves: of pixels, or of the tile if that is larger, as where
/// errors of pixels are correlated.
TileLuminance luminance_of(const FilmSnapshot& film) {
  double sum = 0;
  double squares = 0;
  double apart = 0;
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const HalfValue a = half_value(film, i, 0);
    const HalfValue b = half_value(film, i, 1);
    if (!(a.count > 0) || !(b.count > 0)) {
      return {0, std::numeric_limits<double>::infinity()};
    }
    const auto d = static_cast<double>(luminance(a.mean) - luminance(b.mean)) / 2;
    sum += static_cast<double>(luminance(pixel_value(film, i).mean));
    squares += d * d;
    apart += d;
  }
  const auto n = static_cast<double>(film.pixel_count());
  return {sum / n, std::max(std::sqrt(squares), std::fabs(apart)) / n};
}

/// A tile of the picture and of the census.
struct Compared {
  PixelRect rect;
  double share = 0;  ///< of the picture's area
  TileLuminance picture;
  double upper = 0;  ///< of the picture's luminance
  double hits = 0;
  double never = 0;   ///< hits that the integrator cannot find
  double chance = 1;  ///< of so many hits if the picture is right
  bool is_lacking = false;
};

/// Returns the largest upper end of a tile and its neighbours. Tiles are row by row.
double brightest_around(const std::vector<Compared>& tiles, std::size_t t) {
  const auto end_of_row = std::find_if(tiles.begin(), tiles.end(), [&](const Compared& tile) {
    return tile.rect.y != tiles.front().rect.y;
  });
  const auto columns = end_of_row - tiles.begin();
  const auto at = static_cast<std::ptrdiff_t>(t);
  double most = tiles[t].upper;
  for (std::ptrdiff_t row = at / columns - 1; row <= at / columns + 1; ++row) {
    for (std::ptrdiff_t column = at % columns - 1; column <= at % columns + 1; ++column) {
      const std::ptrdiff_t other = row * columns + column;
      if (column >= 0 && column < columns && other >= 0 && other < std::ssize(tiles)) {
        most = std::max(most, tiles[static_cast<std::size_t>(other)].upper);
      }
    }
  }
  return most;
}

/// Share of the light of a tile's disks that may come from beyond its border. Of the disk around a
/// point at distance d from a straight border the part beyond, integrated over d, is 2 r / (3 pi).
double leak(const PixelRect& rect, int radius_px) {
  const double border = 2.0 * (rect.width + rect.height);
  return std::min(1.0, border * 2 * radius_px /
                           (3 * std::numbers::pi * static_cast<double>(rect.width) * rect.height));
}

/// Marks tiles by Holm's test (1979).
void mark_lacking(std::vector<Compared>& tiles, double alpha) {
  std::vector<Compared*> order;
  for (Compared& tile : tiles) {
    order.push_back(&tile);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const Compared* a, const Compared* b) { return a->chance < b->chance; });
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (order[i]->chance > alpha / static_cast<double>(order.size() - i)) {
      return;
    }
    order[i]->is_lacking = true;
  }
}

/// Returns the integrators that find the light by design and may render the view; first the one
/// that computes all other light as `path` does.
std::vector<std::string> finders_of(const View& view, bool needs_photons) {
  const SceneTraits scene = traits_of(view.scene->summary());
  std::vector<std::string> out;
  for (const std::string_view name :
       {kCausticsIntegrator, std::string_view("bdpt"), std::string_view("sppm")}) {
    RenderSettings settings = default_settings(name);
    settings.film = view.settings.film;
    settings.spectral = view.settings.spectral;
    const bool finds_it =
        !needs_photons || caustic_light_of(row_of(integrators(), name)) == CausticLight::kByPhotons;
    if (finds_it && broken_rules(settings, view.camera, &scene).empty()) {
      out.emplace_back(name);
    }
  }
  return out;
}

/// Names the light, its way and the integrators that find it.
std::string reason_of(const LightCensus& census, const View& view,
                      const std::vector<std::string>& finders) {
  const SceneData& scene = view.scene->data();
  std::string text = "The image lacks light";
  if (const auto source = census.caustic_source()) {
    const std::string& material = scene.materials[source->material].factors.name;
    text += " of '" + scene.light_groups[source->group] + "' by way of ";
    text += material.empty() ? "a smooth surface" : "'" + material + "'";
  }
  std::string names;
  for (const std::string& name : finders) {
    names += names.empty() ? "" : &name == &finders.back() ? " or " : ", ";
    names += name;
  }
  return text + "; " +
         (names.empty() ? "no integrator finds it in such a job." : names + " finds it.");
}

}  // namespace

int census_particles(const RenderSettings& settings, int samples) {
  const PixelRect crop = settings.film.area();
  const double wanted =
      static_cast<double>(crop.width) * crop.height * samples / kSamplesPerParticle;
  const auto count = static_cast<int>(std::clamp<double>(wanted, kParticlesLeast, kParticlesMost));
  return (count + kCensusPart - 1) / kCensusPart * kCensusPart;
}

bool has_census(const View& view) {
  return census_obstacle(view.settings, view.scene->summary().has_scattering).empty();
}

LightNotFound light_not_found(const LightCensus& census, int particles, const Film& film,
                              const View& view, double confidence) {
  LightNotFound out;
  out.confidence = confidence;
  out.particles = static_cast<std::uint32_t>(particles);
  const CausticLight by = caustic_light_of(row_of(integrators(), view.settings.integrator));
  const double alpha = (1 - confidence) / 2;  // for the bound and for the test of tiles
  const auto count = static_cast<std::size_t>(film.tile_count());
  const double alpha_tile = alpha / static_cast<double>(std::max<std::size_t>(count, 1));
  const PixelRect crop = film.crop();
  const double area = static_cast<double>(crop.width) * crop.height;
  std::vector<Compared> tiles(count);
  double mean = 0;
  double unmet = 0;
  double mirrored = 0;  // hits of caustics that the camera sees through smooth surfaces
  double caustics = 0;
  for (std::size_t t = 0; t < count; ++t) {
    Compared& tile = tiles[t];
    tile.rect = film.tile_rect(static_cast<int>(t));
    tile.share = static_cast<double>(tile.rect.width) * tile.rect.height / area;
    tile.picture = luminance_of(film.snapshot(tile.rect));
    tile.upper = tile.picture.mean + normal_quantile(1 - alpha_tile) * tile.picture.error;
    mean += tile.share * tile.picture.mean;
    for (int r = 0; r < LightRoute::kCount; ++r) {
      const LightRoute route = LightRoute::at(r);
      const CensusHits hits = census.hits(static_cast<int>(t), route);
      const Finds how = finds(by, route);
      unmet += how != Finds::kByDesign || hits.open == 0 ? hits.pictured : 0;
      tile.hits += hits.open + hits.held;
      tile.never += how == Finds::kNever ? hits.open + hits.held : 0;
      caustics += route.is_caustic() ? hits.open + hits.held : 0;
      mirrored += route.is_caustic() && route.is_mirrored ? hits.open + hits.held : 0;
    }
  }
  for (std::size_t t = 0; t < count; ++t) {
    Compared& tile = tiles[t];
    const double upper = tile.upper + leak(tile.rect, census.spacing_px()) *
                                          (brightest_around(tiles, t) - tile.upper);
    const double unit = census.unit(static_cast<int>(t));
    tile.chance = unit > upper ? binomial_tail(tile.hits, particles, upper / unit) : 1.0;
  }
  mark_lacking(tiles, alpha);
  const double held = 0.5 * particles;
  double most = census.picture_unit() * binomial_upper(std::min(unmet, held), held, alpha);
  double detected = 0;
  for (std::size_t t = 0; t < count; ++t) {
    const Compared& tile = tiles[t];
    const double unit = census.unit(static_cast<int>(t));
    double lacks = unit * tile.never / particles;
    if (tile.is_lacking) {
      const double upper =
          binomial_upper(std::min<double>(tile.hits, particles), particles, alpha_tile);
      lacks = std::max(lacks, unit * tile.hits / particles - tile.picture.mean);
      most += tile.share * std::max(0.0, unit * upper - tile.picture.mean);
    }
    if (lacks > 0) {
      out.tiles.push_back(static_cast<int>(t));
      detected += tile.share * lacks;
    }
  }
  // A black picture has no share of light; 1 says that all of it may be missing.
  out.at_most = mean > 0 ? most / mean : (most > 0 ? 1.0 : 0.0);
  out.detected = mean > 0 ? detected / mean : (detected > 0 ? 1.0 : 0.0);
  if (!out.tiles.empty()) {
    const bool needs_photons = by == CausticLight::kByConnections || 2 * mirrored > caustics;
    out.integrators = finders_of(view, needs_photons);
    out.reason = reason_of(census, view, out.integrators);
  }
  return out;
}

}  // namespace core
