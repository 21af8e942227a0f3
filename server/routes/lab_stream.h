/// LabStream: runs an experiment on its own thread and sends its lines as they are produced.
#pragma once

#include <stop_token>
#include <string>

#include "api/lab.h"
#include "core/base/mutex.h"
#include "server/http/message.h"

namespace server {

class LabStream {
 public:
  explicit LabStream(api::LabRequest request) : request_(std::move(request)) {}

  /// Sends until the last line, or until the client disconnects or the server shuts down: then the
  /// run is cancelled, and on shutdown the last line is {"cancelled": true}.
  void run(StreamWriter& writer);

 private:
  void compute(const std::stop_token& stop);
  void push(std::string line) EXCLUDES(mutex_);
  /// Waits for lines and returns them. Empty: the run is done, or a stop was requested.
  std::string next(const std::stop_token& stop) EXCLUDES(mutex_);

  const api::LabRequest request_;
  core::Mutex mutex_;
  core::CondVar changed_;
  std::string lines_ GUARDED_BY(mutex_);
  bool done_ GUARDED_BY(mutex_) = false;
};

}  // namespace server
