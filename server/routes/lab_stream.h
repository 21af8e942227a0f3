/// LabStream: runs an experiment on a thread of its own and writes its lines as they come.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "api/lab.h"
#include "core/base/mutex.h"
#include "server/http/message.h"

namespace server {

class LabStream {
 public:
  explicit LabStream(api::LabRequest request) : request_(std::move(request)) {}

  /// Until the last line, or until the client has gone or the server ends: then the run is
  /// cancelled, and in the second case the last line is {"cancelled": true}.
  void run(StreamWriter& writer);

 private:
  void compute(const std::stop_token& stop);
  void push(std::string line) EXCLUDES(mutex_);
  /// The lines that have come; waits for some. Empty: all are done, or a stop is asked for.
  std::string next(const std::stop_token& stop) EXCLUDES(mutex_);

  const api::LabRequest request_;
  core::Mutex mutex_;
  core::CondVar changed_;
  std::string lines_ GUARDED_BY(mutex_);
  bool done_ GUARDED_BY(mutex_) = false;
};

}  // namespace server
