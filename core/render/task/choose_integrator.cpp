#include "core/render/task/choose_integrator.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>
#include <utility>

#include "core/error/error_estimate.h"
#include "core/integrators/bidirectional/caustic_aim.h"
#include "core/integrators/maps/photon_rules.h"
#include "core/integrators/registry.h"
#include "core/light_samplers/light_sampler.h"
#include "core/render/picture/split_pilot.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "core/samplers/streams.h"
#include "core/scene/scene_data.h"
#include "core/settings/sample_sets.h"

namespace core {
namespace {

/// Pixels of a pilot: enough to compare blocks, and few compared with an image.
constexpr double kPixels = 64.0 * 64.0;

/// Samples of a job, an assumption: the choice must not depend on how far a job goes, which may
/// change. Efficiencies are for so many: squared bias falls as N^(-2/3), and the noise of
/// photons with it (Knaus and Zwicker 2011); other noise falls as 1/N.
constexpr double kJobSamples = 1024;

/// samples: 64 of path take less time than 16 of bdpt in five of the six scenes below, and its
/// noise is in rarer paths.
/// ray_weight: CPU seconds per ray, including shading, relative to path's; the geometric mean over
/// cornell-box, interior, glass, keyhole, caustic-pool and many-lights at 240x136 (bdpt 2.1 to 6.1,
/// sppm 2.0 to 5.9, path-caustics 2.4 to 5.7), from the differences in `cpu_seconds` and `rays` of
/// `tessera render SCENE --integrator NAME --json` with 32 and 128 samples.
/// advantage: required over path, because pilots are only this accurate, and path offers adaptive
/// sampling and intervals of denoised images, which correlated pixels do not allow.
/// is_of_photons: all indirect light is, and its noise.
struct Candidate {
  std::string_view name;
  int samples;  ///< of the pilot, rounded to what the sampler can produce
  double ray_weight;
  double advantage;
  bool is_of_photons = false;
};
constexpr std::array<Candidate, 4> kCandidates = {{{"path", 64, 1.0, 1.0},
                                                   {"bdpt", 16, 3.1, 1.5},
                                                   {"sppm", 16, 2.8, 1.5, true},
                                                   {kCausticsIntegrator, 16, 3.3, 1.5}}};

/// Side of the blocks of pixels whose errors are relative to their light, as in the layers of
/// compared images: the smallest with a centre, for errors that are nearly those of single pixels.
constexpr int kBlock = 3;
/// An image has missed light if it is darker by more than twice the errors of both: 95% of a normal
/// distribution.
constexpr double kClear = 2;

/// Ray weight for each candidate of light sampler ris after the first, in CPU time as above: .22,
/// .19 and .18 for 2, 4 and 8 candidates, the geometric means over veach-mis, many-lights,
/// still-life, interior and files with glossy plates, small lights and a bottle under a map (.10 to
/// .36).
constexpr double kWorkOfCandidate = 0.2;
constexpr int kCandidatesMost = 4;  ///< 8 were less efficient in six of seven scenes

/// Samples and continuations of pilots of splitting: of 8 to 128 samples in 1,024 and 4,096 pixels,
/// and 2 or 4 continuations, the cheapest that chose counts with at least .8 of the best efficiency
/// in 16 of 19 scenes (files under maps, built-in ones, rooms). Fewer samples see too much noise of
/// camera rays, which well-distributed points take away first (Mitchell, Consequences of Stratified
/// Sampling in Graphics, 1996).
constexpr int kSplitPilotSamples = 32;
constexpr int kSplitPilotCount = 2;
/// CPU time of a camera ray, which often meets nothing, to that of others: the geometric mean over
/// 23 scenes of files and maps (.4 to 1.3), from `cpu_seconds` and `rays` of `tessera render SCENE
/// --split N --json` with 1 and 4 continuations, 128 samples.
constexpr double kWorkOfCameraRay = 0.65;

/// Samples of a pilot of a light sampler: 8, 16 and 64 chose alike in ten scenes of files and maps
/// and in six built-in ones.
constexpr int kLightPilotSamples = 8;

/// Returns null for names of other integrators.
const Candidate* find_candidate(std::string_view name) {
  const auto* row = std::find_if(kCandidates.begin(), kCandidates.end(),
                                 [&](const Candidate& each) { return each.name == name; });
  return row == kCandidates.end() ? nullptr : row;
}

double advantage_of(std::string_view name) {
  const Candidate* row = find_candidate(name);
  return row == nullptr ? 1 : row->advantage;
}

/// Returns the view with these settings, and a small film of the job's without its parts.
View small_view(const View& view, RenderSettings settings) {
  View small = view;
  settings.film = view.settings.film;
  settings.film.crop.reset();
  settings.film.shares.clear();
  settings.film.albedo = settings.film.normal = settings.film.depth = false;
  const double factor =
      std::min(1.0, std::sqrt(kPixels / settings.film.width / settings.film.height));
  const auto scaled = [factor](int side) {
    return std::max(1, static_cast<int>(std::lround(side * factor)));
  };
  settings.film.width = scaled(settings.film.width);
  settings.film.height = scaled(settings.film.height);
  settings.seed = kChoiceStream;
  small.settings = std::move(settings);
  return small;
}

/// Returns the job's settings as pilots of one of its options take them: without those in which
/// parts of an image or its backgrounds differ, and without the light sampler, which a settled job
/// names.
RenderSettings plain_settings(const View& view) {
  RenderSettings settings = view.settings;
  settings.adaptive = {};
  settings.meter = {};
  settings.replicates = RenderSettings().replicates;
  settings.first_replicate = RenderSettings().first_replicate;
  settings.light_sampler = LightSamplerType::kTree;
  settings.background = {};
  return settings;
}

View pilot_view(const View& view, std::string_view integrator) {
  RenderSettings settings = default_settings(integrator);
  settings.max_depth = view.settings.max_depth;
  settings.sampler = view.settings.sampler;
  settings.estimator.splitting = SplittingType::kNone;
  View small = small_view(view, settings);
  if (accepts(*find_integrator(integrator), "/integrator/photons")) {
    settings.film = view.settings.film;
    const auto pixels = [](const FilmSettings& film) {
      return static_cast<double>(film.width) * film.height;
    };
    const double share = pixels(small.settings.film) / pixels(settings.film);
    small.settings.photons.paths = std::max(1, static_cast<int>(photon_paths(settings) * share));
  }
  return small;
}

struct Rendered {
  std::shared_ptr<Film> film;
  double lacks = 0;  ///< LightNotFound::detected
};

/// Renders a pilot on this thread.
Result<Rendered> render_pilot(const View& view, int samples, bool counts_particles,
                              const std::stop_token& stop) {
  auto renderer = view.measured ? Renderer::create(view) : settled_renderer(view, {}, stop);
  if (!renderer) {
    return renderer.error();
  }
  auto film = make_film(view.settings);
  TaskOptions options;
  options.stop.samples_per_pixel = rounded_samples(view.settings, samples);
  options.compares = false;
  options.counts_particles = counts_particles;
  NullSink sink;
  RenderTask task(*std::move(renderer), film, std::move(options), sink);
  const std::stop_callback cancel(stop, [&task] { task.cancel(); });
  while (!task.finished()) {
    if (const auto slice = task.take()) {
      task.run(*slice);
    }
  }
  if (task.stop_reason() == StopReason::kCancelled) {
    return Error{ErrorCode::kCancelled, "stopped while choosing the integrator", ""};
  }
  const auto light = task.progress().light_not_found;
  return Rendered{film, light ? light->detected : 0};
}

/// Sums of squares over the pixels and channels of a block.
struct BlockFigures {
  double noise = 0;
  double light = 0;
  double roots = 0;   ///< of the luminance, for the floor
  double signal = 0;  ///< products of the halves: squared signal without bias from noise
};

template <typename Visit>
void for_each_pixel(const FilmSnapshot& film, const PixelRect& block, const Visit& visit) {
  for (int y = block.y; y < block.y + block.height; ++y) {
    for (int x = block.x; x < block.x + block.width; ++x) {
      visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(film.rect.width) +
            static_cast<std::size_t>(x));
    }
  }
}

BlockFigures figures_of(const FilmSnapshot& film, const PixelRect& block) {
  BlockFigures sums;
  for_each_pixel(film, block, [&](std::size_t i) {
    const Rgb one = half_value(film, i, 0).mean;
    const Rgb other = half_value(film, i, 1).mean;
    sums.light += 0.5 * static_cast<double>(luminance(one + other));
    sums.roots += root_of_light((one + other) * 0.5F);
    for (int c = 0; c < 3; ++c) {
      const auto apart = static_cast<double>(one[c] - other[c]);
      sums.noise += apart * apart / 4;
      sums.signal += static_cast<double>(one[c]) * static_cast<double>(other[c]);
    }
  });
  return sums;
}

double squared_distance(const FilmSnapshot& a, const FilmSnapshot& b, const PixelRect& block) {
  double sum = 0;
  for_each_pixel(a, block, [&](std::size_t i) {
    const auto mean = [i](const FilmSnapshot& film) {
      return (half_value(film, i, 0).mean + half_value(film, i, 1).mean) * 0.5F;
    };
    const Rgb apart = mean(a) - mean(b);
    for (int c = 0; c < 3; ++c) {
      sum += static_cast<double>(apart[c]) * static_cast<double>(apart[c]);
    }
  });
  return sum;
}

/// Returns the squared bias of an image, from one with a quarter of it: b - b / 4 = 3 b / 4. Its
/// expected value is right, so that of noise alone may be negative.
double squared_bias(const PilotImage& image, double noise, const PixelRect& block) {
  if (!image.finer) {
    return 0;
  }
  const double finer_noise = figures_of(*image.finer, block).noise;
  return 16.0 / 9 * (squared_distance(image.film, *image.finer, block) - noise - finer_noise);
}

std::string in_words(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// Returns the reason why no pilot is needed; empty if one is.
std::string without_pilot(const View& view) {
  if (view.settings.spectral) {
    return "spectral is true";
  }
  const SceneSummary& scene = view.scene->summary();
  if (scene.has_scattering || view.settings.fog) {
    return "the scene has scattering media";
  }
  return scene.has_dispersion ? "the scene has dispersion" : "";
}

}  // namespace

std::vector<double> pilot_errors(std::span<const PilotImage> images) {
  const PixelRect whole = images[0].film.rect;
  std::vector<PixelRect> blocks;
  for (int y = 0; y < whole.height; y += kBlock) {
    for (int x = 0; x < whole.width; x += kBlock) {
      blocks.push_back(
          {x, y, std::min(kBlock, whole.width - x), std::min(kBlock, whole.height - y)});
    }
  }
  std::vector<std::vector<BlockFigures>> figures;  // by block and image
  double roots = 0;
  for (const PixelRect& block : blocks) {
    figures.emplace_back();
    double most = 0;
    for (const PilotImage& image : images) {
      figures.back().push_back(figures_of(image.film, block));
      most = std::max(most, figures.back().back().roots);
    }
    roots += most;
  }
  const double pixels = static_cast<double>(whole.width) * whole.height;
  const double of_channel = error_floor(roots / pixels);
  const double floor = 3 * of_channel * of_channel;
  std::vector<double> noise(images.size());
  std::vector<double> bias(images.size());
  for (std::size_t t = 0; t < blocks.size(); ++t) {
    const double area = static_cast<double>(blocks[t].width) * blocks[t].height;
    const std::vector<BlockFigures>& of = figures[t];
    std::vector<double> biases;
    double signal = 0;
    for (std::size_t k = 0; k < images.size(); ++k) {
      biases.push_back(squared_bias(images[k], of[k].noise, blocks[t]));
      signal = std::max(signal, of[k].signal);
    }
    const double scale =
        area / pixels / std::max(signal + area * floor, std::numeric_limits<double>::min());
    for (std::size_t k = 0; k < images.size(); ++k) {
      double missed = 0;
      for (std::size_t j = 0; j < images.size(); ++j) {
        if (!(of[k].light < of[j].light)) {
          continue;
        }
        const double seen =
            of[k].noise + of[j].noise + std::max(biases[k], 0.0) + std::max(biases[j], 0.0);
        const double apart = squared_distance(images[k].film, images[j].film, blocks[t]);
        if (apart > kClear * kClear * seen) {
          missed = std::max(missed, apart - seen);
        }
      }
      noise[k] += scale * (of[k].noise * images[k].noise_growth + missed);
      bias[k] += scale * biases[k] * images[k].bias_growth;
    }
  }
  std::vector<double> errors;
  for (std::size_t k = 0; k < images.size(); ++k) {
    errors.push_back(noise[k] + std::max(bias[k], 0.0));
  }
  return errors;
}

std::size_t best_of(std::span<const PilotFigures> pilots) {
  const auto is_complete = [](const PilotFigures& pilot) { return !(pilot.lacks > kLackMost); };
  const bool some_are = std::any_of(pilots.begin(), pilots.end(), is_complete);
  std::size_t out = 0;
  double best = 0;
  for (std::size_t k = 0; k < pilots.size(); ++k) {
    const double score = pilots[k].efficiency / advantage_of(pilots[k].name);
    if (score > best && (is_complete(pilots[k]) || !some_are)) {
      best = score;
      out = k;
    }
  }
  return out;
}

namespace {

/// How V of a pilot is measured.
enum class Variance {
  kAgainstAll,  ///< pilot_errors()
  kReported     ///< the square of the error that a job reports, where all find the same light
};

/// Renders the pilot of a candidate, and one with half the radius if it is biased.
Result<PilotFigures> run_pilot(View small, const Candidate& candidate, Variance by,
                               PilotImage& image, const std::stop_token& stop) {
  const bool is_biased = find_integrator(small.settings.integrator)->bias != "none";
  float radius_m = 0;
  if (is_biased) {
    const SceneSummary& summary = small.scene->summary();
    const FilmSettings& film = small.settings.film;
    const auto camera =
        Camera::create(small.camera, summary.cameras, summary.bounds, film.width, film.height);
    if (!camera) {
      return camera.error();
    }
    radius_m = usual_photon_radius_m(small.scene->data(), *camera, film);
    small.settings.photons.radius_m = radius_m;
  }
  const bool compares_light = by == Variance::kAgainstAll;
  auto seen = render_pilot(small, candidate.samples, compares_light, stop);
  if (!seen) {
    return seen.error();
  }
  const Film& film = *seen->film;
  image.film = film.snapshot();
  const auto samples = static_cast<double>(film.sample_counts().sum);
  PilotFigures figures{.name = candidate.name,
                       .samples = film.sample_counts().mean,
                       .work = static_cast<double>(film.rays()) / samples * candidate.ray_weight,
                       .error = ErrorEstimate(film).image(0.95).relative,
                       .lacks = seen->lacks};
  if (is_biased) {
    image.bias_growth = std::cbrt(kJobSamples / figures.samples);  // N^(-2/3) over 1 / N
    image.noise_growth = candidate.is_of_photons ? image.bias_growth : 1;
    small.settings.photons.radius_m = radius_m / 2;
    ++small.settings.seed;  // Its noise is independent.
    seen = render_pilot(small, candidate.samples, compares_light, stop);
    if (!seen) {
      return seen.error();
    }
    image.finer = seen->film->snapshot();
  }
  return figures;
}

std::string text_of(const PilotChoice& choice) {
  std::string efficiencies;
  std::string advantages;
  std::string lacking;
  for (std::size_t k = 0; k < choice.pilots.size(); ++k) {
    const PilotFigures& pilot = choice.pilots[k];
    const std::string name(pilot.name);
    const char* comma = k + 1 < choice.pilots.size() ? ", " : "";
    if (pilot.lacks > kLackMost) {
      lacking += "; that of " + name + " lacks " + in_words(100 * pilot.lacks) + "% of the light";
    }
    efficiencies += in_words(pilot.efficiency) + " (" + name + ")" + comma;
    if (const double advantage = advantage_of(name); advantage > 1) {
      advantages += (advantages.empty() ? ", and the required advantage over path is " : ", ") +
                    in_words(advantage) + " for " + name;
    }
  }
  return "'" + std::string(choice.name) + "', since small pilot images have efficiencies " +
         "1 / (V T) of " + efficiencies + advantages + lacking;
}

/// Returns the fraction of the light on visible surfaces that is caustics.
Result<double> visible_caustics(const View& view) {
  const View small = pilot_view(view, kCausticsIntegrator);
  const auto camera = camera_of(small);
  if (!camera) {
    return camera.error();
  }
  EmissionSampler emission(small.scene->data(), small.environment.get());
  return aim_at_caustics(
      {small.scene->data(), small.environment.get(), small.settings, &camera->first()}, emission);
}

struct Trial {
  Candidate candidate;
  View view;  ///< of its pilot
};

std::vector<Trial> trials_of(const View& view, std::span<const std::string_view> names) {
  std::vector<Trial> out;
  for (const std::string_view name : names) {
    const auto* row = find_candidate(name);
    CHECK(row != nullptr);
    out.push_back({*row, pilot_view(view, name)});
  }
  return out;
}

void set_efficiency(PilotFigures& pilot, double squared_error) {
  pilot.variance = pilot.samples * squared_error;
  const double cost = pilot.variance * pilot.work;
  pilot.efficiency = cost > 0 ? 1 / cost : std::numeric_limits<double>::infinity();
}

Result<PilotChoice> choose_among(const std::vector<Trial>& trials, const std::stop_token& stop) {
  PilotChoice choice;
  std::vector<PilotImage> images(trials.size());
  for (std::size_t k = 0; k < images.size(); ++k) {
    auto figures =
        run_pilot(trials[k].view, trials[k].candidate, Variance::kAgainstAll, images[k], stop);
    if (!figures) {
      return figures.error();
    }
    choice.pilots.push_back(*figures);
  }
  const std::vector<double> errors = pilot_errors(images);
  for (std::size_t k = 0; k < images.size(); ++k) {
    set_efficiency(choice.pilots[k], errors[k]);
  }
  const PilotFigures& first = choice.pilots[0];
  choice.name = choice.pilots[best_of(choice.pilots)].name;
  choice.reason = std::isinf(first.efficiency) && !(first.lacks > kLackMost)
                      ? "'" + std::string(first.name) +
                            "', since its pilot image has no noise and misses no light"
                      : text_of(choice);
  return choice;
}

}  // namespace

Result<PilotChoice> choose_integrator(const View& view, bool has_error_target,
                                      const std::stop_token& stop) {
  if (const std::string why = without_pilot(view); !why.empty()) {
    return PilotChoice{"path", "'path', since " + why, {}};
  }
  std::vector<std::string_view> candidates = candidates_of(view.settings, has_error_target);
  if (candidates.back() == kCausticsIntegrator) {
    const auto caustics = visible_caustics(view);
    if (!caustics) {
      return caustics.error();
    }
    if (*caustics <= kCausticsLeast) {
      candidates.pop_back();
    }
  }
  return choose_among(trials_of(view, candidates), stop);
}

Result<PilotChoice> choose_caustics(const View& view, const std::stop_token& stop) {
  std::string why = without_pilot(view);
  if (why.empty()) {
    const auto caustics = visible_caustics(view);
    if (!caustics) {
      return caustics.error();
    }
    if (*caustics <= kCausticsLeast) {
      why = "caustics are " + in_words(100 * *caustics) + "% of the light that the camera sees";
    }
  }
  if (!why.empty()) {
    return PilotChoice{"path", "'path', since " + why, {}};
  }
  const std::array<std::string_view, 2> candidates = {"path", kCausticsIntegrator};
  return choose_among(trials_of(view, candidates), stop);
}

Result<int> choose_split_count(const View& view, const std::stop_token& stop) {
  RenderSettings settings = plain_settings(view);
  const auto pilot = [&](int count) {
    settings.estimator.splitting = count == 1 ? SplittingType::kNone : SplittingType::kFixed;
    settings.estimator.split_count = count;
    PilotImage image;
    return run_pilot(small_view(view, settings), {"path", kSplitPilotSamples, 1, 1},
                     Variance::kReported, image, stop);
  };
  const auto one = pilot(1);
  const auto several = one ? pilot(kSplitPilotCount) : one;
  if (!several) {
    return several.error();
  }
  // Of V = prefix + branch / n and T = prefix + n branch, at both counts.
  constexpr double kMore = kSplitPilotCount - 1;
  SplitCosts costs;
  costs.branch_variance = std::max(
      0.0, (one->error * one->error - several->error * several->error) * kSplitPilotCount / kMore);
  costs.prefix_variance = std::max(0.0, one->error * one->error - costs.branch_variance);
  costs.branch_rays = (several->work - one->work) / kMore;
  costs.prefix_rays = kWorkOfCameraRay * (one->work - costs.branch_rays);
  return best_split_count(costs);
}

Result<LightChoice> choose_light_sampler(const View& view, const std::stop_token& stop) {
  LightChoice choice;
  View ris = view;
  ris.settings.light_sampler = LightSamplerType::kRis;
  if (!LightSampler(view.scene->data(), nullptr, LightPick::kTree).has_local() ||
      !check_rules(ris)) {
    return choice;
  }
  RenderSettings settings = plain_settings(view);
  for (int candidates = 1; candidates <= kCandidatesMost; candidates *= 2) {
    settings.light_candidates = candidates;
    settings.light_sampler = candidates == 1 ? LightSamplerType::kTree : LightSamplerType::kRis;
    const Candidate priced = {candidates == 1 ? "tree" : "ris", kLightPilotSamples,
                              1 + kWorkOfCandidate * (candidates - 1), 1};
    PilotImage image;
    auto pilot = run_pilot(small_view(view, settings), priced, Variance::kReported, image, stop);
    if (!pilot) {
      return pilot.error();
    }
    set_efficiency(*pilot, pilot->error * pilot->error);
    choice.pilots.push_back(*pilot);
    if (candidates > 1 && !(pilot->efficiency > choice.pilots.end()[-2].efficiency)) {
      break;
    }
    choice.type = settings.light_sampler;
    choice.candidates = candidates;
  }
  return choice;
}

Status settle_light_sampler(View& view, const std::stop_token& stop) {
  LightSamplerType& type = view.settings.light_sampler;
  if (type != LightSamplerType::kMeasured) {
    return ok_status();
  }
  type = LightSamplerType::kTree;
  const bool has_choice =  // Not if `caustics` chose the integrator.
      accepts(*find_integrator(view.settings.integrator), "/light_sampler");
  if (!has_choice || view.is_quick) {
    return ok_status();
  }
  const auto choice = choose_light_sampler(view, stop);
  if (!choice) {
    return choice.error();
  }
  type = choice->type;
  if (type == LightSamplerType::kRis) {
    view.settings.light_candidates = choice->candidates;
  }
  return ok_status();
}

Result<std::string> settle_integrator(View& view, const StopRules& rules,
                                      const std::stop_token& stop) {
  RenderSettings& settings = view.settings;
  const CausticsType caustics = std::exchange(settings.caustics, CausticsType::kOff);
  if (caustics == CausticsType::kOn) {
    settings.integrator = kCausticsIntegrator;
    return std::string("integrator.caustics: 'on' is integrator 'path-caustics'.");
  }
  const bool is_automatic = settings.integrator == kAutomaticIntegrator;
  if (!is_automatic && caustics == CausticsType::kOff) {
    return std::string();
  }
  const auto choice = is_automatic ? choose_integrator(view, rules.has_error_target(), stop)
                                   : choose_caustics(view, stop);
  if (!choice) {
    return choice.error();
  }
  // Both accept no options of estimators, lights and adaptive sampling, so they are not set.
  DefaultTerms terms = kJobTerms;
  terms.has_error_target = rules.relative_error.has_value();
  const RenderSettings defaults = default_settings(choice->name, terms);
  settings.integrator = defaults.integrator;
  settings.estimator = defaults.estimator;
  settings.adaptive = defaults.adaptive;
  settings.light_sampler = defaults.light_sampler;
  return (is_automatic ? "integrator.type: 'auto' chose " : "integrator.caustics: 'auto' chose ") +
         choice->reason + ".";
}

}  // namespace core
