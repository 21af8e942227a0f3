#include "tests/simulation/workers.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <type_traits>
#include <utility>

#include "clients/worker/pauses.h"
#include "core/render/picture/renderer.h"
#include "core/render/units/unit_renderer.h"
#include "server/jobs/render_run.h"
#include "server/store/uuid.h"
#include "tests/simulation/broker.h"
#include "tests/simulation/faults.h"

namespace simulation {

using core::ErrorCode;
using server::WorkBoard;

enum class Character { kHonest, kFleeting, kSick, kLiar };

namespace {

constexpr const char* kBuild = "simulation";
constexpr const char* kArithmetic = "simulated/64";
constexpr double kLeaseSeconds = 15;
constexpr double kTravelMean = 0.02 * kSecond;
constexpr Nanoseconds kTimeout = 5 * kSecond;
constexpr Nanoseconds kAskAgain = std::chrono::nanoseconds(cli::kAskAgain).count();
/// For how long at most the network fails for honest workers.
constexpr double kCutMost = kLeaseSeconds / 3 * kSecond;

std::vector<Character> draw_characters(Random& random) {
  std::vector<Character> characters = {Character::kHonest, Character::kHonest};
  for (const Character each : {Character::kFleeting, Character::kSick, Character::kLiar}) {
    if (random.chance(0.6)) {
      characters.push_back(each);
    }
  }
  return characters;
}

}  // namespace

class Worker {
 public:
  Worker(WorkBoard& board, Character character, std::uint64_t seed, std::function<bool()> is_calm)
      : board_(board),
        character_(character),
        random_(seed),
        is_calm_(std::move(is_calm)),
        key_("key" + std::to_string(seed % 100)),
        reports_([this] { report(); }),
        units_([this] { work(); }) {}

  void stop() {
    is_stopping_ = true;
    units_.join();
    has_stopped_ = true;
    reports_.join();
  }
  const std::string& id() const { return id_; }
  /// The jobs of which wrong results of it were taken.
  const std::vector<server::JobPointer>& victims() const { return victims_; }

 private:
  /// Returns the answer to a request; empty: one of the two was lost.
  template <typename Request>
  auto carry(const Request& request) -> std::optional<std::invoke_result_t<Request>> {
    if (!travels()) {
      return std::nullopt;
    }
    auto answer = request();
    if (!is_calm_() && strikes(Fault::kRequestDoubled)) {
      static_cast<void>(request());
    }
    if (!travels()) {
      return std::nullopt;
    }
    return answer;
  }
  bool travels() {
    sleep_for(static_cast<Nanoseconds>(random_.exponential(kTravelMean)));
    if (now() < cut_until_ || (!is_calm_() && strikes(Fault::kRequestLost))) {
      sleep_for(kTimeout);
      return false;
    }
    return true;
  }
  WorkBoard::Sender sender() const { return {id_, key_}; }

  void report();
  void cut_network();
  void work();
  void do_unit(const UnitMessage& message);
  void hand_back(const std::string& unit, const std::string& fault) {
    static_cast<void>(carry([&] { return board_.hand_back(unit, sender(), fault); }));
  }
  /// Errors: why the unit is returned.
  core::Result<std::string> render(const std::string& unit, const std::string& input);
  core::Status deliver(const std::string& unit, const std::string& result);

