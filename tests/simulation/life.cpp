#include "tests/simulation/life.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <thread>
#include <vector>

#include <unistd.h>

#include "api/job/job_spec.h"
#include "api/json/error_codes.h"
#include "core/compare/comparison.h"
#include "server/store/uuid.h"
#include "tests/simulation/broker.h"
#include "tests/simulation/comparisons.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/faults.h"
#include "tests/simulation/model.h"
#include "tests/simulation/server.h"
#include "tests/simulation/watch.h"
#include "tests/simulation/workers.h"

namespace simulation {
namespace {

using api::JobState;
using server::Access;
using server::JobPointer;

constexpr std::size_t kJobsOfTenant = 10;
/// Nothing fails from this time of a shift on, and clients only wait for their jobs.
constexpr Nanoseconds kCalm = kShift - kHour;

/// Pictures of a few pixels and of two tiles. The last one also counts particles of light
/// (core/integrators/census.h), which takes long; scattering media have no census.
struct Kind {
  std::string_view integrator;
  std::string_view medium;
  int width;
  int height;
};
constexpr std::string_view kPath = R"("path", "max_depth": 2)";
constexpr std::string_view kHaze = R"("medium": {"scattering": [0.1, 0.1, 0.1]},
  "estimator": {"splitting": {"type": "none"}}, )";
constexpr std::array kKinds = {Kind{kPath, kHaze, 2, 2}, Kind{kPath, kHaze, 3, 1},
                               Kind{kPath, kHaze, 33, 1}, Kind{R"("direct")", "", 2, 2}};
/// Most time that a client follows a job.
constexpr Nanoseconds kWatchMost = 120 * kSecond;
/// A clock that is set is wrong by up to a day.
constexpr Nanoseconds kJumpMost = 24 * kHour;
constexpr double kWorkers = 0.15;   ///< Share of the lives in which workers render.
constexpr double kLastKind = 0.02;  ///< With the real renderer.
constexpr std::array kSamples = {2, 4, 8, 16, 32};

std::string body_of(int kind, int samples) {
  const Kind& row = kKinds[static_cast<std::size_t>(kind)];
  return R"({"scene": "cornell-box", "integrator": {"type": )" + std::string(row.integrator) +
         "}, " + std::string(row.medium) + R"("film": {"width": )" + std::to_string(row.width) +
         R"(, "height": )" + std::to_string(row.height) + R"(}, "stop": {"samples_per_pixel": )" +
         std::to_string(samples) + "}}";
}

/// Kind and samples of a new job; the samples can be extended.
std::string draw_job(Random& random) {
  const std::size_t last = kKinds.size() - 1;
  return std::to_string(renders_really() && random.chance(kLastKind) ? last : random.below(last)) +
         " " + std::to_string(kSamples[random.below(kSamples.size() - 1)]);
}

/// A life as its threads see it.
class World {
 public:
  World(const Life& life, Ledger& ledger) : life_(life), ledger_(ledger) {}

  [[noreturn]] void end(Ending ending) {
    if (const std::string faults = fault_counts(); !faults.empty()) {
      ledger_.note(0, "faults " + faults);
    }
    ledger_.note(0, "end " + std::to_string(static_cast<int>(ending)) + " operations " +
                        std::to_string(disk_operations()));
    ::_exit(static_cast<int>(ending));
  }
  [[noreturn]] void fail(const std::string& words) {
    ledger_.note(0, "VIOLATION " + words);
    ::_exit(static_cast<int>(Ending::kViolation));
  }
  void begin(bool is_quick);
  void start();
  [[noreturn]] void play();
  [[noreturn]] void render_all();

