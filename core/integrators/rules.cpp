#include "core/integrators/rules.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include "core/integrators/registry.h"
#include "core/settings/choices.h"
#include "core/settings/sample_sets.h"

namespace core {
namespace {

struct Job {
  const RenderSettings& settings;
  const CameraSettings& camera;
  const SceneTraits* scene;  ///< may be null
  const IntegratorEntry& integrator;
};

/// Something that a job asks for or that its scene has.
struct Trait {
  std::string_view pointer;  ///< where it is refused
  std::string_view words;    ///< its name in sentences
  bool (*is_on)(const Job& job);
};

constexpr Trait kOptimal = {"/estimator/mis/type", "'optimal'", [](const Job& job) {
                              return job.settings.estimator.mis == MisType::kOptimal &&
                                     job.settings.estimator.strategy == Strategy::kMis;
                            }};
constexpr Trait kControl = {
    "/estimator/control_variate/type", "a control variate", [](const Job& job) {
      return job.settings.estimator.control_variate != ControlVariateType::kNone;
    }};
/// Reported for the whole group: another strategy has no control variate of any type.
constexpr Trait kAnyControl = {"/estimator/control_variate", kControl.words, kControl.is_on};
constexpr Trait kWeights = {"/estimator/mis", "weights", [](const Job& job) {
                              const EstimatorSettings usual;
                              return job.settings.estimator.mis != usual.mis ||
                                     job.settings.estimator.mis_exponent != usual.mis_exponent;
                            }};
constexpr Trait kSplitting = {"/estimator/splitting/type", "splitting", [](const Job& job) {
                                return job.settings.estimator.splitting != SplittingType::kNone;
                              }};
constexpr Trait kThreshold = {
    "/estimator/roulette/type", "roulette 'threshold'",
    [](const Job& job) { return job.settings.estimator.roulette == RouletteType::kThreshold; }};
constexpr Trait kRandomEnds = {
    "/estimator/expected_values", "expected_values false",
    [](const Job& job) { return !job.settings.estimator.expected_values; }};
constexpr Trait kBlindDirections = {"/estimator/strategy", "strategies 'cosine' and 'uniform'",
                                    [](const Job& job) {
                                      return job.settings.estimator.strategy == Strategy::kCosine ||
                                             job.settings.estimator.strategy == Strategy::kUniform;
                                    }};
constexpr Trait kOneTechnique = {
    "/estimator/strategy", "a strategy other than 'mis'",
    [](const Job& job) { return job.settings.estimator.strategy != Strategy::kMis; }};
constexpr Trait kNoLightSamples = {
    "/estimator/strategy", "strategies 'bsdf', 'cosine' and 'uniform'", [](const Job& job) {
      return kBlindDirections.is_on(job) || job.settings.estimator.strategy == Strategy::kBsdf;
    }};
constexpr Trait kRis = {"/light_sampler/type", "light sampler 'ris'", [](const Job& job) {
                          return light_reuse(job.settings.light_sampler) == LightReuse::kResample;
                        }};
constexpr Trait kRestir = {"/light_sampler/type", "light sampler 'restir'", [](const Job& job) {
                             return light_reuse(job.settings.light_sampler) == LightReuse::kShare;
                           }};
constexpr Trait kFog = {"/medium", "a medium",
                        [](const Job& job) { return job.settings.fog.has_value(); }};
constexpr Trait kScattering = {"/integrator/type", "scattering in the scene", [](const Job& job) {
                                 return job.scene != nullptr && job.scene->has_scattering;
                               }};
constexpr Trait kMedium = {"/medium", "a medium that scatters", [](const Job& job) {
                             return kFog.is_on(job) || kScattering.is_on(job);
                           }};
constexpr Trait kDispersion = {"/integrator/type", "dispersion in the scene", [](const Job& job) {
                                 return job.scene != nullptr && job.scene->has_dispersion;
                               }};
constexpr Trait kSpectral = {"/spectral", "spectral true",
                             [](const Job& job) { return job.settings.spectral; }};
constexpr Trait kShutter = {"/shutter_seconds", "shutter_seconds",
                            [](const Job& job) { return job.settings.shutter_seconds > 0; }};
constexpr Trait kMeter = {"/meter", "a meter",
                          [](const Job& job) { return !job.settings.meter.empty(); }};
constexpr Trait kCatcher = {"/ground/type", "ground 'catcher'",
                            [](const Job& job) { return has_catcher(job.settings); }};
constexpr Trait kPanorama = {"/camera/type", "'panorama'", [](const Job& job) {
                               return job.camera.type == CameraType::kPanorama;
                             }};
constexpr Trait kShares = {"/film/layers", "layers bounce:N, light:NAME, st:S,T and irradiance",
                           [](const Job& job) { return !job.settings.film.shares.empty(); }};
constexpr Trait kIrradiance = {"/film/layers", "layer 'irradiance'", [](const Job& job) {
                                 const auto& shares = job.settings.film.shares;
                                 return std::any_of(
                                     shares.begin(), shares.end(),
                                     [](const LightShare& share) { return share.is_irradiance; });
                               }};

/// Two traits that no job may have together; the first is refused.
struct Exclusion {
  const Trait* refused;
  const Trait* beside;
  std::string_view why = {};
};
constexpr std::array kExclusions = {
    Exclusion{&kWeights, &kOneTechnique},
    Exclusion{&kAnyControl, &kNoLightSamples},
    Exclusion{&kRestir, &kNoLightSamples},
    // 'optimal' solves a 2x2 system for one light sample and one BSDF sample with known densities.
    Exclusion{&kOptimal, &kRis, ", whose density is unknown"},
    Exclusion{&kOptimal, &kRestir, ", whose density is unknown"},
    Exclusion{&kOptimal, &kThreshold, ", which skips shadow rays"},
    Exclusion{&kOptimal, &kControl, "; it is one"},
    Exclusion{&kOptimal, &kRandomEnds, ", where paths end at random"},
    // Quantities of the image that combine light of several paths are kept in RGB and as a whole.
    Exclusion{&kOptimal, &kMedium},
    Exclusion{&kOptimal, &kSpectral},
    Exclusion{&kOptimal, &kShares},
    Exclusion{&kControl, &kMedium},
    Exclusion{&kControl, &kSpectral},
    Exclusion{&kControl, &kShares},
    Exclusion{&kRestir, &kMedium},
    Exclusion{&kRestir, &kSpectral},
    Exclusion{&kRestir, &kShares},
    // 'restir' shares light samples at camera hits, for paths that have one continuation each and
    // use the samples for nothing else. Paths of different times cannot share.
    Exclusion{&kRestir, &kShutter},
    Exclusion{&kSplitting, &kRestir, ", which gives each path one light sample"},
    Exclusion{&kControl, &kRestir,
              ": a neighbour's sample does not cancel the term subtracted for a path's own sample"},
    // These strategies require a single BSDF at each point, and irradiance is measured in RGB.
    Exclusion{&kBlindDirections, &kSpectral},
    Exclusion{&kSpectral, &kMeter, ", which uses RGB"},
    Exclusion{&kSpectral, &kIrradiance, ", which uses RGB"},
    Exclusion{&kMeter, &kShutter, ": it has a single time"},
    Exclusion{&kOneTechnique, &kCatcher},
    Exclusion{&kRestir, &kCatcher},
    Exclusion{&kFog, &kCatcher},
    Exclusion{&kSpectral, &kCatcher},
    Exclusion{&kShares, &kCatcher},
};

/// A trait that not all integrators support.
struct Support {
  const Trait* trait;
  bool (*is_by)(const IntegratorEntry& integrator);
};
constexpr std::array kSupports = {
    Support{&kDispersion, [](const IntegratorEntry& row) { return row.disperses; }},
    Support{&kScattering, [](const IntegratorEntry& row) { return accepts(row, kFog.pointer); }},
    // Filters reach across the seam and the poles of a panorama, where splats would be cut off.
    Support{&kPanorama, [](const IntegratorEntry& row) { return !row.splats; }},
    Support{&kCatcher, [](const IntegratorEntry& row) { return row.name == "path"; }},
};

/// Returns whether both settings have the same values of these members of a group.
template <auto kGroup, auto... kMembers>
bool same_in(const RenderSettings& a, const RenderSettings& b) {
  return ((a.*kGroup.*kMembers == b.*kGroup.*kMembers) && ...);
}
template <auto kMember>
bool same(const RenderSettings& a, const RenderSettings& b) {
  return a.*kMember == b.*kMember;
}

/// An option that integrators list in IntegratorEntry::accepts. Integrators without it require the
/// default. Members that depend on a type of the same group need no comparison of their own.
struct Option {
  std::string_view pointer;
  bool (*is_same)(const RenderSettings& a, const RenderSettings& b);
};
constexpr auto kEstimator = &RenderSettings::estimator;
constexpr std::array kOptions = {
    Option{"/integrator/max_depth", &same<&RenderSettings::max_depth>},
    Option{"/integrator/caustics", &same<&RenderSettings::caustics>},
    Option{"/integrator/photons", &same_in<&RenderSettings::photons, &PhotonSettings::paths>},
    Option{"/integrator/radius_m", &same_in<&RenderSettings::photons, &PhotonSettings::radius_m>},
    Option{"/integrator/alpha", &same_in<&RenderSettings::photons, &PhotonSettings::alpha>},
    Option{"/integrator/final_gather",
           &same_in<&RenderSettings::photons, &PhotonSettings::final_gather>},
    Option{"/integrator/tolerance", &same_in<&RenderSettings::cache, &CacheSettings::tolerance>},
    Option{"/integrator/rays", &same_in<&RenderSettings::cache, &CacheSettings::rays>},
    Option{"/integrator/records", &same_in<&RenderSettings::cache, &CacheSettings::records>},
    Option{"/estimator/strategy", &same_in<kEstimator, &EstimatorSettings::strategy>},
    Option{"/estimator/mis",
           &same_in<kEstimator, &EstimatorSettings::mis, &EstimatorSettings::mis_exponent>},
    Option{"/estimator/roulette", &same_in<kEstimator, &EstimatorSettings::roulette>},
    Option{"/estimator/splitting", &same_in<kEstimator, &EstimatorSettings::splitting>},
    Option{"/estimator/control_variate", &same_in<kEstimator, &EstimatorSettings::control_variate>},
    Option{"/estimator/expected_values", &same_in<kEstimator, &EstimatorSettings::expected_values>},
    Option{"/sampler/type", &same<&RenderSettings::sampler>},
    Option{"/sampler/replicates", &same<&RenderSettings::replicates>},
    Option{"/light_sampler", &same<&RenderSettings::light_sampler>},
    Option{"/adaptive", &same_in<&RenderSettings::adaptive, &AdaptiveSettings::type>},
    Option{kFog.pointer,
           [](const RenderSettings& a, const RenderSettings& b) {
             return a.fog.has_value() == b.fog.has_value();
           }},
    Option{kSpectral.pointer, &same<&RenderSettings::spectral>},
    Option{kShutter.pointer, &same<&RenderSettings::shutter_seconds>},
    Option{kThroughGlass,
           &same_in<&RenderSettings::background, &BackgroundSettings::through_glass>},
};

class Walk {
 public:
  explicit Walk(const Job& job) : job_(job) {}

