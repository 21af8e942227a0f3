#include "clients/worker/worker_jobs.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/job/job_spec.h"
#include "api/job/view_of.h"
#include "clients/cli/file_inputs.h"
#include "clients/cli/files.h"
#include "clients/cli/patience.h"
#include "core/base/sha256.h"
#include "core/image_io/image_io.h"
#include "core/render/task/settle.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/scene_io/gltf_load.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;
using nlohmann::json;
namespace fs = std::filesystem;

/// Jobs kept loaded, since units of several jobs alternate; each holds its scene.
constexpr std::size_t kLoadedMax = 4;

/// Age of a part of a file whose writer has died: files are written in one go, after they have
/// arrived.
constexpr std::chrono::hours kStale{1};

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

core::SharedBytes shared(const std::string& text) {
  const auto bytes = bytes_of(text);
  return std::make_shared<const core::Bytes>(bytes.begin(), bytes.end());
}

}  // namespace

core::Result<std::string> WorkerJobs::file(const std::string& job, const std::string& id,
                                           ApiClient& server, const std::stop_token& stop) {
  const fs::path path = folder_ / id;
  if (auto kept = read_file(path.string());
      kept && core::sha256_hex(kept->data(), kept->size()) == id) {
    std::error_code ignored;  // On failure the file is only removed earlier.
    fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);
    return kept;
  }
  auto reply = keep_trying(server, stop, [&]() -> core::Result<Reply> {
    auto got = server.get("/v1/work/jobs/" + job + "/files/" + id);
    return !got || core::sha256_hex(got->body.data(), got->body.size()) == id
               ? std::move(got)
               : Error{ErrorCode::kUnavailable, "the file arrived damaged", id};
  });
  if (!reply) {
    return reply.error();
  }
  std::error_code code;
  fs::create_directories(folder_, code);
  if (code) {
    return Error{ErrorCode::kInternal, "cannot be created: " + code.message(), folder_.string()};
  }
  if (const auto written = write_file(path.string(), reply->body); !written) {
    return written.error();
  }
  keep_within_bounds();
  return std::move(reply->body);
}

/// Removes parts of files that no worker completes any more, then the least recently used files.
void WorkerJobs::keep_within_bounds() const {
  struct CachedFile {
    fs::file_time_type used;
    std::uint64_t bytes = 0;
    fs::path path;
  };
  std::vector<CachedFile> files;
  std::uint64_t all = 0;
  std::error_code code;
  for (fs::directory_iterator at(folder_, code), end; !code && at != end; at.increment(code)) {
    std::error_code is_gone;  // Another worker may share the folder.
    const CachedFile file = {at->last_write_time(is_gone), at->file_size(is_gone), at->path()};
    if (is_gone) {
      continue;
    }
    if (file.path.has_extension() && fs::file_time_type::clock::now() - file.used > kStale) {
      fs::remove(file.path, is_gone);
      continue;
    }
    files.push_back(file);
    all += file.bytes;
  }
  std::sort(files.begin(), files.end(),
            [](const CachedFile& a, const CachedFile& b) { return a.used < b.used; });
  for (const CachedFile& file : files) {
    if (all <= options_.folder_bytes_max) {
      return;
    }
    fs::remove(file.path, code);
    all -= file.bytes;
  }
}

core::Result<std::shared_ptr<core::UnitRenderer>> WorkerJobs::renderer(
    const std::string& job, ApiClient& server, const std::stop_token& stop) {
  const core::MutexLock lock(mutex_);
  const auto found = std::find_if(loaded_.begin(), loaded_.end(),
                                  [&job](const Loaded& each) { return each.job == job; });
  if (found != loaded_.end()) {
    loaded_.splice(loaded_.begin(), loaded_, found);
    return found->renderer;
  }
  const auto reply = keep_trying(server, stop, [&] { return server.get("/v1/work/jobs/" + job); });
  if (!reply) {
    return reply.error();
  }
  const json inputs = json::parse(reply->body, nullptr, false);
  const bool is_whole = inputs.is_object() && inputs.contains("spec") && inputs.contains("files") &&
                        inputs["files"].is_object();
  const auto parsed =
      is_whole ? api::parse_job(inputs["spec"].dump()) : api::parse_job(std::string_view());
  if (!parsed) {
    return Error{ErrorCode::kInternal, "the server's job is invalid: " + parsed.problem().detail,
                 ""};
  }
  const api::JobSpec& spec = parsed->spec;
  std::map<std::string, core::SharedBytes> files;
  for (const auto& each : inputs["files"].items()) {
    auto content = file(job, each.value().get<std::string>(), server, stop);
    if (!content) {
      return content.error();
    }
    files[each.key()] = shared(*content);
  }
  if (const core::BuiltinScene* scene = core::find_builtin_scene(spec.scene)) {
    files[""] = std::make_shared<const core::Bytes>(scene->make_glb());
  }
  if (!files.contains("")) {
    return Error{ErrorCode::kInternal, "the server's job has no document", ""};
  }
  const auto resolve = [&files](std::string_view uri) -> core::SharedBytes {
    const auto at = files.find(std::string(uri));
    return at == files.end() ? nullptr : at->second;
  };
  FileInputs from(spec,
                  {.scene =
                       [&](const core::GltfOptions& options) {
                         return core::load_gltf(*files[""], resolve, options);
                       },
                   .environment = [&](const std::string& asset) -> core::Result<core::Image> {
                     const auto content = file(job, asset, server, stop);
                     if (!content) {
                       return content.error();
                     }
                     return core::decode_image(bytes_of(*content), core::ImageLimits());
                   }},
                  {options_.threads, options_.isa, stop});
  auto view = api::view_of(spec, from);
  if (!view) {
    return view.error();
  }
  auto made = core::settled_renderer(*std::move(view), spec.stop, stop);
  if (!made) {
    return made.error();
  }
  loaded_.push_front({job, std::make_shared<core::UnitRenderer>(*std::move(made))});
  if (loaded_.size() > kLoadedMax) {
    loaded_.pop_back();
  }
  return loaded_.front().renderer;
}

}  // namespace cli
