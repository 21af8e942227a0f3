#include "tests/simulation/watch.h"

#include <chrono>
#include <limits>
#include <map>
#include <span>
#include <string_view>
#include <utility>

namespace simulation {
namespace {

std::string name_of(int tile, std::uint32_t revision) {
  return "revision " + std::to_string(revision) + " of tile " + std::to_string(tile);
}

class Client final : public server::StreamWriter {
 public:
  explicit Client(Nanoseconds until) : until_(until) {}
  bool write(std::string_view bytes) override {
    while (!bytes.empty() && fault_.empty()) {
      const auto frame = api::decode_tile_frame(std::as_bytes(std::span(bytes)));
      if (!frame || frame->consumed == 0 || has_ended_) {
        fault_ = has_ended_ ? "a tile after the end" : "a broken frame";
        break;
      }
      bytes.remove_prefix(frame->consumed);
      has_ended_ = (frame->frame.flags & api::kTileEnd) != 0;
      std::uint32_t& newest = revisions_[{frame->frame.rect.x, frame->frame.rect.y}];
      if (!has_ended_ && frame->frame.revision <= newest) {
        fault_ = "revision " + std::to_string(frame->frame.revision) +
                 " of a tile was sent after revision " + std::to_string(newest);
      }
      newest = has_ended_ ? newest : frame->frame.revision;
    }
    return !client_gone();
  }
  bool client_gone() const override { return now() >= until_ || !fault_.empty(); }
  bool stopping() const override { return false; }
  std::stop_token stop_token() const override { return {}; }
  bool has_ended() const { return has_ended_; }
  const std::string& fault() const { return fault_; }
  /// Returns what is not the newest of the film; empty: nothing.
  std::string lacks(const core::Film& film) const {
    for (int tile = 0; tile < film.tile_count(); ++tile) {
      const core::PixelRect rect = film.tile_rect(tile);
      const auto sent = revisions_.find({rect.x, rect.y});
      const std::uint32_t newest = sent == revisions_.end() ? 0 : sent->second;
      if (film.tile_samples(tile) > 0 && newest != film.tile_revision(tile)) {
        return "the stream ended with " + name_of(tile, newest) + ", the film has revision " +
               std::to_string(film.tile_revision(tile));
      }
    }
    return "";
  }

 private:
  const Nanoseconds until_;
  std::map<std::pair<int, int>, std::uint32_t> revisions_;
  bool has_ended_ = false;
  std::string fault_;
};

}  // namespace

std::string watch_tiles(const server::TileStream::Parts& parts, const server::JobPointer& job,
                        Nanoseconds until) {
  Client client(until);
  server::TileStream(parts, job, {}).run(client);
  if (!client.fault().empty() || !client.has_ended()) {
    return client.fault();
  }
  while (job->run()) {
    sleep_for(kSecond / 10);
  }
  const auto film = parts.jobs.films().film(*job);
  // What a failed job could not store is lost; a retry renders it again.
  return film && job->state() != api::JobState::kFailed ? client.lacks(**film) : "";
}

std::string watch_events(const server::JobPointer& job, Nanoseconds until) {
  std::map<int, std::uint32_t> revisions;
  for (std::uint64_t last = 0; now() < until;) {
    const auto events = job->log().read_after(last, std::numeric_limits<std::size_t>::max());
    for (const server::LoggedEvent& event : events) {
      if (event.seq <= last) {
        return "event " + std::to_string(event.seq) + " comes after event " + std::to_string(last);
      }
      last = event.seq;
      if (event.type != api::EventType::kTile) {
        continue;
      }
      std::uint32_t& newest = revisions[event.tile];
      if (event.revision <= newest) {
        return name_of(event.tile, event.revision) + " is announced after " +
               name_of(event.tile, newest);
      }
      newest = event.revision;
    }
    if (api::is_final(job->state())) {
      return "";
    }
    job->log().wait_after(
        last, server::EventLog::Wake::kAnything,
        std::chrono::steady_clock::now() + std::chrono::nanoseconds(until - now()), {});
  }
  return "";
}

}  // namespace simulation
