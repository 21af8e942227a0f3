/// Sends the tiles of a job to the image viewer tev as they arrive.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "clients/cli/api_client.h"
#include "clients/cli/job_flags.h"
#include "clients/cli/tev.h"
#include "clients/cli/tile_frames.h"
#include "core/base/mutex.h"

namespace cli {

/// Returns the image's rectangle on the full film, in pixels: its crop, or the whole.
TevRect picture_rect(const Json& job);

/// Follows the stream of tiles in its own thread, across lost connections.
class TevFeed {
 public:
  /// client: used only by this object. job: as returned by the server.
  TevFeed(std::unique_ptr<ApiClient> client, std::string path, TevConnection tev, const Json& job);
  /// Does not wait for the end of the job.
  ~TevFeed();
  TevFeed(const TevFeed&) = delete;
  TevFeed& operator=(const TevFeed&) = delete;

  /// Call after the end of the job: waits until its last tile is sent. Errors: why tev does not
  /// show all of it.
  core::Status finish();

 private:
  void follow();
  core::Result<bool> follow_once();
  core::Status show(const TileFrame& frame);
  core::Status take(std::string_view piece, bool& ended);

  std::unique_ptr<ApiClient> client_;
  std::string path_;
  TevConnection tev_;
  std::string name_;
  TevRect rect_;
  bool created_ = false;
  TileParser parser_;
  std::atomic<bool> stop_ = false;
  std::atomic<bool> job_ended_ = false;
  core::Mutex mutex_;
  core::Status result_ GUARDED_BY(mutex_) = core::ok_status();
  std::thread thread_;
};

}  // namespace cli
