#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <limits>
#include <new>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "api/answers/job_view.h"
#include "api/answers/matte_manifest.h"
#include "api/job/job_checks.h"
#include "api/job/light_exposure.h"
#include "api/json/schemas.h"
#include "api/json/values.h"
#include "api/queries/fireflies.h"
#include "clients/cli/command.h"
#include "clients/cli/fetch.h"
#include "clients/cli/files.h"
#include "clients/cli/progress.h"
#include "clients/cli/render_job.h"
#include "clients/cli/shown.h"
#include "core/base/cgroup.h"
#include "core/color/tone_map.h"
#include "core/denoise/make_denoiser.h"
#include "core/film/meter_reading.h"
#include "core/film/set_aside.h"
#include "core/film/splats.h"
#include "core/image_io/image_io.h"
#include "core/integrators/registry.h"
#include "core/layers/exposure.h"
#include "core/layers/layer_rows.h"
#include "core/layers/layers.h"
#include "core/lights/outdoor.h"
#include "core/render/picture/feature_pass.h"
#include "core/render/picture/unsampled_light.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/settings/choices.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

// Set by the first Ctrl-C, after which the current image is written. The second one ends the
// process.
volatile std::sig_atomic_t g_interrupted =
    0;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

void on_interrupt(int signal) {
  g_interrupted = 1;
  std::signal(signal, SIG_DFL);
}

ProgressFacts facts_of(const core::Progress& progress) {
  ProgressFacts facts;
  facts.fraction = progress.fraction;
  facts.samples_per_pixel = progress.samples_mean;
  facts.elapsed_seconds = progress.elapsed_seconds;
  facts.relative_error = progress.error.relative;
  facts.error_low = progress.error.low;
  facts.error_high = progress.error.high;
  facts.is_unreliable = progress.error.unreliable;
  facts.rays_per_second = progress.rays_per_second;
  facts.eta_seconds = progress.eta_seconds;
  return facts;
}

/// Runs the task on `threads` threads while this thread shows the progress.
void run_with_progress(core::RenderTask& task, int threads) {
  ProgressPrinter printer(stderr);
  std::signal(SIGINT, &on_interrupt);
  std::atomic<bool> is_over = false;
  std::exception_ptr failure;
  std::jthread renderer([&] {
    try {
      core::run_to_end(task, threads);
    } catch (...) {
      failure = std::current_exception();
    }
    is_over = true;
  });
  auto next_show = std::chrono::steady_clock::now() + std::chrono::milliseconds(200);
  while (!is_over) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (g_interrupted != 0) {
      task.cancel();
    }
    if (const auto now = std::chrono::steady_clock::now(); now >= next_show && !task.finished()) {
      printer.show(facts_of(task.progress()));
      next_show = now + std::chrono::milliseconds(500);
    }
  }
  renderer.join();
  if (failure) {
    std::rethrow_exception(failure);
  }
}

const core::ImageFormat* find_format(const std::string& output) {
  std::string extension = output == "-" ? "png" : extension_of(output);
  extension = extension == "jpeg" ? "jpg" : extension == "tiff" ? "tif" : extension;
  for (const core::ImageFormat& format : core::image_formats()) {
    if (format.extension == extension) {
      return &format;
    }
  }
  return nullptr;
}

/// The image selected by --denoise; its picture is null for the plain one.
struct Shown {
  core::DenoisedInput input;
  core::DenoiserFacts by;
  std::string note;
};

/// Denoises a job's film; computes the features once.
class FilmDenoiser {
 public:
  FilmDenoiser(const LocalJob& job, int threads)
      : job_(job), parallel_(core::parallel_for(threads)) {}

  /// Errors: a half is missing; the job's denoise.type is none.
  core::Result<core::MadeDenoised> denoise(const core::FilmSnapshot& film) {
    const core::DenoiserType type = job_.spec.denoise.type;
    if (const core::Status allowed = api::check_denoiser(type, "--denoise"); !allowed) {
      return allowed.error();
    }
    if (core::samples_of_halves(film) == 0) {
      return Error{ErrorCode::kInvalidArgument,
                   "a pixel has samples of only one half; denoising needs both (--spp 2 or more)",
                   "--denoise"};
    }
    if (!features_) {
      auto made = core::feature_pass(job_.renderer->view(), parallel_);
      if (!made) {
        return made.error();
      }
      features_ = **std::move(made);
    }
    return core::denoise_with(type, film, &*features_, parallel_);
  }

