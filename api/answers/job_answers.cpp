// ETags, tickets and lists of jobs.
#include <charconv>

#include <nlohmann/json.hpp>

#include "api/answers/job_view.h"
#include "api/answers/views.h"
#include "api/json/time_text.h"
#include "api/json/values.h"

namespace api {

std::string job_etag(const JobView& job) {
  return "\"s" + std::to_string(job.spec_version) + "-r" + std::to_string(job.progress.revision) +
         "-" + std::string(to_text(job.state)) +
         (job.pause_reason == PauseReason::kStorageFull ? "-storage_full" : "") +
         (job.is_denoising ? "-denoising" : "") +
         (job.denoised ? "-d" + std::to_string(job.denoised->revision) : "") +
         (job.warnings.empty() ? "" : "-w" + std::to_string(job.warnings.size())) + "\"";
}

std::optional<std::uint32_t> etag_spec_version(std::string_view etag) {
  if (etag.starts_with("W/")) {
    etag.remove_prefix(2);
  }
  constexpr std::string_view kStart = "\"s";
  if (!etag.starts_with(kStart)) {
    return {};
  }
  etag.remove_prefix(kStart.size());
  std::uint32_t version = 0;
  const auto read = std::from_chars(etag.data(), etag.data() + etag.size(), version);
  const std::string_view rest(read.ptr,
                              static_cast<std::size_t>(etag.data() + etag.size() - read.ptr));
  if (read.ec != std::errc() || !rest.starts_with("-r") || !rest.ends_with('"')) {
    return {};
  }
  return version;
}

const View<TicketView>& ticket_view() {
  static const View<TicketView> kView = {
      "Ticket",
      "A stream ticket.",
      {{"ticket", shape::text("Value of `?ticket=`."), Member<&TicketView::ticket>::json},
       {"expires_at", shape::time(),
        [](const TicketView& t) -> Json { return rfc3339(t.ends_unix_seconds); }},
       {"jobs", shape::texts("Ids of the jobs that its bearer may watch."),
        [](const TicketView& t) -> Json {
          return std::vector<std::string>(t.jobs.begin(), t.jobs.end());
        }}}};
  return kView;
}

std::string ticket_json(std::string_view ticket, double ends_unix_seconds,
                        std::span<const std::string> jobs) {
  return dump(ticket_view().print({ticket, ends_unix_seconds, jobs}));
}

Json damaged_shape() {
  return shape::texts(
      "Ids of jobs whose stored records are damaged: nothing is known of them, and they can only "
      "be "
      "deleted.");
}

const View<JobListView>& job_list_view() {
  static const View<JobListView> kView = {
      "JobList",
      "A page of jobs.",
      {{"jobs", shape::list(job_view().shape(), "Newest first."),
        [](const JobListView& l) { return print_list(job_view(), l.jobs); }},
       {"damaged", damaged_shape(),
        [](const JobListView& l) -> Json {
          return std::vector<std::string>(l.damaged.begin(), l.damaged.end());
        }},
       {"next", shape::nullable(shape::text("Cursor of the next page; null: the last one.")),
        [](const JobListView& l) { return or_null(l.next); }}}};
  return kView;
}

std::string job_list_json(std::span<const JobView> jobs, std::span<const std::string> damaged,
                          const std::optional<std::string>& next) {
  return dump(job_list_view().print({jobs, damaged, next}));
}

}  // namespace api