 private:
  void play_tenant(int tenant);
  void act(int tenant, Random& random);
  api::ParsedJob parsed(int kind, int samples) {
    auto request = api::parse_job(body_of(kind, samples));
    if (!request) {
      fail("a request is refused: " + api::problem_json(request.problem(), ""));
    }
    return *std::move(request);
  }
  void submit(int tenant, const std::string& id);
  void watch(const std::string& id, const JobPointer& job, Random& random);
  void compare(int tenant, const std::string& id, const JobPointer& job);
  /// Cancels the job; then, perhaps, removes it and uses its id again.
  void cancel(int tenant, const std::string& id, const JobPointer& job, Random& random);
  /// Returns the job if it is there; checks that it is as it was acknowledged.
  JobPointer look(int tenant, const std::string& id);
  void check_view(const std::string& id, const KnownJob& known, const api::JobView& view);
  void check_events(int tenant, const std::string& id, const JobPointer& job);
  void check_film(const std::string& id, const JobPointer& job);
  void note_answer(int tenant, const std::string& verb, const std::string& id,
                   const server::Verdict& verdict);
  void ask(int tenant, const std::string& verb, const std::string& id,
           const std::string& more = "") {
    ledger_.note(tenant, "ask-" + verb + " " + id + (more.empty() ? "" : " " + more));
  }
  std::vector<std::string> ids_of(int tenant);
  Nanoseconds time_of_shift() const { return now() % kShift; }
  bool is_calm() const { return time_of_shift() >= kCalm; }
  void operate(Random& random);
  void check_keys(bool is_unreadable);
  void use_keys(Random& random);
  void settle(int tenant);
  void cancel_hanging(int tenant, const std::vector<std::string>& resumed);
  void check_rest();

