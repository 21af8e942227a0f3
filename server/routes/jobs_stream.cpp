#include "server/routes/jobs_stream.h"

#include <algorithm>
#include <utility>

namespace server {
namespace {

using Clock = std::chrono::steady_clock;

/// Interval for polling the jobs' logs: a thread can wait on only one of them.
constexpr std::chrono::milliseconds kJobsPoll{100};

/// Returns one id for each job, or none.
std::vector<SseId> parse_ids(std::string_view text, std::size_t count) {
  std::vector<SseId> ids;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('.'), text.size());
    auto id = parse_sse_id(text.substr(0, end));
    if (!id) {
      return {};
    }
    ids.push_back(*std::move(id));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return ids.size() == count ? ids : std::vector<SseId>();
}

}  // namespace

JobsStream::JobsStream(JobService& jobs, const std::vector<JobPointer>& watched,
                       std::string_view last, const StreamGate& streams)
    : streams_(streams), ids_(watched.size(), format_sse_id("0", 0)) {
  const std::vector<SseId> ids = parse_ids(last, watched.size());
  for (std::size_t i = 0; i < watched.size(); ++i) {
    std::optional<SseId> id;
    if (!ids.empty()) {
      id = ids[i];
      ids_[i] = format_sse_id(id->stream, id->seq);
    }
    EventStream::Options options;
    options.format = [this, i](const SseEvent& event) { return format(i, event); };
    parts_.push_back(std::make_unique<EventStream>(jobs, watched[i], std::move(id), streams,
                                                   std::move(options)));
  }
}

std::string JobsStream::format(std::size_t job, const SseEvent& event) {
  std::string id;
  if (!event.id.empty()) {
    ids_[job] = std::string(event.id);
    for (const std::string& each : ids_) {
      id += (id.empty() ? "" : ".") + each;
    }
  }
  // Every event's data is a JSON object with at least one member.
  std::string data = "{\"job\":\"" + parts_[job]->job().id() + "\",";
  data += event.data.substr(1);
  return format_sse(SseEvent{.id = id, .event = event.event, .data = data, .retry_ms = {}});
}

bool JobsStream::is_over() const {
  return std::all_of(parts_.begin(), parts_.end(),
                     [](const auto& part) { return part->is_over(); });
}

bool JobsStream::has_ended() const {
  return std::all_of(parts_.begin(), parts_.end(),
                     [](const auto& part) { return part->has_ended(); });
}

void JobsStream::run(StreamWriter& writer) {
  std::string text;
  for (const auto& part : parts_) {
    text += part->beginning();
  }
  auto written = Clock::now();
  while (writer.write(text) && !has_ended() && !writer.client_gone()) {
    if (writer.stopping()) {
      writer.write(farewell_text());
      return;
    }
    wait(!text.empty(), writer);
    text.clear();
    for (const auto& part : parts_) {
      text += part->has_ended() ? std::string() : part->news();
    }
    const auto now = Clock::now();
    if (text.empty() && now - written >= kEventsPing) {
      text = format_sse_comment("ping");
    }
    written = text.empty() ? written : now;
  }
}

void JobsStream::wait(bool has_sent, StreamWriter& writer) const {
  const auto running = std::find_if(parts_.begin(), parts_.end(),
                                    [](const auto& part) { return !part->has_ended(); });
  const EventLog& log = (*running)->job().log();
  const auto until = Clock::now() + (has_sent ? Clock::duration(streams_.pace(kEventsPace))
                                              : Clock::duration(kJobsPoll));
  log.wait_after(log.last_seq(), has_sent ? EventLog::Wake::kDurable : EventLog::Wake::kAnything,
                 until, writer.stop_token());
}

}  // namespace server
