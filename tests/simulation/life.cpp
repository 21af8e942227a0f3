#include "tests/simulation/life.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "api/job/job_spec.h"
#include "api/json/error_codes.h"
#include "core/compare/comparison.h"
#include "server/observe/clock.h"
#include "server/store/database.h"
#include "server/store/key_table.h"
#include "server/store/uuid.h"
#include "tests/simulation/broker.h"
#include "tests/simulation/comparisons.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/faults.h"
#include "tests/simulation/model.h"
#include "tests/simulation/receiver.h"
#include "tests/simulation/requests.h"
#include "tests/simulation/server.h"
#include "tests/simulation/watch.h"
#include "tests/simulation/workers.h"
#include "tests/simulation/world.h"

namespace simulation {
namespace {

constexpr std::size_t kJobsOfTenant = 10;

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
/// Of some jobs, which are forgotten so long after their end.
constexpr int kRetentionSeconds = 600;
constexpr double kWorkers = 0.3;    ///< Share of the lives in which workers render.
constexpr double kLastKind = 0.02;  ///< With the real renderer.
/// Seconds after which a call that is due must have been made; more than all polls and rests.
constexpr double kCallWaits = 600;
constexpr int kKindWithWebhook = 1;
constexpr std::array kSamples = {2, 4, 8, 16, 32};

}  // namespace

std::string body_of(int kind, int samples, int retention_seconds) {
  const Kind& row = kKinds[static_cast<std::size_t>(kind)];
  return R"({"scene": "cornell-box", "integrator": {"type": )" + std::string(row.integrator) +
         "}, " + std::string(row.medium) + R"("film": {"width": )" + std::to_string(row.width) +
         R"(, "height": )" + std::to_string(row.height) + R"(}, "stop": {"samples_per_pixel": )" +
         std::to_string(samples) + "}" +
         (retention_seconds > 0 ? ", \"retention_seconds\": " + std::to_string(retention_seconds)
                                : "") +
         (kind == kKindWithWebhook ? R"(, "webhook": {"url": "http://receiver.example"})" : "") +
         "}";
}

std::string access_name(int tenant) { return "tenant" + std::to_string(tenant); }

namespace {

/// Kind, samples and retention of a new job; the samples can be extended.
std::string draw_job(Random& random) {
  const std::size_t last = kKinds.size() - 1;
  return std::to_string(renders_really() && random.chance(kLastKind) ? last : random.below(last)) +
         " " + std::to_string(kSamples[random.below(kSamples.size() - 1)]) + " " +
         std::to_string(random.chance(0.1) ? kRetentionSeconds : 0);
}

}  // namespace

void World::begin(bool is_quick) {
  Random random(life_.seed * 1'000'003 + life_.number);
  constexpr std::array kPreempts = {0.0, 0.002, 0.02, 0.2};
  constexpr std::array<Nanoseconds, 3> kSlices = {kSecond / 100, kSecond / 4, 3 * kSecond};
  constexpr std::array<Nanoseconds, 3> kSyncs = {0, kSecond / 200, kSecond};
  Schedule schedule{.seed = random.next(), .start = life_.start};
  seed_faults(random.next());
  schedule.preempt = kPreempts[random.below(kPreempts.size())];
  schedule.may_stall = !is_quick && random.chance(0.5);
  schedule.slice_mean = is_quick ? kSlices[0] : kSlices[random.below(kSlices.size())];
  schedule.on_deadlock = [this](const std::string& words) { fail(words); };
  DiskFaults faults{.seed = random.next()};
  faults.sync_mean = kSyncs[random.below(kSyncs.size())];
  faults.loses_power = random.chance(0.5);
  faults.ends = life_.is_faulty;
  if (life_.is_faulty && random.chance(0.2)) {  // Already while it starts, or soon after.
    faults.end_at = 1 + random.below(100);
  }
  if (!is_quick && random.chance(kWorkers)) {
    workers_seed_ = random.next();
    // Three honest workers that stand still would fail a job.
    schedule.may_stall = false;
  }
  may_stall_ = schedule.may_stall;
  step_ = schedule.slice_mean + faults.sync_mean;
  faults.end = [this, power = faults.loses_power] {
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
  const bool is_unreadable =
      life_.is_faulty && randomness().chance(chance_at_start(Fault::kDiskUnreadable));
  set_disk_unreadable(is_unreadable);
  server_.keys.emplace(server_.config, *server_.key_table);
  check_keys(is_unreadable);
  set_disk_unreadable(false);
  failed = server_.start(
      life_.build, workers_seed_,
      std::make_unique<Calls>([this](const server::WebPost& post) { take_call(post); },
                              [this] { return life_.is_faulty && !is_calm(); }));
  if (!failed.empty()) {
    fail("the server does not resume: " + failed);
  }
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
  if (verdict.is(core::ErrorCode::kInternal)) {  // The disk may hold it nevertheless.
    ledger_.note(tenant, "lost-" + verb + " " + id + " " + verdict.problem().detail);
    return;
  }
  ledger_.note(tenant, (verdict ? "ok-" : "no-") + verb + " " + id +
                           (verdict ? "" : " " + verdict.problem().detail));
  if (verdict.is(core::ErrorCode::kNoSpace) && (verb == "cancel" || verb == "pause")) {
    fail("a full disk refuses to " + verb + " job " + id);
  }
}

void World::submit(int tenant, const std::string& id) {
  const KnownJob known = ledger_.jobs()[id];
  const auto submitted = server_.jobs->submit(
      parsed(known.kind, known.samples, known.retention_seconds),
      {.access = Access::of(access_name(tenant)),
       .body_hash = body_of(known.kind, known.samples, known.retention_seconds),
       .id = id});
  if (submitted) {
    ledger_.note(tenant, "ok-submit " + id);
  } else {
    const bool is_unknown = submitted.problem().status == 500;
    ledger_.note(tenant, (is_unknown ? "lost-submit " : "no-submit ") + id + " " +
                             submitted.problem().detail);
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
  // It may have ended before, and then goes on when that is asked.
  if (known.is_cancelled && !api::is_final(view.state) && !may_extend && known.asked != "retry") {
    fail("job " + id + " was cancelled and is " + state);
  }
  if (known.is_paused && known.asked.empty() && view.state != JobState::kPaused &&
      !api::is_final(view.state)) {
    fail("job " + id + " was paused and is " + state);
  }
  const std::string failure = view.failure ? view.failure->detail : "";
  if (view.state == JobState::kFailed && failure.find(kLoadFailure) == std::string::npos &&
      failure.find("/O error") == std::string::npos &&  // Of SQLite.
      failure.find("the disk could not read it") == std::string::npos &&
      failure.find(std::strerror(EIO)) == std::string::npos) {
    fail("job " + id + " failed: " + failure);
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
  if (!stored && has_happened(Fault::kReadFails)) {
    return;
  }
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
    // What could not be stored was published nevertheless.
    if (was_full_ || has_happened(Fault::kWriteFails) || event.stream != server_.run ||
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
  const bool is_forgotten =  // Meanwhile.
      known.retention_seconds > 0 && !server_.jobs->find(id, Access::operators());
  if (count < known.events && !is_forgotten) {
    fail("events of job " + id + " are lost");
  }
  if (count > known.events) {
    ledger_.note(tenant, "events " + id + " " + std::to_string(count) + " " + std::to_string(hash));
  }
}

/// A call arrives: it must be signed, and what it is about must have ended as it says.
void World::take_call(const server::WebPost& post) {
  const auto header = [&](const std::string& name) {
    const auto found = std::find_if(post.headers.begin(), post.headers.end(),
                                    [&](const auto& each) { return each.first == name; });
    return found == post.headers.end() ? "" : found->second;
  };
  const auto body = nlohmann::json::parse(post.body);
  const auto& data = body.at("data");
  const auto id = data.at("id").get<std::string>();
  std::optional<std::string> tenant;
  if (const auto job = server_.jobs->find(id, Access::operators())) {
    tenant = (*job)->tenant();
  } else if (const auto batch = server_.batch_table->find(id, Access::operators())) {
    tenant = batch->tenant;
  }
  const auto secret =
      tenant ? server_.webhook_secrets->of(*tenant) : core::Result<std::string>(core::Error{});
  if (secret && header("webhook-signature") !=
                    server::webhook_signature(*server::webhook_key(*secret), header("webhook-id"),
                                              std::stoll(header("webhook-timestamp")), post.body)) {
    fail("a call about " + id + " is not signed by its tenant's secret");
  }
  const bool is_batch = body.at("type") == "batch.end";
  for (const auto& job : is_batch ? data.at("jobs") : nlohmann::json::array({data})) {
    const auto state = api::job_state_from_text(job.at("state").get<std::string>());
    if (!state || !api::is_final(*state)) {
      fail("a call says that " + id + " has ended, and a job is " + job.at("state").dump());
    }
  }
  const int samples = is_batch ? 0 : data.at("spec").at("stop").at("samples_per_pixel").get<int>();
  const std::string digest = ledger_.digest(kKindWithWebhook, samples);  // Empty: not yet known.
  if (!is_batch && data.at("state") == "finished" && !digest.empty() &&
      data.at("film_digest") != digest) {
    fail("a call names another digest for job " + id);
  }
  ledger_.note(0, "ok-call " + header("webhook-id") + " " + id);
}

/// The end of a job has made a call, which is not overdue.
void World::check_calls(const std::string& id, const server::Job& job) {
  if (!job.record().view.spec.webhook) {
    return;
  }
  const auto calls = server_.deliveries->list({.job = id}, Access::operators());
  if (calls && calls->empty()) {
    fail("job " + id + " has ended, and its webhook is lost");
  }
  for (const server::DeliveryRow& call : calls ? *calls : std::vector<server::DeliveryRow>()) {
    if (call.state == "pending" && call.next_at < server::unix_now() - kCallWaits) {
      fail("call " + call.id + " of job " + id + " is not made");
    }
  }
}

void World::check_film(const std::string& id, const JobPointer& job) {
  const KnownJob known = ledger_.jobs()[id];
  const auto film = server_.jobs->films().final_film(*job, {});
  const JobState state = job->state();
  const auto has_failed_by = [&](core::ErrorCode code) {
    return !film && film.error().code == code;
  };
  if (known.is_damaged || state == JobState::kFailed || (!film && known.retention_seconds > 0) ||
      has_failed_by(core::ErrorCode::kInternal) ||
      (has_failed_by(core::ErrorCode::kUnavailable) && has_happened(Fault::kReadFails))) {
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
                             known.retention_seconds > 0 ||
                             job.error().code == core::ErrorCode::kInternal ||
                             (!known.is_there && (known.asked == "submit" || known.asked.empty()));
    if (!may_be_gone) {
      fail("job " + id + " is lost: " + job.error().message);
    }
    if (!known.is_removed) {
      ledger_.note(tenant, "gone " + id);
      if (known.retention_seconds > 0 && known.is_there && known.asked != "remove") {
        ledger_.note(tenant, "ok-expire");
      }
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
  if (random.chance(0.2)) {  // Its last slices may still be running.
    watch(tenant, id, job, random);
  }
  if (random.chance(0.5)) {
    ask(tenant, "remove", id);
    note_answer(tenant, "remove", id, jobs.remove(job));
    if (random.chance(0.5) && ledger_.jobs()[id].is_removed) {  // The id may be used again.
      ask(tenant, "submit", id, draw_job(random));
      submit(tenant, id);
    }
  }
}

void World::watch(int tenant, const std::string& id, const JobPointer& job, Random& random) {
  const Nanoseconds until =
      now() + static_cast<Nanoseconds>(random.exponential(think_seconds_ / 2 * kSecond));
  const bool is_of_events = random.chance(0.5);
  const std::string wrong =
      is_of_events
          ? watch_events(job, until)
          : watch_tiles({*server_.jobs, *server_.denoising, server_.frames, server_.streams}, job,
                        until);
  if (!wrong.empty()) {
    fail("a client of job " + id + ": " + wrong);
  }
  ledger_.note(tenant, is_of_events ? "ok-watch-events" : "ok-watch-tiles");
}

void World::retry(int tenant, const std::string& id, const JobPointer& job) {
  ask(tenant, "retry", id);
  note_answer(tenant, "retry", id, server_.jobs->retry(job));
}

void World::expire(int tenant, const std::string& id, const JobPointer& job) {
  const api::JobView view = server_.jobs->view(*job);
  const double due = view.finished_at_unix_seconds.value_or(0) + kRetentionSeconds -
                     static_cast<double>(unix_now()) / static_cast<double>(kSecond);
  if (due > kRetentionSeconds) {  // The clock was set since.
    return;
  }
  sleep_for(static_cast<Nanoseconds>(std::max(0.0, due) + 60) * kSecond);
  if (look(tenant, id)) {
    fail("job " + id + " has not been forgotten");
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
    server::ComparisonStore& table = server_.comparisons->table();
    const auto found = table.find(own, Access::of(access_name(tenant)));
    const bool is_unread = !found && found.error().code != core::ErrorCode::kNotFound &&
                           has_happened(Fault::kReadFails);
    if (!is_unread && (!found || *found != body)) {
      fail("comparison " + own + " is lost or has changed");
    }
    if (table.find(own, Access::of(access_name(tenant % kTenants + 1)))) {
      fail("another tenant sees comparison " + own);
    }
  }
  if (random.chance(0.2)) {
    requests_.act(tenant, random);
    return;
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
        watch(tenant, id, job, random);
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
  if (is_full_ && random.chance(0.5)) {  // To make room.
    cancel(tenant, id, job, random);
    return;
  }
  if (job->state() == JobState::kFailed && random.chance(0.5)) {
    retry(tenant, id, job);
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
        watch(tenant, id, job, random);
        break;
      }
      [[fallthrough]];
    default:
      if (random.chance(0.5)) {
        watch(tenant, id, job, random);
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
void World::settle(int tenant, Random& random) {
  sleep_for(kCalm + 2 * kTick - time_of_shift());  // Afterwards the operator lets no load hang.
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
    requests_.cancel_loading(tenant);
  }
  requests_.settle(tenant, random, [this] { return is_night(); });
  for (const std::string& id : ids_of(tenant)) {
    for (bool has_ended = false; !has_ended;) {
      const JobPointer job = look(tenant, id);
      has_ended = !job || api::is_final(job->state());
      if (job && job->state() == JobState::kFailed) {
        has_ended = false;
        look(tenant, id);
        retry(tenant, id, job);
      }
      if (!has_ended && job->state() == JobState::kPaused) {
        ask(tenant, "resume", id);
        note_answer(tenant, "resume", id,
                    server_.jobs->patch(job, R"({"paused": false})", std::nullopt,
                                        Access::of(access_name(tenant))));
      }
      if (!has_ended && is_night()) {
        fail("job " + id + " has not ended in the calm hour; it is " +
             std::string(api::to_text(job->state())));
      }
      if (has_ended && job) {
        if (ledger_.jobs()[id].retention_seconds > 0) {
          expire(tenant, id, job);
        } else {
          check_film(id, job);
          check_calls(id, *job);
          look(tenant, id);
        }
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
    // Several requests often follow each other at once, and all when the disk fills up.
    const double mean = random.chance(0.5) ? 0.01 * kSecond : 2 * think_seconds_ * kSecond;
    wait(&is_full_, now() + 1 + static_cast<Nanoseconds>(random.exponential(mean)));
    act(tenant, random);
  }
  settle(tenant, random);
}

void World::play_floods() {
  Random random(life_.seed * 4099 + life_.number);
  requests_.end_flood();  // Of an earlier life.
  while (!workers_ && !is_calm()) {
    const auto pause = static_cast<Nanoseconds>(random.exponential(kHour));
    sleep_for(std::min(pause, kCalm - time_of_shift()));
    if (!is_calm() && !is_full_ && !is_draining_) {
      requests_.flood(random, step_, [this] {
        return is_calm() || is_full_ || is_draining_ || may_stall_ || hanging_loads() > 0;
      });
    }
  }
  requests_.end_flood();
}

void World::play() {
  Random random(life_.seed * 65'537 + life_.number);
  if (workers_seed_) {
    workers_.emplace(*server_.jobs->board(), *workers_seed_,
                     [this] { return !life_.is_faulty || is_calm(); });
  }
  if (life_.is_faulty) {
    fail_operations();
  }
  std::vector<std::thread> tenants;
  tenants.emplace_back([this] { play_floods(); });
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
  const auto are_settled = [this] {
    return std::find(is_settled_.begin() + 1, is_settled_.end(), false) == is_settled_.end();
  };
  while (!are_settled()) {
    if (!is_calm() && strikes(Fault::kStopped)) {
      server_.jobs->stop();
      if (random.chance(0.5)) {
        count_fault(Fault::kUpgraded);
        end(Ending::kUpgraded);
      }
      end(Ending::kStopped);
    }
    operate(random);
    if (is_night()) {
      fail("jobs have not ended in the calm hour");
    }
    sleep_for(kTick);
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
  sleep_for(kShift - time_of_shift() - kSecond);
  server_.jobs->stop();
  end(Ending::kShiftOver);
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
  end(Ending::kShiftOver);
}

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