  double bound(const core::Film& film, double confidence) {
    const auto made = denoise(film.snapshot());
    return made ? made->picture.interval(core::DenoiseMode::kMixed, confidence).high
                : std::numeric_limits<double>::infinity();
  }

 private:
  const LocalJob& job_;
  const core::ParallelFor parallel_;
  std::optional<core::FeaturePicture> features_;
};

core::Result<Shown> shown_picture(FilmDenoiser& denoiser, const core::Film& film,
                                  const JobFlags& flags) {
  if (flags.denoise.empty() || flags.denoise == "off") {
    return Shown{};
  }
  auto made = denoiser.denoise(film.snapshot());
  if (!made) {
    return made.error();
  }
  if (!made->note.empty()) {
    std::fprintf(stderr, "warning: %s\n", shown(made->note).c_str());
  }
  Shown out = {.input = {}, .by = std::move(made->by), .note = std::move(made->note)};
  out.input = {std::make_shared<const core::DenoisedPicture>(std::move(made->picture)),
               flags.denoise == "full" ? core::DenoiseMode::kFull : core::DenoiseMode::kMixed};
  return out;
}

/// Returns the exposure of the output in stops; 0 for linear formats.
double exposure_of(const api::JobSpec& spec, const core::Brightness& brightness,
                   const JobFlags& flags) {
  if (find_format(flags.output)->high_dynamic_range || flags.exposure.empty()) {
    return 0;
  }
  if (flags.exposure != "auto") {
    return std::strtod(flags.exposure.c_str(), nullptr);
  }
  return api::auto_exposure_stops(spec, [&] { return brightness.auto_exposure; });
}

/// Returns whether the plain image is written without fireflies. Errors: --fireflies that the
/// output cannot honour.
core::Result<bool> sets_aside(const JobFlags& flags) {
  const core::ImageFormat& format = *find_format(flags.output);
  const auto asked = [&]() -> std::optional<api::Fireflies> {
    if (flags.fireflies.empty()) {
      return std::nullopt;
    }
    return flags.fireflies == "keep" ? api::Fireflies::kKeep : api::Fireflies::kSetAside;
  };
  api::FireflyImage image;
  image.is_linear = format.high_dynamic_range;
  image.is_denoised = !flags.denoise.empty() && flags.denoise != "off";
  if (format.extension != "exr") {
    image.layer = core::kBeauty;
  }
  auto made = api::sets_fireflies_aside(asked(), image);
  return made ? std::move(made) : Error{made.error().code, made.error().message, "--fireflies"};
}

/// Returns the share of the light that was set aside.
core::Result<double> write_picture(const core::RenderTask& task, const LocalJob& job,
                                   const JobFlags& flags, const core::Brightness& brightness,
                                   const core::DenoisedInput& denoised) {
  const api::JobSpec& spec = job.spec;
  const core::ImageFormat& format = *find_format(flags.output);
  core::FilmSnapshot film = task.film().snapshot();
  const auto calm = sets_aside(flags);
  if (!calm) {
    return calm.error();
  }
  const core::SetAside taken = denoised.picture != nullptr ? denoised.picture->set_aside
                               : *calm                     ? core::set_aside(film, film.rect)
                                                           : core::SetAside{};
  core::Result<core::FloatImage> image =
      denoised.picture != nullptr ? core::layer_image(film, "denoised", &denoised)
      : format.extension == "exr" ? core::all_layers_image(film, spec.render.film)
                                  : core::layer_image(film, core::kBeauty);
  if (!image) {
    return image.error();
  }
  core::EncodeOptions options;
  options.tone_map = core::ToneMap::kKhronosNeutral;  // as the server's images
  options.whole_channels = core::whole_channels();
  options.exposure_stops = static_cast<float>(exposure_of(spec, brightness, flags));
  if (flags.look.white_balance_k) {
    options.white_kelvin = static_cast<float>(*flags.look.white_balance_k);
  }
  options.contrast = static_cast<float>(flags.look.contrast);
  options.bits = flags.look.bits;
  if (format.extension == "exr") {
    api::add_mattes(options.metadata, spec.render.film, job.renderer->view().scene.get());
  }
  const auto file = core::encode_image(*image, format, options);
  if (!file) {
    return file.error();
  }
  const auto written =
      write_file(flags.output, {reinterpret_cast<const char*>(file->data()), file->size()});
  return written ? core::Result<double>(taken.share()) : written.error();
}

