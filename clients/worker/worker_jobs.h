/// WorkerJobs: renderers of the jobs whose units a worker holds. Files are fetched by their hash
/// and cached in a folder of limited size; a limited number of jobs stays loaded.
#pragma once

#include <cstdint>
#include <filesystem>
#include <list>
#include <memory>
#include <stop_token>
#include <string>

#include "clients/cli/api_client.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "core/render/units/unit_renderer.h"
#include "core/scene/scene.h"

namespace cli {

class WorkerJobs {
 public:
  struct Options {
    std::string folder;  ///< Created if missing; the files are in its subfolder tessera-inputs.
    std::uint64_t folder_bytes_max = 0;
    int threads = 1;  ///< for acceleration structures
    std::string isa;  ///< instruction set that Embree is limited to; empty: no limit
  };
  explicit WorkerJobs(Options options)
      : options_(std::move(options)),
        folder_(std::filesystem::path(options_.folder) / "tessera-inputs") {}

  /// Loads the job if necessary; one at a time. Errors: kNotFound when none of its units is open
  /// any more; kUnavailable when the server does not answer; those of loading.
  /// stop: do not try failed requests again.
  core::Result<std::shared_ptr<core::UnitRenderer>> renderer(const std::string& job,
                                                             ApiClient& server,
                                                             const std::stop_token& stop);

 private:
  struct Loaded {
    std::string job;
    std::shared_ptr<core::UnitRenderer> renderer;
  };
  core::Result<std::string> file(const std::string& job, const std::string& id, ApiClient& server,
                                 const std::stop_token& stop);
  void keep_within_bounds() const;

  const Options options_;
  const std::filesystem::path folder_;  ///< Holds nothing but files written by workers.
  core::Mutex mutex_;
  std::list<Loaded> loaded_ GUARDED_BY(mutex_);  ///< latest first
};

}  // namespace cli