  void options() {
    const RenderSettings usual = default_settings(job_.integrator.name);
    for (const std::string_view pointer : integrator_options()) {
      const auto* option = std::find_if(kOptions.begin(), kOptions.end(),
                                        [&](const Option& row) { return row.pointer == pointer; });
      CHECK(option != kOptions.end());
      if (!option->is_same(job_.settings, usual)) {
        need_support({std::string(pointer), ""},
                     [pointer](const IntegratorEntry& row) { return accepts(row, pointer); });
      }
    }
  }
  void supports() {
    for (const Support& row : kSupports) {
      if (row.trait->is_on(job_)) {
        need_support({std::string(row.trait->pointer), std::string(row.trait->words) + " "},
                     row.is_by);
      }
    }
  }
  void exclusions() {
    for (const auto& [refused, beside, why] : kExclusions) {
      if (refused->is_on(job_) && beside->is_on(job_)) {
        add({std::string(refused->pointer),
             std::string(refused->words) + " cannot be combined with " +
                 std::string(beside->words) + std::string(why),
             refused == &kShares ? std::optional<std::size_t>(0) : std::nullopt});
      }
    }
  }
  void shares() {
    const auto& shares = job_.settings.film.shares;
    for (std::size_t i = 0; i < shares.size(); ++i) {
      const LightShare& share = shares[i];
      need_support({std::string(kShares.pointer), "'" + share.layer + "' ", i},
                   [&share](const IntegratorEntry& row) { return keeps_share(row, share); });
      if (!share.group || job_.scene == nullptr || !job_.scene->light_groups) {
        continue;
      }
      const auto& groups = *job_.scene->light_groups;
      if (std::find(groups.begin(), groups.end(), *share.group) == groups.end()) {
        add({std::string(kShares.pointer),
             "'" + *share.group + "' is not a light group of the scene; available: " +
                 listed(groups, [](const std::string& name) { return std::string_view(name); }),
             i});
      }
    }
  }
  /// A crop must be inside the film.
  void crop() {
    const FilmSettings& film = job_.settings.film;
    const PixelRect crop = film.area();
    const auto check = [this](const std::string& axis, std::int64_t first, std::int64_t count,
                              int size, const std::string& side) {
      if (first < 0 || count < 1 || first + count > size) {
        add({"/film/crop", "covers " + axis + " = " + std::to_string(first) + " to " +
                               std::to_string(first + count) + ", outside the film's " + side +
                               " of " + std::to_string(size)});
      }
    };
    check("x", crop.x, crop.width, film.width, "width");
    check("y", crop.y, crop.height, film.height, "height");
  }
  void shared_paths() {
    const int side = job_.settings.light_block;
    const int paths = side * side * job_.settings.light_history;
    if (kRestir.is_on(job_) && paths > kSharedPathsMost) {
      const std::string block = std::to_string(side);
      add({"/light_sampler/history",
           std::to_string(job_.settings.light_history) + " passes of " + block + " x " + block +
               " pixels are " + std::to_string(paths) + " paths that share samples; at most " +
               std::to_string(kSharedPathsMost) + " can"});
    }
  }