/// Returns the interval to report; if an error ended the job, only its upper bound holds.
core::ErrorInterval told_error(const core::DenoisedInput& denoised, const core::RenderTask& task,
                               double confidence) {
  core::ErrorInterval out = denoised.picture->interval(denoised.mode, confidence);
  if (core::is_by_error(task.stop_reason()) && std::isfinite(out.low)) {
    out.low = 0;
  }
  if (!core::halves_show_error(task.renderer().view().settings)) {
    out.low = out.high = std::numeric_limits<double>::quiet_NaN();
  }
  return out;
}

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json denoised_json(const Shown& shown, const core::RenderTask& task, double confidence) {
  const core::DenoisedInput& denoised = shown.input;
  if (denoised.picture == nullptr) {
    return nullptr;
  }
  const core::ErrorInterval error = told_error(denoised, task, confidence);
  const bool is_full = denoised.mode == core::DenoiseMode::kFull;
  return {{"type", shown.by.type},
          {"version", shown.by.version},
          {"sha256", api::text_or_null(shown.by.sha256)},
          {"quality", api::text_or_null(shown.by.quality)},
          {"note", api::text_or_null(shown.note)},
          {"mode", is_full ? "full" : "mixed"},
          {"bias", is_full ? "biased" : "consistent"},
          {"relative", number_or_null(error.relative)},
          {"low", number_or_null(error.low)},
          {"high", number_or_null(error.high)},
          {"grain", number_or_null(error.grain)},
          {"doubt", number_or_null(error.doubt)},
          {"unreliable", error.unreliable},
          {"relative_rmse", number_or_null(error.relative)}};
}

/// Returns the readings of the job's meter; none if it has no meter.
std::vector<core::MeterReading> readings_of(const core::RenderTask& task,
                                            const core::RenderSettings& settings) {
  return core::meter_readings(core::meter_points(settings.meter), task.film().meter(),
                              core::unsampled_path_light(task.renderer().view()));
}

/// Returns the member `meter` of the result.
Json meter_member(const core::RenderTask& task, std::vector<core::MeterReading> readings) {
  if (readings.empty()) {
    return nullptr;
  }
  const core::Environment* environment = task.renderer().view().environment.get();
  const bool has_sky = environment != nullptr && !environment->is_black();
  const double outdoor_lux = has_sky ? core::horizontal_irradiance(*environment)
                                     : std::numeric_limits<double>::quiet_NaN();
  return Json::parse(api::meter_json({{}, std::move(readings), outdoor_lux}));
}

void print_readings(std::span<const core::MeterReading> readings) {
  for (const core::MeterReading& r : readings) {
    const core::Place at = r.at.position;
    std::fprintf(stderr, "meter at %.9g %.9g %.9g: %.4g lux (%.4g to %.4g)%s\n", at.x, at.y, at.z,
                 r.illuminance, r.low, r.high, r.unreliable ? ", unreliable" : "");
  }
}

Json result_json(const core::RenderTask& task, const LocalJob& job, const std::string& output,
                 const Shown& shown, double exposure, const std::vector<std::string>& warnings) {
  const core::Progress progress = task.progress();
  const bool valid = core::error_is_valid(progress.error, job.spec.render);
  Json details = Json::array();
  for (const core::Warning& warning : job.warning_details) {
    details.push_back(
        {{"code", warning.code}, {"pointer", warning.pointer}, {"detail", warning.detail}});
  }
  return {
      {"output", output},
      {"exposure", exposure},
      {"stop_reason", std::string(api::to_text(task.stop_reason()))},
      {"samples_per_pixel",
       {{"min", progress.samples_min},
        {"mean", progress.samples_mean},
        {"max", progress.samples_max}}},
      {"elapsed_seconds", progress.elapsed_seconds},
      {"cpu_seconds", progress.cpu_seconds},
      {"rays", progress.rays},
      {"rays_per_second", progress.rays_per_second},
      {"error",
       {{"relative", number_or_null(progress.error.relative)},
        {"low", valid ? number_or_null(progress.error.low) : Json(nullptr)},
        {"high", valid ? number_or_null(progress.error.high) : Json(nullptr)},
        {"bias", std::string(api::bias_of(job.spec.render, core::is_by_error(task.stop_reason())))},
        {"valid", valid},
        {"grain", number_or_null(progress.error.grain)},
        {"doubt", number_or_null(progress.error.doubt)},
        {"unreliable", progress.error.unreliable},
        {"confidence", job.spec.stop.confidence},
        {"relative_rmse", number_or_null(progress.error.relative)}}},
      {"light_not_found", progress.light_not_found
                              ? Json::parse(api::light_not_found_json(progress.light_not_found))
                              : Json(nullptr)},
      {"denoised", denoised_json(shown, task, job.spec.stop.confidence)},
      {"efficiency", number_or_null(progress.efficiency())},
      {"efficiency_low", valid ? number_or_null(progress.efficiency_low()) : Json(nullptr)},
      {"efficiency_high", valid ? number_or_null(progress.efficiency_high()) : Json(nullptr)},
      {"rejected_samples", progress.rejected_samples},
      {"meter", meter_member(task, readings_of(task, job.spec.render))},
      {"film_digest", task.film().digest()},
      {"warnings", warnings},
      {"warning_details", details}};
}