  WorkBoard& board_;
  const Character character_;
  Random random_;
  const std::function<bool()> is_calm_;
  const std::string key_;
  std::string id_ = server::make_uuid();
  bool is_stopping_ = false;
  bool has_stopped_ = false;
  Nanoseconds cut_until_ = 0;
  std::optional<UnitMessage> held_;
  Nanoseconds since_ = 0;  ///< Start of that unit.
  bool is_dropped_ = false;
  server::JobPointer job_;  ///< Of that unit.
  std::vector<server::JobPointer> victims_;
  /// A result that the network delivers again later.
  std::function<void()> late_;
  std::thread reports_;
  std::thread units_;
};

void Worker::cut_network() {
  if (is_calm_() || now() < cut_until_ || !strikes(Fault::kNetworkCut)) {
    return;
  }
  const bool is_long = character_ == Character::kFleeting;
  const double time = is_long ? random_.exponential(kOutage) : random_.uniform() * kCutMost;
  cut_until_ = now() + static_cast<Nanoseconds>(time);
  if (is_long && random_.chance(0.5)) {  // Its machine was restarted.
    count_fault(Fault::kWorkerRestarted);
    id_ = server::make_uuid();
    is_dropped_ = true;
  }
}

void Worker::report() {
  while (!has_stopped_) {
    cut_network();
    api::WorkerReport report;
    report.build = kBuild;
    report.arithmetic = kArithmetic;
    report.draining = is_stopping_;
    if (held_) {
      renew_unit(*held_);
      report.units[held_->unit] = static_cast<double>(now() - since_) / kSecond;
    }
    const auto orders = carry([&] { return board_.report(sender(), report); });
    if (orders && *orders && held_ && !report.units.empty()) {
      const auto& dropped = (*orders)->dropped;
      is_dropped_ =
          is_dropped_ || std::find(dropped.begin(), dropped.end(), held_->unit) != dropped.end();
    }
    const auto pause =
        orders && *orders
            ? static_cast<Nanoseconds>((*orders)->report_seconds * static_cast<double>(kSecond))
            : kAskAgain;
    await_report_request(id_, now() + pause);
  }
}

void Worker::work() {
  while (!is_stopping_) {
    if (const auto message = pull_unit(now() + 30 * kSecond)) {
      do_unit(*message);
    }
    if (late_ && random_.chance(0.5)) {
      std::exchange(late_, nullptr)();
    }
  }
}

void Worker::do_unit(const UnitMessage& message) {
  const std::string& unit = message.unit;
  const auto input = carry([&] { return board_.lease(unit, sender()); });
  if (!input || (!*input && input->error().code == ErrorCode::kUnavailable)) {
    if (!input) {
      hand_back(unit, "");  // It may have been leased.
    }
    hand_unit_back(message);
    sleep_for(kAskAgain);
    return;
  }
  if (!*input) {  // It is done, or another worker holds it.
    finish_unit(message);
    return;
  }
  is_dropped_ = false;
  since_ = now();
  held_ = message;
  const std::string id = id_;
  const auto result = render(unit, **input);
  const core::Status delivered = result ? deliver(unit, *result) : core::Status(result.error());
  if (id == id_) {  // Otherwise another process goes on, which knows nothing of the unit.
    if (!delivered) {
      const bool is_fault = !is_dropped_ && delivered.error().code != ErrorCode::kNotFound;
      hand_back(unit, is_fault ? delivered.error().message : "");
    }
    finish_unit(message);
  }
  held_.reset();
}

core::Result<std::string> Worker::render(const std::string& unit, const std::string& input) {
  if (character_ == Character::kSick) {
    count_fault(Fault::kWorkerSick);
    return core::Error{ErrorCode::kNoSpace, "No space left on device", ""};
  }
  auto work = core::decode_work(input, core::WorkPart::kInput);
  if (!work) {
    return work.error();
  }
  const auto job = carry([&] { return board_.job_of_lease(unit.substr(0, unit.find('.')), key_); });
  const auto run = job && *job ? (*job)->run() : nullptr;
  if (!run) {
    return core::Error{ErrorCode::kNotFound, "the job is gone", ""};
  }
  job_ = *job;
  const auto renderer = core::Renderer::create(run->task().renderer().view());
  if (!renderer) {
    return renderer.error();
  }
  if (!core::UnitRenderer(*renderer).render(*work, {})) {
    return core::Error{ErrorCode::kCancelled, "stopped", ""};
  }
  if (character_ == Character::kLiar && !work->front().state.pixels.empty()) {
    work->front().state.pixels.front().mean_r += 0.25F;
  }
  return core::encode_work(*work, core::WorkPart::kResult);
}

core::Status Worker::deliver(const std::string& unit, const std::string& result) {
  const WorkBoard::Sender from = sender();
  while (!is_dropped_) {
    const auto taken = carry([&] { return board_.take(unit, from, result); });
    if (taken && (*taken || taken->error().code != ErrorCode::kUnavailable)) {
      if (character_ == Character::kLiar && *taken) {
        count_fault(Fault::kWorkerLied);
        victims_.push_back(job_);
      }
      if (!is_calm_() && strikes(Fault::kResultLate)) {
        late_ = [this, unit, from, result] {
          static_cast<void>(carry([&] { return board_.take(unit, from, result); }));
        };
      }
      return *taken;
    }
    sleep_for(kAskAgain);
  }
  return core::Error{ErrorCode::kCancelled, "dropped", ""};
}

Workers::Workers(WorkBoard& board, std::uint64_t seed, std::function<bool()> is_calm)
    : board_(board) {
  Random random(seed);
  const std::vector<Character> characters = draw_characters(random);
  for (const Character each : characters) {
    workers_.push_back(std::make_unique<Worker>(board, each, random.next(), is_calm));
  }
}

Workers::~Workers() = default;

server::WorkOptions Workers::options(std::uint64_t seed) {
  Random random(seed);
  const std::vector<Character> characters = draw_characters(random);
  server::WorkOptions options;
  options.lease_seconds = kLeaseSeconds;
  options.build = kBuild;
  options.arithmetic = kArithmetic;
  options.has_local_threads = random.chance(0.3);
  // Results of a liar that are not verified are taken.
  const bool has_liar =
      std::find(characters.begin(), characters.end(), Character::kLiar) != characters.end();
  options.verify_share = has_liar ? 1.0F : 0.0F;
  return options;
}

void Workers::stop() {
  for (const auto& worker : workers_) {
    worker->stop();
  }
}

std::string Workers::check_rest(
    const std::function<bool(const server::Job&)>& was_interrupted) const {
  const WorkBoard::Counts counts = board_.counts();
  if (counts.open != 0) {
    return "at rest " + std::to_string(counts.open) + " units are open";
  }
  const std::vector<api::WorkerView> views = board_.workers();
  std::uint64_t liars = 0;
  for (const auto& worker : workers_) {
    const auto view = std::find_if(views.begin(), views.end(),
                                   [&](const auto& each) { return each.id == worker->id(); });
    // Each unit is verified before its job finishes.
    const auto& victims = worker->victims();
    const bool was_compared =
        std::any_of(victims.begin(), victims.end(), [&](const server::JobPointer& job) {
          return job->state() == api::JobState::kFinished && !was_interrupted(*job);
        });
    if (was_compared && (view == views.end() || view->state != "suspended")) {
      return "a worker whose wrong result was compared is not suspended";
    }
    liars += victims.empty() ? 0U : 1U;
  }
  if (counts.suspended > liars) {
    return "an honest worker is suspended";
  }
  for (const api::WorkerView& view : views) {
    if (view.leases != 0) {
      return "at rest a worker holds units";
    }
  }
  return "";
}

std::string Workers::counts() const {
  const WorkBoard::Counts counts = board_.counts();
  return "taken " + std::to_string(counts.taken) + " expired " + std::to_string(counts.expired) +
         " refused " + std::to_string(counts.refused) + " verified " +
         std::to_string(counts.verified) + " differing " + std::to_string(counts.differing) +
         " suspended " + std::to_string(counts.suspended) + " own " + std::to_string(counts.own);
}

}  // namespace simulation
