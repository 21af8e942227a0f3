#include "clients/cli/render_job.h"

#include <span>
#include <utility>

#include "api/job/view_of.h"
#include "clients/cli/converted_model.h"
#include "clients/cli/file_inputs.h"
#include "clients/cli/files.h"
#include "core/base/sha256.h"
#include "core/image_io/image_io.h"
#include "core/image_io/radiance.h"
#include "core/render/task/settle.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/scene_io/gltf_load.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

Error error_of_problem(const api::Problem& problem) {
  std::string text = problem.detail.empty() ? problem.title : problem.detail;
  for (const api::FieldError& fault : problem.errors) {
    const std::string line = fault.pointer + ": " + fault.detail;
    if (text.find(line) == std::string::npos) {  // the detail may repeat the first fault
      text += "\n  " + line;
    }
  }
  return Error{ErrorCode::kInvalidArgument, std::move(text), ""};
}

core::Result<core::SceneDescription> load_builtin(const std::string& name,
                                                  const core::GltfOptions& options) {
  const core::BuiltinScene* scene = core::find_builtin_scene(name);
  if (scene == nullptr) {
    std::string known;
    for (const core::BuiltinScene& row : core::builtin_scenes()) {
      known += " " + std::string(row.name);
    }
    return Error{ErrorCode::kNotFound,
                 "is neither a file nor a built-in scene; built-in scenes:" + known, name};
  }
  const core::Bytes glb = scene->make_glb();
  return core::load_gltf(
      glb, [](std::string_view) { return core::SharedBytes(); }, options);
}

core::Result<core::SceneDescription> load_file(const std::string& path,
                                               const core::GltfOptions& options) {
  if (extension_of(path) == "zip") {
    return Error{
        ErrorCode::kUnsupportedFormat,
        "archives can only be submitted to a server (`tessera submit`); unpack it to render here",
        path};
  }
  if (const core::Converters converters{.helper = core::find_converter()};
      converters.takes(core::extension_of_name(path))) {
    const auto converted = convert_model(path, converters);
    if (!converted) {
      return converted.error();
    }
    auto scene = core::load_gltf(
        converted->glb, [](std::string_view) { return core::SharedBytes(); }, options);
    if (scene) {
      scene->name = path.substr(path.find_last_of('/') + 1);
      for (const std::string& note : converted->notes) {
        scene->warnings.emplace_back("converted", "", note);
      }
    }
    return scene;
  }
  const auto file = read_file(path);
  if (!file) {
    return file.error();
  }
  std::string refused;
  const auto resolve = [&](std::string_view name) -> core::SharedBytes {
    const auto place = side_file_path(folder_of(path), name);
    const auto bytes = place ? read_file(*place) : core::Result<std::string>(place.error());
    if (!bytes) {
      refused += "\n  " + std::string(name) + ": " + bytes.error().message;
      return nullptr;
    }
    const auto view = bytes_of(*bytes);
    return std::make_shared<const core::Bytes>(view.begin(), view.end());
  };
  auto scene = core::load_gltf(bytes_of(*file), resolve, options);
  if (!scene) {
    const std::string place = scene.error().where.empty() ? "" : " at " + scene.error().where;
    return Error{scene.error().code, scene.error().message + place + refused, path};
  }
  if (scene->name.empty()) {
    scene->name = path.substr(path.find_last_of('/') + 1);
  }
  return scene;
}

core::Result<core::SceneDescription> load_scene(const std::string& scene,
                                                const core::GltfOptions& options) {
  const auto file = model_file(scene);
  if (!file) {
    return file.error();
  }
  return *file ? load_file(**file, options) : load_builtin(scene, options);
}

core::Result<core::Image> read_environment(const std::string& path,
                                           std::vector<std::string>& warnings) {
  if (path.empty()) {
    return Error{ErrorCode::kInvalidArgument,
                 "a job file's environment asset is on a server; give the file with --environment",
                 "/environment/asset"};
  }
  const auto file = read_file(path);
  if (!file) {
    return file.error();
  }
  auto image = core::decode_image(bytes_of(*file), core::ImageLimits());
  if (!image) {
    return Error{image.error().code, image.error().message, path};
  }
  if (auto warning = core::radiance_warning(bytes_of(*file), *image, "the environment");
      !warning.empty()) {
    warnings.push_back(std::move(warning));
  }
  return image;
}

}  // namespace

core::Result<api::ParsedJob> parse_local_job(const JobFlags& flags) {
  auto request = make_request(flags);
  if (!request) {
    return request.error();
  }
  if (!flags.environment.empty()) {
    const auto bytes = read_file(flags.environment);
    if (!bytes) {
      return bytes.error();
    }
    (*request)["environment"]["asset"] = core::sha256_hex(bytes->data(), bytes->size());
  }
  auto parsed = api::parse_job(request->dump());
  if (!parsed) {
    return error_of_problem(parsed.problem());
  }
  if (!parsed->spec.has_image) {
    return Error{ErrorCode::kInvalidArgument,
                 "the job's film is null, so there is no image to write; submit it to a server",
                 "/film"};
  }
  return *std::move(parsed);
}

core::Result<LocalJob> prepare_local_job(const JobFlags& flags, api::ParsedJob parsed,
                                         int threads) {
  LocalJob job{std::move(parsed.spec), std::move(parsed.warnings), {}, nullptr};
  std::vector<std::string> image_warnings;
  FileInputs inputs(
      job.spec,
      {.scene =
           [&](core::GltfOptions options) {
             options.is_strict = flags.strict;
             return load_scene(job.spec.scene, options);
           },
       .environment =
           [&](const std::string&) { return read_environment(flags.environment, image_warnings); }},
      {.threads = threads});
  auto made = api::view_of(job.spec, inputs);
  if (!made) {
    return made.error();
  }
  core::View& view = *made;
  const core::SceneSummary& summary = view.scene->summary();
  for (const core::Warning& warning : summary.warnings) {
    job.warnings.push_back(warning.text());
    job.warning_details.push_back(warning);
  }
  for (std::string& warning : api::adaptive_warnings(job.spec)) {
    job.warnings.push_back(std::move(warning));
  }
  if (const auto settled = api::resolve_environment(job.spec, summary)) {
    job.warnings.push_back(*settled);
  }
  job.warnings.insert(job.warnings.end(), image_warnings.begin(), image_warnings.end());
  if (auto chosen = core::settle(view, job.spec.stop); !chosen) {
    return chosen.error();
  } else if (!chosen->empty()) {
    job.spec.render = view.settings;
    job.warnings.push_back(*std::move(chosen));
  }
  auto renderer = core::Renderer::create(*std::move(made));
  if (!renderer) {
    return renderer.error();
  }
  job.renderer = *std::move(renderer);
  return job;
}

}  // namespace cli