std::vector<std::string> warnings_of_image(const core::Progress& progress,
                                           const core::Brightness& brightness,
                                           const JobFlags& flags) {
  std::vector<std::string> warnings;
  if (progress.rejected_samples > 0) {
    warnings.push_back(core::rejected_warning(progress.rejected_samples));
  }
  if (brightness.is_clipped() && flags.exposure.empty()) {
    warnings.push_back(core::clipped_warning(brightness, "--exposure "));
  }
  return warnings;
}

int render_to_file(const LocalJob& job, const JobFlags& flags, int threads) {
  core::NullSink sink;
  const core::RenderSettings& settings = job.spec.render;
  auto film = core::make_film(settings);
  core::TaskOptions options;
  options.stop = job.spec.stop;
  options.counts_particles = true;
  FilmDenoiser denoiser(job, threads);
  options.denoised_bound = [&denoiser](const core::Film& seen, double confidence) {
    return denoiser.bound(seen, confidence);
  };
  core::RenderTask task(job.renderer, std::move(film), std::move(options), sink);
  run_with_progress(task, threads);

  const core::Progress progress = task.progress();
  if (progress.samples_max == 0) {
    return complain("render", {ErrorCode::kCancelled, "interrupted before there was an image", ""});
  }
  const auto shown = shown_picture(denoiser, task.film(), flags);
  if (!shown) {
    return complain("render", shown.error());
  }
  const core::DenoisedInput& denoised = shown->input;
  const core::Brightness brightness = core::brightness_of(task.film(), settings.film);
  const double exposure = exposure_of(job.spec, brightness, flags);
  std::vector<std::string> warnings = job.warnings;
  for (std::string& warning : warnings_of_image(progress, brightness, flags)) {
    std::fprintf(stderr, "warning: %s\n", warning.c_str());
    warnings.push_back(std::move(warning));
  }
  const auto aside = write_picture(task, job, flags, brightness, denoised);
  if (!aside) {
    return complain("render", aside.error());
  }
  if (flags.json) {
    Json result = result_json(task, job, flags.output, *shown, exposure, warnings);
    result["set_aside"] = *aside;
    // The names of files are in any encoding.
    const std::string text = result.dump(2, ' ', false, Json::error_handler_t::replace);
    std::printf("%s\n", text.c_str());
  }
  const ProgressFacts facts = facts_of(progress);
  std::fprintf(stderr, "%s: %.0f samples in %s, %s, %s\n", flags.output.c_str(),
               facts.samples_per_pixel, duration_text(facts.elapsed_seconds).c_str(),
               interval_text(facts).c_str(), rate_text(facts.rays_per_second).c_str());
  if (*aside > 0) {
    std::fprintf(stderr, "fireflies: %s of the light was set aside\n",
                 api::share_words(*aside).c_str());
  }
  if (progress.light_not_found) {
    std::fprintf(stderr, "light: %s\n", api::light_words(*progress.light_not_found).c_str());
  }
  if (flags.exposure == "auto") {
    std::fprintf(stderr, "exposure: %s stops\n", core::exposure_text(exposure).c_str());
  }
  print_readings(readings_of(task, settings));
  if (denoised.picture != nullptr) {
    const core::ErrorInterval error = told_error(denoised, task, job.spec.stop.confidence);
    ProgressFacts of_denoised;
    of_denoised.relative_error = error.relative;
    of_denoised.error_low = error.low;
    of_denoised.error_high = error.high;
    of_denoised.is_unreliable = error.unreliable;
    std::fprintf(stderr, "denoised (%s): %s\n", flags.denoise.c_str(),
                 interval_text(of_denoised).c_str());
  }
  return g_interrupted == 0 ? kDone : kFailed;
}