  std::vector<BrokenRule> broken;

 private:
  void add(BrokenRule rule) { broken.push_back(std::move(rule)); }

  template <typename Items, typename Name>
  static std::string listed(const Items& items, const Name& name_of) {
    std::string text;
    for (const auto& item : items) {
      text += (text.empty() ? "'" : ", '") + std::string(name_of(item)) + "'";
    }
    return text.empty() ? "none" : text;
  }

  /// Completes the reason, which begins with what is to be supported, unless the job's integrator
  /// does.
  template <typename Supports>
  void need_support(BrokenRule rule, const Supports& supports) {
    if (supports(job_.integrator)) {
      return;
    }
    std::vector<std::string_view> others;
    for (const IntegratorEntry& row : integrators()) {
      if (supports(row)) {
        others.push_back(row.name);
      }
    }
    rule.reason += "is not supported by integrator '" + std::string(job_.integrator.name) +
                   "', but by " + listed(others, [](std::string_view name) { return name; });
    add(std::move(rule));
  }

  const Job& job_;
};

}  // namespace

std::vector<BrokenRule> broken_rules(const RenderSettings& asked, const CameraSettings& camera,
                                     const SceneTraits* scene) {
  const RenderSettings settings = with_caustics(asked);
  const IntegratorEntry* row = find_integrator(settings.integrator);
  if (row == nullptr) {
    return {{"/integrator/type", "this build has no integrator '" + settings.integrator + "'"}};
  }
  SceneTraits traits = scene != nullptr ? *scene : SceneTraits{};
  // Where a scene disperses light, `auto` leaves caustics off.
  traits.has_dispersion = traits.has_dispersion && asked.caustics != CausticsType::kAuto;
  const Job job = {settings, camera, scene != nullptr ? &traits : nullptr, *row};
  Walk walk(job);
  walk.crop();
  walk.options();
  walk.supports();
  walk.exclusions();
  walk.shares();
  walk.shared_paths();
  if (settings.integrator != asked.integrator) {
    // Options of photons are those of the integrator that has them in its name.
    const Job named = {asked, camera, scene, row_of(integrators(), asked.integrator)};
    Walk of_path(named);
    of_path.options();
    for (BrokenRule& rule : of_path.broken) {
      if (std::none_of(walk.broken.begin(), walk.broken.end(),
                       [&](const BrokenRule& other) { return other.pointer == rule.pointer; })) {
        walk.broken.push_back(std::move(rule));
      }
    }
  }
  return std::move(walk.broken);
}

std::vector<BrokenRule> broken_stop_rules(const StopRules& stop, const RenderSettings& asked,
                                          const SceneTraits* scene) {
  std::vector<BrokenRule> broken;
  const std::string_view obstacle =
      census_obstacle(asked, scene != nullptr && scene->has_scattering);
  if (stop.light_not_found && !obstacle.empty()) {
    broken.push_back({"/stop/light_not_found", "light that was not found has no bound " +
                                                   std::string(obstacle) +
                                                   "; give relative_error, samples_per_pixel or "
                                                   "seconds"});
  }
  const RenderSettings settings = with_caustics(asked);
  // broken_rules() tells of an integrator that this build lacks.
  const bool is_known = find_integrator(settings.integrator) != nullptr;
  if (stop.denoised_error && is_known && !halves_show_error(settings)) {
    broken.push_back({"/stop/denoised_error",
                      "the error of denoised images of integrator '" + settings.integrator +
                          "' is unknown: its images are biased, and their halves show only the "
                          "noise; give relative_error, samples_per_pixel or seconds"});
  }
  return broken;
}

std::string_view census_obstacle(const RenderSettings& settings, bool has_scattering) {
  if (settings.fog) {
    return "with fog";
  }
  if (has_scattering) {
    return "in a scene with scattering media";
  }
  return settings.shutter_seconds > 0 ? "with motion blur" : "";
}

}  // namespace core
