#include "server/routes/event_stream.h"

#include <algorithm>
#include <utility>

#include "core/error/error_estimate.h"

namespace server {
namespace {

constexpr std::string_view kDigits = "0123456789abcdefghijklmnopqrstuvwxyz";
constexpr std::size_t kStreamDigitsMax = 12;

}  // namespace

std::string stream_name(std::int64_t run) {
  std::string name;
  for (auto rest = static_cast<std::uint64_t>(std::max<std::int64_t>(run, 0)); rest > 0;
       rest /= 36) {
    name.insert(name.begin(), kDigits[rest % 36]);
  }
  return name.empty() ? "0" : name;
}

std::optional<std::int64_t> stream_number(std::string_view name) {
  if (name.empty() || name.size() > kStreamDigitsMax) {
    return std::nullopt;
  }
  std::int64_t run = 0;
  for (const char digit : name) {
    const auto value = kDigits.find(digit);
    if (value == std::string_view::npos) {
      return std::nullopt;
    }
    run = run * 36 + static_cast<std::int64_t>(value);
  }
  return run;
}

std::string farewell_text() {
  constexpr int kRetryMs = 2000;
  return "retry: " + std::to_string(kRetryMs) + "\n\n" +
         format_sse_comment("the server is shutting down");
}

EventStream::EventStream(JobService& jobs, JobPointer job, std::optional<SseId> last,
                         const StreamGate& streams, Options options)
    : jobs_(jobs),
      job_(std::move(job)),
      last_(std::move(last)),
      streams_(streams),
      options_(options),
      stream_(stream_name(jobs.journal().run_number())) {}

bool EventStream::is_over() const {
  const auto end = job_->end_mark();
  return last_ && end && api::is_final(job_->state()) &&
         stream_number(last_->stream) == end->stream && last_->seq == end->seq;
}

std::string EventStream::text_of(std::string_view id, api::EventType type,
                                 std::string_view data) const {
  const SseEvent event = {.id = id, .event = api::to_text(type), .data = data, .retry_ms = {}};
  return options_.format ? options_.format(event) : format_sse(event);
}

std::string EventStream::snapshot(const std::string& id) const {
  return text_of(id, api::EventType::kSnapshot, api::snapshot_event(jobs_.view(*job_)));
}

void EventStream::run(StreamWriter& writer) {
  written_ = Clock::now();
  if (!writer.write(beginning())) {
    return;
  }
  while (!ended_ && !writer.client_gone()) {
    if (writer.stopping()) {
      writer.write(farewell_text());
      return;
    }
    if (!send_news(writer)) {
      return;
    }
  }
}

std::string EventStream::beginning() {
  const bool in_log = job_->history() == Job::History::kInLog;
  if (last_) {
    const bool same_stream = last_->stream == stream_ && in_log;
    if (!same_stream || last_->seq > job_->log().last_seq()) {
      return from_store(*last_);
    }
    // The snapshot carries the client's own id: if the connection breaks now, the later events are
    // still missing.
    seq_ = last_->seq;
    return snapshot(format_sse_id(stream_, seq_));
  }
  if (api::is_final(job_->state())) {
    return ended_job();
  }
  seq_ = job_->log().last_seq();
  return snapshot(format_sse_id(stream_, seq_));
}

std::string EventStream::ended_job() {
  const api::JobView view = jobs_.view(*job_);
  const EndMark end =
      job_->end_mark().value_or(EndMark{.stream = jobs_.journal().run_number(), .seq = 1});
  const std::string stream = stream_name(end.stream);
  ended_ = true;
  // Separate statements fix the order of the calls: JobsStream counts events as they are formatted.
  const std::string first = snapshot(format_sse_id(stream, end.seq - 1));
  return first +
         text_of(format_sse_id(stream, end.seq), api::EventType::kEnd, api::end_event(view));
}

std::string EventStream::from_store(const SseId& last) {
  seq_ = job_->log().last_seq();
  std::string text;
  const auto number = stream_number(last.stream);
  if (number && *number <= jobs_.journal().run_number()) {
    const auto missed = jobs_.journal().events_after(*job_, *number, last.seq);
    for (const EventRow& event : missed ? *missed : std::vector<EventRow>()) {
      const bool later = event.stream == jobs_.journal().run_number() && event.seq > seq_ &&
                         job_->history() == Job::History::kInLog;
      const auto type = api::event_type_from_text(event.type);
      if (!type || *type == api::EventType::kEnd || later) {
        continue;  // `end` comes last; later events follow in order.
      }
      text += text_of(format_sse_id(stream_name(event.stream), event.seq), *type, event.data);
    }
  }
  text += text_of("", api::EventType::kReset,
                  api::reset_event("progress and tiles from the time in between are not stored"));
  if (api::is_final(job_->state())) {
    return text + ended_job();
  }
  return text + snapshot(format_sse_id(stream_, seq_));
}

bool EventStream::is_last_end(const LoggedEvent& event) const {
  const auto end = job_->end_mark();
  return end && end->stream == jobs_.journal().run_number() && end->seq == event.seq &&
         api::is_final(job_->state());
}

std::string EventStream::news() {
  const auto events = job_->log().read_after(seq_, options_.tiles_at_a_time);
  std::string text;
  for (const LoggedEvent& event : events) {
    seq_ = event.seq;
    if (event.type == api::EventType::kEnd && !is_last_end(event)) {
      continue;  // Skipped because the job has been extended since: clients disconnect on "end".
    }
    text += format_event(event);
    if (event.type == api::EventType::kEnd) {
      ended_ = true;
      break;  // Nothing follows it, not even pending tiles.
    }
  }
  append_due_progress(text);
  return text;
}

bool EventStream::send_news(StreamWriter& writer) {
  const std::uint64_t seq_before = seq_;
  const std::string text = news();
  const auto now = Clock::now();
  if (!text.empty()) {
    if (!writer.write(text)) {
      return false;
    }
    written_ = now;
  } else if (now - written_ >= kEventsPing) {
    if (!writer.write(format_sse_comment("ping"))) {
      return false;
    }
    written_ = now;
  }
  if (!ended_) {
    wait_for_news(seq_ != seq_before, writer);
  }
  return true;
}

void EventStream::wait_for_news(bool has_sent, StreamWriter& writer) const {
  if (has_sent) {
    // Tile events may wait for the next interval; states may not.
    job_->log().wait_after(seq_, EventLog::Wake::kDurable,
                           Clock::now() + streams_.pace(kEventsPace), writer.stop_token());
    return;
  }
  const auto ping_due = written_ + kEventsPing;
  const auto due =
      progress_pending_ ? std::min(ping_due, progress_told_ + options_.progress) : ping_due;
  job_->log().wait_after(seq_, EventLog::Wake::kAnything, due, writer.stop_token());
}

void EventStream::append_due_progress(std::string& text) {
  const auto now = Clock::now();
  if (!progress_pending_ || ended_ || now - progress_told_ < options_.progress) {
    return;
  }
  progress_pending_ = false;
  progress_told_ = now;
  text += text_of(format_sse_id(stream_, seq_), api::EventType::kProgress,
                  api::progress_event(jobs_.view(*job_)));
}

std::string EventStream::format_event(const LoggedEvent& event) {
  if (event.type == api::EventType::kProgress) {
    progress_pending_ = true;
    return {};
  }
  if (event.type == api::EventType::kTile && options_.format) {
    return tile_text(event);
  }
  if (event.type == api::EventType::kTile) {
    return *job_->tile_texts().of(event.tile, event.seq, [&] { return tile_text(event); });
  }
  return text_of(format_sse_id(stream_, event.seq), event.type, event.data);
}

std::string EventStream::tile_text(const LoggedEvent& event) {
  const auto film = jobs_.films().film(*job_);
  if (!film) {
    return {};
  }
  const std::uint32_t revision = (*film)->tile_revision(event.tile);
  if (revision > event.revision) {
    return {};  // A later event reports the newer revision.
  }
  const api::TileEvent tile = {.rect = (*film)->tile_rect(event.tile),
                               .revision = revision,
                               .samples = (*film)->tile_samples_mean(event.tile),
                               .error = static_cast<double>(core::tile_error(**film, event.tile))};
  return text_of(format_sse_id(stream_, event.seq), api::EventType::kTile,
                 api::tile_event(job_->id(), tile));
}

}  // namespace server