/// Returns wrong usage only if the command line is wrong even without its job file.
int fault_code(const core::Error& error, const JobFlags& flags) {
  const int code = request_fault_code(error, flags);
  if (code == kFailed || flags.job_file.empty()) {
    return code;
  }
  JobFlags alone = flags;
  alone.job_file.clear();
  alone.scene = alone.scene.empty() ? "cornell-box" : alone.scene;
  return parse_local_job(alone) ? kFailed : kWrongUsage;
}

int run(const JobFlags& flags) {
  if (const auto name = check_picture_name(flags.output); !name) {
    complain("render", name.error());
    return kWrongUsage;
  }
  if (const auto calm = sets_aside(flags); !calm) {
    complain("render", calm.error());
    return kWrongUsage;
  }
  PictureQuery wanted;
  wanted.exposure = flags.exposure;
  wanted.look = flags.look;
  if (const auto look = check_look(wanted, flags.output); !look) {
    complain("render", look.error());
    return kWrongUsage;
  }
  const int machine = core::usable_threads();
  const int threads = flags.threads > 0 ? flags.threads : machine;
  auto parsed = parse_local_job(flags);
  if (!parsed) {
    complain("render", parsed.error());
    return fault_code(parsed.error(), flags);
  }
  const auto job = [&]() -> core::Result<LocalJob> {
    try {
      return prepare_local_job(flags, *std::move(parsed), threads);
    } catch (const std::bad_alloc&) {
      return Error{ErrorCode::kTooLarge, "out of memory while loading it", flags.scene};
    }
  }();
  if (!job) {
    return complain("render", job.error());
  }
  if (const auto writable = check_writable(flags.output); !writable) {
    return complain("render", writable.error());
  }
  for (const std::string& warning : job->warnings) {
    std::fprintf(stderr, "warning: %s\n", shown(warning).c_str());
  }
  return render_to_file(*job, flags, threads);
}

void print_builtin_scenes() {
  for (const core::BuiltinScene& scene : core::builtin_scenes()) {
    std::printf("%-12.*s  %.*s\n", static_cast<int>(scene.name.size()), scene.name.data(),
                static_cast<int>(scene.summary.size()), scene.summary.data());
  }
  throw CLI::Success();
}

/// Adds the members of an object of the job request, as --set names them.
void add_members(const Json& schema, const std::string& path, std::vector<std::string>& names) {
  for (const auto& [name, member] : schema.at("properties").items()) {
    if (member.contains("properties")) {
      add_members(member, path + name + ".", names);
    } else {
      names.push_back(path + name + "=");
    }
  }
}

/// Returns the choices of job options, and of options by which client verbs select jobs and images.
Choices render_choices() {
  std::vector<std::string> states;
  for (int state = 0; state <= static_cast<int>(api::JobState::kCancelled); ++state) {
    states.emplace_back(api::to_text(static_cast<api::JobState>(state)));
  }
  std::vector<std::string> members;
  add_members(api::job_request_schema(), "", members);
  return {{"--set", std::move(members)},
          {"--integrator", names_of(core::integrators())},
          {"--sampler", names_of(core::samplers())},
          {"--light-sampler", names_of(core::light_samplers())},
          {"--mis", names_of(core::mis_types())},
          {"--roulette", names_of(core::roulette_types())},
          {"--control-variate", names_of(core::control_variate_types())},
          {"--adaptive", names_of(core::adaptive_types())},
          {"--layer", names_of(core::layers())},
          {"--tonemap", names_of(core::tone_maps())},
          {"--state", std::move(states)}};
}

}  // namespace

int render(const Args& args) {
  CLI::App app("Renders one image on this machine, without a server.", "tessera render");
  JobFlags flags;
  add_job_flags(app, flags,
                "Built-in scene (--scenes lists them), a .glb or .gltf file, or a folder with one");
  app.get_option("--output")->required();
  app.add_flag_callback("--scenes", &print_builtin_scenes,
                        "List the built-in scenes; render nothing");
  return parse_and_run(
      app, args, [&] { return run(flags); }, &render_choices);
}

}  // namespace cli
