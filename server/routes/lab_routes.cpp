// The estimator laboratory.

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "api/lab.h"
#include "api/limits.h"
#include "core/base/mutex.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/lab_stream.h"

namespace server {
namespace {

/// Places for experiments: so many in all, and so many of each stored key.
class LabPlaces {
 public:
  LabPlaces(int in_all, int of_a_key) : gate_(in_all), of_a_key_(of_a_key) {}

  /// One place, given back by the destructor.
  class Place {
   public:
    Place(LabPlaces& places, StreamSlot slot, std::string key)
        : places_(places), slot_(std::move(slot)), key_(std::move(key)) {}
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    ~Place() { places_.leave(key_); }

   private:
    LabPlaces& places_;
    StreamSlot slot_;
    std::string key_;
  };

  /// key: id of a stored key, or empty. Errors: kTooManyRequests.
  core::Result<std::shared_ptr<Place>> take(const std::string& key) {
    const core::MutexLock lock(mutex_);
    const auto running = running_.find(key);
    if (!key.empty() && of_a_key_ > 0 && running != running_.end() && running->second >= of_a_key_) {
      return core::Error{core::ErrorCode::kTooManyRequests,
                         "the key '" + key + "' runs " + std::to_string(running->second) + " experiments already", ""};
    }
    StreamSlot slot = gate_.try_enter();
    if (!slot) {
      return core::Error{core::ErrorCode::kTooManyRequests, std::to_string(gate_.limit()) + " experiments run already",
                         ""};
    }
    ++running_[key];
    return std::make_shared<Place>(*this, std::move(slot), key);
  }

 private:
  void leave(const std::string& key) {
    const core::MutexLock lock(mutex_);
    if (const auto running = running_.find(key); --running->second == 0) {
      running_.erase(running);
    }
  }

  StreamGate gate_;
  const int of_a_key_;
  core::Mutex mutex_;
  std::map<std::string, int> running_ GUARDED_BY(mutex_);
};

Response run_experiment(const std::shared_ptr<LabPlaces>& places, const Request& request) {
  if (auto refused = refuse_query(request)) {
    return std::move(*refused);
  }
  auto parsed = api::parse_lab_request(request.body);
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  auto place = places->take(request.principal);
  if (!place) {
    return error_answer(request, place.error());
  }
  const auto stream = std::make_shared<LabStream>(*std::move(parsed));
  return stream_response("application/x-ndjson", [places, place = *std::move(place), stream](StreamWriter& writer) mutable {
    stream->run(writer);
    place.reset();
  });
}

}  // namespace

void add_lab_handlers(const RouteContext& context, HandlerTable& table) {
  const auto places = std::make_shared<LabPlaces>(context.config.lab_runs_max, context.config.quota_lab_runs);
  table["runExperiment"] = {
      .handler = [places](Request& request) { return run_experiment(places, request); },
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
}

}  // namespace server