  const Life& life_;
  Ledger& ledger_;
  Server server_;
  std::uint64_t memory_bytes_ = 0;
  double think_seconds_ = 120;
  bool may_stall_ = false;
  std::optional<Nanoseconds> stop_at_;
  bool is_full_ = false;
  bool was_full_ = false;  ///< Some events are in memory only.
  bool is_draining_ = false;
  std::optional<std::uint64_t> workers_seed_;  ///< Empty: there are no workers.
  std::optional<Workers> workers_;
  bool is_broker_up_ = true;
  std::set<std::string> paused_;  ///< Ids of jobs that this process was asked to pause.
  std::vector<bool> is_settled_ = std::vector<bool>(kTenants + 1, false);
};

std::string access_name(int tenant) { return "tenant" + std::to_string(tenant); }

void World::begin(bool is_quick) {
  Random random(life_.seed * 1'000'003 + life_.number);
  constexpr std::array kPreempts = {0.0, 0.002, 0.02, 0.2};
  constexpr std::array kStalls = {0.0, 1e-5, 1e-4, 1e-3};
  constexpr std::array<Nanoseconds, 3> kSlices = {kSecond / 100, kSecond / 4, 3 * kSecond};
  constexpr std::array<Nanoseconds, 3> kSyncs = {0, kSecond / 200, kSecond};
  Schedule schedule{.seed = random.next(), .start = life_.start};
  schedule.preempt = kPreempts[random.below(kPreempts.size())];
  schedule.stall = is_quick ? 0 : kStalls[random.below(kStalls.size())];
  schedule.slice_mean = is_quick ? kSlices[0] : kSlices[random.below(kSlices.size())];
  schedule.on_deadlock = [this](const std::string& words) { fail(words); };
  DiskFaults faults{.seed = random.next()};
  faults.sync_mean = kSyncs[random.below(kSyncs.size())];
  faults.loses_power = random.chance(0.4);
  if (life_.is_faulty && random.chance(0.9)) {
    const double mean = random.chance(0.2) ? 60 : 4000;  // Soon after the start, or later.
    faults.end_at = 1 + static_cast<std::uint64_t>(random.exponential(mean));
  }
  if (life_.is_faulty && random.chance(0.1)) {
    stop_at_ = life_.start + static_cast<Nanoseconds>(random.exponential(0.5 * kHour));
  }
  if (!is_quick && random.chance(kWorkers)) {
    workers_seed_ = random.next();
    // Three honest workers that stand still would fail a job.
    schedule.stall = 0;
  }
  may_stall_ = schedule.stall > 0;
  faults.end = [this, power = faults.loses_power] {
    count_fault(power ? Fault::kPowerLost : Fault::kKilled);
    end(power ? Ending::kPowerLost : Ending::kKilled);
  };
  simulation::begin(std::move(schedule));
  use_disk(life_.root + "/", std::move(faults));
}

void World::start() {
  ledger_.note(0, "start " + std::to_string(life_.number));
  std::string failed = server_.open(life_.root + "/data");
  const std::string damage = server_.database ? server_.database->damage() : failed;
  if (life_.expects_damage) {
    if (damage.empty()) {
      fail("a damaged log was not noticed");
    }
    count_fault(Fault::kLogDamaged);
    end(Ending::kStopped);
  }
  if (!failed.empty()) {
    fail("the server does not start: " + failed);
  }
  if (!damage.empty()) {
    fail("damage without a cause: " + damage);
  }
  // Only keys are read then.
  const bool is_unreadable = life_.is_faulty && randomness().chance(0.3);
  set_disk_unreadable(is_unreadable);
  server_.keys.emplace(server_.config, *server_.key_table);
  check_keys(is_unreadable);
  set_disk_unreadable(false);
  failed = server_.start(memory_bytes_, workers_seed_);
  if (!failed.empty()) {
    fail("the server does not resume: " + failed);
  }
}

/// is_unreadable: the keys cannot be read, so none is accepted.
void World::check_keys(bool is_unreadable) {
  for (const auto& [id, key] : ledger_.keys()) {
    if (key.is_there == true && !server_.keys->is_needed()) {
      fail("there are keys, and none is required");
    }
    if (key.is_there && (!is_unreadable || !*key.is_there) &&
        server_.keys->holder_of_hash(key.hash).has_value() != *key.is_there) {
      fail("key " + id + (*key.is_there ? " is not accepted" : " was removed and is accepted"));
    }
  }
}

void World::use_keys(Random& random) {
  const auto& known = ledger_.keys();
  std::string id;
  std::string verb = "add-key ";
  core::Status done = core::ok_status();
  if (known.size() < 2 || random.chance(0.5)) {
    const server::KeyRow row = server::make_key("key").row;
    id = row.id;
    ledger_.note(0, "ask-" + verb + id + " " + row.token_hash);
    done = server_.key_table->insert(row);
  } else {
    id = std::next(known.begin(), static_cast<std::ptrdiff_t>(random.below(known.size())))->first;
    verb = "remove-key ";
    ledger_.note(0, "ask-" + verb + id);
    const auto removed = server_.key_table->remove(id);
    done = removed ? core::ok_status() : core::Status(removed.error());
  }
  ledger_.note(0, (done ? "ok-" : "no-") + verb + id);
  sleep_for(2 * kSecond);  // The ring reads them again each second.
  check_keys(false);
}

std::vector<std::string> World::ids_of(int tenant) {
  std::vector<std::string> ids;
  for (const auto& [id, job] : ledger_.jobs()) {
    if (job.tenant == tenant) {
      ids.push_back(id);
    }
  }
  return ids;
}

void World::note_answer(int tenant, const std::string& verb, const std::string& id,
                        const server::Verdict& verdict) {
  ledger_.note(tenant, (verdict ? "ok-" : "no-") + verb + " " + id +
                           (verdict ? "" : " " + verdict.problem().detail));
  if (verdict.is(core::ErrorCode::kNoSpace) && (verb == "cancel" || verb == "pause")) {
    fail("a full disk refuses to " + verb + " job " + id);
  }
}

void World::submit(int tenant, const std::string& id) {
  const KnownJob known = ledger_.jobs()[id];
  const auto submitted = server_.jobs->submit(parsed(known.kind, known.samples),
                                              {.access = Access::of(access_name(tenant)),
                                               .body_hash = body_of(known.kind, known.samples),
                                               .id = id});
  if (submitted) {
    ledger_.note(tenant, "ok-submit " + id);
  } else {
    ledger_.note(tenant, "no-submit " + id + " " + submitted.problem().detail);
  }
}

void World::check_view(const std::string& id, const KnownJob& known, const api::JobView& view) {
  const std::string state(api::to_text(view.state));
  const int samples = view.spec.stop.samples_per_pixel.value_or(0);
  const bool may_extend = known.asked == "extend" && samples == known.asked_samples;
  if (samples != known.samples && !may_extend) {
    fail("job " + id + " has " + std::to_string(samples) + " samples, not " +
         std::to_string(known.samples));
  }
  if (!known.end.empty() && state != known.end && !may_extend && known.asked != "retry") {
    fail("job " + id + " was " + known.end + " and is " + state);
  }
  if (known.is_cancelled && !api::is_final(view.state)) {
    fail("job " + id + " was cancelled and is " + state);
  }
  if (known.is_paused && known.asked.empty() && view.state != JobState::kPaused &&
      !api::is_final(view.state)) {
    fail("job " + id + " was paused and is " + state);
  }
  if (view.state == JobState::kFailed) {
    fail("job " + id + " failed: " + (view.failure ? view.failure->detail : ""));
  }
  if (view.state == JobState::kFinished &&
      view.film_digest != ledger_.digest(known.kind, samples)) {
    fail("job " + id + " has the digest " + view.film_digest + ", undisturbed " +
         ledger_.digest(known.kind, samples));
  }
}

void World::check_events(int tenant, const std::string& id, const JobPointer& job) {
  const KnownJob& known = ledger_.jobs()[id];
  const auto live = job->log().read_after(0, std::numeric_limits<std::size_t>::max());
  const auto stored = server_.jobs->journal().events_after(*job, 0, 0);
  if (!stored) {
    fail("events of job " + id + ": " + stored.error().message);
  }
  std::uint64_t hash = 0;
  std::size_t count = 0;
  std::size_t place = 0;
  std::pair<std::int64_t, std::uint64_t> last = {-1, 0};
  for (const server::EventRow& event : *stored) {
    const std::pair<std::int64_t, std::uint64_t> mark = {event.stream, event.seq};
    if (mark <= last) {
      fail("events of job " + id + " are not in order");
    }
    last = mark;
    hash = hash * 1099511628211U + std::hash<std::string>()(event.type + event.data) + event.seq;
    if (++count == known.events && hash != known.events_hash) {
      fail("earlier events of job " + id + " have changed");
    }
    if (was_full_ || event.stream != server_.run ||
        job->history() != server::Job::History::kInLog) {
      continue;
    }
    while (place < live.size() && live[place].data.empty()) {
      ++place;
    }
    if (place < live.size()) {
      if (live[place].seq != event.seq || live[place].data != event.data) {
        fail("event " + std::to_string(event.seq) + " of job " + id +
             " is not the one that was published");
      }
      ++place;
    }
  }
  if (count < known.events) {
    fail("events of job " + id + " are lost");
  }
  if (count > known.events) {
    ledger_.note(tenant, "events " + id + " " + std::to_string(count) + " " + std::to_string(hash));
  }
}

void World::check_film(const std::string& id, const JobPointer& job) {
  const KnownJob known = ledger_.jobs()[id];
  const auto film = server_.jobs->films().final_film(*job, {});
  const JobState state = job->state();
  if (known.is_damaged) {
    return;
  }
  if (state != JobState::kFinished) {  // Cancelled: it may have a film.
    if (!film && film.error().code == api::kGone) {
      fail("the film of cancelled job " + id + " is lost: " + film.error().message);
    }
    return;
  }
  const std::string expected = ledger_.digest(known.kind, known.samples);
  if (!film) {
    fail("the film of job " + id + " is lost: " + film.error().message);
  }
  if ((*film)->digest() != expected) {
    fail("the film of job " + id + " has the digest " + (*film)->digest() + ", undisturbed " +
         expected);
  }
}

JobPointer World::look(int tenant, const std::string& id) {
  const KnownJob known = ledger_.jobs()[id];
  const auto job = server_.jobs->find(id, Access::of(access_name(tenant)));
  if (!job) {
    const bool may_be_gone = known.is_removed || known.asked == "remove" ||
                             (!known.is_there && (known.asked == "submit" || known.asked.empty()));
    if (!may_be_gone) {
      fail("job " + id + " is lost: " + job.error().message);
    }
    if (!known.is_removed) {
      ledger_.note(tenant, "gone " + id);
    }
    return nullptr;
  }
  if (known.is_removed) {
    fail("job " + id + " was removed and is there");
  }
  if (server_.jobs->find(id, Access::of(access_name(tenant % kTenants + 1)))) {
    fail("another tenant sees job " + id);
  }
  const api::JobView view = server_.jobs->view(**job);
  check_view(id, known, view);
  const std::string state(api::to_text(view.state));
  if (!known.asked.empty() || (api::is_final(view.state) && known.end != state)) {
    ledger_.note(tenant, "saw " + id + " " + state + " " +
                             std::to_string(view.spec.stop.samples_per_pixel.value_or(0)));
  }
  check_events(tenant, id, *job);
  return *job;
}

void World::cancel(int tenant, const std::string& id, const JobPointer& job, Random& random) {
  server::JobService& jobs = *server_.jobs;
  ask(tenant, "cancel", id);
  note_answer(tenant, "cancel", id, jobs.cancel(job));
  if (random.chance(0.5)) {
    ask(tenant, "remove", id);
    note_answer(tenant, "remove", id, jobs.remove(job));
    if (random.chance(0.5) && ledger_.jobs()[id].is_removed) {  // The id may be used again.
      ask(tenant, "submit", id, draw_job(random));
      submit(tenant, id);
    }
  }
}

void World::watch(const std::string& id, const JobPointer& job, Random& random) {
  const Nanoseconds until = now() + static_cast<Nanoseconds>(random.uniform() * kWatchMost);
  const std::string wrong =
      random.chance(0.5)
          ? watch_events(job, until)
          : watch_tiles({*server_.jobs, *server_.denoising, server_.frames, server_.streams}, job,
                        until);
  if (!wrong.empty()) {
    fail("a client of job " + id + ": " + wrong);
  }
}

void World::compare(int tenant, const std::string& id, const JobPointer& job) {
  const auto film = server_.jobs->films().final_film(*job, {});
  if (job->state() != JobState::kFinished || !film) {
    return;
  }
  const core::Picture picture = core::picture_of((*film)->snapshot());
  const auto compared = core::compare_pictures(picture, picture);
  if (!compared || compared->mse != 0) {
    fail("the film of job " + id + " differs from itself");
  }
  const std::string own = server::make_uuid();
  const std::string body = "film " + (*film)->digest();
  ask(tenant, "compare", own);
  const Comparisons::Stored stored = server_.comparisons->store(access_name(tenant), own, body);
  if (stored.starved > 0 && !may_stall_) {
    fail("a comparison waited " + std::to_string(stored.starved / kSecond) +
         " s for those of one other tenant");
  }
  if (stored.is_stored) {
    ledger_.note(tenant, "ok-compare " + own + " " + body);
  }
}

void World::act(int tenant, Random& random) {
  if (const auto compared = ledger_.compared().find(tenant); compared != ledger_.compared().end()) {
    const auto& [own, body] = compared->second;
    if (server_.comparisons->find(own, Access::of(access_name(tenant))) != body) {
      fail("comparison " + own + " is lost or has changed");
    }
    if (!server_.comparisons->find(own, Access::of(access_name(tenant % kTenants + 1))).empty()) {
      fail("another tenant sees comparison " + own);
    }
  }
  const std::vector<std::string> ids = ids_of(tenant);
  if (ids.size() < 2 || (ids.size() < kJobsOfTenant && random.chance(0.3))) {
    const std::string id = server::make_uuid();
    ask(tenant, "submit", id, draw_job(random));
    submit(tenant, id);
    if (random.chance(0.2)) {  // A mistake: while it waits, loads or has just begun.
      sleep_for(static_cast<Nanoseconds>(random.exponential(0.05 * kSecond)));
      if (const JobPointer job = look(tenant, id)) {
        cancel(tenant, id, job, random);
      }
    } else if (random.chance(0.4)) {
      if (const JobPointer job = look(tenant, id)) {
        watch(id, job, random);
      }
    }
    return;
  }
  const std::string id = ids[random.below(ids.size())];
  const JobPointer job = look(tenant, id);
  if (!job) {
    ledger_.note(tenant, "forget " + id);
    return;
  }
  server::JobService& jobs = *server_.jobs;
  const auto patch = [&](const std::string& verb, const std::string& body) {
    ask(tenant, verb, id);
    note_answer(tenant, verb, id,
                jobs.patch(job, body, std::nullopt, Access::of(access_name(tenant))));
  };
  const bool has_ended = api::is_final(job->state());
  switch (random.below(has_ended ? 6 : 7)) {
    case 0:
      if (has_ended) {
        check_film(id, job);
      } else {
        patch("rank", R"({"priority": )" + std::to_string(random.below(3)) + "}");
      }
      break;
    case 1:
    case 2:
      if (has_ended && job->state() == JobState::kFinished && random.chance(0.4)) {
        const int samples = kSamples[1 + random.below(kSamples.size() - 1)];
        ask(tenant, "extend", id, std::to_string(samples));
        note_answer(tenant, "extend", id,
                    jobs.extend(job, R"({"stop": {"samples_per_pixel": )" +
                                         std::to_string(samples) + "}}"));
      } else if (has_ended) {
        ask(tenant, "remove", id);
        note_answer(tenant, "remove", id, jobs.remove(job));
      } else {
        paused_.insert(id);
        patch("pause", R"({"paused": true})");
      }
      break;
    case 3:
      cancel(tenant, id, job, random);
      break;
    case 4:
      if (has_ended) {
        compare(tenant, id, job);
        break;
      }
      [[fallthrough]];
    case 5:
      if (has_ended) {
        watch(id, job, random);
        break;
      }
      [[fallthrough]];
    default:
      if (random.chance(0.5)) {
        watch(id, job, random);
        break;
      }
      patch("resume", R"({"paused": false})");
      break;
  }
}

/// Cancels the tenant's jobs whose scenes may be among those that do not load. resumed: jobs that
/// were paused, which may load although they are queued.
void World::cancel_hanging(int tenant, const std::vector<std::string>& resumed) {
  for (const std::string& id : ids_of(tenant)) {
    const JobPointer job = look(tenant, id);
    const bool was_paused = std::find(resumed.begin(), resumed.end(), id) != resumed.end();
    if (job &&
        (job->state() == JobState::kLoading || (was_paused && job->state() == JobState::kQueued))) {
      ask(tenant, "cancel", id);
      note_answer(tenant, "cancel", id, server_.jobs->cancel(job));
    }
  }
}

/// Resumes the tenant's jobs and waits until all have ended; cancels those that would never load.
void World::settle(int tenant) {
  // A job that was paused while its scene loads goes on loading, and is queued when it is resumed.
  std::vector<std::string> resumed;
  for (const std::string& id : ids_of(tenant)) {
    if (const JobPointer job = look(tenant, id); job && job->state() == JobState::kPaused) {
      resumed.push_back(id);
      ask(tenant, "resume", id);
      note_answer(tenant, "resume", id,
                  server_.jobs->patch(job, R"({"paused": false})", std::nullopt,
                                      Access::of(access_name(tenant))));
    }
  }
  for (; hanging_loads() > 0; sleep_for(10 * kSecond)) {
    cancel_hanging(tenant, resumed);
  }
  for (const std::string& id : ids_of(tenant)) {
    for (bool has_ended = false; !has_ended;) {
      const JobPointer job = look(tenant, id);
      has_ended = !job || api::is_final(job->state());
      if (!has_ended && job->state() == JobState::kPaused) {
        ask(tenant, "resume", id);
        note_answer(tenant, "resume", id,
                    server_.jobs->patch(job, R"({"paused": false})", std::nullopt,
                                        Access::of(access_name(tenant))));
      }
      if (!has_ended && time_of_shift() < kCalm) {
        fail("job " + id + " has not ended in the calm hour; it is " +
             std::string(api::to_text(job->state())));
      }
      if (has_ended && job) {
        check_film(id, job);
        look(tenant, id);
      } else {
        sleep_for(10 * kSecond);
      }
    }
  }
  is_settled_[static_cast<std::size_t>(tenant)] = true;
}

void World::play_tenant(int tenant) {
  Random random(life_.seed * 7919 + life_.number * 31 + static_cast<std::uint64_t>(tenant));
  // Finds out first what became of the requests that have no answer.
  for (const std::string& id : ids_of(tenant)) {
    const KnownJob known = ledger_.jobs()[id];
    if (known.asked == "submit" && random.chance(0.5)) {
      submit(tenant, id);  // Again.
    }
    if (!look(tenant, id)) {
      ledger_.note(tenant, "forget " + id);
    }
  }
  while (!is_calm()) {
    // Several requests often follow each other at once.
    sleep_for(static_cast<Nanoseconds>(random.chance(0.5)
                                           ? random.exponential(0.01 * kSecond)
                                           : random.exponential(2 * think_seconds_ * kSecond)) /
              (is_full_ ? 10 : 1));
    act(tenant, random);
  }
  settle(tenant);
}

/// At rest nothing is held.
void World::check_rest() {
  const server::JobService::Counts counts = server_.jobs->counts();
  if (counts.queued != 0 || counts.rendering != 0 || counts.held_bytes != 0) {
    fail("at rest " + std::to_string(counts.queued) + " jobs wait, " +
         std::to_string(counts.rendering) + " render, " + std::to_string(counts.held_bytes) +
         " bytes are held");
  }
  for (const auto& entry : std::filesystem::directory_iterator(server_.data->films_path())) {
    const std::string id = entry.path().stem().string();
    if (!server_.jobs->find(id, Access::operators())) {
      fail("at rest there is a film of no job: " + id);
    }
  }
  const auto drained = server_.jobs->drain();
  if (drained.running != 0) {
    fail("at rest " + std::to_string(drained.running) + " places are taken");
  }
}

/// The disk fills up and is freed; the server is drained for a while.
void World::operate(Random& random) {
  if (is_calm()) {
    spare_process();
  }
  const bool is_faulty = life_.is_faulty && !is_calm();
  get_stuck_sometimes(is_faulty);
  if (is_full_ ? !is_faulty || random.chance(0.05) : is_faulty && random.chance(0.004)) {
    is_full_ = !is_full_;
    was_full_ = true;
    ledger_.note(0, is_full_ ? "disk-full" : "disk-freed");
    set_disk_full(is_full_);
  }
  if (is_draining_ ? !is_faulty || random.chance(0.1) : is_faulty && random.chance(0.0005)) {
    is_draining_ = !is_draining_;
    if (is_draining_) {
      count_fault(Fault::kDrained);
    }
    ledger_.note(0, is_draining_ ? "drain" : "drain-ends");
    server_.jobs->set_draining(is_draining_);
  }
  if (is_faulty && random.chance(0.005)) {
    jump_clock(static_cast<Nanoseconds>((2 * random.uniform() - 1) * kJumpMost));
  }
  if (random.chance(0.02)) {
    use_keys(random);
  }
  if (workers_) {
    set_broker_lossy(is_faulty);
    if (is_broker_up_ ? is_faulty && random.chance(0.01) : !is_faulty || random.chance(0.3)) {
      is_broker_up_ = !is_broker_up_;
      ledger_.note(0, is_broker_up_ ? "queue-up" : "queue-down");
      set_broker_up(is_broker_up_);
    }
  }
}

void World::play() {
  Random random(life_.seed * 65'537 + life_.number);
  if (workers_seed_) {
    workers_.emplace(*server_.jobs->board(), *workers_seed_,
                     [this] { return !life_.is_faulty || is_calm(); });
  }
  std::vector<std::thread> tenants;
  for (int tenant = 1; tenant <= kTenants; ++tenant) {
    tenants.emplace_back([this, tenant] { play_tenant(tenant); });
  }
  for (std::uint64_t i = 0; i < 2; ++i) {
    tenants.emplace_back([this, seed = life_.seed * 6151 + life_.number * 2 + i] {
      for (Random draws(seed); !is_calm();) {
        server_.comparisons->flood(draws);
      }
    });
  }
  const Nanoseconds shift_end = (life_.start / kShift + 1) * kShift - kSecond;
  const auto are_settled = [this] {
    return std::find(is_settled_.begin() + 1, is_settled_.end(), false) == is_settled_.end();
  };
  while (!are_settled()) {
    if (stop_at_ && now() >= *stop_at_ && !is_calm()) {
      server_.jobs->stop();
      count_fault(Fault::kStopped);
      end(Ending::kStopped);
    }
    operate(random);
    if (now() >= shift_end) {
      fail("jobs have not ended in the calm hour");
    }
    sleep_for(30 * kSecond);
  }
  for (std::thread& tenant : tenants) {
    tenant.join();
  }
  if (workers_) {
    workers_->stop();
    sleep_for(kSecond);
    const auto was_interrupted = [this](const server::Job& job) {
      return was_full_ || paused_.count(job.id()) > 0;
    };
    ledger_.note(0, "workers " + workers_->counts());
    if (const std::string words = workers_->check_rest(was_interrupted); !words.empty()) {
      fail(words);
    }
  }
  check_rest();
  server_.jobs->stop();
  sleep_for(shift_end + kSecond - now());
  end(Ending::kShift);
}

void World::render_all() {
  std::vector<std::pair<std::pair<int, int>, JobPointer>> made;
  const std::size_t kinds = kKinds.size() - (renders_really() ? 0 : 1);
  for (int kind = 0; kind < static_cast<int>(kinds); ++kind) {
    for (const int samples : kSamples) {
      auto job = server_.jobs->submit(parsed(kind, samples), {});
      if (!job) {
        fail("a request is refused: " + job.problem().detail);
      }
      made.push_back({{kind, samples}, job->job});
    }
  }
  for (const auto& [what, job] : made) {
    while (!api::is_final(job->state())) {
      sleep_for(kSecond);
    }
    ledger_.note(0, "digest " + std::to_string(what.first) + " " + std::to_string(what.second) +
                        " " + server_.jobs->view(*job).film_digest);
  }
  end(Ending::kShift);
}

}  // namespace

void live(const Life& life, Ledger& ledger) {
  World world(life, ledger);
  world.begin(false);
  world.start();
  world.play();
}

void render_undisturbed(const Life& life, Ledger& ledger) {
  World world(life, ledger);
  world.begin(true);
  world.start();
  world.render_all();
}

}  // namespace simulation
