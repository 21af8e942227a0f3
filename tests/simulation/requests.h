/// Requests of tenants besides those on single jobs (life.cpp), over the wire: uploads, presets,
/// batches, jobs with an idempotency key, and floods.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>

#include "tests/simulation/ledger.h"
#include "tests/simulation/server.h"
#include "tests/simulation/wire.h"

namespace simulation {

/// What is carried out and counted, as `ok-NAME` in the trace.
inline constexpr std::array<std::string_view, 26> kRequests = {
    "submit",  "post",       "rank",       "pause",       "resume",      "cancel",
    "remove",  "extend",     "retry",      "expire",      "watch-tiles", "watch-events",
    "compare", "upload",     "cut-upload", "drop-upload", "preset",      "drop-preset",
    "batch",   "drop-batch", "add-key",    "remove-key",  "backup",      "check-rest",
    "small",   "call"};

std::string access_name(int tenant);
/// JSON of a job. kind: of life.cpp's kKinds.
std::string body_of(int kind, int samples, int retention_seconds = 0);

class Requests {
 public:
  using Fail = std::function<void(const std::string& words)>;
  /// fail: called with what does not hold; must not return.
  Requests(Server& server, Ledger& ledger, Fail fail)
      : server_(server), ledger_(ledger), fail_(std::move(fail)) {}

  void act(int tenant, Random& random);
  /// Checks all things of the tenant.
  void check(int tenant, Random& random);
  /// Cancels batches of the tenant with a job that loads.
  void cancel_loading(int tenant);
  /// Waits for the tenant's batches and removes them; enters jobs whose submission has no answer.
  /// time_is_over: whether they should have ended. Pre: no scene loads for ever.
  void settle(int tenant, Random& random, const std::function<bool()>& time_is_over);
  /// One tenant submits large jobs; another then submits the smallest, whose wait is bounded.
  /// step: mean time of a slice and of a sync together. is_disturbed: whether something else may
  /// delay it.
  void flood(Random& random, Nanoseconds step, const std::function<bool()>& is_disturbed);
  /// Cancels and removes what an earlier life left of a flood.
  void end_flood();

 private:
  void upload(int tenant, Random& random);
  void put_preset(int tenant, Random& random);
  void post(int tenant, Random& random);
  void submit_batch(int tenant, Random& random);
  void drop(int tenant, const std::string& thing, Random& random);
  /// Returns the value of the thing as the server has it; "": it is not there; empty: unknown.
  std::optional<std::string> value_of(int tenant, const std::string& thing, Random& random);
  void note(int tenant, const std::string& words) { ledger_.note(tenant, words); }
  /// Notes what the answer says of a request that was noted as `ask-` and these words.
  void note_answer(int tenant, int status, const std::string& words);

  Server& server_;
  Ledger& ledger_;
  const Fail fail_;
};

}  // namespace simulation
