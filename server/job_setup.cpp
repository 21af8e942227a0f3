#include "server/job_setup.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/base/cgroup.h"
#include "server/queue/units.h"

namespace server {
namespace {

/// Returns null without --queue.
core::Result<std::shared_ptr<queue::UnitQueue>> open_queue(const Config& config) {
  if (config.queue.empty()) {
    return std::shared_ptr<queue::UnitQueue>();
  }
  const auto at_flag = [](core::Error error) {
    error.where = "--queue";
    return error;
  };
  auto link =
      queue::NatsLink::open({config.queue, config.queue_creds, config.queue_ca}, "tessera serve");
  if (!link) {
    return at_flag(link.error());
  }
  const auto version = queue::server_version(config.queue);
  const auto usable = version ? queue::check_version(*version) : core::ok_status();
  if (!usable) {
    return at_flag(usable.error());
  }
  return std::shared_ptr<queue::UnitQueue>(
      std::make_shared<queue::UnitPublisher>(*std::move(link)));
}

}  // namespace

std::map<std::string, std::string, std::less<>> converter_commands(const Config& config) {
  std::map<std::string, std::string, std::less<>> commands;
  for (const std::string& entry : config.converters) {
    const std::size_t equals = entry.find('=');
    commands[entry.substr(0, equals)] = entry.substr(equals + 1);
  }
  return commands;
}

int render_threads(const Config& config) {
  const auto cores = core::usable_threads();
  return config.threads > 0 ? config.threads : std::max(cores, 1);
}

core::Result<JobServiceOptions> job_options(const Config& config, const MemoryLimits& memory,
                                            const api::ServerView& about) {
  JobServiceOptions options;
  options.quota_jobs = config.quota_jobs;
  options.retention = {.seconds = static_cast<double>(config.retention_seconds),
                       .count = config.ended_max};
  options.arithmetic = about.build.arithmetic;
  options.threads = render_threads(config);
  options.book.queue_max = config.queue_max;
  options.book.running_max = config.running_max;
  options.book.previews_of_tenant_max = config.quota_previews;
  options.samples_max = config.samples_max;
  options.checkpoint_seconds = config.checkpoint_seconds;
  options.film_cache_bytes = memory.film_cache_bytes;
  options.build = api::build_json(about);
  options.render_threads = config.render_threads;
  options.work = {.lease_seconds = config.lease_seconds,
                  .build = about.build.id,
                  .arithmetic = about.build.arithmetic,
                  .has_local_threads = config.render_threads > 0,
                  .verify_share = config.verify_share};
  auto queue = open_queue(config);
  if (!queue) {
    return queue.error();
  }
  options.queue = *std::move(queue);
  return options;
}

}  // namespace server
