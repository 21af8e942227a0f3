#include "clients/cli/tev_feed.h"

#include <array>
#include <chrono>
#include <span>
#include <utility>

#include "clients/cli/job_json.h"
#include "clients/cli/terminal.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::array<std::string_view, 4> kChannels = {"R", "G", "B", "A"};
// A queued or paused job sends nothing; the connection is then reopened.
constexpr std::chrono::seconds kSilenceMax{60};
constexpr std::chrono::milliseconds kPause{200};
constexpr int kPausesBetweenTries = 5;

int whole_at(const Json& object, const char* key) {
  return static_cast<int>(number_at(object, key, 0));
}

std::span<const std::string_view> channels_of(const TileFrame& frame) {
  return std::span(kChannels).first(frame.has_alpha ? 4 : 3);
}

}  // namespace

TevRect picture_rect(const Json& job) {
  const Json& film = object_in(object_in(job, "spec"), "film");
  const Json& crop = object_in(film, "crop");
  if (crop.empty()) {
    return {0, 0, whole_at(film, "width"), whole_at(film, "height")};
  }
  return {whole_at(crop, "x"), whole_at(crop, "y"), whole_at(crop, "width"),
          whole_at(crop, "height")};
}

TevFeed::TevFeed(std::unique_ptr<ApiClient> client, std::string path, TevConnection tev,
                 const Json& job)
    : client_(std::move(client)),
      path_(std::move(path)),
      tev_(std::move(tev)),
      name_("tessera " + text_at(job, "id")),
      rect_(picture_rect(job)) {
  const SignalsHeld inherited;  // signals go to the main thread
  thread_ = std::thread([this] { follow(); });
}

TevFeed::~TevFeed() {
  stop_ = true;
  client_->stop();
  if (thread_.joinable()) {
    thread_.join();
  }
}

core::Status TevFeed::finish() {
  job_ended_ = true;
  thread_.join();
  const core::MutexLock lock(mutex_);
  return result_;
}

void TevFeed::follow() {
  while (!stop_) {
    const auto ended = follow_once();
    if (ended && *ended) {
      return;
    }
    // An interrupted stream means that the server restarts, unless the job has ended.
    const bool final = !ended && (ended.error().code != ErrorCode::kUnavailable || job_ended_);
    if (final) {
      const core::MutexLock lock(mutex_);
      result_ = ended.error();
      return;
    }
    for (int i = 0; i < kPausesBetweenTries && !stop_; ++i) {
      std::this_thread::sleep_for(kPause);
    }
  }
}

core::Result<bool> TevFeed::follow_once() {
  parser_.restart();
  bool ended = false;
  core::Status taken = core::ok_status();
  const auto status =
      client_->stream(path_ + "/tiles", {}, kSilenceMax, [&](std::string_view piece) {
        taken = take(piece, ended);
        return taken.has_value() && !ended && !stop_;
      });
  if (!taken) {
    return Error{ErrorCode::kInternal, taken.error().message, taken.error().where};
  }
  if (!status) {
    return status.error();
  }
  return bool{ended};
}

core::Status TevFeed::take(std::string_view piece, bool& ended) {
  const auto frames = parser_.feed(piece);
  if (!frames) {
    return frames.error();
  }
  for (const TileFrame& frame : *frames) {
    ended = ended || frame.is_end;
    if (auto shown = show(frame); !shown) {
      return shown;
    }
  }
  return core::ok_status();
}

core::Status TevFeed::show(const TileFrame& frame) {
  if (frame.is_end) {
    return core::ok_status();
  }
  const auto channels = channels_of(frame);
  if (!created_) {
    if (auto sent = tev_.send(tev_create_image(name_, rect_.width, rect_.height, channels));
        !sent) {
      return sent;
    }
    created_ = true;
  }
  const TevRect place{frame.x - rect_.x, frame.y - rect_.y, frame.width, frame.height};
  return tev_.send(tev_update_image(name_, place, channels, frame.planes));
}

}  // namespace cli
