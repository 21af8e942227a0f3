/// Workers of a coordinator, on other machines behind a network that delays, loses and repeats
/// requests and answers. They speak as clients/worker/worker.cpp does, with calls of WorkBoard in
/// place of HTTP.
///
/// One worker disappears for a while and comes back under another id, one cannot render because its
/// disk is full, one sends wrong results; at least two are honest and lose the network for less
/// than a lease.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/jobs/work_board.h"
#include "tests/simulation/executor.h"

namespace simulation {

class Worker;

class Workers {
 public:
  /// board must outlive it. is_calm: whether the network loses nothing now.
  Workers(server::WorkBoard& board, std::uint64_t seed, std::function<bool()> is_calm);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// Options of the coordinator of these workers.
  static server::WorkOptions options(std::uint64_t seed);
  /// Lets all end what they do. Pre: it is calm.
  void stop();
  /// Returns what does not hold; empty: everything holds. was_interrupted: whether units of the job
  /// may have been given up before they were compared. Pre: stopped, and every job has ended.
  std::string check_rest(const std::function<bool(const server::Job&)>& was_interrupted) const;
  /// Results that were taken, units lent and the like, for the trace.
  std::string counts() const;

 private:
  server::WorkBoard& board_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace simulation
